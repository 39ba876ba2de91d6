"""What `docs/extending.md` adds to the package, typed as it stands, passes the tests that ask about columns."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLUGIN = """
import importlib.util, pathlib, sys

class Typed:
    def find_spec(self, name, path=None, target=None):
        file = pathlib.Path(__file__).parent.joinpath("package", *name.split(".")).with_suffix(".py")
        return importlib.util.spec_from_file_location(name, file) if file.exists() else None

sys.meta_path.insert(0, Typed())
sys.path.insert(0, {root!r})
import tolalloc  # from its own place, where its solvers are kept compiled
"""
COLUMNS = (
    "architecture/test_house.py::test_columns_of_the_model_stand_in_the_nomenclature",
    "wings/assembly/test_mounting.py",
    "verification/test_hysteresis_twin.py",
    "wings/motion/test_prototype.py",
    "verification/test_allocation_drawing.py",
    "verification/test_scene.py",
)


def typed(text: str, hunk: str) -> str:
    """Return a file with the lines of a hunk added and removed, at its end where the hunk has nothing else."""
    lines = hunk.splitlines()
    before, after = ("\n".join(line[1:] for line in lines if line[:1] != sign) for sign in "+-")
    if not before.strip():
        return f"{text}\n\n{after}\n"
    assert text.count(before) == 1, before
    return text.replace(before, after)


def diffs(section: str) -> list[tuple[str, list[str]]]:
    """Return the files that a section of the page changes, each with its hunks."""
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    (text,) = re.findall(rf"^## {section}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    blocks = re.findall(r"```diff\n--- a/(\S+)\n\+\+\+ .*\n((?:.*\n)*?)```", text)
    return [(path, re.split(r"^ *\.\.\.\n", body, flags=re.MULTILINE)) for path, body in blocks]


def write_typed(folder: Path, section: str) -> None:
    """Write what a section of the page adds; what it adds to the package is imported from beside it."""
    for path, hunks in diffs(section):
        text = (ROOT / path).read_text(encoding="utf-8")
        for hunk in hunks:
            text = typed(text, hunk)
        place = folder / ("package" if path.startswith("tolalloc") else "") / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    (folder / "typed_package.py").write_text(PLUGIN.format(root=str(ROOT)), encoding="utf-8")


@pytest.fixture(scope="module")
def with_flange(tmp_path_factory):
    """A folder with the tests and the flange of the page."""
    folder = tmp_path_factory.mktemp("flange")
    for name in ("tests", "docs/reference"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "studies", "tolalloc"):
        (folder / name).symlink_to(ROOT / name)
    write_typed(folder, "A spring group")
    return folder


@pytest.mark.slow
@pytest.mark.push
@pytest.mark.parametrize(
    ("chosen", "tests"), [("", ("verification/test_rows_against_geometry.py",)), ("not slow", COLUMNS)]
)
def test_the_flange_of_the_page_passes_the_tests_of_columns(with_flange, chosen, tests):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-n0", "-p", "typed_package", "-p", "no:cacheprovider", "-m", chosen]
        + [f"tests/{name}" for name in tests],
        cwd=with_flange,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(with_flange), str(ROOT)])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


RMS = """
import typed_package
import tolalloc as ta
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

name = "rms transmission error [arcsec]"
limits = {name: ta.Limit(upper=20.0), ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
known = Prepared(study=ta.Study(ta.reducer("rv20e"), ta.drawing("rv20e_table4"), limits=limits))
x = known.space.units(known.space.uniform(1.0), SeedTree(1), 1)
print(*known.model.reading((name, ta.PEAK_TO_PEAK))(x).values[0])
"""


@pytest.mark.slow
def test_the_output_of_the_page_is_read_as_it_stands(tmp_path):
    write_typed(tmp_path, "An output of the reducer")
    done = subprocess.run(
        [sys.executable, "-c", RMS],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rms, peak_to_peak = map(float, done.stdout.split())
    assert 0.1 * peak_to_peak < rms < 0.5 * peak_to_peak  # no more than half of a range (Popoviciu 1935)

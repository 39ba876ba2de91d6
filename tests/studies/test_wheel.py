"""What is released: the wheel alone runs a folder of one's own; wheel and source hold what is tracked and no more."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.studies.command import ROOT


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Return the folder that holds the content of the wheel, and nothing of the checkout."""
    place = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", place, ROOT]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = place.glob("*.whl")
    with ZipFile(wheel) as content:
        content.extractall(place / "installed")
    return place / "installed"


PROGRAM = """
import sys
import tolalloc
from tolalloc.cli.main import main

print(tolalloc.__file__, file=sys.stderr)
main()
"""
STUDY = """
import tolalloc as ta


def gap(housing, shaft):
    return housing - shaft


zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
study = ta.Study(
    ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **zone}, {"id": "shaft", "nominal": 30.0, **zone}]),
    limits={"gap [mm]": ta.Limit(lower=0.06, upper=0.14)},
    questions=[ta.Allocation(front=False, what_if=False)],
)
"""


def of_the_wheel(installed, folder, *words):
    """Run a command of the wheel in another folder."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    program = [sys.executable, "-c", PROGRAM, *words]
    result = subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert str(installed) in result.stderr.splitlines()[0]
    return result.stdout


@pytest.mark.slow
def test_the_wheel_holds_what_it_needs_and_no_more(installed):
    names = {str(path.relative_to(installed)) for path in installed.rglob("*") if path.is_file()}
    needed = {
        "tolalloc/reports/page/chart.js",
        "tolalloc/reports/page/mechanism.js",
        "tolalloc/reports/page/document.html.j2",
        "tolalloc/cli/live/page/live.html",
        "tolalloc/reducers/reducer/presets/rv20e.reducer.toml",
        "tolalloc/drawings/data/rv20e_drawing.tolerances.csv",
    }
    assert needed <= names
    assert not [name for name in names if name.startswith(("tests", "studies", "docs")) or "__pycache__" in name]


@pytest.mark.slow
def test_a_folder_and_a_study_of_one_s_own_run_from_the_wheel(installed, tmp_path):
    """A study that needs no kernel, which every installation compiles anew for two minutes."""
    assert "mine with 3 cranks" in of_the_wheel(installed, tmp_path, "new", "mine", "--cranks", "3")
    (tmp_path / "gap.py").write_text(STUDY, encoding="utf-8")
    said = of_the_wheel(installed, tmp_path, "run", "gap.py", "--quick", "--out", "run")
    assert " simulated units stay between 0.06 and 0.14 mm; 99.73 % was required" in said
    assert "NOT met" not in said
    assert (tmp_path / "run" / "report.html").stat().st_size > 10_000


OF_A_HOST = (".github", ".gitignore", ".pre-commit-config.yaml")
"""What is tracked for a host or an editor, and is no part of a release; hatchling keeps `.gitignore` all the same."""


@pytest.mark.slow
def test_a_clean_clone_is_released_whole_and_without_anything_else(tmp_path):
    clone, place = tmp_path / "clone", tmp_path / "dist"
    cloned = subprocess.run(["git", "clone", "--quiet", ROOT, clone], capture_output=True, check=False)
    if cloned.returncode:
        pytest.skip("This is not a git checkout, so nothing says what is tracked.")
    listed = subprocess.run(["git", "ls-files"], cwd=clone, capture_output=True, text=True, check=True)
    tracked = set(listed.stdout.splitlines())
    build = [sys.executable, "-m", "hatchling", "build", "--directory", place]
    subprocess.run(build, cwd=clone, capture_output=True, check=True)
    (source,), (wheel,) = place.glob("*.tar.gz"), place.glob("*.whl")
    with tarfile.open(source) as content:
        released = {Path(*Path(own.name).parts[1:]).as_posix() for own in content if own.isfile()}
    of_a_host = {name for name in tracked if name.startswith(OF_A_HOST)}
    assert released == tracked - of_a_host | {".gitignore", "PKG-INFO"}
    with ZipFile(wheel) as content:
        inside = {name for name in content.namelist() if ".dist-info/" not in name}
    assert inside == {name for name in tracked if name.startswith("tolalloc/")}

"""Plant one fault at a time in a copy of the tree, and say whether the tests catch it.

    python -m tests.faults.plant                     # every fault against the default run
    python -m tests.faults.plant --gate push         # what the gate runs of a push with that fault alone, too
    python -m tests.faults.plant --gate all          # all slow tests too
    python -m tests.faults.plant --hinted --only zones --only costs

The test files that a fault names are tried first; the rest run only where these pass. A fault of a compiled file costs
a compilation of the kernel, about a minute. Of a push no test is run because it is its turn.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.import_graph import ROOT
from tests.push import Touched, chosen, slow_tests
from tests.whole_run import last_whole_run

FAULTS = Path(__file__).with_name("faults.toml")
COPIED = ("tolalloc", "tests", "studies", "docs", ".ci", "pyproject.toml", "README.md", "LICENSE")
FAILED, NOTHING_COLLECTED = (1, 2), 5  # tests or collection failed; exit codes of pytest


@dataclass(frozen=True)
class Edit:
    """What stands in a file, and what is put in its place."""

    file: str
    old: str
    new: str

    def places(self, root: Path = ROOT) -> int:
        """Return how often the old text stands in the file."""
        return (root / self.file).read_text(encoding="utf-8").count(self.old)

    def make(self, root: Path) -> None:
        """Put the new text into a copy of the tree."""
        if self.places(root) != 1:
            raise SystemExit(f"{self.file}: {self.old!r} stands there {self.places(root)} times instead of once.")
        path = root / self.file
        rewrite(path, path.read_text(encoding="utf-8").replace(self.old, self.new))


@dataclass(frozen=True)
class Fault:
    """What it is, the edits that make it, and the test files to try first."""

    name: str
    edits: tuple[Edit, ...]
    tests: tuple[str, ...]

    @property
    def files(self) -> tuple[str, ...]:
        return tuple(edit.file for edit in self.edits)


def rewrite(path: Path, text: str) -> None:
    """Write a source file, and drop its bytecode: another text of the same length and second would not be noticed."""
    path.write_text(text, encoding="utf-8")
    for kept in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
        kept.unlink()


def load_faults() -> tuple[Fault, ...]:
    """Return all faults, those of compiled files last."""
    content = tomllib.loads(FAULTS.read_text(encoding="utf-8"))
    return tuple(
        Fault(
            fault["name"],
            tuple(Edit(own["file"], own["old"], own["new"]) for own in (fault, *fault.get("also", ()))),
            tuple(fault["tests"]),
        )
        for fault in content["fault"]
    )


def copied_tree(folder: Path) -> Path:
    """Return a copy of the tree, without what was compiled."""
    for name in COPIED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "runs"))
        else:
            shutil.copy(ROOT / name, folder / name)
    return folder


def first_failure(root: Path, arguments: list[str]) -> str | None:
    """Return the first test that fails in the copy, or None where all pass."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", "--tb=no", "-rfE", *arguments]
    result = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    if result.returncode in (0, NOTHING_COLLECTED):
        return None
    if result.returncode not in FAILED:
        raise SystemExit(f"pytest ended with {result.returncode}:\n{result.stdout}\n{result.stderr}")
    failure = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", result.stdout, re.MULTILINE)
    return failure[1] if failure else "collection"


collected = cache(slow_tests)


def slow_of_push(fault: Fault) -> tuple[str, ...]:
    """Return the slow tests that the gate runs of a push with this fault alone, whosever turn it is."""
    run = last_whole_run()
    if run is None:
        raise SystemExit("No whole run is written down; `.ci/run --all` writes one.")
    found, touched = collected(), Touched.of(fault.files)
    return chosen(found.tests, found.every, run, touched, commits=None).tests


def caught_by(root: Path, fault: Fault, gate: str, hinted: bool) -> str | None:
    """Return the test that catches a planted fault, or None."""
    slow = {"default": (), "push": slow_of_push(fault) if gate == "push" else (), "all": fault.tests}[gate]
    first = [[path] for path in fault.tests]
    first += [["-m", "slow", test] for test in slow if test.partition("::")[0] in fault.tests]
    # That every old text stands in its file is not what catches a fault.
    rest = [["--deselect", "tests/architecture/test_faults.py", "tests"]]
    rest += {"default": [], "push": [["-m", "slow", *slow]], "all": [["-m", "slow", "tests"]]}[gate]
    return next((test for tests in (first if hinted else first + rest) if (test := first_failure(root, tests))), None)


def main() -> None:
    """Plant the faults and print a line for each, then how many were caught."""
    parser = argparse.ArgumentParser(description="Plant faults one at a time and see whether the tests catch them.")
    parser.add_argument("--gate", choices=("default", "push", "all"), default="default", help="which tests are run")
    parser.add_argument("--hinted", action="store_true", help="run only the test files that a fault names")
    parser.add_argument("--only", action="append", default=[], help="faults whose name begins so; may be repeated")
    options = parser.parse_args()
    faults = [fault for fault in load_faults() if not options.only or fault.name.startswith(tuple(options.only))]
    caught = 0
    with tempfile.TemporaryDirectory() as name:
        root = copied_tree(Path(name))
        for fault in faults:
            began = time.monotonic()
            sound = {file: (root / file).read_text(encoding="utf-8") for file in fault.files}
            for edit in fault.edits:
                edit.make(root)
            found = caught_by(root, fault, options.gate, options.hinted)
            for file, text in sound.items():
                rewrite(root / file, text)
            caught += found is not None
            took = f"{time.monotonic() - began:6.0f} s"
            print(f"{'caught' if found else 'MISSED':<7} {took}  {fault.name:<72} {found or ''}", flush=True)
    print(f"{caught} of {len(faults)} faults caught by the {options.gate} run.")


if __name__ == "__main__":
    main()

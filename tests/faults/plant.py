"""Plant one fault at a time in a copy of the tree, and say whether the tests catch it.

    python tests/faults/plant.py                     # every fault against the default run
    python tests/faults/plant.py --full              # the slow tests too
    python tests/faults/plant.py --hinted --only zones --only costs

The test files that a fault names are tried first; the rest run only where these pass. A fault of a compiled file costs
a compilation of the kernel, about a minute.
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
from pathlib import Path

ROOT = Path(__file__).parents[2]
FAULTS = Path(__file__).with_name("faults.toml")
COPIED = ("tolalloc", "tests", "studies", "docs", ".ci", "pyproject.toml", "README.md", "LICENSE")
FAILED, NOTHING_COLLECTED = (1, 2), 5  # tests or collection failed; exit codes of pytest


@dataclass(frozen=True)
class Fault:
    """What stands in a file, what is put in its place, and the test files to try first."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    def places(self, root: Path = ROOT) -> int:
        """Return how often the old text stands in the file."""
        return (root / self.file).read_text(encoding="utf-8").count(self.old)

    def plant(self, root: Path) -> None:
        """Put the fault into a copy of the tree."""
        if self.places(root) != 1:
            raise SystemExit(f"{self.file}: {self.old!r} stands there {self.places(root)} times instead of once.")
        path = root / self.file
        rewrite(path, path.read_text(encoding="utf-8").replace(self.old, self.new))


def rewrite(path: Path, text: str) -> None:
    """Write a source file, and drop its bytecode: another text of the same length and second would not be noticed."""
    path.write_text(text, encoding="utf-8")
    for kept in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
        kept.unlink()


def load_faults() -> tuple[Fault, ...]:
    """Return all faults, those of compiled files last."""
    content = tomllib.loads(FAULTS.read_text(encoding="utf-8"))
    return tuple(Fault(**{**fault, "tests": tuple(fault["tests"])}) for fault in content["fault"])


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


def caught_by(root: Path, fault: Fault, full: bool, hinted: bool) -> str | None:
    """Return the test that catches a planted fault, or None."""
    marks = ["-m", ""] if full else []
    for path in fault.tests:
        if found := first_failure(root, [*marks, path]):
            return found
    if hinted:
        return None
    # That every old text stands in its file is not what catches a fault.
    return first_failure(root, [*marks, "--deselect", "tests/architecture/test_faults.py", "tests"])


def main() -> None:
    """Plant the faults and print a line for each, then how many were caught."""
    parser = argparse.ArgumentParser(description="Plant faults one at a time and see whether the tests catch them.")
    parser.add_argument("--full", action="store_true", help="run the slow tests too")
    parser.add_argument("--hinted", action="store_true", help="run only the test files that a fault names")
    parser.add_argument("--only", action="append", default=[], help="faults whose name begins so; may be repeated")
    options = parser.parse_args()
    chosen = [fault for fault in load_faults() if not options.only or fault.name.startswith(tuple(options.only))]
    caught = 0
    with tempfile.TemporaryDirectory() as name:
        root = copied_tree(Path(name))
        for fault in chosen:
            began, path = time.monotonic(), root / fault.file
            sound = path.read_text(encoding="utf-8")
            fault.plant(root)
            found = caught_by(root, fault, options.full, options.hinted)
            rewrite(path, sound)
            caught += found is not None
            took = f"{time.monotonic() - began:6.0f} s"
            print(f"{'caught' if found else 'MISSED':<7} {took}  {fault.name:<72} {found or ''}", flush=True)
    print(f"{caught} of {len(chosen)} faults caught by the {'full' if options.full else 'default'} run.")


if __name__ == "__main__":
    main()

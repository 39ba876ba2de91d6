"""What the gate runs of a push: which slow tests and which scripts of the handbook.

    python -m tests.push due              # why the whole gate is to be run, if so
    python -m tests.push tests FILE       # the slow tests of a push, an id a line, into a file
    python -m tests.push scripts          # a pattern of the handbook's scripts that are run
    python -m tests.push shapes MODULES   # in which of some modules the shapes are checked

A push is what has changed since the last whole run. Of the slow tests it gets those that every push runs, those that
failed in that whole run, an eighth of the others, another one at each commit, and the nearest to what has changed, by
the number of imports between, until its time is used up, two minutes of it at least.
"""

from __future__ import annotations

import ast
import io
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.import_graph import PACKAGE, ROOT, graph, module_of, public_uses, steps_to
from tests.whole_run import WholeRun, git, last_whole_run

OLDEST = 40
"""Commits after which the whole gate is due again [-]."""
TURNS = 8
"""Commits within which every slow test is run once [-]."""
TIME = 1150.0
"""What the slow tests of a push may take on one core [s]."""
NEAR = 120.0
"""What of it the nearest may take at least, however long those of every push and the turn take [s]."""
NEW = 10.0
"""What a test, or the fixtures of a file, are taken to take that the last whole run does not tell [s]."""
PINS = ".ci/constraints.txt"
SCRIPTS = sorted(path for room in ("tutorials", "gallery") for path in (ROOT / "docs" / room).glob("plot_*.py"))


def reason_for_all(run: WholeRun | None) -> str:
    """Return why the whole gate is due, or nothing where a push will do."""
    if run is None:
        return "no whole run is written down"
    since = git("rev-list", "--count", f"{run.commit}..HEAD")
    if since is None:
        return f"the commit of the last whole run, {run.commit[:8]}, is not in this clone"
    if int(since) > OLDEST:
        return f"the last whole run is {since} commits old"
    return "the pinned libraries have changed" if PINS in changed_since(run.commit) else ""


def changed_since(commit: str) -> set[str]:
    """Return the files that differ from a commit, with those that git does not know yet."""
    tracked, new = git("diff", "--name-only", commit), git("ls-files", "--others", "--exclude-standard")
    return {*(tracked or "").splitlines(), *(new or "").splitlines()}


@dataclass(frozen=True)
class Touched:
    """What a push touches.

    Parameters
    ----------
    modules
        Modules of the package and of the tests; those of a folder where another file of it is touched.
    stems
        Names of other files without their endings: a golden case, a study, a page.
    """

    modules: frozenset[str]
    stems: frozenset[str]

    @classmethod
    def of(cls, files: Iterable[str]) -> Touched:
        """Return what some files are, of the package, of the tests and others."""
        modules, stems = set[str](), set[str]()
        for path in (ROOT / name for name in files):
            if path.suffix == ".py" and (name := module_of(path)) in graph():
                modules.add(name)
                continue
            stems.add(path.stem)
            if PACKAGE in path.parents:
                modules |= beside(path)
        return cls(frozenset(modules), frozenset(stems))

    def steps(self, test: str) -> int | None:
        """Return by how many imports a test is away, or None where nothing leads from it to what is touched."""
        path, _, name = test.partition("::")
        case = re.search(r"\[(.+)\]$", name)
        if case and case[1].removeprefix("shipped_") in {stem.removeprefix("shipped_") for stem in self.stems}:
            return 0
        return steps_to(module_of(ROOT / path), self.modules)


def beside(path: Path) -> set[str]:
    """Return the modules of the nearest folder above a file of the package that has some."""
    folder = next(above for above in path.parents if [*above.glob("*.py")])
    return {module_of(file) for file in folder.glob("*.py")}


@dataclass(frozen=True)
class Push:
    """The slow tests of a push.

    Parameters
    ----------
    always, turn, near
        Those that every push runs, those whose turn it is, and the nearest to what is touched.
    left
        Tests of the modules that import what is touched, or of itself, which the time does not allow.
    seconds
        What they took in the last whole run, on one core [s].
    """

    always: tuple[str, ...]
    turn: tuple[str, ...]
    near: tuple[str, ...]
    left: tuple[str, ...]
    seconds: float

    @property
    def tests(self) -> tuple[str, ...]:
        return (*self.always, *self.turn, *self.near)

    def sentence(self, of: int) -> str:
        """Return how many tests of how many are run, and why these."""
        return (
            f"{len(self.tests):,} of {of:,} slow tests, {self.seconds / 60:.0f} processor minutes: {len(self.always)} "
            f"of every push, {len(self.turn)} whose turn it is, {len(self.near)} near to what has changed; "
            f"{len(self.left)} others near to it are left to `.ci/run --all`."
        )


def chosen(tests: Sequence[str], every: set[str], run: WholeRun, touched: Touched, commits: int | None) -> Push:
    """Return the tests of a push among all slow ones.

    Parameters
    ----------
    tests
        Ids of the slow tests.
    every
        Those that every push runs; what failed in the last whole run is added.
    run
        The last whole run.
    touched
        What has changed since.
    commits
        Number of commits in all [-]; the turn follows from it. It is nobody's turn where that is None.
    """
    cost = {test: NEW if (own := run.taken_by(test)) is None else own for test in tests}
    every = {*every, *run.failed}
    always = [test for test in tests if test in every]
    others = {test: own for test, own in cost.items() if test not in every}
    turn = [] if commits is None else turn_of(others, run, commits)
    taken = {*always, *turn}
    steps = {test: found for test in tests if test not in taken and (found := touched.steps(test)) is not None}
    files = {file_of(test) for test in taken}
    seconds = sum(cost[test] for test in taken) + sum(run.setups.get(file, NEW) for file in files)
    near, left, allowed = list[str](), list[str](), max(TIME, seconds + NEAR)
    for test in sorted(steps, key=lambda test: (steps[test], cost[test], test)):
        more = cost[test] + (0.0 if file_of(test) in files else run.setups.get(file_of(test), NEW))
        if seconds + more <= allowed:
            near.append(test)
            files.add(file_of(test))
            seconds += more
        elif steps[test] <= 1:
            left.append(test)
    return Push(tuple(always), tuple(turn), tuple(near), tuple(left), seconds)


class _Collected:
    """A plugin that keeps which tests there are, and which of them every push runs."""

    def __init__(self) -> None:
        self.tests: list[str] = []
        self.every: set[str] = set()

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            self.tests.append(item.nodeid)
            if item.get_closest_marker("push"):
                self.every.add(item.nodeid)


def turn_of(cost: Mapping[str, float], run: WholeRun, commits: int) -> list[str]:
    """Return the tests whose turn it is: files as a whole, which share their fixtures, and long tests one by one.

    They are dealt out dearest first, so that each turn takes about as long.
    """
    parts: dict[str, list[str]] = {}
    for test, own in cost.items():
        parts.setdefault(test if own > NEW else file_of(test), []).append(test)
    whole = {part: sum(cost[test] for test in own) + run.setups.get(file_of(part), NEW) for part, own in parts.items()}
    dearest_first = sorted(parts, key=lambda part: (-whole[part], part))
    return [test for part in dearest_first[commits % TURNS :: TURNS] for test in parts[part]]


def file_of(test: str) -> str:
    """Return the file of a test."""
    return test.partition("::")[0]


def slow_tests() -> _Collected:
    """Return the slow tests, in order."""
    found, said = _Collected(), io.StringIO()
    with redirect_stdout(said):
        code = pytest.main(["--collect-only", "-q", "-m", "slow", "-p", "no:cacheprovider", str(ROOT)], plugins=[found])
    if code:
        sys.exit(f"{said.getvalue()}\nThe slow tests cannot be collected.")
    return found


def scripts_near(touched: Touched) -> list[Path]:
    """Return the scripts of the handbook that have changed, or of which a module has that they name."""
    return [
        path
        for path in SCRIPTS
        if path.stem in touched.stems or public_uses(ast.parse(path.read_text(encoding="utf-8"))) & touched.modules
    ]


def shaped(modules: Sequence[str], touched: Touched, commits: int) -> list[str]:
    """Return in which modules a push checks the shapes: those that it touches, and an eighth of the others by turn."""
    others = [own for own in modules if own not in touched.modules]
    return sorted({*modules}.difference(others) | {*others[commits % TURNS :: TURNS]})


def main(words: Sequence[str]) -> None:
    """Print or write what is asked for."""
    run = last_whole_run()
    if words[0] == "due":
        sys.stdout.write(reason_for_all(run))
        return
    if run is None:
        sys.exit("Error: no whole run is written down; `.ci/run --all` writes one.")
    touched = Touched.of(changed_since(run.commit))
    if words[0] == "scripts":
        sys.stdout.write("|".join(re.escape(path.name) + "$" for path in scripts_near(touched)) or "(?!)")
        return
    commits = int(git("rev-list", "--count", "HEAD") or 0)
    if words[0] == "shapes":
        sys.stdout.write(",".join(shaped(words[1].split(","), touched, commits)))
        return
    found = slow_tests()
    push = chosen(found.tests, found.every, run, touched, commits)
    Path(words[1]).write_text("".join(f"{test}\n" for test in push.tests), encoding="utf-8")
    sys.stdout.write(f"Since {run.commit[:8]}: {push.sentence(len(found.tests))}\n")


if __name__ == "__main__":
    main(sys.argv[1:])

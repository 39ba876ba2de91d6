"""Mutated inputs of every kind: each is read or refused by name, quickly, in little memory, and no file changes."""

from __future__ import annotations

import csv
import random
import re
import signal
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from openpyxl import Workbook

import tolalloc as ta
from studies.published.measurement_folder import write_measurements
from studies.published.simulated_bench import random_units, simulated_bench
from tests.studies.bench_files import CURVES_AND_LOOPS
from tests.verification.plain_reading import DECIMALS, differences, made, rows, said
from tolalloc.allocation.cost.points import load_shop_points
from tolalloc.allocation.cost.process_costs import load_process_costs
from tolalloc.drawings.correlation import load_correlations
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.table_file import DATA
from tolalloc.drawings.tolerance_table import load_process_capabilities, load_tolerance_table, table_text
from tolalloc.exceptions import TolallocError
from tolalloc.reducers.reducer.files import PRESETS, load_identified_stiffness, load_reducer
from tolalloc.reducers.unit_file import load_unit, load_units
from tolalloc.wings.assembly.files import DATA as CHAINS
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.bench.measurements import load_measurements

GIBIBYTE = 2**20
"""As Linux counts memory [kB]."""
STATUS = Path("/proc/self/status")


def memory(name: str) -> int:
    """Return what Linux says of this process's memory: VmRSS is what it has, VmHWM the most that it had [kB]."""
    return next(int(line.split()[1]) for line in STATUS.read_text().splitlines() if line.startswith(name))


@pytest.fixture(autouse=True)
def in_little_memory():
    """Reading takes less than a gibibyte on top of what the process has already."""
    if not STATUS.exists():
        yield
        return
    Path("/proc/self/clear_refs").write_text("5")  # forgets the most that there was
    before = memory("VmRSS")
    yield
    assert memory("VmHWM") - before < GIBIBYTE


@contextmanager
def in_time(seconds: int) -> Iterator[None]:
    """Raise where something hangs; only Unix wakes what hangs."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def raised(*_: object) -> None:
        raise TimeoutError(f"over {seconds} s")

    before = signal.signal(signal.SIGALRM, raised)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


VALUES = (
    *("", "0", "-1", "1e999", "-1e999", "nan", "inf", "1e-320", "5e-324", "1_0", "١", "0x10", "1,5", "1.234", "--1"),
    *("true", "yes", "#REF!", "=1+1", "@x", "'=x", "[red]", "[/red]", "µm", "mm", "m", "Ø", "a" * 300, "x " * 200_000),
    *("9" * 5000, "1e308", "\x00", "\x1b[31m", "\ufeff", "\u202e", '"', "'", ";", "\t", "\n", "\r", "#", "[", "]", "{"),
    *(
        "[[a]]",
        "a.b.c = 1",
        "1:1e308 2:1",
        "random:1/40",
        "1:0:1 2:0:1",
        "normal",
        "size",
        "locked",
    ),
)
"""What is put in the place of a value."""


def mutated(text: str, chance: random.Random) -> bytes:
    """Return a text with some of its values, lines or bytes changed."""
    for _ in range(chance.randint(1, 3)):
        lines = text.split("\n")
        at = chance.randrange(len(lines))
        change = chance.randrange(6)
        if change == 0:
            del lines[at]
        elif change == 1:
            lines.insert(at, chance.choice(lines))
        elif change == 2:
            lines[at] = lines[at][: chance.randint(0, len(lines[at]))]
        else:
            marks = [place for place, mark in enumerate(lines[at]) if mark in ',=[]" ']
            first = chance.choice(marks) + 1 if marks else 0
            last = min((place for place in marks if place > first), default=len(lines[at]))
            lines[at] = lines[at][:first] + chance.choice(VALUES) + lines[at][last:]
        text = "\n".join(lines)
    content = bytearray(text.encode())
    if chance.random() < 0.2 and content:
        for _ in range(chance.randint(1, 9)):
            content[chance.randrange(len(content))] = chance.randrange(256)
    return bytes(content[: chance.randint(0, len(content))] if chance.random() < 0.1 else content)


def mutated_workbook(rows: list[list[object]], chance: random.Random) -> bytes:
    """Return a workbook with cells, parts or bytes changed."""
    book = Workbook()
    sheet = book.active
    for row in rows:
        sheet.append(row)
    for _ in range(chance.randint(1, 3)):
        column = chance.randint(1, len(rows[0]))
        value = chance.choice([value for value in VALUES if value.isprintable() and len(value) < 30_000])
        if chance.random() < 0.6:
            value = chance.choice(rows[1:])[column - 1]
        far = chance.random() < 0.05
        sheet.cell(10 ** chance.randint(2, 6) if far else chance.randint(2, len(rows)), column).value = value
    if chance.random() < 0.1:
        sheet.merge_cells("B2:B3")
    out = BytesIO()
    book.save(out)
    if chance.random() < 0.3:
        changed, which = BytesIO(), chance.choice(zipfile.ZipFile(out).namelist())
        with zipfile.ZipFile(out) as old, zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as new:
            for part in old.namelist():
                text = old.read(part)
                new.writestr(part, mutated(text.decode().replace(">", ">\n"), chance) if part == which else text)
        out = changed
    content = bytearray(out.getvalue())
    if chance.random() < 0.2:
        for _ in range(chance.randint(1, 9)):
            content[chance.randrange(len(content))] = chance.randrange(256)
    return bytes(content)


@pytest.fixture(scope="module")
def kinds(tmp_path_factory) -> dict[str, tuple[Path, Callable[[Path], Any]]]:
    """Return every kind of input: a good file beside what it names, and what reads it."""
    folder = tmp_path_factory.mktemp("good")
    given, seeds = load_reducer("rv20e_liu2020"), SeedTree(7)
    sources = load_tolerance_table("rv20e_table4")
    bench = replace(CURVES_AND_LOOPS, curve_angles=CURVES_AND_LOOPS.curve_angles[::3])
    units = random_units(ErrorModel(sources), 2, seeds.child("units"))
    write_measurements(simulated_bench(given, units, bench).measured(seeds.child("noise")), folder)
    chain = next(CHAINS.glob("*.chain.toml"))

    def written(name: str, content: str) -> Path:
        (folder / name).write_text(content, encoding="utf-8")
        return folder / name

    def copied(path: Path) -> Path:
        return written(path.name, path.read_text(encoding="utf-8"))

    table = written("t.tolerances.csv", table_text((*sources[:6], *sources[-6:])))
    prices = "".join(f"{process},{at},µm,{9 - at},n\n" for process in ("ground", "milled") for at in range(1, 6))
    names = [source.name for source in sources]
    pairs = f"sources,correlation\n{names[0]} {names[1]},0.5\n{names[2]} {names[3]},-0.2\n"
    curve = next(path for path in sorted(folder.glob("*.csv")) if "curve" in path.name)
    return {
        "tolerance table": (table, load_tolerance_table),
        "process library": (copied(DATA / "generic.processes.csv"), load_process_capabilities),
        "process costs": (copied(DATA / "rv20e.process_costs.csv"), lambda path: load_process_costs(path, sources)),
        "prices": (written("s.csv", f"process,tolerance,unit,cost,note\n{prices}"), load_shop_points),
        "correlations": (
            written("c.csv", pairs),
            lambda path: load_correlations(path, sources),
        ),
        "reducer": (copied(PRESETS / "rv20e_liu2020.reducer.toml"), load_reducer),
        "stiffness": (copied(PRESETS / "rv20e_table6.stiffness.toml"), load_identified_stiffness),
        "unit": (copied(PRESETS / "table4.unit.toml"), load_unit),
        "units": (folder / "units.csv", load_units),
        "measurement": (folder / "measurement.toml", load_measurements),
        "curve": (curve, lambda path: load_measurements(folder / "measurement.toml")),
        "chain": (copied(chain), load_plan),
    }


def outcome(read: Callable[..., object], *given: object, **named: object) -> tuple[str, object]:
    """Return whether an input was read or refused, and what was read; anything else is raised."""
    try:
        with warnings.catch_warnings(), in_time(20):
            warnings.simplefilter("error", RuntimeWarning)  # of numbers that overflow
            return "read", read(*given, **named)
    except TolallocError as error:
        sentences = str(error).split("\n")
        assert len(sentences) <= 21 and all(0 < len(sentence) <= 2000 for sentence in sentences), error
        return "refused", None


JUDGED = {
    # What has a default, left out where that stood
    "tolerance table": r"\d+/(3|7|9|14|23) left out",  # nominal 0, normal, no shift, not sorted, one of each
    "process library": r"\d+/(3|4|6) left out",  # no shift, normal, not sorted
    "chain": r"\.(adjust|measure|effort\.\w+) left out",
    "reducer": r"\.stiffness\.pin_contact_law left out",
    # Notes, which are for people; and no fixed cost
    "prices": r"\d+/4( left out)?",
    "process costs": r"\d+/9( left out)?|\d+/3 left out",
}
"""What a person judged right: where a file may say another thing and mean the same."""


def require_read_plainly(name: str, before: tuple[dict, object], path: Path, answer: object) -> None:
    """Raise unless a reader's answer is another where a plain reading of the file is, and only there."""
    now, is_same = said(path), made(answer) == before[1]
    told = differences(before[0], now)
    if not told:
        assert is_same, "the file says the same, and was read as another"
    elif is_same:
        judged = JUDGED.get(name, "(?!)")
        odd = [place for place, share in told.items() if share > DECIMALS and not re.fullmatch(judged, place)]
        in_any_order = rows(before[0], judged) == rows(now, judged)
        assert in_any_order or not odd, f"the file says another thing, and was read as the same: {odd}"


Reader = Callable[[Path], Any]


def fuzz(name: str, path: Path, read: Reader, contents: Iterator[bytes]) -> Counter[str]:
    """Read contents in the place of a good file, and put it back; nothing else in the folder changes."""
    outcomes, good = Counter[str](), path.read_bytes()
    beside = {other: other.read_bytes() for other in path.parent.iterdir() if other != path}
    before = said(path), made(read(path))
    for content in contents:
        path.write_bytes(content)
        try:
            kind, answer = outcome(read, path)
            if kind == "read":
                require_read_plainly(name, before, path, answer)
        except BaseException as error:
            error.add_note(f"{name}: {content[:3000]!r}")
            raise
        finally:
            after = path.read_bytes()
            path.write_bytes(good)
        outcomes[kind] += 1
        assert after == content
    assert {other: other.read_bytes() for other in path.parent.iterdir() if other != path} == beside
    return outcomes


def fuzzed(kinds, names, seed: int, count: int) -> Counter[str]:
    """Mutate text files of every kind."""
    chance, outcomes = random.Random(seed), Counter[str]()
    for name in names:
        path, read = kinds[name]
        good = path.read_text(encoding="utf-8")
        outcomes += fuzz(name, path, read, (mutated(good, chance) for _ in range(count)))
    return outcomes


def fuzzed_workbooks(kinds, names, seed: int, count: int) -> Counter[str]:
    """Mutate workbooks of the kinds that may be one."""
    chance, outcomes = random.Random(seed), Counter[str]()
    for name in names:
        table, read = kinds[name]
        lines = [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        rows: list[list[object]] = [list(map(as_cell, row)) for row in csv.reader(lines[:5])]
        book, path = Workbook(), table.with_suffix(".xlsx")
        for row in rows:
            book.active.append(row)
        book.save(path)
        outcomes += fuzz(name, path, read, (mutated_workbook(rows, chance) for _ in range(count)))
        path.unlink()
    return outcomes


def as_cell(text: str) -> object:
    """Return a cell as a spreadsheet keeps it: numbers as such."""
    try:
        return float(text)
    except ValueError:
        return text or None


FIELDS = (
    None,
    True,
    0,
    -1,
    1.5,
    10**400,
    1e308,
    float("nan"),
    "",
    "60",
    b"x",
    (),
    (1,),
    {},
    {"a": 1},
    print,
    int,
    "x" * 300,
)
"""Values of any kind."""


MADE = (
    (ta.Study, ("name", "seed", "limits", "questions", "effort", "largest_failed_share", "model", "drawing")),
    (ta.Limit, ("upper", "lower", "show")),
    (ta.Allocation, ("grades", "fixed_first", "front", "what_if", "unit_price", "quality_loss")),
    (ta.Difference, ("zones", "units")),
    (ta.Effort, ("ranking", "allocation", "is_quick")),
    (partial(ta.reducer, "rv20e"), ("flank_clearance", "radial_clearance", "rotation_clearance", "neglected")),
)
"""What a user builds, and the names of its fields."""


def fuzzed_fields(seed: int, count: int) -> Counter[str]:
    """Build studies and what they are made of from values of any kind; no answer is asked.

    Left out is what the tests' own check of types refuses before it is read.
    """
    chance, outcomes = random.Random(seed), Counter[str]()
    for _ in range(count):
        kind, names = chance.choice(MADE)
        given = {name: chance.choice(FIELDS) for name in chance.sample(names, chance.randint(1, min(2, len(names))))}
        try:
            outcomes[outcome(kind, **given)[0]] += 1
        except Exception as error:
            error.add_note(f"{kind}: {sorted(given)}, {[type(value) for value in given.values()]}")
            raise
    return outcomes


TABLES = ("tolerance table", "process library", "process costs", "prices", "correlations")
RECORDS = ("reducer", "stiffness", "unit", "chain")
BENCH = ("units", "measurement", "curve")


WORKBOOKS = ("tolerance table", "correlations")


@pytest.mark.parametrize("names", [TABLES, RECORDS, BENCH], ids=["tables", "records", "bench"])
def test_mutated_files_are_read_plainly_or_refused(names, kinds):
    outcomes = fuzzed(kinds, names, seed=1, count=7)
    assert outcomes["refused"] > outcomes["read"] > 0


def test_mutated_workbooks_are_read_plainly_or_refused(kinds):
    outcomes = fuzzed_workbooks(kinds, WORKBOOKS, seed=1, count=7)
    assert outcomes["refused"] > 0 < outcomes["read"]


def test_fields_of_any_kind_make_a_study_or_are_refused():
    assert fuzzed_fields(seed=1, count=200)["refused"] > 100


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3, 4])
def test_thousands_of_mutated_inputs_are_read_plainly_or_refused(seed, kinds):
    """Ten thousand with three seeds."""
    outcomes = fuzzed(kinds, (*TABLES, *RECORDS, *BENCH), seed, count=220)
    outcomes += fuzzed_workbooks(kinds, WORKBOOKS, seed, count=150)
    outcomes += fuzzed_fields(seed, count=400)
    assert outcomes.total() == 3340

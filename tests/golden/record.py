"""What the commands of a golden case said and wrote: prose as one text, numbers as one record.

``python -m tests.golden.record NAME …`` makes golden files anew, all of them unless named; ``--check`` compares
instead, to the last digit that is kept.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import json
import math
import re
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable, Sequence
from html.parser import HTMLParser
from itertools import zip_longest
from pathlib import Path

import pandas as pd

from tests.golden.cases import LONGER, SMALL, UNRECORDED, Case, shipped
from tests.studies.command import ROOT, tolalloc
from tolalloc.running.compiled import processor

Run = Callable[..., subprocess.CompletedProcess[str]]
Look = Callable[[subprocess.CompletedProcess[str], Path], None]
FOLDER = Path(__file__).parent
STUDIES = sorted({path.stem for path in (ROOT / "studies").glob("*.py")} - {*UNRECORDED})
CASES = {case.name: case for case in (*SMALL, *LONGER, *map(shipped, STUDIES))}
_UNSTEADY = (
    (r"\d+(\.\d+)? s(?= here| to |,|$|\.)", "# s"),
    (r"\d+ to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"\d+(\.\d+)? (s|min|h) to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"# s to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"\d{4}-\d\d-\d\d", "DATE"),
    (r"(Compiling the kernel|What is asked takes).*\n", ""),
    (r", \d+ units/s", ", # units/s"),
    (r'(computing time \[s\](": |,))[\d.e+,-]*\d', r"\g<1>0"),
    (r"(computing time \[s\]) .*$", r"\1"),
)
"""What no two runs or machines have in common, and what stands for it."""
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_TIMED = re.compile(r"seconds \[s\]|per second|speed over|computing time|time a set")
"""Headers of columns that hold how long something took."""
FIRST, SPARSE, EVERY = 20, 1000, 200
"""Rows of a long table that are kept, rows from which it is a time series, and which of its rows are kept then [-]."""
WIDEST = 200
"""Letters of a line of a golden file that holds more than one value [-]."""
_BLOCKS = {"p", "h1", "h2", "h3", "li", "div", "section", "summary", "dt", "dd", "figcaption", "br"}


class _Prose(HTMLParser):
    """The text of a page, a block a line, without scripts, styles and tables."""

    def __init__(self) -> None:
        super().__init__()
        self.text, self.hidden = "", 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag in ("script", "style", "table", "svg"):
            self.hidden += 1
        if tag in _BLOCKS:
            self.text += "\n"

    def handle_endtag(self, tag: str) -> None:
        if tag in ("script", "style", "table", "svg"):
            self.hidden -= 1
        if tag in _BLOCKS:
            self.text += "\n"

    def handle_data(self, data: str) -> None:
        if not self.hidden:
            self.text += data


def prose_of(page: Path) -> str:
    """Return the text of a page, a block a line."""
    parser = _Prose()
    parser.feed(page.read_text(encoding="utf-8"))
    lines = (" ".join(line.split()) for line in parser.text.splitlines())
    return "\n".join(line for line in lines if line)


def recorded(case: Case, run: Run = tolalloc, look: Look = lambda *_: None) -> tuple[str, dict[str, object]]:
    """Run a case in an empty folder and return its prose and its numbers.

    What runs a command is this process unless another way is given; what is to be looked at is given the last
    command's result and the folder before that is gone. Tables of a terminal are wrapped by the length of the paths in
    them, so the folder's name has one length everywhere.
    """
    place = "/tmp" if Path("/tmp").is_dir() else None
    with tempfile.TemporaryDirectory(dir=place) as made:
        return _recorded(case, Path(made), run, look)


def _recorded(case: Case, folder: Path, run: Run, look: Look) -> tuple[str, dict[str, object]]:
    for name, text in case.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    prose, numbers, seen = "", dict[str, object](), dict[str, str]()
    for at, typed in enumerate(case.commands, start=1):
        before = set(folder.rglob("*"))
        done = run(*(f"{folder}/{word[1:]}" if word.startswith("@") else word for word in typed.split()))
        said = f"$ tolalloc {typed}\n{done.stdout}"
        prose += said + (f"{done.stderr}" if done.returncode else "") + f"exit {done.returncode}\n"
        for path in sorted(set(folder.rglob("*")) - before):
            name = f"{at} {path.relative_to(folder).as_posix()}"
            if "/.tolalloc-units" in str(path) or path.name == "manifest.json" or path.is_dir():
                continue
            if typed.startswith("new ") and case.name != "start":
                continue  # what `new` makes is kept once
            if path.suffix in (".json", ".csv", ".xlsx"):
                content = _numbers_of(path, case.wandering)
                same = seen.setdefault(json.dumps(content), name)
                numbers[name] = content if same == name else f"the same as {same}"
            else:
                prose += f"--- {name}\n{_words_of(path)}"
    look(done, folder)
    return steady(prose, folder), json.loads(steady(json.dumps(numbers, ensure_ascii=False), folder))


def _numbers_of(path: Path, wandering: str) -> object:
    """Return what is kept of a table, a record or a workbook, of the last the size of each sheet."""
    if path.suffix == ".json":
        return abridged(json.loads(path.read_text(encoding="utf-8")), wandering)
    if path.suffix == ".csv":
        return abridged_table(_rows(path), wandering)
    return {name: [*map(str, frame.shape)] for name, frame in pd.read_excel(path, sheet_name=None, header=None).items()}


def _words_of(path: Path) -> str:
    """Return the text of a page or of a file that people read, and nothing of others."""
    if path.name == "report.html":
        return f"{prose_of(path)}\n"
    return f"{path.read_text(encoding='utf-8')}\n" if path.suffix in (".toml", ".py", ".md") else ""


def _rows(path: Path) -> list[str]:
    """Return the lines of a table without the columns that hold how long something took."""
    text = path.read_text(encoding="utf-8-sig")
    if not _TIMED.search(text.split("\n", 1)[0]):
        return text.splitlines()
    rows = list(csv.reader(text.splitlines()))
    left = [at for at, header in enumerate(rows[0]) if not _TIMED.search(header)]
    return [",".join(row[at] for at in left) for row in rows]


def abridged_table(lines: list[str], wandering: str) -> list[str]:
    """Return a table's header and first rows with a digest of each column; of a time series every 200th row.

    Rows that tell of a random search are in no digest.
    """
    if len(lines) > SPARSE:
        return lines[::EVERY]
    if len(lines) <= FIRST + 5:
        return lines
    rows = [line for line in lines[1:] if not re.search(wandering, _as_written(line))]
    columns = zip_longest(*csv.reader([lines[0], *rows]), fillvalue="")
    said = (f"{name}: {_digest(cells)}" for name, *cells in columns)
    return [*lines[: FIRST + 1], f"all {len(lines) - 1} rows", *said]


def abridged(content: object, wandering: str) -> object:
    """Return the content of a JSON file, of each of its long lists the first items and a digest."""
    if isinstance(content, dict):
        return {key: abridged(value, wandering) for key, value in content.items()}
    if isinstance(content, float):
        return float(f"{content:.10g}")  # what follows is another processor's, and would change with each record
    if not isinstance(content, list):
        return content
    if len(content) <= FIRST + 5:
        return [abridged(item, wandering) for item in content]
    items = [item for item in content if not re.search(wandering, _as_written(item))]
    first = [abridged(item, wandering) for item in content[:FIRST]]
    keys = list(items[0]) if items and all(isinstance(item, dict) for item in items) else []
    cells = {f"{key}: ": [item.get(key) for item in items] for key in keys} or {"": items}
    said = (f"{key}{_digest([json.dumps(cell) for cell in own])}" for key, own in cells.items())
    return [*first, f"all {len(content)}", *said]


def _as_written(item: object) -> str:
    """Return an item of a list as a line of a golden file."""
    return f"  {json.dumps(item, ensure_ascii=False)},"


def _digest(cells: Sequence[str]) -> str:
    """Return what the numbers and the words of some cells come to, so that any one of them, or their order, changes it.

    Of the numbers these are the root mean square and, over it, the mean and the mean weighted by the place from −1 to
    1; processors that agree on the numbers agree on them.
    """
    found = [float(number) for cell in cells for number in _NUMBER.findall(cell) if math.isfinite(float(number))]
    words = zlib.crc32("|".join(_NUMBER.sub("#", cell) for cell in cells).encode())
    scale = math.sqrt(sum(value**2 for value in found) / len(found)) if found else 0.0
    if not scale:
        return f"words x{words:08x}"
    mean = sum(found) / len(found) / scale
    moment = sum(value * (2 * at / len(found) - 1) for at, value in enumerate(found)) / len(found) / scale
    return f"words x{words:08x}, size {scale:.6e}, mean {mean:.5f}, slope {moment:.5f}"


def steady(text: str, folder: Path) -> str:
    """Return a text without what no two runs or machines have in common."""
    text = text.replace(str(folder), "@")
    for pattern, instead in _UNSTEADY:
        text = re.sub(pattern, instead, text, flags=re.MULTILINE)
    return text


def as_text(content: object, indent: int = 0) -> str:
    """Return the text of a golden file: what fits in a line stands in one."""
    line = json.dumps(content, ensure_ascii=False)
    if len(line) + indent <= WIDEST or not isinstance(content, dict | list):
        return line
    inner = indent + 1
    if isinstance(content, list):
        (first, last), items = "[]", [as_text(item, inner) for item in content]
    else:
        (first, last) = "{}"
        items = [f"{json.dumps(key, ensure_ascii=False)}: {as_text(own, inner)}" for key, own in content.items()]
    between = ",\n" + " " * inner
    return f"{first}\n{' ' * inner}{between.join(items)}\n{' ' * indent}{last}"


def kept(name: str) -> tuple[str, dict[str, object], str]:
    """Return prose and numbers of the golden files of a case, and on what processor they were made if that matters."""
    prose = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    numbers = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return prose, numbers, numbers.pop(MADE_ON, "")


MADE_ON = "made on"
"""What tells the processor in the numbers of a searched case."""


def this_processor() -> str:
    """Return what tells this processor from others that may answer otherwise in the last bit."""
    return hashlib.sha256(json.dumps(processor()).encode()).hexdigest()[:12]


def main(words: list[str]) -> int:
    """Make or check golden files."""
    names = [word for word in words if word != "--check"] or list(CASES)
    different = 0
    for name in names:
        prose, numbers = recorded(CASES[name])
        text = as_text({MADE_ON: this_processor(), **numbers} if CASES[name].searched else numbers) + "\n"
        if "--check" in words:
            was = [(FOLDER / f"{name}.{end}").read_text(encoding="utf-8").splitlines() for end in ("txt", "json")]
            for old, new, what in zip(was, (prose.splitlines(), text.splitlines()), ("prose", "numbers"), strict=True):
                lines = list(difflib.unified_diff(old, new, f"{name} {what}", "now", lineterm="", n=0))
                different += bool(lines)
                sys.stdout.write("\n".join(line[:160] for line in lines[:24]) + ("\n" if lines else ""))
            sys.stdout.write(f"{name}: compared\n")
        else:
            (FOLDER / f"{name}.txt").write_text(prose, encoding="utf-8")
            (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")
            sys.stdout.write(f"{name}: made\n")
        sys.stdout.flush()
    return different


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

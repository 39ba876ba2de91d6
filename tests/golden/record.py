"""What the commands of a golden case said and wrote: prose as one text, numbers as one record.

``python -m tests.golden.record NAME …`` makes golden files anew, all of them unless named; ``--check`` compares
instead, to the last bit.
"""

from __future__ import annotations

import csv
import difflib
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pandas as pd

from tests.golden.cases import LONGER, SMALL, Case, shipped
from tests.studies.command import ROOT, tolalloc

Run = Callable[..., subprocess.CompletedProcess[str]]
Look = Callable[[subprocess.CompletedProcess[str], Path], None]
FOLDER = Path(__file__).parent
STUDIES = sorted(path.stem for path in (ROOT / "studies").glob("*.py"))
CASES = {case.name: case for case in (*SMALL, *LONGER, *map(shipped, STUDIES))}
_UNSTEADY = (
    (r"\d+(\.\d+)? s(?= here| to |,|$|\.)", "# s"),
    (r"\d+ to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"\d+(\.\d+)? (s|min|h) to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"# s to \d+(\.\d+)? (s|min|h) here", "# here"),
    (r"\d{4}-\d\d-\d\d", "DATE"),
    (r"Compiling the kernel.*\n", ""),
    (r", \d+ units/s", ", # units/s"),
    (r'(computing time \[s\](": |,))[\d.e+,-]*\d', r"\g<1>0"),
    (r"(computing time \[s\]) .*$", r"\1"),
)
"""What no two runs or machines have in common, and what stands for it."""
_TIMED = re.compile(r"seconds \[s\]|per second|speed over|computing time|time a set")
"""Headers of columns that hold how long something took."""
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
    prose, numbers = "", dict[str, object]()
    for at, typed in enumerate(case.commands, start=1):
        before = set(folder.rglob("*"))
        done = run(*(f"{folder}/{word[1:]}" if word.startswith("@") else word for word in typed.split()))
        said = f"$ tolalloc {typed}\n{done.stdout}"
        prose += said + (f"{done.stderr}" if done.returncode else "") + f"exit {done.returncode}\n"
        for path in sorted(set(folder.rglob("*")) - before):
            name = f"{at} {path.relative_to(folder).as_posix()}"
            if "/.tolalloc-units" in str(path) or path.name == "manifest.json" or path.is_dir():
                continue
            if path.name == "report.html":
                prose += f"--- {name}\n{prose_of(path)}\n"
            elif path.suffix == ".json":
                numbers[name] = json.loads(path.read_text(encoding="utf-8"))
            elif path.suffix == ".csv":
                numbers[name] = _rows(path)
            elif path.suffix == ".xlsx":
                sheets = pd.read_excel(path, sheet_name=None, header=None)
                numbers[name] = {sheet: [*map(str, frame.shape)] for sheet, frame in sheets.items()}
            elif path.suffix in (".toml", ".py", ".md"):
                prose += f"--- {name}\n{path.read_text(encoding='utf-8')}\n"
            else:
                prose += f"--- {name}\n"
    look(done, folder)
    return steady(prose, folder), json.loads(steady(json.dumps(numbers, ensure_ascii=False), folder))


def _rows(path: Path) -> list[str]:
    """Return the lines of a table without the columns that hold how long something took."""
    text = path.read_text(encoding="utf-8-sig")
    if not _TIMED.search(text.split("\n", 1)[0]):
        return text.splitlines()
    rows = list(csv.reader(text.splitlines()))
    left = [at for at, header in enumerate(rows[0]) if not _TIMED.search(header)]
    return [",".join(row[at] for at in left) for row in rows]


def steady(text: str, folder: Path) -> str:
    """Return a text without what no two runs or machines have in common."""
    text = text.replace(str(folder), "@")
    for pattern, instead in _UNSTEADY:
        text = re.sub(pattern, instead, text, flags=re.MULTILINE)
    return text


def kept(name: str) -> tuple[str, dict[str, object]]:
    """Return prose and numbers of the golden files of a case."""
    prose = (FOLDER / f"{name}.txt").read_text(encoding="utf-8")
    return prose, json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def main(words: list[str]) -> int:
    """Make or check golden files."""
    names = [word for word in words if word != "--check"] or list(CASES)
    different = 0
    for name in names:
        prose, numbers = recorded(CASES[name])
        text = json.dumps(numbers, ensure_ascii=False, indent=1) + "\n"
        if "--check" in words:
            was = [
                *map(str.splitlines, (kept(name)[0], json.dumps(kept(name)[1], ensure_ascii=False, indent=1) + "\n"))
            ]
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

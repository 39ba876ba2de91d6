"""Every module, function, dimension, file, command, option and test that a page names exists.

The changelog and the decisions speak of the past, so they are exempt.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path
from pydoc import locate

import pytest
from typer.main import get_command

import tolalloc as ta
from tolalloc.cli.main import app

ROOT = Path(__file__).parents[2]
PATTERNS = ("docs/**/*.md", "docs/**/*.rst", "docs/**/plot_*.py", "docs/**/*.ipynb", "docs/**/*.toml", "README.md")
PAST = ("docs/changelog.md", "docs/decisions/", "docs/_")
FOLDERS = ("tolalloc", "docs", "tests", "studies", ".ci")
ROOMS = tuple(f"{path.name}/" for path in (ROOT / "tolalloc").iterdir() if path.is_dir())
READERS = ("spread.py", "with_processes.py", "numpy.py", "tolalloc.py")
"""Files that a page tells its reader to write, or not to write."""
FILE = re.compile(r"\.(?:py|toml|csv|json|md|xlsx|html|pdf|d\w\w|ipynb|css|js|j2|txt)$")
DEFINED = re.compile(r"^ *(?:(?:def|class) (\w+)|([\w, ]+)(?:: | = ).+$)", re.MULTILINE)
COMMANDS = {
    name: {"--help", *chain.from_iterable((*own.opts, *own.secondary_opts) for own in command.params)}
    for name, command in get_command(app).commands.items()
}


@cache
def pages() -> dict[str, str]:
    """Return the text of every page of the present."""
    found = {path.relative_to(ROOT).as_posix(): path for own in PATTERNS for path in ROOT.glob(own)}
    return {name: path.read_text(encoding="utf-8") for name, path in found.items() if not name.startswith(PAST)}


@cache
def files() -> dict[str, str]:
    """Return the path of every file and folder of the repository, with the text of those that hold names."""
    paths = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if "__pycache__" not in path.parts]
    named = (".py", ".csv", ".toml", ".css", ".svg", ".js")
    return {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8", errors="replace")
        if path.suffix in named
        else ""
        for path in paths
    }


@cache
def modules() -> dict[tuple[str, ...], set[str]]:
    """Return the path of every module and room, in parts, with the names that it defines at any depth."""
    found: dict[tuple[str, ...], set[str]] = {}
    for name, text in files().items():
        if name.endswith(".py") or "." not in name:
            parts = tuple(name.removesuffix(".py").removesuffix("/__init__").split("/"))
            defined = " ".join(function or variables for function, variables in DEFINED.findall(text))
            found.setdefault(parts, set()).update(re.findall(r"\w+", defined))
    return found


@cache
def dimensions() -> set[str]:
    """Return the names of dimensions in the shipped tables and in the package, without the numbers of the parts."""
    tables = "\n".join(text for name, text in files().items() if name.endswith((".csv", ".toml")))
    code = "\n".join(text for name, text in files().items() if name.endswith(".py") and name.startswith("tolalloc"))
    names = {*re.findall(r"[a-z]\w*(?:\.\w+)+", tables), *re.findall(r'"([a-z]\w*(?:\.\w+)+)"', code)}
    return {
        re.sub(r"\d", "", ".".join(parts[:end])) for parts in (own.split(".") for own in names) for end in (2, 3, 4)
    }


@cache
def of_tests() -> set[str]:
    """Return the names of tests and their files, and of fields that begin as these do."""
    own = {name: text for name, text in files().items() if name.startswith("tests/")}
    functions = re.findall(r"def (test_\w+)", "\n".join(own.values()))
    fields = re.findall(r'"(test_\w+)"', "\n".join(text for name, text in files().items() if name not in own))
    return {*functions, *fields, *(Path(name).stem for name in own)}


def spans(text: str) -> list[str]:
    """Return what stands in a text as code inside a sentence, be it broken between two lines."""
    sentences = re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)
    return [re.sub(r"\n(?:# )? *", " ", span) for span in re.findall(r"`+((?:[^`\n]|\n(?!\s*\n))+)`+", sentences)]


def is_public(name: str) -> bool:
    """Whether ``ta`` has a name, and what it names the attribute or field that follows."""
    first, _, rest = name.partition(".")
    if first not in dir(ta):
        return False
    public = getattr(ta, first)
    fields = chain.from_iterable(vars(base).get("__annotations__", {}) for base in getattr(public, "__mro__", ()))
    return not rest or hasattr(public, rest) or rest in fields


def is_defined(name: str) -> bool:
    """Whether a dotted name is that of a module, or of what a module or a class in it defines."""
    parts = tuple(name.split("."))
    fewest = 0 if name[0].isupper() else 1
    return any(
        path[len(path) - count :] == parts[:count] and names.issuperset(parts[count:])
        for path, names in modules().items()
        for count in range(fewest, len(parts) + 1)
    )


def is_file(path: str) -> bool:
    """Whether the repository has a file or folder whose path ends so."""
    return any(f"/{name}".endswith(f"/{path.rstrip('/')}") for name in files())


def unknown_names(text: str) -> Iterator[str]:
    """Yield the dotted names of a text that nothing defines."""
    yield from (f"ta.{name}" for name in re.findall(r"\bta\.(\w+(?:\.\w+)?)", text) if not is_public(name))
    calls = [re.fullmatch(r"([A-Za-z_]\w*(?:\.\w+)+)(?:\(.*\))?", span) for span in spans(text)]
    for name in {*re.findall(r"\btolalloc(?:\.\w+)+", text), *(call[1] for call in calls if call)}:
        first = name.partition(".")[0]
        if first == "ta" or FILE.search(name) or is_public(name) or is_defined(name):
            continue
        on_page = f'"{name}"' in text or re.search(rf"^ *{first} = ", text, re.MULTILINE)
        library = first in sys.stdlib_module_names and locate(name)
        if not (on_page or library or re.sub(r"\d", "", name) in dimensions()):
            yield name


def unknown_files(text: str) -> Iterator[str]:
    """Yield the paths of a text that lead to no file of the repository, and the tests that there are not."""
    for path in re.findall(rf"(?<![\w/.<-])((?:{'|'.join(FOLDERS)})/[\w./*-]*[\w*])", text):
        if "_build" not in path and not any(ROOT.glob(path)):
            yield path
    for word in chain.from_iterable(re.findall(r"[\w./-]+", span) for span in spans(text)):
        is_script = word.endswith(".py") and word not in READERS and not word.startswith("mine/")
        is_placeholder = re.search("[A-Z]{4}", word)
        if (is_script or word.startswith(ROOMS)) and not (is_placeholder or is_file(word)):
            yield word
    yield from {*re.findall(r"(?<![\w.])test_\w+", text)} - of_tests()


def unknown_words(text: str) -> Iterator[str]:
    """Yield the commands and options of a text that the command line has not."""
    code = "\n".join(files().values())
    known = {"--upgrade", *re.findall(r'add_argument\("(--[\w-]+)"', code)}.union(*COMMANDS.values())  # the first of uv
    for span in spans(text):
        options = {*re.findall(r"(?<![\w-])--[a-z][\w-]*", span)}
        command = re.match(r"tolalloc ([a-z][a-z-]*)", span)
        if command and not (command[1] in COMMANDS and options <= COMMANDS[command[1]]):
            yield span
        elif span.startswith("--"):
            yield from (own for own in options - known if f"var({own}" not in code)


@pytest.mark.parametrize("unknown", [unknown_names, unknown_files, unknown_words])
def test_what_a_page_names_exists(unknown):
    found = {page: names for page, text in pages().items() if (names := sorted({*unknown(text)}))}
    assert not found


@pytest.mark.parametrize(
    ("unknown", "text", "wrong"),
    [
        (unknown_names, "`tolalloc.reducers.cycloid.pressed`, `contact_stiffness.APPROACH`, `bearings.Friction`", 2),
        (unknown_names, "`ta.Studies`, `ta.Study.questioned`, `ta.Study.limits`, `Programs.stride`, `disc.pitches`", 4),
        (unknown_files, "tests/three_cranks.py, `reducers/tooth.py`, `steer.py`, `springs.py`, `test_nothing`", 4),
        (unknown_words, "`tolalloc ask mine`, `tolalloc te --sheets`, `tolalloc te --torque 1`, `--slowly`", 3),
    ],
)
def test_what_does_not_exist_is_noticed(unknown, text, wrong):
    assert len({*unknown(text)}) == wrong

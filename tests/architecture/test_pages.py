"""The Python on the pages works as it stands, and the page of public names lists all of them."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType

import pytest

import tolalloc as ta
from tolalloc import exceptions
from tolalloc.cli.start import KINDS, schema
from tolalloc.drawings.fields import COLUMNS, HEADERS, ToleranceRow
from tolalloc.study.prepared import Prepared

ROOT = Path(__file__).parents[2]
RUN = ("docs/own-model.md", "docs/extending.md")
ASKS = ("many-studies", "notebook", "two-limits")
LIKE_THE_NOTEBOOK = (  # the six lines that `tests/studies/test_notebook.py` runs, and studies that are made like it
    *("README.md", "docs/reference/study.md"),
    *(f"docs/how-to/{name}.md" for name in ASKS),
)
PAGES = (*RUN, *LIKE_THE_NOTEBOOK)


def blocks(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_the_python_on_a_page_works(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module = ModuleType("page_of_the_documents")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    assert blocks(page)
    for block in blocks(page):
        exec(compile(block, page, "exec", dont_inherit=True), vars(module))
        shown = [repr(made) for made in vars(module).values() if isinstance(made, ta.Study | ta.Answer)]
        assert all(len(line) < 300 for line in shown)


@pytest.mark.parametrize("page", LIKE_THE_NOTEBOOK)
def test_a_page_like_the_notebook_is_python(page):
    assert blocks(page)
    for block in blocks(page):
        compile(block, page, "exec")


@pytest.mark.parametrize("name", [name for name in ASKS if name != "notebook"])
def test_the_study_on_a_page_of_an_everyday_ask_can_be_asked(name):
    page = ModuleType("page_of_an_everyday_ask")
    for block in blocks(f"docs/how-to/{name}.md"):
        exec(compile(block, name, "exec", dont_inherit=True), vars(page))
    assert Prepared(study=page.study).requirements


@pytest.mark.parametrize("page", PAGES)
def test_pages_import_public_names_alone(page):
    for block in blocks(page):
        if "SpringGroup" not in block:  # a new file of the package itself
            assert not re.search(r"from tolalloc|import tolalloc\.", block)


def test_the_page_of_public_names_lists_each_with_its_first_line():
    page = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    for name in ta.__all__:
        found = getattr(ta, name)
        said = f'"{found}"' if isinstance(found, str) else (inspect.getdoc(found) or "").splitlines()[0]
        assert f"| `{name}` | {said} |" in page
    assert page.count("| `") == len(ta.__all__)


def test_the_page_of_rooms_lists_each_with_the_first_line_of_its_own():
    page = (ROOT / "docs" / "reference" / "rooms.md").read_text(encoding="utf-8")
    package = ROOT / "tolalloc"
    rooms = [file.parent for file in package.glob("**/__init__.py") if file.parent != package]
    outer = [room for room in rooms if room.name != "solvers" and room.parent.name != "families"]
    files = [file for file in package.glob("*.py") if file.name != "__init__.py"]
    for place in (*outer, *files):
        source = (place / "__init__.py" if place.is_dir() else place).read_text(encoding="utf-8")
        said = source.removeprefix('"""').partition("\n")[0].removesuffix('"""')
        assert f"| `{place.relative_to(ROOT).as_posix()}` | {said} |" in page
    assert page.count("| `") == len(outer) + len(files)


def public_records() -> list[type]:
    return [kind for name in ta.__all__ if inspect.isclass(kind := getattr(ta, name)) and is_dataclass(kind)]


@pytest.mark.parametrize("record", public_records(), ids=lambda record: record.__name__)
def test_the_help_of_a_public_record_says_what_its_fields_are(record):
    section = inspect.getdoc(record).partition("Parameters")[2]
    stated = re.findall(r"^(\w+(?:, \w+)*)$", section, re.MULTILINE)
    named = {name for line in stated for name in line.split(", ")}
    assert {own.name for own in fields(record) if own.init} <= named


def test_the_page_of_files_says_every_field_of_every_kind(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    page = importlib.import_module("files_page").page()
    for kind in KINDS:
        found = schema(kind)
        for table in (found, *found.get("$defs", {}).values()):
            for field in table.get("properties", {}):
                assert f"| `{field}` |" in page
    assert "| `crank_count` | whole number | 2 to 6 |  |" in page
    assert "| `contact_angle_deg` | number | 0 or more, below 90 | `0.0` |" in page


def test_the_page_of_columns_explains_each_as_the_list_of_fields_does(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    text = importlib.import_module("columns_page").page()
    there = (ROOT / "docs" / "reference" / "columns.md").read_text(encoding="utf-8")
    assert there == text, "write it anew with python docs/columns_page.py"
    rows = text.splitlines()
    for name, column in COLUMNS.items():
        needed = "yes" if ToleranceRow.model_fields[name].is_required() else ""
        assert any(row.startswith(f"| {HEADERS[name]} | {needed} |") and f"| {column.meaning} |" in row for row in rows)
    start = rows.index("| column | needed | allowed | meaning |")
    assert len(rows) - start == 2 + len(COLUMNS)
    assert "| Cp [-] |  | 0.1 to 10 | capability; 1 unless given |" in rows


def test_the_page_of_public_names_lists_every_error():
    page = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    for name, kind in vars(exceptions).items():
        if inspect.isclass(kind) and issubclass(kind, exceptions.TolallocError):
            assert re.search(rf"`[\w.]*{name}`", page)

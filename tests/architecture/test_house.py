"""The house: names in the nomenclature, docstrings, doors of the heavy libraries, the top level."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from datetime import date
from pathlib import Path

import pytest

from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.wings.bench.ask.identify import NAMES
from tolalloc.wings.bench.parameters import SYMBOLS

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "tolalloc"
FILES = sorted(PACKAGE.rglob("*.py"))
DOORS = {
    "SALib": ("sensitivity/",),
    "pymoo": ("allocation/search/pattern_search.py",),
    "cvxpy": ("allocation/search/convex_program.py",),
    "sklearn": ("sensitivity/surrogate/", "reducers/surrogates.py"),
    "matplotlib": ("reports/",),
    "jinja2": ("reports/",),
    "openpyxl": ("drawings/table_file.py",),
    "xlsxwriter": ("reports/excel.py",),
    "distributed": ("running/workers.py",),
    "numba": ("running/compiled.py", "running/compiled_parts.py", "reducers/equivalent/solvers/simd.py"),
    "llvmlite": ("running/compiled_parts.py", "reducers/equivalent/solvers/simd.py"),
    "ezdxf": ("reports/drawing_files.py",),
    "exudyn": ("wings/motion/prototype.py",),
    "typer": ("cli/",),
    "rich": ("cli/",),
}
LATE = ("cvxpy", "sklearn", "pymoo", "pandas")
"""Libraries that are loaded when they are used and not with the package."""
LATER = ("matplotlib", "numba", "scipy.stats", "scipy.special")
"""Libraries that no help needs either."""
SOLVED_WITH = ("numba", "scipy.stats", "scipy.special")
"""Libraries with which a check solves some random units."""
SAYS = re.compile(r"[Tt]heory page,? equations? ((?:\(\d+\)(?:, and |, | and | to )?)+)")
"""How code says which equations of the theory page it computes."""
UNSAID = {85}
"""Equations that nothing in the package computes: of noise, which `tests/verification/test_form.py` compares alone."""


def imports(tree: ast.Module) -> set[str]:
    """Return the libraries that a file imports, but for those that only its annotations name."""
    found, nodes = set(), [tree]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.split(".")[0])
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            nodes += node.orelse
        else:
            nodes += (child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr))
    return found


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.Module]:
    """Return each file of the package, parsed."""
    return {path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in FILES}


def test_heavy_libraries_enter_through_one_door(trees):
    elsewhere = [
        f"{place}: {library}"
        for place, tree in trees.items()
        for library in imports(tree) & DOORS.keys()
        if not place.startswith(DOORS[library])
    ]
    assert not elsewhere


def loaded_by(program: str) -> set[str]:
    """Return the late libraries that a process of its own has loaded when the program is done."""
    said = f"""
import sys
{program}
sys.stderr.write("\\n" + " ".join(name for name in {(*LATE, *LATER)!r} if name in sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", said], cwd=ROOT, capture_output=True, text=True, check=True)
    return set(done.stderr.splitlines()[-1].split())  # what takes longer beside others says so in lines before


def test_the_package_is_imported_without_heavy_libraries():
    assert not loaded_by("import tolalloc")


@pytest.mark.parametrize(
    ("words", "allowed"), [(["--help"], ()), (["check", "studies/liu2020_allocation.py"], SOLVED_WITH)]
)
def test_help_and_check_need_no_heavy_library(words, allowed):
    program = f"""
from tolalloc.cli.main import main
sys.argv = ["tolalloc", *{words!r}]
try:
    main()
except SystemExit as end:
    assert not end.code
"""
    assert loaded_by(program) <= {*allowed}


def test_help_lists_the_parameters_that_can_be_identified():
    assert NAMES.split(", ") == list(SYMBOLS)


def said(text: str) -> set[int]:
    """Return the numbers of the equations of the theory page that a text says."""
    listed = " ".join(SAYS.findall(" ".join(text.replace("#", "").split())))
    ends = re.findall(r"\((\d+)\)(?: to \((\d+)\))?", listed)
    return {number for first, last in ends for number in range(int(first), int(last or first) + 1)}


def beside_equations(page: str) -> dict[str, set[int]]:
    """Return each name in the paragraph before a numbered equation, with the numbers on either side of that paragraph.

    Equations that follow each other without a word between are one.
    """
    blocks: list[tuple[str, set[int]]] = []
    for block in re.split(r"\n\s*\n|(\$\$.*?\$\$)", page, flags=re.DOTALL):
        if not (block and block.strip()):
            continue
        text, tags = block if "$$" not in block else "", {*map(int, re.findall(r"\\tag\{(\d+)\}", block))}
        if blocks and not (text or blocks[-1][0]):
            blocks[-1] = ("", blocks[-1][1] | tags)
        else:
            blocks.append((text, tags))
    found: dict[str, set[int]] = {}
    for (_, before), (text, _), (_, after) in zip([("", set()), *blocks], blocks, blocks[1:], strict=False):
        for name in re.findall(r"`([A-Za-z_][\w.]*)`", text) if after else ():
            found[name] = found.get(name, set()) | before | after
    return found


def described(trees: dict[str, ast.Module]) -> dict[str, str]:
    """Return the docstring of every function, class and method of the package, by its dotted name."""
    found, inside = {}, [(place.removesuffix(".py").replace("/", "."), tree) for place, tree in trees.items()]
    while inside:
        place, node = inside.pop()
        for own in node.body:
            if isinstance(own, ast.FunctionDef | ast.ClassDef):
                found[f"{place}.{own.name}"] = ast.get_docstring(own) or ""
                inside += [(f"{place}.{own.name}", own)] * isinstance(own, ast.ClassDef)
    return found


def unsaid(page: str, docstrings: dict[str, str]) -> tuple[set[str], set[str]]:
    """Return the functions and classes beside equations of a page, and those among them that say no number."""
    known, wanting = set(), set()
    for name, numbers in beside_equations(page).items():
        own = [text for place, text in docstrings.items() if f".{place}".endswith(f".{name.removeprefix('tolalloc.')}")]
        if own:
            known.add(name)
            if not any(said(text) & numbers for text in own):
                wanting.add(name)
    return known, wanting


def test_what_stands_beside_an_equation_says_its_number(trees):
    known, wanting = unsaid((ROOT / "docs" / "theory.md").read_text(encoding="utf-8"), described(trees))
    assert len(known) > 100
    assert not wanting


def test_the_code_names_the_equations_of_the_theory_page_and_no_others(trees):
    page = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    given = {int(number) for number in re.findall(r"\\tag\{(\d+)\}", page)}
    texts = {place: (PACKAGE / place).read_text(encoding="utf-8") for place in trees}
    assert set().union(*map(said, texts.values())) == given - UNSAID
    assert not [place for place, text in texts.items() if re.search(r"heory pages?,?\s+\(|heory pages\s", text)]


def test_an_equation_that_nothing_says_is_noticed():
    page = "As `one.same`, with `LIMIT`,\n\n$$a \\tag{1}$$\n\n$$b \\tag{2}$$\n\nand `two`\n$$c \\tag{3}$$\n\n`three`."
    docstrings = {"room.one.same": "Theory page equation (2).", "room.two": "Equation (3)."}
    assert beside_equations(page) == {"one.same": {1, 2}, "LIMIT": {1, 2}, "two": {1, 2, 3}}
    assert unsaid(page, docstrings) == ({"one.same", "two"}, {"two"})
    assert said("theory page, equations (1), (4) to (6) and\n    (8), (9)") == {1, 4, 5, 6, 8, 9}
    assert not said("liu2020, equations (2) to (12); theory page (7)")


def lines_of(function: ast.FunctionDef) -> int:
    """Return the lines of a function's body, without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_functions_stay_small(trees):
    functions = [
        (f"{place}: {node.name}", lines_of(node))
        for place, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    ]
    assert not [(name, lines) for name, lines in functions if lines > 65]


def _documented_numbers(record: ast.ClassDef) -> list[tuple[str, str]]:
    """Return the number fields of a record with what is said of them, in its docstring or beside the field."""
    fields = [item for item in record.body if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)]
    numbers = {
        item.target.id for item in fields if ast.unparse(item.annotation).startswith(("float", "int", "Float", "Int"))
    }
    entries = re.finditer(r"^(\w[\w, ]*)\n((?:    .*\n?)+)", ast.get_docstring(record) or "", re.MULTILINE)
    said = [(entry[1], entry[2]) for entry in entries if {*entry[1].split(", ")} & numbers]
    for field, after in zip(record.body, record.body[1:], strict=False):
        is_number = isinstance(field, ast.AnnAssign) and getattr(field.target, "id", "") in numbers
        if is_number and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            said.append((field.target.id, str(after.value.value)))
    return said


def test_every_documented_number_states_its_unit(trees):
    """What is said of a number field ends with a unit in brackets, unless it is a name, a flag or a record."""
    wanting = [
        f"{place}: {node.name}.{name}"
        for place, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        for name, text in _documented_numbers(node)
        if "[" not in text
    ]
    assert not wanting


def test_columns_of_the_model_stand_in_the_nomenclature(rv20e):
    page = (ROOT / "docs" / "reference" / "nomenclature.md").read_text(encoding="utf-8")
    for column in rv20e.columns:
        generic = re.sub(r"crank\d+", "crank{i}", source_name(column))
        generic = re.sub(r"journal\d+", "journal{j}", generic)
        generic = re.sub(r"disc\d+", "disc{j}", generic)
        generic = re.sub(r"bore\d+", "bore{i}", generic)
        generic = re.sub(r"(planet|mesh)\d+", r"\1{i}", generic)
        generic = generic.removeprefix("modification.")
        assert f"`{generic}`" in page, generic


def test_top_level_holds_only_what_it_should():
    tracked = subprocess.run(["git", "ls-tree", "--name-only", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode:
        pytest.skip("not a git checkout")
    names = {name for name in tracked.stdout.split() if not name.startswith(".")}
    assert names <= {"pyproject.toml", "tolalloc", "studies", "tests", "docs", "README.md", "LICENSE"}


def test_the_version_stands_in_changes_and_citation_too():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    (first, *_) = re.findall(r"^## (\S+), (.+)$", (ROOT / "docs" / "changelog.md").read_text(encoding="utf-8"), re.M)
    cited = dict(re.findall(r"^([\w-]+): (.+)$", (ROOT / "docs" / "CITATION.cff").read_text(encoding="utf-8"), re.M))
    assert version == first[0] == cited["version"]
    assert f"{date.fromisoformat(cited['date-released']):%-d %B %Y}" == first[1]


def test_a_version_has_at_most_25_rows_in_the_changelog():
    _, *versions = (ROOT / "docs" / "changelog.md").read_text(encoding="utf-8").split("\n## ")
    for version in versions:
        rows, heads = re.findall(r"^\| ", version, re.M), re.findall(r"^\|---", version, re.M)
        assert len(rows) - len(heads) <= 25, version.partition("\n")[0]


def test_answers_to_the_review_of_the_repository_stand_on_the_page():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    page = (ROOT / "docs" / "CONTRIBUTING.md").read_text(encoding="utf-8")
    stated = dict(re.findall(r"^\| ([A-Z]+\d+) \| .+? \| (.+) \|$", page, re.M))
    assert stated == settings["tool"]["repo-review"]["ignore"]

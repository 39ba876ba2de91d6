"""Which file imports which, of the package and of its tests, read from their text."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "tolalloc"
FOUND_BY_KIND = ("tolalloc.reports.tellers.", "tolalloc.reports.portraits.")
"""Modules that no import names: a command finds them by the kind of its answer or its own name."""


def module_of(path: Path) -> str:
    """Return the module of a file of the package or of the tests."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported(tree: ast.AST, modules: set[str]) -> set[str]:
    """Return the modules that a file imports, wherever: on top, for a type checker alone, or inside a function."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            inner = {f"{node.module}.{name.name}" for name in node.names}
            found |= inner & modules or {node.module}
    return found & modules


@cache
def public_places() -> dict[str, str]:
    """Return the module from which each public name of the package is loaded."""
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module)
    return {name.asname or name.name: node.module for node in nodes for name in node.names}


def public_uses(tree: ast.AST) -> set[str]:
    """Return the modules behind the public names that a file takes from ``tolalloc`` itself."""
    named = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute) and _is_package(node.value)}
    return {place for name in named if (place := public_places().get(name)) is not None}


def _is_package(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id in ("ta", "tolalloc")


@cache
def graph() -> dict[str, set[str]]:
    """Return each module of the package and of the tests with those that it imports itself."""
    files = {module_of(path): path for path in sorted([*PACKAGE.rglob("*.py"), *(ROOT / "tests").rglob("*.py")])}
    found = dict[str, set[str]]()
    for name, path in files.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))  # one at a time: all of them kept slow the parser down
        found[name] = ((imported(tree, set(files)) | public_uses(tree)) & files.keys()) - {name, "tolalloc"}
    found["tolalloc.cli.main"] |= {name for name in files if name.startswith(FOUND_BY_KIND)}
    return found


@cache
def steps_to(start: str, goals: frozenset[str]) -> int | None:
    """Return by how many imports a module leads to the nearest of some others, or None where it leads to none."""
    reached, front, steps = {start}, {start}, 0
    while front:
        if front & goals:
            return steps
        front = {other for name in front for other in graph()[name]} - reached
        reached |= front
        steps += 1
    return None

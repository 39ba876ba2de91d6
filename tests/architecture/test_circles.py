"""The shape of the house: no file imports itself in a roundabout way, sentences keep their users."""

from __future__ import annotations

import ast
import inspect
import tomllib

import pytest

from tests.import_graph import PACKAGE, imported, module_of
from tolalloc.models.model import Model


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Return the sets of nodes that reach each other (Tarjan), every one as a closed walk."""
    number: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        number[node] = lowest[node] = len(number)
        stack.append(node)
        for other in sorted(edges[node]):
            if other not in number:
                visit(other)
            if other in stack:
                lowest[node] = min(lowest[node], lowest[other])
        if lowest[node] == number[node]:
            at = stack.index(node)
            if len(stack) > at + 1:
                found.append(walk(set(stack[at:]), edges))
            del stack[at:]

    for node in edges:
        if node not in number:
            visit(node)
    return found


def walk(inside: set[str], edges: dict[str, set[str]]) -> list[str]:
    """Return a closed walk inside a set of nodes that reach each other."""
    path = [min(inside)]
    while (step := min(edges[path[-1]] & inside)) not in path:
        path.append(step)
    return [*path[path.index(step) :], step]


@pytest.fixture(scope="module")
def edges() -> dict[str, set[str]]:
    files = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}
    return {
        name: imported(ast.parse(path.read_text(encoding="utf-8")), set(files)) - {name} for name, path in files.items()
    }


def test_a_circle_is_found_as_a_closed_walk():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == [["b", "c", "b"]]


def test_no_file_imports_itself_in_a_roundabout_way(edges):
    wrong = circles(edges)
    assert not wrong, "\n".join(" → ".join(found) for found in wrong)


def test_a_model_has_no_words_or_pictures():
    members = [name for name, _ in inspect.getmembers(Model) if not name.startswith("_")]
    assert not {"scene", "illustration", "cautions", "left_out", "assumptions", "spoken"} & {*members}


def constants(node: ast.AST) -> set[str]:
    """Return the texts in an expression."""
    return {part.value for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)}


def said_in(tree: ast.Module) -> dict[str, tuple[set[str], set[str]]]:
    """Return, of every file of sentences that a teller opens, the keys that it surely says and those it may."""
    found: dict[str, tuple[set[str], set[str]]] = {}
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)):
            continue
        if getattr(node.value.func, "id", "") != "Sentences":
            continue
        name = node.targets[0].id
        calls = [own for own in ast.walk(tree) if isinstance(own, ast.Call) and getattr(own.func, "id", "") == name]
        sure = {own.args[0].value for own in calls if own.args and isinstance(own.args[0], ast.Constant)}
        found[node.value.args[0].value] = (sure, constants(tree))
    return found


def test_every_sentence_has_a_teller_and_every_teller_its_sentences():
    said: dict[str, list[tuple[set[str], set[str]]]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        for name, keys in said_in(ast.parse(path.read_text(encoding="utf-8"))).items():
            said.setdefault(name, []).append(keys)
    files = {path.stem: path for path in PACKAGE.rglob("sentences/*.toml")}
    assert said.keys() == files.keys()
    for name, path in files.items():
        known = set(tomllib.loads(path.read_text(encoding="utf-8")))
        sure, possible = (set().union(*(keys[at] for keys in said[name])) for at in (0, 1))
        assert sure <= known, f"{path.name} has no {sorted(sure - known)}"
        begun = tuple(text for text in possible if text.endswith("_"))  # such as that of f"law_{law}"
        unsaid = [key for key in known - possible if not key.startswith(begun)]
        assert not unsaid, f"nobody says {sorted(unsaid)} of {path.name}"

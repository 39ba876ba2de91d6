"""Where an equation of the theory page is computed, the docstring says whose it is and what comes out of one case."""

from __future__ import annotations

import ast
import re

from tests.studies.command import ROOT

NAMED = re.compile(r"`tolalloc\.((?:reducers|sensitivity|capability|allocation)\.[\w.]+)\.(\w+)`")
SOURCE = re.compile(r"\b(1[789]|20)\d\d\b|own\s+derivation|[=≈≤≥∝∑Σ√∫]", re.IGNORECASE)
EXAMPLE = re.compile(r"^\s*(>>>|\.\.\.).*$", re.MULTILINE)


def named_functions() -> dict[str, str]:
    """Return the docstring of every function that the theory page names in a room of numbers."""
    found = {}
    for module, name in set(NAMED.findall((ROOT / "docs" / "theory.md").read_text(encoding="utf-8"))):
        path = ROOT / "tolalloc" / f"{module.replace('.', '/')}.py"
        if path.exists():
            nodes = ast.parse(path.read_text(encoding="utf-8")).body
            found |= {
                f"{module}.{name}": ast.get_docstring(node) or ""
                for node in nodes
                if isinstance(node, ast.FunctionDef) and node.name == name
            }
    return found


def test_what_computes_an_equation_of_the_theory_page_has_a_source_and_a_worked_number():
    known = named_functions()
    assert len(known) > 50
    without = {name for name, text in known.items() if not EXAMPLE.search(text)}
    unsourced = {name for name, text in known.items() if not SOURCE.search(EXAMPLE.sub("", text))}
    assert not without, sorted(without)
    assert not unsourced, sorted(unsourced)

"""The validation manual: numbered cases, each with source, target, value, difference and its errors apart."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
KINDS = {
    "code": ("Code verification", "Are the equations solved as they stand? Compared with closed forms and twins."),
    "solution": ("Solution verification", "How large are the errors of steps, angles and samples of a single answer?"),
    "validation": ("Validation", "Does the model say what was measured, or what a catalogue states?"),
}
HEAD = """# Validation manual

Numbered cases, the shortest way to see what the numbers of a report are worth. A test shows every value: it fails once
the number is another one to its last digit. Numerical error, sampling error and model error stand apart, since more
angles, more units and a better model mend different ones. Everything that was compared stands in
[Validation](../validation.md), with what is missed.
"""


def page() -> str:
    """Return the page."""
    cases = tomllib.loads((HERE / "reference" / "cases.toml").read_text(encoding="utf-8"))["case"]
    parts = [HEAD]
    for kind, (title, words) in KINDS.items():
        own = [case for case in cases if case["kind"] == kind]
        rows = [
            f"| [{case['number']}](#{_anchor(case)}) | {case['title']} | {case['target']} | {case['value']} "
            f"| {_difference(case)} | {case['unit']} |"
            for case in own
        ]
        head = "| case | | target | value | difference | unit |\n|---|---|--:|--:|--:|---|"
        parts.append("\n".join([f"## {title}\n\n{words}\n", head, *rows, ""]))
        parts += [_told(case) for case in own]
    return "\n".join(parts)


def _told(case: dict[str, Any]) -> str:
    unit = "" if case["unit"] == "-" else f" {case['unit']}"
    rows = {
        "source": case["source"],
        "what is compared": case["quantity"],
        "target": f"{case['target']}{unit}",
        "value": f"{case['value']}{unit}",
        "difference": f"{_difference(case)}{unit}",
        "numerical error": case["numerical"],
        "sampling error": case["sampling"],
        "model error": case["model"],
        "test": f"`{case['test']}`",
    }
    table = "\n".join(["| | |", "|---|---|", *(f"| {name} | {text} |" for name, text in rows.items())])
    figure = f"![{case['title']}](../figures/{case['figure']})\n\n" if "figure" in case else ""
    return f"({_anchor(case)})=\n### {case['number']}. {case['title']}\n\n{figure}{table}\n"


def _anchor(case: dict[str, Any]) -> str:
    return f"case-{case['number'].lower()}"


def _difference(case: dict[str, Any]) -> str:
    """Return value less target with the digits of the value; a bound is a difference already."""
    if case["value"].startswith("≤"):
        return str(case["value"])
    decimals = len(case["value"].partition(".")[2])
    found = round(float(case["value"]) - float(case["target"]), decimals)
    return f"{found:+.{decimals}f}" if found else "0"

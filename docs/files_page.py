"""The page of files: every field of the TOML files, made from the records that read them, so that neither can drift."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tolalloc.cli.start import KINDS, schema
from tolalloc.reducers.families.known import FAMILIES

_FAMILY = "`NAME.reducer.toml` with a table `[{table}]`; `tolalloc new --family {kind}` writes one."
TITLES = {
    **{
        own.new.schema: (own.new.title, _FAMILY.format(table=own.record.table, kind=own.new.schema))
        for own in FAMILIES.values()
    },
    "reducer": ("Reducer", "`NAME.reducer.toml`: sizes, stiffness, modification and load; `tolalloc new` writes one."),
    "unit": ("One unit", "`NAME.unit.toml`: the part errors of one reducer, for `te` and `simulate`."),
    "stiffness": ("Identified stiffness", "`NAME.stiffness.toml`: `tolalloc identify --write` writes it."),
    "bench": ("Measurements", "`measurement.toml`: what a test bench has read, for `tolalloc identify`."),
    "chain": (
        "Datum flow chain",
        "`NAME.chain.toml`: parts of an assembly and its steps, for `tolalloc assemble`.",
    ),
}
HEAD = """# Files

The TOML files that you write, field by field. A name ends in its unit; springs without one are in N/m.
What is not listed is refused by name, and the
nearest field is offered. `tolalloc schema KIND` prints the same for an editor, which then offers the fields. Tables of
tolerances have [columns](../reference/columns.md) instead.

Where a field may be a number or a table, either may stand; a table is explained below under its own heading.
"""


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for kind in KINDS:
        title, words = TITLES[kind]
        found = schema(kind)
        parts.append(f"## {title}\n\n{words}\n\n{_table(found)}")
        parts += [f"### {title}: {name}\n\n{text}" for name, text in _inner(found)]
    return "\n".join(parts)


def _inner(found: dict[str, Any]) -> Iterator[tuple[str, str]]:
    for name, own in sorted(found.get("$defs", {}).items()):
        if "properties" in own:
            words = " ".join(own.get("description", "").split("\n\n")[0].split()).replace("``", "`")
            yield name.removesuffix("Record"), f"{words}\n\n{_table(own)}"


def _table(own: dict[str, Any]) -> str:
    needed = own.get("required", [])
    rows = [
        f"| `{name}` | {_kind(field)} | {allowed(field)} | {'' if name in needed else _default(field)} |"
        for name, field in own["properties"].items()
    ]
    return "\n".join(["| field | kind | allowed | unless given |", "|---|---|---|---|", *rows, ""])


def _kind(field: dict[str, Any]) -> str:
    """Return what may stand in a field, in words."""
    if "$ref" in field:
        return f"table {field['$ref'].rsplit('/', 1)[1].removesuffix('Record')}"
    if several := field.get("anyOf") or field.get("oneOf") or field.get("allOf"):
        return " or ".join(dict.fromkeys(_kind(own) for own in several if own.get("type") != "null"))
    words = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false"}
    if field.get("type") == "array":
        items = field.get("items") or next(iter(field.get("prefixItems", [{}])))
        return f"list of {_kind(items)}"
    if field.get("type") == "object":
        inner = field.get("additionalProperties")
        return f"table of names, each with a {_kind(inner)}" if isinstance(inner, dict) else "table"
    return words.get(field.get("type", ""), "text")


def allowed(field: dict[str, Any]) -> str:
    """Return which values are allowed, in words."""
    if several := field.get("anyOf") or field.get("oneOf") or field.get("allOf"):
        return " or ".join(dict.fromkeys(filter(None, map(allowed, several))))
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    if field.get("type") == "array" and isinstance(field.get("items"), dict):
        return allowed(field["items"])
    low, above = field.get("minimum"), field.get("exclusiveMinimum")
    high, below = field.get("maximum"), field.get("exclusiveMaximum")
    ends = [f"{low:g} or more" if low is not None else "", f"above {above:g}" if above is not None else ""]
    ends += [f"up to {high:g}" if high is not None else "", f"below {below:g}" if below is not None else ""]
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    return ", ".join(filter(None, ends))


def _default(field: dict[str, Any]) -> str:
    """Return what counts where a field is left out."""
    if "description" in field:
        return str(field["description"]).removesuffix(", unless given")
    value = field.get("default")
    if isinstance(value, dict):
        return "as its fields say"
    return f"`{value}`" if value not in (None, "", [], {}) else "nothing"

"""What a file says when it is read plainly, with nothing but the standard library, and what a reader made of it.

Two files that say the same must give the same answer; two that do not say the same must not. A reader that skips a cell
fails the second, one that takes a number for another fails the first.
"""

from __future__ import annotations

import csv
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any
from unicodedata import category

import numpy as np
from openpyxl import load_workbook

Said = dict[str, object]
"""Place in the file → what stands there, a number as one."""

DECIMALS = 1e-12
"""Relative difference of two numbers below which units of measurement may make them one [-]."""

_LOST = 1e-300
"""Number that is zero in another unit of measurement."""


def said(path: Path) -> Said:
    """Return what a file says; empty cells, comments and how numbers are written say nothing."""
    content = path.read_bytes()
    if path.suffix == ".toml":
        return dict(_leaves(tomllib.loads(_text(content)), ""))
    if path.suffix == ".xlsx":
        sheet = load_workbook(BytesIO(content), data_only=True).worksheets[0]
        return _cells([["" if value is None else str(value) for value in row] for row in sheet.values])
    lines = ["" if line.startswith("#") else line for line in StringIO(_text(content))]
    return _cells(list(csv.reader(lines)))


def rows(table: Said, left_out: str) -> list[list[str]]:
    """Return what a table's rows say, whatever their order, without the places of a pattern."""
    found: dict[str, list[str]] = {}
    for place, value in table.items():
        if not re.fullmatch(left_out, place):
            row, _, column = place.partition("/")
            found.setdefault(row, []).append(f"{column} {value}")
    return sorted(found.values())


def differences(before: Said, now: Said) -> dict[str, float]:
    """Return every place where two files differ, and by how much: 1, or less where both have a number.

    A place that says nothing any more is called so.
    """
    found = {}
    for place in {**before, **now}:
        one, other = before.get(place), now.get(place)
        # A header need not state the unit that a column has.
        if one != other and not str(one).startswith(f"{other} ["):
            numbers = isinstance(one, float) and isinstance(other, float)
            largest = max(abs(one), abs(other), _LOST) if numbers else 1.0
            found[place if place in now else f"{place} left out"] = abs(one - other) / largest if numbers else 1.0
    return found


def made(value: Any) -> Any:
    """Return an answer as nested tuples that compare, whatever it is made of."""
    if isinstance(value, Enum | str | bytes | Path | None):
        return value
    if isinstance(value, float | int):
        return float(value)
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if is_dataclass(value):
        # Where a row stood is no part of what it says.
        return tuple(made(getattr(value, field.name)) for field in fields(value) if field.name != "place")
    if isinstance(value, Mapping):
        return tuple(sorted((str(name), made(own)) for name, own in value.items()))
    if isinstance(value, tuple | list | frozenset | set):
        return tuple(map(made, value))
    return made(vars(value))


def _text(content: bytes) -> str:
    """Return a text in UTF-8, or as offices save a table: in Windows-1252 where one byte or more is none of UTF-8."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "cp1252")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _meant(text: str) -> object:
    if text in ("yes", "true", "no", "false"):
        return "yes" if text in ("yes", "true") else "no"
    try:
        return float(text)
    except ValueError:
        return text


def _cells(rows: list[list[str]]) -> Said:
    """Return row and column → cell; rows that are blank do not count, nor titles above a header that has an id.

    A damaged header above a whole one is a title; signs that nobody sees are none.
    """
    seen = [["".join(sign for sign in cell if category(sign) != "Cf").strip() for cell in row] for row in rows]
    kept = [row for row in seen if any(row)]
    kept = kept[next((at for at, row in enumerate(kept) if "id" in row), 0) :]
    while len(kept) > 1 and "id" in kept[0] and "id" in kept[1]:
        kept = kept[1:]
    header = kept[0] if kept else []
    found: Said = {f"header {at}": re.sub(r"\s*\[\s*\]$", "", name) for at, name in enumerate(header) if name}
    for number, row in enumerate(kept[1:], start=1):
        found |= {f"{number}/{at}": _meant(cell) for at, cell in enumerate(row) if cell}
    return found


def _leaves(value: object, place: str) -> Iterator[tuple[str, object]]:
    if isinstance(value, Mapping):
        for name, own in value.items():
            yield from _leaves(own, f"{place}.{name}")
    elif isinstance(value, list):
        yield place, len(value)
        for at, own in enumerate(value):
            yield from _leaves(own, f"{place}[{at}]")
    else:
        yield place, float(value) if type(value) in (int, float) else value

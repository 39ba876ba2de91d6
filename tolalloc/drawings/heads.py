"""What the heads of a table mean, as an office writes them, and which row has them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import is_unit, usual_signs

MOST_TITLES = 200
"""Rows among which the heads of a table are looked for [-]."""


_TEXTS = ("id", "part", "feature", "unit", "distribution", "group", "process", "grade", "sources", "source", "measured")
"""Columns whose cells are no numbers, whatever they look like."""
_WORDS = ("drawing", "label", "note")
"""Columns that are carried through, dates too."""
_BRACKET = re.compile(r"(.*?)\s*\(([^()]*)\)")
"""Head with its unit in round brackets."""
_NUMBER = re.compile(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?")
"""What is no head."""


def split_header(header: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``disc1.tilt.x [µrad]``; the unit is empty where none is stated."""
    match = re.fullmatch(r"(.*?)\s*\[(.*)\]", header)
    if match is None:
        return header, ""
    return match[1], usual_signs(match[2].strip())


@dataclass(frozen=True, kw_only=True)
class Heads:
    """How a table's heads are read."""

    # Names of columns: the header is the first row that has them all, and rows above it are titles
    needed: tuple[str, ...] = ()
    # Names of columns in the spelling that is meant; a head in other capitals is one of them
    known: tuple[str, ...] = ()
    # Head as an office writes it, without its unit → the name of the column that it is
    called: Mapping[str, str] = field(default_factory=dict)

    def meant(self, head: str) -> str:
        """Return a head as a column is named, with the unit that it states."""
        name, unit = split_header(head)
        spelt = self._names
        bracket = _BRACKET.fullmatch(name)
        if bracket and not unit and _spelt(bracket[1]) in spelt and is_unit(bracket[2]):
            name, unit = bracket[1], usual_signs(bracket[2].strip())
        found = spelt.get(_spelt(name), name)
        return f"{found} [{unit}]" if unit else found

    @cached_property
    def _names(self) -> dict[str, str]:
        """Head without its capitals and its unit → name of the column."""
        return {_spelt(own): own for own in self.known} | {
            _spelt(_without_unit(own)): name for own, name in self.called.items()
        }

    def row_in(self, rows: Sequence[Sequence[str]]) -> int:
        """Return the position of the row that names all needed columns and most others, 0 where none does."""
        named = {at: self.named(cells) for at, cells in enumerate(rows[:MOST_TITLES])} if self.needed else {}
        found = {at: len(own & {*self.known}) for at, own in named.items() if own.issuperset(self.needed)}
        return max(found, key=lambda at: found[at], default=0)

    def require_in(self, path: Path, rows: Sequence[Sequence[str]]) -> None:
        """Raise unless a row has a head for each column that is needed, and a column each head that is said so."""
        first = rows[:MOST_TITLES]
        words = [sum(bool(cell) and not _NUMBER.fullmatch(cell) for cell in cells) for cells in first]
        at = words.index(max(words)) if words else 0
        seen = [cell for cell in (rows[at] if rows else ()) if cell]
        # Of a table that has most of its heads it is said which one is missing.
        has_all = any(self.named(cells).issuperset(self.needed) for cells in first)
        if seen and 2 * len(self.named(seen) & {*self.known}) <= len(seen) and not has_all:
            raise InputError(
                f"{path}: no row has a head {' and '.join(map(repr, self.needed))}; row {at + 1} has "
                f"{', '.join(map(repr, seen))}. Say what these are, each with a name of a column or left out, in "
                f"{path.with_suffix('.toml').name} beside it: columns = {_guessed(seen, self.known)}"
            )
        header = rows[self.row_in(rows)] if rows else ()
        there = [_without_unit(cell) for cell in header if cell]
        for own in self.called:
            if _spelt(_without_unit(own)) not in map(_spelt, there):
                raise UnknownNameError.among(f"{path}, columns", "head", _without_unit(own), there)

    def kind(self, head: str) -> str:
        """Return what stands under a head of a table: number, text (of ours), or words that nothing is read from."""
        name = split_header(self.meant(head))[0]
        if name in _WORDS or (self.known and name not in self.known):
            return "words"
        return "text" if name in _TEXTS else "number"

    def named(self, cells: Sequence[str]) -> set[str]:
        """Return the names that a row would give to columns."""
        return {split_header(self.meant(cell))[0] for cell in cells}


def _spelt(head: str) -> str:
    """Return a head without its capitals and line breaks."""
    return " ".join(head.split()).lower()


def _without_unit(head: str) -> str:
    """Return a head without the unit that it states in brackets of either kind."""
    name, _ = split_header(head)
    bracket = _BRACKET.fullmatch(name)
    return bracket[1] if bracket and is_unit(bracket[2]) else name


@cache
def office_words(kind: str) -> dict[str, str]:
    """Return what offices' words mean, in small letters: heads of ``columns``, or words in ``cells``."""
    text = (Path(__file__).parent / "data" / "office_words.toml").read_text(encoding="utf-8")
    return {word: name for name, words in tomllib.loads(text)[kind].items() for word in words}


def _guessed(heads: Iterable[str], known: Sequence[str]) -> str:
    """Return an inline table of TOML that says what heads mean, as far as offices' words are known."""
    meant = office_words("columns")
    names = {_without_unit(head): meant.get(_spelt(_without_unit(head)), "?") for head in heads}
    guessed = {head: name for head, name in names.items() if name in known} or dict.fromkeys(names, "?")
    return "{ " + ", ".join(f'"{head}" = "{name}"' for head, name in guessed.items()) + " }"

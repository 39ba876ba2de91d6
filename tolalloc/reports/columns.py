"""Tables as declared columns: report, workbook, summary and terminal follow from one declaration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tolalloc.reading.units import COST_UNITS

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.drawings.sources import Source

Row = TypeVar("Row")

_SAME = 1e-6
"""Relative difference of two numbers below which a cell has one of them [-]."""


@dataclass(frozen=True)
class Column(Generic[Row]):
    """One column of a table."""

    header: str  # Header with its unit; ``{cost}`` in it stands for what costs are counted in
    value: Callable[[Row], Any]  # What stands in a row's cell
    _: KW_ONLY
    # Name in a summary, where a program reads it; the header unless given, None where no program needs it
    key: str | None = ""
    # Place among the columns that a terminal shows, those of one place in their order; 0 if it does not show it [-]
    terminal: int = 0
    # Cell that says nothing: where all cells are so or empty, the column is left out; None to keep it always
    nothing: str | None = None

    def titled(self, cost_unit: str) -> str:
        """Return the header with what costs are counted in."""
        return self.header.replace("{cost}", cost_unit)


@dataclass(frozen=True, kw_only=True)
class Table(Generic[Row]):
    """A table as it is declared, with its rows."""

    name: str  # Name of its sheet and file
    columns: Sequence[Column[Row]]  # Its columns in their order
    rows: Sequence[Row]  # What its rows tell of

    def frame(self, cost_unit: str = COST_UNITS) -> pd.DataFrame:
        """Return the table for people: all columns that say something, costs in their unit."""
        return _framed(self._cells(self.columns), cost_unit)

    def terminal(self, cost_unit: str = COST_UNITS) -> pd.DataFrame:
        """Return the columns that a terminal shows."""
        return _framed(self._cells(self._shown), cost_unit)

    def shown(self, cost_unit: str = COST_UNITS) -> tuple[str, ...]:
        """Return the headers of the columns that a terminal shows."""
        return tuple(own.titled(cost_unit) for own in self._shown)

    def records(self) -> list[dict[str, Any]]:
        """Return the rows for a program, costs in cost units whatever people count them in; nothing for no number."""
        told = self._cells([own for own in self.columns if own.key is not None])
        named = {own.key or own.titled(COST_UNITS): cells for own, cells in told}
        return [{name: plain(cells[at]) for name, cells in named.items()} for at in range(len(self.rows))]

    @property
    def _shown(self) -> list[Column[Row]]:
        return sorted((own for own in self.columns if own.terminal), key=lambda own: own.terminal)

    def _cells(self, columns: Sequence[Column[Row]]) -> list[tuple[Column[Row], list[Any]]]:
        """Return the columns that say something with their cells."""
        told = [(own, [own.value(row) for row in self.rows]) for own in columns]
        return [
            (own, cells)
            for own, cells in told
            if own.nothing is None or any(cell not in (own.nothing, "") for cell in cells)
        ]


def of_positions(name: str, columns: Mapping[str, Any], rows: Iterable[int] | None = None) -> Table[int]:
    """Return a table whose rows are positions in arrays.

    Parameters
    ----------
    name
        Name of its sheet and file.
    columns
        Header → what stands at every position, or what says it of one.
    rows
        The positions in the order of the table; all that the first column has unless given.

    Examples
    --------
    >>> of_positions("zones", {"zone [µm]": [4.0, 9.0], "row [-]": lambda at: at + 1}, [1, 0]).records()
    [{'zone [µm]': 9.0, 'row [-]': 2}, {'zone [µm]': 4.0, 'row [-]': 1}]
    """
    made = [
        Column[int](header=header, value=own if callable(own) else own.__getitem__) for header, own in columns.items()
    ]
    rows = range(len(next(iter(columns.values())))) if rows is None else rows
    return Table(name=name, columns=made, rows=list(rows))


def _framed(told: Sequence[tuple[Column[Row], list[Any]]], cost_unit: str) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame({own.titled(cost_unit): cells for own, cells in told})


_NUMBERS = " 0123456789/-_.#"
"""What a name ends in that numbers the copies of a part."""
_COPIES = 3
"""Own ids of one row from which the first and the last alone are told [-]."""


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: numbers of Python, null for NaN and infinity.

    >>> plain(float("inf")) is None, plain(1.5)
    (True, 1.5)
    """
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not isfinite(value) else value


def span(low: float, high: float) -> float | str:
    """Return a cell from one number to another, or the number where they are one.

    >>> span(4.0, 4.0), span(-1.5, 4.0)
    (4.0, '-1.5…4')
    """
    return low if high - low <= _SAME * max(abs(low), abs(high)) else f"{low:.4g}…{high:.4g}"


def own_words(
    members: Callable[[Row], Sequence[Source]], named: Callable[[Row], str] = lambda _: ""
) -> tuple[Column[Row], ...]:
    """Return the columns of own id, drawing and label of a row's sources, which stand where a drawing states any.

    Own ids of several copies stand as the first and the last; those that say what the row is called, but for the
    numbers of its copies, say nothing.
    """

    def said(field: str) -> Callable[[Row], str]:
        return lambda row: ", ".join(_each(members(row), field))

    def own_id(row: Row) -> str:
        found = _each(members(row), "own_id")
        bare = named(row).rstrip(_NUMBERS)
        if bare and {own.rstrip(_NUMBERS) for own in found} == {bare}:
            return ""
        return ", ".join(found) if len(found) < _COPIES else f"{found[0]} … {found[-1]}"

    return (
        Column("own id", own_id, nothing=""),
        Column("drawing", said("drawing"), nothing=""),
        Column("label", said("label"), nothing=""),
    )


def _each(members: Sequence[Source], field: str) -> list[str]:
    """Return what the members state in a field of theirs, what is alike once."""
    return list(dict.fromkeys(filter(None, (getattr(own, field) for own in members))))

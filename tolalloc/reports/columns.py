"""Tables as declared columns: report, workbook, summary and terminal follow from one declaration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from tolalloc.reading.units import COST_UNITS

if TYPE_CHECKING:
    import pandas as pd

Row = TypeVar("Row")


@dataclass(frozen=True, kw_only=True)
class Column(Generic[Row]):
    """One column of a table.

    Parameters
    ----------
    header
        Header with its unit; ``{cost}`` in it stands for what costs are counted in.
    value
        What stands in a row's cell.
    key
        Name in a summary, where a program reads it; the header unless given, None where no program needs it.
    terminal
        Whether a terminal shows it.
    """

    header: str
    value: Callable[[Row], Any]
    key: str | None = ""
    terminal: bool = False

    def titled(self, cost_unit: str) -> str:
        """Return the header with what costs are counted in."""
        return self.header.replace("{cost}", cost_unit)


@dataclass(frozen=True, kw_only=True)
class Table(Generic[Row]):
    """A table as it is declared, with its rows.

    Parameters
    ----------
    name
        Name of its sheet and file.
    columns
        Its columns in their order.
    rows
        What its rows tell of.
    """

    name: str
    columns: tuple[Column[Row], ...]
    rows: Sequence[Row]

    def frame(self, cost_unit: str = COST_UNITS) -> pd.DataFrame:
        """Return the table for people: all columns, costs in their unit."""
        return self._framed(self.columns, cost_unit)

    def terminal(self, cost_unit: str = COST_UNITS) -> pd.DataFrame:
        """Return the columns that a terminal shows."""
        return self._framed(tuple(own for own in self.columns if own.terminal), cost_unit)

    def records(self) -> list[dict[str, Any]]:
        """Return the rows for a program, costs in cost units whatever people count them in."""
        told = [(own.key or own.titled(COST_UNITS), own.value) for own in self.columns if own.key is not None]
        return [{name: value(row) for name, value in told} for row in self.rows]

    def _framed(self, columns: tuple[Column[Row], ...], cost_unit: str) -> pd.DataFrame:
        import pandas as pd

        return pd.DataFrame({own.titled(cost_unit): [own.value(row) for row in self.rows] for own in columns})

"""Many studies, such as a product series or a grid of limits, answered in one table."""

from __future__ import annotations

from typing import Any

import pandas as pd

from tolalloc.reading.units import COST_UNITS
from tolalloc.reports.document import Section
from tolalloc.reports.finished_run import Member
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences

_NUMBERS = {
    "cost [cost units]": "cost [{cost}]",
    "lower bound [cost units]": "bound [{cost}]",
    "yield [-]": "yield [-]",
}
"""Number in a summary → column of the table."""
_say = Sentences("series")


class SeriesTeller(Teller[tuple[Member, ...]]):
    """What is said of every study of a series."""

    @property
    def title(self) -> str:
        """What it is."""
        return _say("title", count=len(self.result))

    @property
    def subtitle(self) -> str:
        """Which ones."""
        return ", ".join(member.name for member in self.result)

    @property
    def sentences(self) -> tuple[str, ...]:
        """How many have an answer."""
        done = sum(member.found is not None for member in self.result)
        met = [member.met for member in self.result if member.met is not None]
        key = "allocated" if met else "done"
        return (_say(key, done=done, count=len(self.result), judged=len(met), met=sum(met)),)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Which could not be run, and why."""
        return tuple(_say("fault", name=own.name, fault=own.fault) for own in self.result if own.fault)

    @property
    def sections(self) -> tuple[Section, ...]:
        """One table."""
        return (Section(heading=_say("heading"), tables=(("answers", self._table),), unfolded=True),)

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The same table."""
        return ((self._table, _say("heading")),)

    @property
    def summary(self) -> dict[str, Any]:
        """The table for a program."""
        return {"studies": [_row(member, COST_UNITS) for member in self.result]}

    @property
    def _table(self) -> pd.DataFrame:
        """A row per study."""
        return pd.DataFrame([_row(member, self.header.cost_unit) for member in self.result])


def _row(member: Member, cost_unit: str) -> dict[str, object]:
    """Return the row of a study, with what its answer says."""
    row: dict[str, object] = {"study": member.name, "answer": member.verdict}
    if member.found is None:
        return row
    for name, header in _NUMBERS.items():
        if member.found.summary.get(name) is not None:
            row[header.replace("{cost}", cost_unit)] = float(member.found.summary[name])
    if member.found.yields and member.found.joint is not None:
        row["yield of all limits [-]"] = member.found.joint
    first = str(member.found.ranking["dimension"].iloc[0]) if len(member.found.ranking) else ""
    return {**row, "largest driver": first, "folder": member.folder.name}


TELLER = SeriesTeller

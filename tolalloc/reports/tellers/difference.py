"""What other zones do to cost, yield and quantiles: both drawings on the same random units."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from tolalloc.allocation.difference import DifferenceResult
from tolalloc.allocation.space.design_space import outside_range
from tolalloc.allocation.space.requirement import WorstCase
from tolalloc.capability.indices import Interval
from tolalloc.drawings.sources import Source, by_row, zone_in, zone_unit
from tolalloc.reading.units import COST_UNITS, unit_of
from tolalloc.reports.columns import Column, Table, own_words
from tolalloc.reports.document import Section
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import alike, short, with_unit

_BEYOND = 10
"""Units beyond a quantile below which its interval is too narrow [-]."""
_say = Sentences("difference")

_Row = tuple[Source, tuple[Source, ...], tuple[Source, ...]]
"""What a table calls sources, these before, and after."""
_Changed = tuple[str, str, tuple[float, float], Interval]
"""What changes, its unit, before and after, and the change with its interval."""

_CHANGES: tuple[Column[_Changed], ...] = (
    Column("what", lambda row: row[0]),
    Column("unit", lambda row: row[1]),
    Column("before [unit]", lambda row: row[2][0]),
    Column("after [unit]", lambda row: row[2][1]),
    Column("change [unit]", lambda row: row[3].estimate),
    Column("low 95 % [unit]", lambda row: row[3].low),
    Column("high 95 % [unit]", lambda row: row[3].high),
)


def _zone_columns(unit: str) -> tuple[Column[_Row], ...]:
    """Return the columns of the sources whose zones change, in a unit."""
    return (
        Column("source", lambda row: row[0].name),
        *own_words(lambda row: row[:1]),
        Column(f"zone before [{unit}]", lambda row: zone_in(row[1][0], unit)),
        Column(f"zone after [{unit}]", lambda row: zone_in(row[2][0], unit)),
        Column("cost before [{cost}]", lambda row: sum(own.cost for own in row[1])),
        Column("cost after [{cost}]", lambda row: sum(own.cost for own in row[2])),
    )


class DifferenceTeller(Teller[DifferenceResult]):
    """What is said of two drawings on the same random units."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", asked=self.header.asked)

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """What changes of cost, yield and one output: one that passes its limit, or else the leading one that moves."""
        result, cost = self.result, self.result.cost_change
        leading, found = result.requirements[0], _in_percent(result.yield_change)
        changes = [*zip(result.limited, result.quantile_changes, strict=True)]
        moved = [own for (own, _), change in changes if not change.low <= 0.0 <= change.high]
        sides = [
            (own, [own.limits.distance(end) for end in ends])
            for (own, _), ends in zip(result.limited, result.quantiles, strict=True)
        ]
        passing = [own for own, (before, after) in sides if own in moved and (before >= 0) != (after >= 0)]
        first = passing or moved or [leading]
        told = leading if leading in first else first[0]
        quantiles = " and ".join(
            _say("quantile", share=_percent(share), output=short(own.output), **_with_interval(change, own.output))
            for (own, share), change in changes
            if own is told
        )
        costs = {"before": result.whole_cost, "after": result.whole_cost + cost, "change": cost}
        shares = {"change": found.estimate, "low": found.low, "high": found.high}
        return (
            _say("cost", cost_unit=self.header.cost_unit, **costs),
            _say("yield", units=result.values.shape[1], quantiles=quantiles, **shares),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        units = self.result.values.shape[1]
        locked = dict.fromkeys(own.own_id or own.name for own in self.result.after if own.locked)
        found = [_say("locked", names=", ".join(locked))] if locked else []
        found += [sentence for own in self.result.after if not own.locked and (sentence := outside_range(own))]
        if any(units * min(share, 1 - share) < _BEYOND for _, share in self.result.limited):
            found.append(_say("few", units=units, beyond=_BEYOND))
        if any(isinstance(own.guarantee, WorstCase) for own in self.result.requirements):
            found.append(_say("worst_case", units=units))
        if lost := self.result.unanswered:
            found.append(_say("unanswered", lost=lost, solutions=2 * units))
        return tuple(found)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their tables."""
        unit = self.header.cost_unit
        shown: dict[str, Table[Any]] = {"heading_changes": self._changes(unit), "heading_zones": self._zones}
        return tuple(Section(heading=_say(key), tables=((own.name, own.frame(unit)),)) for key, own in shown.items())

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        return {
            "study": self.header.name,
            "seed": self.header.seed,
            "units [-]": self.result.values.shape[1],
            "changes": self._changes(COST_UNITS).records(),
            "zones": self._zones.records(),
            "statuses": dict(self.header.statuses),
            "warnings": list(self.warnings),
        }

    def _changes(self, cost_unit: str) -> Table[_Changed]:
        """Return cost, yield and every limited quantile before and after, with the intervals of what is random."""
        result, none = self.result, float("nan")
        costs = (result.whole_cost, result.whole_cost + result.cost_change)
        shares = (100 * result.yields[0], 100 * result.yields[1])
        rows: list[_Changed] = [
            ("cost", cost_unit, costs, Interval(estimate=costs[1] - costs[0], low=none, high=none)),
            ("yield, all limits", "%", shares, _in_percent(result.yield_change)),
        ]
        found = zip(result.limited, result.quantiles, result.quantile_changes, strict=True)
        rows += [
            (f"{_percent(share)} of {short(own.output)}", unit_of(own.output), both, change)
            for (own, share), both, change in found
        ]
        return Table(name="changes", columns=_CHANGES, rows=rows)

    @property
    def _zones(self) -> Table[_Row]:
        """The zones that change, with their costs."""
        before = {own.name: own for own in self.result.before}
        rows = [(row, tuple(before[own.name] for own in after), after) for row, after in by_row(self.result.after)]
        return Table(name="changed zones", columns=_zone_columns(zone_unit(self.result.before)), rows=rows)


def _with_interval(change: Interval, output: str) -> dict[str, str]:
    """Return a change of an output and the ends of its interval, one rounding for all."""
    numbers = alike(change.estimate, change.low, change.high)
    return {
        key: with_unit(said if said.startswith("−") else f"+{said}", output)
        for key, said in zip(("change", "low", "high"), numbers, strict=True)
    }


def _in_percent(found: Interval) -> Interval:
    """Return the change of a share in percent."""
    return Interval(estimate=100 * found.estimate, low=100 * found.low, high=100 * found.high)


def _percent(share: float) -> str:
    """Return a share in percent, with as many digits as half of the usual rejects take."""
    return f"{100 * share:.5g} %"


TELLER = DifferenceTeller

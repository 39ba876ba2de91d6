"""The inspection plan of a drawing: what is measured on every line, against which limits, how often and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from tolalloc.allocation.result import AllocationResult
from tolalloc.capability.conformity import Risks, guard_band, parts_to_show, risks
from tolalloc.capability.indices import Limits
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.population import demand
from tolalloc.drawings.qdas_file import Described, write_description
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.excel import Book
from tolalloc.reports.feature_frame import FeatureFrame, stated_limits
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.allocation_population import demands
from tolalloc.reports.templates import Sentences

_say = Sentences("allocation")

_DRIVERS = 0.8
"""Part of the sum of all indices that the lines measured in every batch make up [-]; assumption."""
_SHOWN = 4.0 / 3.0
"""Cpk that a sample is expected to have, over the one that it must show [-]; assumption."""
_FIRST_ARTICLE = 5
"""Parts of a first article [-]; assumption."""


@dataclass(frozen=True, kw_only=True)
class PlanLine:
    """One line of the plan, which has the number of its balloon on the sheet."""

    number: int
    name: str  # Of the line of the drawing
    members: tuple[Source, ...]  # As drawn, alike
    frame: FeatureFrame
    demand: str  # What it demands of the population of its parts
    index: float  # Total-effect index of its dimension as drawn [%]
    is_driver: bool  # Whether it is among the lines that make up most of all indices

    @property
    def first(self) -> Source:
        """The member that stands for all."""
        return self.members[0]

    @property
    def parts(self) -> str:
        """The parts that carry it."""
        return ", ".join(dict.fromkeys(own.part for own in self.members))

    @cached_property
    def limits(self) -> Limits:
        """Limits as the drawing states them: deviations from nominal, or the largest of what has a zone alone [m]."""
        lower, upper = stated_limits(self.first, self.frame)
        return Limits(lower=lower, upper=upper)

    @property
    def acceptance(self) -> Limits | None:
        """What a reading must keep so that the part keeps the limits with 95 %; none where no reading can [m]."""
        guard, own = guard_band(self.first.uncertainty), self.limits
        lower, upper = None if own.lower is None else own.lower + guard, (own.upper or 0.0) - guard
        return Limits(lower=lower, upper=upper) if upper > max(lower or 0.0, 0.0 if lower is None else lower) else None

    @property
    def risks(self) -> Risks | None:
        """How often its gauge decides wrongly with this acceptance; not known of vectors and without a gauge."""
        own = self.first
        is_normal = own.feature is Feature.SIZE and own.distribution is Distribution.NORMAL and not own.sorted
        if not own.uncertainty or not is_normal or not self.frame.is_deviation or self.acceptance is None:
            return None
        mean, deviation = (number * own.zone for number in own.zone_mapping.moments)
        return risks(mean + own.middle, deviation, self.limits, own.uncertainty, guard_band(own.uncertainty))

    @property
    def sample(self) -> int:
        """Parts to measure: as many as show the demanded capability, or a first article [-]."""
        return parts_to_show(self.first.cp, _SHOWN * self.first.cp) if self.is_driver else _FIRST_ARTICLE


def plan_lines(result: AllocationResult, indices: dict[str, float]) -> tuple[PlanLine, ...]:
    """Return the plan: every line of the drawing in its order, with the indices of its dimensions [%]."""
    portrait, drivers = portrait_of(result.model), {*_drivers(indices)}
    lines = [(own, members) for own in result.lines for members in _alike(own[1])]
    return tuple(
        PlanLine(
            number=number,
            name=_name(result, dimension, every, members),
            members=members,
            frame=portrait.frame(members[0]),
            demand=demands(result, members),
            index=indices.get(dimension, np.nan),
            is_driver=dimension in drivers,
        )
        for number, ((dimension, every), members) in enumerate(lines, start=1)
    )


def _alike(members: Sequence[Source]) -> list[tuple[Source, ...]]:
    """Return the members of a line parted by what is measured: nominal size, gauge and population."""
    found: dict[tuple[object, ...], list[Source]] = {}
    for own in members:
        found.setdefault((own.nominal, own.uncertainty, demand(own), own.drawing), []).append(own)
    return [tuple(own) for own in found.values()]


def _name(result: AllocationResult, dimension: str, every: tuple[Source, ...], members: tuple[Source, ...]) -> str:
    """Return what the drawing calls a line: the word that all its members have, else the name of the line."""
    labels = {own.label for own in members}
    if len(labels) == 1 and all(labels):
        return labels.pop()
    name = result.line_name((dimension, every))
    return name if len(members) == len(every) else f"{dimension}: {', '.join(own.name for own in members)}"


def _drivers(indices: dict[str, float]) -> Iterator[str]:
    """Yield the dimensions with the largest indices that make up most of their sum."""
    left = _DRIVERS * sum(indices.values())
    for name, index in sorted(indices.items(), key=lambda own: -own[1]):
        if left <= 0.0:
            return
        yield name
        left -= index


def plan_table(lines: Sequence[PlanLine]) -> Table[PlanLine]:
    """Return the plan as a sheet of the drawing's workbook."""

    def limit(side: str, of: str) -> Column[PlanLine]:
        accepted = f"accept {'from' if side == 'lower' else 'to'} [mm]"
        head = f"{side} deviation [mm]" if of == "limits" else accepted

        def shown(row: PlanLine) -> float | str:
            limits = getattr(row, of)
            found = None if limits is None else getattr(limits, side)
            if limits is None and side == "upper":
                return _say("plan_no_reading")
            return "" if found is None else round(found / MILLIMETRE, 6)

        return Column(head, shown)

    def risk(head: str, name: str, factor: float) -> Column[PlanLine]:
        return Column(head, lambda row: getattr(row.risks, name) * factor if row.risks else "", nothing="")

    columns: list[Column[PlanLine]] = [
        Column("no. [-]", lambda row: row.number),
        Column("part", lambda row: row.parts),
        Column("dimension", lambda row: row.name),
        Column("drawing", lambda row: row.first.drawing, nothing=""),
        Column("characteristic", lambda row: " ".join(filter(None, (row.frame.characteristic, row.frame.place)))),
        Column("features [-]", lambda row: len(row.members) * row.first.each),
        Column("nominal [mm]", lambda row: row.first.nominal / MILLIMETRE),
        limit("lower", "limits"),
        limit("upper", "limits"),
        Column("population", lambda row: row.demand),
        Column("gauge U [µm]", lambda row: row.first.uncertainty / MICROMETRE or "", nothing=""),
        *(
            (limit("lower", "acceptance"), limit("upper", "acceptance"))
            if any(own.first.uncertainty for own in lines)
            else ()
        ),
        risk("good parts rejected [%]", "producer", 100.0),
        risk("bad parts accepted [ppm]", "consumer", 1e6),
        Column("sample [-]", lambda row: row.sample),
        Column("when", lambda row: _say("plan_driver" if row.is_driver else "plan_other")),
        Column("index as drawn [%]", lambda row: row.index),
    ]
    return Table(name="inspection plan", columns=columns, rows=list(lines))


def add_plan(book: Book, lines: Sequence[PlanLine]) -> None:
    """Add the plan to a workbook, with what is assumed of samples below it."""
    table = plan_table(lines)
    sheet = book.table(table.name, table.frame())
    sheet.cell(sheet.rows + 2, 1, _say("plan_note"), italic=True)


def write_plan(lines: Sequence[PlanLine], title: str, path: Path) -> None:
    """Write the plan for a measuring room's program, a Q-DAS file that describes every line."""
    write_description(title, [_described(own) for own in lines], path)


def _described(line: PlanLine) -> Described:
    own = line.first
    return Described(
        number=str(line.number),
        short=own.own_id or own.name,
        name=f"{line.name} ({line.parts})",
        nominal=own.nominal / MILLIMETRE if line.frame.is_deviation else 0.0,
        lower=None if line.limits.lower is None else line.limits.lower / MILLIMETRE,
        upper=(line.limits.upper or 0.0) / MILLIMETRE,
        is_driver=line.is_driver,
        remark=line.demand,
    )

"""What a measured curve tells of the parts of its unit: which source drives it, and what the gauges would show."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reports.columns import Column, Table, of_positions
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import alike
from tolalloc.wings.bench.diagnosis import DiagnosisResult
from tolalloc.wings.bench.repair import REDRAWN, Advice, NextReading
from tolalloc.wings.bench.sources import InseparableColumns

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = 10
"""Sources that a terminal shows [-]."""
_say = Sentences("diagnosis", "tolalloc.wings.bench")


_ENDS = ("reading [µm]", "low 2.5 % [µm]", "high 97.5 % [µm]")
"""What the gauge of a source would show: mean and 95 % interval."""
_GROUPS: tuple[Column[tuple[int, InseparableColumns, int]], ...] = (
    Column("group [-]", lambda row: row[0]),
    Column("column", lambda row: row[1].columns[row[2]]),
    Column("spread alone over the drawing's [-]", lambda row: row[1].alone[row[2]]),
    Column("weight in the known sum [-]", lambda row: row[1].combination[row[2]]),
    Column("known sum over the drawing's spread [-]", lambda row: row[1].value),
    Column("its spread over the drawing's [-]", lambda row: row[1].together),
)
_NEXT: tuple[Column[NextReading], ...] = (
    Column("source", lambda row: row.source, terminal=1),
    Column("gauge minutes [min]", lambda row: row.minutes, terminal=1),
    Column("standard deviation of the gauge [µm]", lambda row: row.gauge / MICROMETRE),
    Column("expected cost before [{cost}]", lambda row: row.before),
    Column("expected cost after [{cost}]", lambda row: row.after, terminal=1),
    Column("standard error of what it saves [{cost}]", lambda row: row.error),
    Column("saved per minute [{cost}]", lambda row: row.gain_per_minute, terminal=1),
    Column("saved beyond its minutes [{cost}]", lambda row: row.worth, terminal=1),
    Column("pays", lambda row: "yes" if row.pays else "no", terminal=1),
)


class DiagnosisTeller(Teller[DiagnosisResult]):
    """What is said of a diagnosed unit."""

    @cached_property
    def _sources(self) -> Table[int]:
        """What the gauge of every source would show, the likeliest to dominate first."""
        found = self.result.diagnosis
        zones = np.array([source.zone for source in self.result.request.errors.active])
        shown = np.stack([found.reading_mean, *found.reading_interval]) / MICROMETRE
        columns = {
            "source": found.sources,
            "P(dominant) [%]": found.dominant_probability * 100,
            "named": ["yes" if source in found.named else "no" for source in found.sources],
            **dict(zip(_ENDS, shown, strict=True)),
            "zone [µm]": zones / MICROMETRE,
        }
        order = np.lexsort((-np.abs(found.reading_mean) / zones, -found.dominant_probability))
        return of_positions("sources", columns, order)

    @property
    def _columns(self) -> Table[int]:
        """Every column with its interval."""
        found = self.result.diagnosis
        levers = [source.lever for source in self.result.request.errors.active for _ in source.columns]
        scale = np.array(levers) / MICROMETRE
        low, high = found.column_interval * scale
        shown = {"mean [µm]": found.deviations.mean(axis=0) * scale, "low 2.5 % [µm]": low, "high 97.5 % [µm]": high}
        return of_positions("columns", {"column": found.columns, **shown})

    @property
    def _groups(self) -> Table[tuple[int, InseparableColumns, int]]:
        """The columns that the curve does not tell apart, with the combination that it knows."""
        groups = enumerate(self.result.diagnosis.groups, start=1)
        rows = [(number, group, at) for number, group in groups for at in range(len(group.columns))]
        return Table(name="groups", columns=_GROUPS, rows=rows)

    @cached_property
    def _next(self) -> Table[NextReading]:
        return Table(name="next", columns=_NEXT, rows=self.result.advice.readings if self.result.advice else ())

    def _decisions(self, found: Advice) -> Table[int]:
        """Return what every decision is expected to cost, the cheapest first."""
        costs = {"expected cost [{cost}]": found.cost, "standard error [{cost}]": found.error}
        return of_positions("decisions", {"decision": found.decisions, **costs}, np.argsort(found.cost, kind="stable"))

    def _advised(self, found: Advice) -> str:
        """Return what to measure next, or that nothing is worth its time, and what to do without it."""
        unit, own = self.header.cost_unit, found.next
        now = _say("decide", decision=found.best, cost=float(found.cost.min()), unit=unit)
        if own is None:
            return _say("stop", now=now)
        costs = {"before": own.before, "after": own.after, "saved": own.gain_per_minute}
        rate = own.price / own.minutes
        return _say("next", source=own.source, minutes=own.minutes, unit=unit, now=now, rate=rate, **costs)

    @property
    def title(self) -> str:
        """Which unit it is."""
        return _say("title", unit=self.header.name)

    @property
    def subtitle(self) -> str:
        """How it was measured."""
        sources = len(self.result.request.errors.active)
        return _say("subtitle", reducer=self.header.model, torque=self.result.curve.torque, sources=sources)

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The diagnosis in sentences."""
        found, fit = self.result.diagnosis, self.result.diagnosis.fit
        peak_to_peak = np.ptp(self.result.curve.transmission_error) / ARCSECOND
        measured = _say("measured", unit=self.header.name, peak_to_peak=peak_to_peak)
        if not fit.explained:
            return (_say("unexplained", measured=measured, chi_square=fit.chi_square, freedom=fit.freedom),)
        named = [row for row in self._sources.records() if row["named"] == "yes"]
        likely = ", ".join(_say("one_likely", source=row["source"], share=row["P(dominant) [%]"]) for row in named)
        first, key = named[0], "likely" if named[1:] else "certain"
        reading, low, high = alike(*(first[name] for name in _ENDS), figures=2)
        pairs = "; ".join(_say("pair", one=one, other=other) for one, other in found.twins)
        return (
            _say(key, measured=measured, level=self.result.request.level, likely=likely),
            _say("first", source=first["source"], reading=reading, low=low, high=high, zone=first["zone [µm]"]),
            *((_say("twins", pairs=pairs),) if pairs else ()),
            *(
                _say("groups", sources=", ".join(sources))
                for sources in dict.fromkeys(group.sources for group in found.groups)
            ),
            *((self._advised(self.result.advice),) if self.result.advice else ()),
        )

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before opening the unit."""
        return (
            *(() if self.result.diagnosis.fit.explained else (_say("warn_unexplained"),)),
            *((_say("warn_failed", failed=self.header.failed),) if self.header.failed else ()),
            *(_say("warn_repaired", repair=repair) for repair in self.result.curve.repairs),
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        noise = self.result.noise
        return (
            *self.result.request.reducer.assumptions,
            _say("assume_noise", reading=noise.reading / ARCSECOND),
            _say(
                "assume_discrepancy", discrepancy=noise.discrepancy / ARCSECOND, angle=noise.correlation_angle / DEGREE
            ),
            _say("assume_prior"),
            _say("assume_angle"),
            *((_say("assume_repair", redrawn=REDRAWN), _say("assume_gauge")) if self.result.advice else ()),
            *self.header.assumptions,
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        found = self.result.diagnosis
        return {
            "unit": self.header.name,
            "reducer": self.header.model,
            "torque [N·m]": self.result.curve.torque,
            "seed": self.header.seed,
            "explained": found.fit.explained,
            "mean sum of squared residuals [-]": found.fit.chi_square,
            "expected [-]": found.fit.freedom,
            "named": list(found.named),
            "level [-]": self.result.request.level,
            "sources": self._sources.records(),
            "twins": [list(pair) for pair in found.twins],
            "not told apart": [list(group.sources) for group in found.groups],
            "curves solved [-]": found.evaluations,
            "curves failed [-]": found.failed,
            **(self._advice_summary(self.result.advice) if self.result.advice else {}),
            "warnings": list(self.warnings),
        }

    def _advice_summary(self, advice: Advice) -> dict[str, Any]:
        measure = advice.next.source if advice.next else None
        tables = {"readings": self._next.records(), "decisions": self._decisions(advice).records()}
        return {"measure next": measure, "decision": advice.best, **tables}

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The sources that are likeliest to dominate."""
        sources = self._sources.frame().head(_SHOWN), _say("terminal", unit=self.header.name)
        saving = [own for own in self._next.rows if own.gain > 0.0]
        if not saving:
            return (sources,)
        table = replace(self._next, rows=saving[:_SHOWN])
        return sources, (table.terminal(self.header.cost_unit), _say("terminal_next"))

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Sections in the order of the questions that a reader has."""
        groups, unit = self._groups, self.header.cost_unit
        advice: tuple[Section, ...] = ()
        if found := self.result.advice:
            tables = (("next", self._next.frame(unit)), ("decisions", self._decisions(found).frame(unit)))
            advice = (Section(heading=_say("next_heading"), paragraphs=(_say("next_meaning"),), tables=tables),)
        return (
            *advice,
            Section(
                heading=_say("dominant_heading"),
                paragraphs=(_say("dominant"),),
                figures=(self._dominant_figure(),),
                tables=(("sources", self._sources.frame()),),
            ),
            Section(heading=_say("readings_heading"), figures=(self._reading_figure(),)),
            Section(
                heading=_say("groups_heading"),
                tables=(("groups", groups.frame()),) if groups.rows else (),
                paragraphs=() if groups.rows else (_say("no_groups"),),
            ),
            Section(heading=_say("curve_heading"), figures=self._curve_figures()),
            Section(heading=_say("columns_heading"), tables=(("columns", self._columns.frame()),)),
        )

    def _dominant_figure(self) -> Figure:
        rows = self._sources.frame()
        return Figure(
            name="dominant",
            title=_say("dominant_figure"),
            x_label="probability of being the dominant source [%]",
            series=(Series.bars("probability", rows["source"], rows["P(dominant) [%]"]),),
        )

    def _reading_figure(self) -> Figure:
        rows = self._sources.frame()
        ends = (rows[name] / rows["zone [µm]"] for name in _ENDS)
        return Figure(
            name="readings",
            title=_say("readings_figure"),
            x_label="reading over zone [-]",
            series=(Series.bars("mean and 95 % interval", rows["source"], *ends),),
            vertical=((1.0, "zone"),),
        )

    def _curve_figures(self) -> tuple[Figure, Figure]:
        fit = self.result.diagnosis.fit
        angle, left = fit.carrier_angle / DEGREE, (fit.measured - fit.fitted) / ARCSECOND
        measured, fitted, low, high = (values / ARCSECOND for values in (fit.measured, fit.fitted, *fit.band))
        curve = Figure(
            name="curve",
            title=_say("curve_figure"),
            x_label="carrier angle [°]",
            y_label="transmission error [arcsec]",
            series=(
                Series.points("measured", angle, measured),
                Series.line("model, mean and 95 % band", angle, fitted, low, high),
            ),
        )
        apart = (Series.line("measured less model", angle, left),)
        return curve, replace(curve, name="left", title=_say("left_figure"), series=apart, horizontal=((0.0, ""),))

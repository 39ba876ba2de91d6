"""What a lot shows: which process moved, how its parts keep their zones, control limits and the drawing of the lot."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reports.columns import Column, Table, own_words
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import alike
from tolalloc.wings.bench.lot_orders import LotOrder
from tolalloc.wings.bench.lots import FOUND, LotCapability, LotResult, MeasuredProcess

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = 10
"""Rows of a table that a terminal shows [-]."""
_NAMED = 5
"""Moved processes that the first sentence names [-]."""
_LIMIT = 3.0
"""Standard errors at which a control limit stands [-]."""
_say = Sentences("lot", "tolalloc.wings.bench")


def _moved(own: MeasuredProcess) -> str:
    """Return what of a process moved, in a word."""
    words = (("mean", own.named_shift), ("spread", own.spread_moved))
    return " and ".join(word for word, is_so in words if is_so)


_PROCESSES: tuple[Column[MeasuredProcess], ...] = (
    Column("source", lambda row: row.name, terminal=1),
    *own_words(lambda row: (row.column.source,)),
    Column("gauge", lambda row: row.column.gauge.value),
    Column("readings [-]", lambda row: row.stated.law.parts, terminal=1),
    Column("mean [µm]", lambda row: row.mean / MICROMETRE, terminal=1),
    Column("mean, low 2.5 % [µm]", lambda row: row.mean_interval[0] / MICROMETRE),
    Column("mean, high 97.5 % [µm]", lambda row: row.mean_interval[1] / MICROMETRE),
    Column("drawing's mean [µm]", lambda row: row.stated.mean / MICROMETRE, terminal=1),
    Column("standard deviation [µm]", lambda row: row.deviation / MICROMETRE),
    Column("standard deviation, low 2.5 % [µm]", lambda row: row.deviation_interval[0] / MICROMETRE),
    Column("standard deviation, high 97.5 % [µm]", lambda row: row.deviation_interval[1] / MICROMETRE),
    Column("drawing's standard deviation [µm]", lambda row: row.stated.deviation / MICROMETRE),
    Column(
        "variance by the gauge [%]",
        lambda row: row.gauge_share * 100.0 if row.column.error.deviation else "",
        nothing="",
    ),
    Column("shift [drawing's σ]", lambda row: row.shift[0], terminal=1),
    Column("spread over the drawing's [-]", lambda row: row.spread[0], terminal=1),
    Column("p value of the mean [-]", lambda row: row.shift_probability),
    Column("p value of the spread [-]", lambda row: row.spread_probability),
    Column("smaller p value [-]", lambda row: row.probability, key=None, terminal=1),
    Column("moved", _moved, terminal=1),
)
_CAPABILITIES: tuple[Column[LotCapability], ...] = (
    Column("source", lambda row: row.source.name, terminal=1),
    *own_words(lambda row: (row.source,)),
    Column("parts [-]", lambda row: row.parts),
    Column("zone [µm]", lambda row: row.source.zone / MICROMETRE, terminal=1),
    Column("outside the zone [-]", lambda row: row.outside, terminal=1),
    Column("drawing's Cp [-]", lambda row: row.source.cp, terminal=1),
    Column("Cp [-]", lambda row: row.cp, terminal=1),
    Column("Cp, low 2.5 % [-]", lambda row: row.cp_interval[0]),
    Column("Cp, high 97.5 % [-]", lambda row: row.cp_interval[1]),
    Column("Cpk [-]", lambda row: row.cpk, terminal=1),
    Column("Cpk, low 2.5 % [-]", lambda row: row.cpk_interval[0]),
    Column("Cpk, high 97.5 % [-]", lambda row: row.cpk_interval[1]),
    Column("drawing's shift [half zone]", lambda row: row.source.shift),
    Column("shift [half zone]", lambda row: row.row.shift),
)
_LIMITS: tuple[Column[MeasuredProcess], ...] = (
    Column("source", lambda row: row.name),
    Column("gauge", lambda row: row.column.gauge.value),
    Column("parts of the sample [-]", lambda row: row.next.parts),
    Column("mean, lower limit [µm]", lambda row: row.next.mean[0] / MICROMETRE),
    Column("mean, centre [µm]", lambda row: row.stated.mean / MICROMETRE),
    Column("mean, upper limit [µm]", lambda row: row.next.mean[1] / MICROMETRE),
    Column("s, lower limit [µm]", lambda row: row.next.deviation[0] / MICROMETRE),
    Column("s, upper limit [µm]", lambda row: row.next.deviation[1] / MICROMETRE),
)
_ORDERS: tuple[Column[LotOrder], ...] = (
    Column("order", lambda row: row.order, terminal=1),
    Column("root mean square amplitude of the lot [arcsec]", lambda row: row.amplitude, terminal=1),
    Column("predicted, low 5 % [arcsec]", lambda row: row.predicted[0], terminal=1),
    Column("predicted, high 95 % [arcsec]", lambda row: row.predicted[1], terminal=1),
    Column("p value [-]", lambda row: row.probability, terminal=1),
    Column("moved", lambda row: "yes" if row.moved else "", terminal=1),
    Column("sources, total effect on it", lambda row: _makers(row, len(row.sources))),
)


class LotTeller(Teller[LotResult]):
    """What is said of a lot."""

    @property
    def title(self) -> str:
        """Which lot it is, and what it was made to."""
        return _say("title", lot=self.header.name, drawing=self.header.model)

    @property
    def subtitle(self) -> str:
        """How much was measured."""
        return _say("subtitle", rows=self.result.rows, columns=len(self.result.processes))

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """What moved, what could have been seen, and which zone is kept least."""
        moved, count, level = self.result.moved, len(self.result.processes), self.result.request.level * 100.0
        first = [_say("unmoved", columns=count, level=level)]
        if moved:
            more = f"; and {len(moved) - _NAMED} more" if len(moved) > _NAMED else ""
            first = [_say("moved", what="; ".join(map(_what, moved[:_NAMED])) + more, level=level)]
            first += [_say("rest", count=count - len(moved))] if count > len(moved) else []
        return (*first, *self._curves, *self._seen, *self._gauges, self._least_capable)

    @property
    def _curves(self) -> tuple[str, ...]:
        """Which orders of the curves moved, and what makes them."""
        found = self.result.orders
        if not self.result.request.curves:
            return ()
        said = {"orders": len(found), "units": len(self.result.request.curves.waves)}
        moved = sorted((own for own in found if own.moved), key=lambda own: own.probability)
        if not moved:
            return (_say("orders_unmoved", **said),)
        first = moved[0]
        amplitude, low, high = alike(first.amplitude, *first.predicted)
        what = {"order": first.order, "amplitude": amplitude, "low": low, "high": high}
        more = _say("orders_more", names=", ".join(str(own.order) for own in moved[1:])) if moved[1:] else ""
        several = "order_of_several" if len(first.sources) > 1 else "order_of_one"
        makers = _say(several, order=first.order, makers=_makers(first, _NAMED)) if first.sources else ""
        return (" ".join(filter(None, (_say("order_moved", **said, **what), more, makers))),)

    @property
    def _seen(self) -> tuple[str, ...]:
        """What shift of a size this lot could have shown."""
        normal = [own.stated.law.parts for own in self.result.processes if own.stated.is_normal]
        return (_say("detectable", shift=self.result.detectable, found=FOUND, parts=min(normal)),) if normal else ()

    @property
    def _gauges(self) -> tuple[str, ...]:
        """How much of what was read is the gauge, where it makes most."""
        most = max(self.result.processes, key=lambda own: own.gauge_share)
        return (_say("gauges", name=most.name, share=most.gauge_share),) if most.gauge_share else ()

    @property
    def _least_capable(self) -> str:
        least = min(self.result.capabilities, key=lambda own: own.cpk)
        cpk, low, high = alike(least.cpk, *least.cpk_interval)
        name, outside = least.source.name, least.outside
        return _say("least_capable", source=name, cpk=cpk, low=low, high=high, outside=outside, parts=least.parts)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        rows, curves = self.result.capabilities, self.result.request.curves
        return (
            *(_say("warn_far", source=own.source.name, count=own.far, parts=own.parts) for own in rows if own.far),
            *(
                _say("warn_clipped", source=own.row.name, cp=own.row.cp, shift=own.row.shift)
                for own in rows
                if own.clipped
            ),
            *((_say("warn_failed", failed=self.header.failed),) if curves and self.header.failed else ()),
            *(curves.model.mismatches if curves else ()),
            *(_say("warn_repaired", repair=own) for own in (curves.repairs if curves else ())),
            *self.result.request.drawing.notes,
        )

    @property
    def _assumed_of_curves(self) -> tuple[str, ...]:
        if not self.result.request.curves:
            return ()
        noise, torque = self.result.request.curves.discrepancy, self.result.request.curves.model.kernel.torque
        errs = {"reading": noise.reading / ARCSECOND, "discrepancy": noise.discrepancy / ARCSECOND}
        return (_say("assume_curves", torque=torque, angle=noise.correlation_angle / DEGREE, **errs),)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the tests take for granted."""
        normal = [own.stated.is_normal for own in self.result.processes]
        erring = [own.name for own in self.result.processes if own.column.error.deviation]
        return (
            *((_say("assume_fit"),) if any(normal) else ()),
            *(() if all(normal) else (_say("assume_simulated", lots=self.result.lots),)),
            _say("assume_holm", level=self.result.request.level * 100.0),
            _say("assume_gauge_errs", names=", ".join(erring)) if erring else _say("assume_gauge"),
            *self._assumed_of_curves,
            *self.header.assumptions,
        )

    @cached_property
    def _processes(self) -> Table[MeasuredProcess]:
        return Table(name="processes", columns=_PROCESSES, rows=self.result.processes)

    @cached_property
    def _capabilities(self) -> Table[LotCapability]:
        return Table(name="capability", columns=_CAPABILITIES, rows=self.result.capabilities)

    @cached_property
    def _orders(self) -> Table[LotOrder]:
        return Table(name="orders of the curves", columns=_ORDERS, rows=self.result.orders)

    @cached_property
    def _limits(self) -> Table[MeasuredProcess]:
        return Table(name="control limits", columns=_LIMITS, rows=self.result.processes)

    @property
    def sections(self) -> tuple[Section, ...]:
        """What moved, how the zones are kept, what the next sample is held against, and the drawing of the lot."""
        shown = [
            ("process_heading", "process", self._processes.name, self._processes.frame()),
            ("orders_heading", "orders", self._orders.name, self._orders.frame()),
            ("capability_heading", "capability", self._capabilities.name, self._capabilities.frame()),
            ("limits_heading", "limits", self._limits.name, self._limits.frame()),
            ("table_heading", "table", "lot", self.result.drawing.to_frame()),
        ]
        process, orders, *others = (
            Section(heading=_say(heading), paragraphs=(_say(said),), tables=((name, frame),))
            for heading, said, name, frame in shown
        )
        process = replace(process, figures=(self._shift_figure, self._spread_figure))
        return (process, *((orders,) if self.result.request.curves else ()), *others)

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The processes that are likeliest to have moved, and the zones that are kept least."""
        surest = sorted(self.result.processes, key=lambda own: own.probability)
        least = sorted(self.result.capabilities, key=lambda own: own.cpk)
        processes = replace(self._processes, rows=surest[:_SHOWN])
        capabilities = replace(self._capabilities, rows=least[:_SHOWN])
        orders = ((self._orders.terminal(), _say("terminal_orders", lot=self.header.name)),)
        return (
            (processes.terminal(), _say("terminal_processes", lot=self.header.name)),
            *(orders if self.result.request.curves else ()),
            (capabilities.terminal(), _say("terminal_capability", lot=self.header.name)),
        )

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        return {
            "lot": self.header.name,
            "drawing": self.header.model,
            "measured [-]": self.result.rows,
            "false-alarm rate [-]": self.result.request.level,
            "moved": [own.name for own in self.result.moved],
            "shift found with 95 % probability [σ]": self.result.detectable,
            "processes": self._processes.records(),
            "capability": self._capabilities.records(),
            "control limits": self._limits.records(),
            **({"orders of the curves": self._orders.records()} if self.result.request.curves else {}),
            "seed": self.header.seed,
            "warnings": list(self.warnings),
        }

    def add_files(self, folder: Path) -> None:
        """Add the tolerance table of the lot, which is read back."""
        self.result.drawing.to_csv(folder / "lot.tolerances.csv")

    @property
    def _shift_figure(self) -> Figure:
        """Means in standard errors, between the control limits."""
        rows = self.result.processes
        ends = zip(*([shift * sqrt(own.stated.law.parts) for shift in own.shift] for own in rows), strict=True)
        return Figure(
            name="shift",
            title=_say("shift_figure"),
            x_label="mean less the drawing's, over its standard error [-]",
            series=(Series.bars("mean and 95 % interval", [own.name for own in rows], *ends),),
            vertical=((-_LIMIT, ""), (_LIMIT, "control limits")),
        )

    @property
    def _spread_figure(self) -> Figure:
        """Standard deviations over the drawing's."""
        rows = self.result.processes
        ends = zip(*(own.spread for own in rows), strict=True)
        return Figure(
            name="spread",
            title=_say("spread_figure"),
            x_label="standard deviation over the drawing's [-]",
            series=(Series.bars("standard deviation and 95 % interval", [own.name for own in rows], *ends),),
            vertical=((1.0, "drawing"),),
        )


def _makers(own: LotOrder, most: int) -> str:
    """Return the sources that make an order, each with its part of the variance."""
    return ", ".join(_say("maker", name=name, share=share) for name, share in own.sources[:most])


def _what(own: MeasuredProcess) -> str:
    """Return what of a process moved, and by how much."""
    lengths = (own.mean, *own.mean_interval, own.stated.mean)
    mean, low, high, stated = alike(*(length / MICROMETRE for length in lengths))
    ratio, least, most = alike(*own.spread)
    of_mean = {"name": own.name, "mean": mean, "stated": stated, "shift": own.shift[0]}
    of_spread = {"name": own.name, "ratio": ratio, "low": least, "high": most}
    if not own.named_shift:
        return _say("spread_up", **of_spread)
    if own.spread_moved:
        return _say("both", **of_mean | of_spread)
    return _say("mean_up", low=low, high=high, **of_mean)

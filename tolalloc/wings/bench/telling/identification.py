"""What measured units say of the stiffness: parameters, what the data fix, and what simpler explanations would do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reports.columns import Column, Table, of_positions
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number
from tolalloc.wings.bench.identification import IdentificationResult
from tolalloc.wings.bench.information import LEVEL, Direction
from tolalloc.wings.bench.measurements import MeasuredCurve
from tolalloc.wings.bench.parameters import BIAS, Parameter
from tolalloc.wings.bench.prediction import CURVE, LARGE_DRIFT, LOOP, PEAK_TO_PEAK, ReadingBlock
from tolalloc.wings.bench.profile import ParameterChoice, ParameterEstimate

if TYPE_CHECKING:
    import pandas as pd

_OPEN = 10.0
"""Width of an interval of a logarithm beyond which it says nothing [-]."""
_TOP = 4.0
"""A profile is drawn up to so many times its threshold [-]."""
_SMALL = 0.05
"""Loadings below this share of the largest are not written [-]."""
_say = Sentences("identification", "tolalloc.wings.bench")

_ESTIMATES: tuple[Column[ParameterEstimate], ...] = (
    Column("parameter", lambda row: f"{row.parameter.symbol} [{row.parameter.unit}]"),
    Column("given", lambda row: row.parameter.start),
    Column("identified", lambda row: row.value if row.identified else "no"),
    Column("95 % interval", lambda row: _interval(row.interval)),
)
"""What a person reads first of every parameter."""


def estimate_sentence(estimate: ParameterEstimate) -> str:
    """Return what to make of one parameter."""
    item, interval = estimate.parameter, _with_unit(estimate.parameter, _interval(estimate.interval))
    if not estimate.identified:
        return _say("not_identified", symbol=item.symbol, interval=interval)
    key = "estimate_on_bound" if estimate.on_bound else "estimate"
    return _say(key, symbol=item.symbol, value=_with_unit(item, number(estimate.value, ".4g")), interval=interval)


def choice_name(choice: ParameterChoice) -> str:
    """Return what is fitted, in symbols."""
    return " + ".join(item.symbol for item in choice.parameters) or _say("nothing_fitted")


def direction_sentence(direction: Direction, symbols: tuple[str, ...]) -> str:
    """Return a combination of parameters that the data know independently of the others, and how well."""
    largest = np.abs(direction.loading).max()
    parts = [
        f"{number(share, '+.2f')}·{symbol}"
        for share, symbol in zip(direction.loading, symbols, strict=True)
        if abs(share) >= _SMALL * largest
    ]
    bounded = "open" if direction.deviation < direction.half_width else "open_to_bounds"
    return _say(
        "fixed" if direction.is_fixed else bounded,
        combination=" ".join(parts).removeprefix("+"),
        deviation=direction.deviation,
        half_width=direction.half_width,
    )


class IdentificationTeller(Teller[IdentificationResult]):
    """What is said of stiffnesses that measured units tell."""

    @cached_property
    def _units(self) -> str:
        """Number of units in words."""
        units = int(self.result.data.units.size)
        return _say("one_unit") if units == 1 else _say("units", units=units)

    @cached_property
    def _symbols(self) -> tuple[str, ...]:
        """Symbols of all parameters but the bias: those whose relative changes the directions combine."""
        return tuple(item.symbol for item in self.result.parameters if item.name != BIAS)

    @property
    def title(self) -> str:
        """What was measured on which reducer."""
        return _say("title", reducer=self.result.reducer.name, measurements=self.result.measurements.name)

    @property
    def subtitle(self) -> str:
        """How it was found."""
        found = self.result.found
        return _say(
            "subtitle",
            units=self._units,
            readings=self.result.data.measured.size,
            method=found.method,
            evaluations=found.evaluations,
            status=found.status,
            seed=self.header.seed,
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """Parameters, what the data fix, residuals, and what simpler explanations leave."""
        own = self.result
        at = {"before": own.at_start, "after": own.at_found, "written": own.at_written}
        reach = "; ".join(
            _say("rms", kind=kind, **{name: own.rms(found, kind) / ARCSECOND for name, found in at.items()})
            for kind in own.data.kinds
        )
        return (
            *map(estimate_sentence, own.estimates),
            *(
                _say("direction", number=number, direction=direction_sentence(item, self._symbols))
                for number, item in enumerate(own.information.directions, start=1)
            ),
            _say("all_rms", each=reach),
            *self._comparisons,
        )

    @property
    def _comparisons(self) -> tuple[str, ...]:
        """How a constant alone, and the choice by units not seen, compare with the fit."""
        chosen = self.result.chosen
        if chosen is None:
            return (_say("too_few", units=self._units),)
        verdict = (self._verdict,) if PEAK_TO_PEAK in self.result.data.kinds else ()
        return (*verdict, _say("chosen", units=self._units, choice=choice_name(chosen)))

    @property
    def _verdict(self) -> str:
        """Whether a constant explains the peak-to-peaks, or the stiffness does, or nothing needs explaining."""
        asked = tuple(item.name for item in self.result.parameters)
        given, constant, whole = (self.result.choice(*names) for names in ((), (BIAS,), asked))
        if not (given and constant and whole):
            return _say("too_few_for_all", units=self._units)

        def left(item: ParameterChoice, *, unseen: bool) -> float:
            return item.rms(PEAK_TO_PEAK, unseen=unseen) / ARCSECOND

        each = {"given": given, "bias": constant, "fit": whole}
        unseen = {name: left(item, unseen=True) for name, item in each.items()}
        best = min(unseen, key=lambda name: unseen[name])
        numbers = _say(
            "numbers",
            choice=choice_name(whole),
            **{name: left(item, unseen=False) for name, item in each.items()},
            **{f"{name}_unseen": value for name, value in unseen.items()},
        )
        both = "best_fit_with_bias" if BIAS in asked else "best_fit"
        return _say({"given": "best_given", "bias": "best_bias", "fit": both}[best], numbers=numbers)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before using the numbers."""
        own, known = self.result, self.result.information
        left_open = [item.parameter.symbol for item in own.estimates if not item.identified]
        bounded = [item.parameter.symbol for item in own.estimates if item.on_bound and item.identified]
        doubted = own.data.noise_stated and known.estimated
        return (
            *((_say("warn_open", symbols=", ".join(left_open)),) if left_open else ()),
            *(_say("warn_bound", symbol=symbol) for symbol in bounded),
            *((_say("warn_noise", times=np.sqrt(known.reduced_chi_square)),) if doubted else ()),
            *(() if own.data.noise_stated else (_say("warn_no_noise"),)),
            *((_say("warn_drift", drift=own.drift),) if own.drift > LARGE_DRIFT else ()),
            *(_say("warn_repaired", repair=repair) for repair in own.measurements.repairs),
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        said = (_say("assume_noise"), _say("assume_means"), _say("assume_bounds"))
        return (*self.result.reducer.assumptions, *self.result.measurements.assumptions, *said)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        own, data, kinds = self.result, self.result.data, self.result.data.kinds
        at = {"rms before": own.at_start, "rms after": own.at_found, "rms as written": own.at_written}
        return {
            "reducer": own.reducer.name,
            "data": own.measurements.name,
            "units [-]": int(data.units.size),
            "readings [-]": int(data.measured.size),
            "method": own.found.method,
            "objective [-]": own.found.objective,
            "evaluations [-]": own.found.evaluations,
            "status": own.found.status,
            "parameters": [_as_row(item) for item in own.estimates],
            "directions": [direction_sentence(item, self._symbols) for item in own.information.directions],
            "reduced chi square [-]": own.information.reduced_chi_square,
            **{
                f"{name} [arcsec]": {kind: own.rms(prediction, kind) / ARCSECOND for kind in kinds}
                for name, prediction in at.items()
            },
            "choices": [
                {
                    "fitted": choice_name(item),
                    "left out [noise]": item.score,
                    "rms [arcsec]": {kind: item.rms(kind, unseen=False) / ARCSECOND for kind in kinds},
                    "rms left out [arcsec]": {kind: item.rms(kind, unseen=True) / ARCSECOND for kind in kinds},
                }
                for item in own.choices
            ],
            "chosen": choice_name(own.chosen) if own.chosen else None,
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Every parameter, and simpler choices of them if any were judged."""
        own = self.result
        estimates = Table(name="estimates", columns=_ESTIMATES, rows=own.estimates).frame()
        title = _say("terminal", reducer=own.reducer.name, measurements=own.measurements.name)
        choices = ((self._choices.terminal(), _say("terminal_choices")),) if own.choices else ()
        return ((estimates, title), *choices)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Sections in the order of the questions that a reader has."""
        polynomial = self.result.polynomial
        rms, largest = polynomial.rms_error / ARCSECOND, polynomial.largest_error / ARCSECOND
        known = {"trained": polynomial.trained, "held_out": polynomial.held_out}
        trained = _say("polynomials", rms=rms, largest=largest, **known)
        parameters, directions, choices, readings = (
            Section(heading=_say(heading), paragraphs=paragraphs, tables=((name, frame),))
            for heading, paragraphs, name, frame in (
                ("parameters_heading", (_say("parameters"),), "parameters", self._parameters.frame()),
                ("fixed_heading", (_say("directions"), trained), "directions", self._directions.frame()),
                ("choices_heading", (_say("choices"),), "choices", self._choices.frame()),
                ("readings_heading", (), "units", self._units_frame()),
            )
        )
        return (
            parameters,
            replace(directions, figures=(self._profile_figure,)),
            *((choices,) if self.result.choices else ()),
            replace(readings, figures=tuple(self._reading_figures())),
        )

    @property
    def stiffness(self) -> IdentifiedStiffness | None:
        """What a stiffness file states, with what to make of parameters that the data leave open."""
        found = self.result.stiffness
        if found is None:
            return None
        doubtful = [item for item in self.result.estimates if not item.identified or item.on_bound]
        return replace(found, notes=(*found.notes, *map(estimate_sentence, doubtful)))

    def add_files(self, folder: Path) -> None:
        """Add the stiffness file, if a stiffness was asked for."""
        from tolalloc.reducers.reducer.files import write_identified_stiffness

        if self.stiffness:
            write_identified_stiffness(self.stiffness, folder / "identified.stiffness.toml")

    @property
    def _parameters(self) -> Table[int]:
        """Every parameter with all its intervals; a row is its place."""
        own, first_order, items = self.result, self.result.information.interval, self.result.parameters
        quantiles = (0.5 - LEVEL / 2, 0.5 + LEVEL / 2)
        resampled = None if own.bootstrap is None else np.quantile(own.bootstrap, quantiles, axis=0)

        def bounded(at: int) -> bool:
            return items[at].name == BIAS or bool(np.ptp(first_order[:, at]) < _OPEN)

        def uncertainty(row: ParameterEstimate) -> str:
            is_bias = row.parameter.name == BIAS
            return f"{row.uncertainty:.3g} arcsec" if is_bias else f"{100 * row.uncertainty:.3g} %"

        columns = {
            "parameter": [f"{item.symbol} [{item.unit}], {item.name.replace('_', ' ')}" for item in items],
            "given": [f"{item.start:.4g}" for item in items],
            "bounds": [f"{item.low:.4g}…{item.high:.4g}" for item in items],
            "least objective at": lambda at: f"{items[at].value(float(own.found.coordinates[at])):.4g}",
            "95 % profile": [_interval(row.interval) for row in own.estimates],
            "95 % first order": lambda at: _span(items[at], first_order[:, at]) if bounded(at) else "no limit",
            "95 % bootstrap": lambda at: "" if resampled is None else _span(items[at], resampled[:, at]),
            "identified": [_yes(row.identified) for row in own.estimates],
            "on a bound": [_yes(row.on_bound) for row in own.estimates],
            "written": [f"{row.value:.4g}" for row in own.estimates],
            "standard uncertainty": [uncertainty(row) for row in own.estimates],
        }
        return of_positions("parameters", columns)

    @property
    def _directions(self) -> Table[int]:
        """The combinations that the data fix, best first."""
        found = self.result.information.directions
        columns = {
            "direction": range(1, len(found) + 1),
            **{
                symbol: [round(float(own.loading[at]), 3) + 0.0 for own in found]
                for at, symbol in enumerate(self._symbols)
            },
            "standard error left by the data [%]": [
                100 * own.deviation if own.deviation < own.half_width else "no limit" for own in found
            ],
            "left by the bounds alone [%]": [100 * own.half_width for own in found],
            "fixed": [_yes(own.is_fixed) for own in found],
        }
        return of_positions("directions", columns)

    @property
    def _choices(self) -> Table[ParameterChoice]:
        """Every choice of parameters with what it leaves of units seen and not seen."""
        data, chosen = self.result.data, self.result.chosen

        def rms(kind: str, *, unseen: bool) -> Column[ParameterChoice]:
            return Column(
                f"{kind}, {'units left out, ' if unseen else ''}rms [arcsec]",
                lambda row: row.rms(kind, unseen=unseen) / ARCSECOND,
            )

        columns: tuple[Column[ParameterChoice], ...] = (
            Column("fitted", choice_name, terminal=True),
            Column("parameters [-]", lambda row: len(row.parameters)),
            *(rms(kind, unseen=unseen) for kind in data.kinds for unseen in (False, True)),
            Column("units left out, over noise [-]", lambda row: row.score, terminal=True),
            Column("chosen", lambda row: "yes" if chosen is row else "", terminal=True),
        )
        return Table(name="choices", columns=columns, rows=self.result.choices)

    def _units_frame(self) -> pd.DataFrame:
        """Return the residual of every unit before and after; what was not read of a unit has no cell."""
        import pandas as pd

        data, rows = self.result.data, []
        for unit in data.units:
            row: dict[str, object] = {"unit": self.result.measurements.units[unit].name}
            for kind in data.kinds:
                own = data.rows(kind)
                own = own[data.unit[own] == unit]
                for when, left in self._left(own) if own.size else ():
                    value = float(left[0]) if left.size == 1 else float(np.sqrt((left**2).mean()))
                    name = "model less measured" if left.size == 1 else "rms of model less measured"
                    row[f"{kind}, {name}, {when} [arcsec]"] = value
            rows.append(row)
        return pd.DataFrame(rows)

    def _left(self, rows: slice | Int[np.ndarray, " row"]) -> Iterator[tuple[str, Float[np.ndarray, " row"]]]:
        """Yield model less measured of some readings, before and after [arcsec]."""
        for label, prediction in (("before", self.result.at_start), ("after", self.result.at_found)):
            yield label, (prediction.values - self.result.data.measured)[rows] / ARCSECOND

    @property
    def _profile_figure(self) -> Figure:
        """How much worse the fit gets as each stiffness or torque is held away from its best value."""
        series = []
        for item, own in zip(self.result.parameters, self.result.profiles, strict=True):
            if item.name == BIAS:
                continue
            shown = own.rise <= _TOP * own.threshold
            change = [100 * (item.value(float(at)) / item.start - 1) for at in own.coordinate[shown]]
            series.append(Series.line(item.symbol, change, own.rise[shown]))
        return Figure(
            name="profiles",
            title=_say("profiles_figure"),
            x_label="change from the given value [%]",
            y_label="rise of twice the objective [-]",
            series=tuple(series),
            horizontal=((self.result.profiles[0].threshold, "95 %"),),
        )

    def _reading_figures(self) -> Iterator[Figure]:
        """Yield every kind of reading that there is: the first curve and loop, and what is left of each unit's."""
        kinds = self.result.data.kinds
        if PEAK_TO_PEAK in kinds:
            yield self._peak_to_peak_figure()
        for kind in (CURVE, LOOP):
            if kind in kinds:
                yield from self._shape_figures(kind)
                yield self._residual_figure(kind)

    def _first(self, kind: str) -> ReadingBlock:
        return next(block for block in self.result.data.blocks if block.kind == kind)

    def _peak_to_peak_figure(self) -> Figure:
        rows = self._first(PEAK_TO_PEAK).rows
        numbers = [float(unit) + 1 for unit in self.result.data.unit[rows]]
        return Figure(
            name="peak_to_peak_residuals",
            title=_say("peak_to_peak_figure"),
            x_label="unit [-]",
            y_label="model less measured [arcsec]",
            series=tuple(Series.points(label, numbers, left) for label, left in self._left(rows)),
            horizontal=((0.0, ""),),
        )

    def _shape_figures(self, kind: str) -> tuple[Figure, Figure]:
        """Return the first curve or loop, and what the model leaves of it before and after the fit."""
        block, measurements = self._first(kind), self.result.measurements
        both, read = (self.result.data.measured, self.result.at_found.values), block.shape_of(measurements)
        measured, model = (values[block.rows] / ARCSECOND for values in both)
        if isinstance(read, MeasuredCurve):
            place, x = f"{read.torque:g} N·m", read.carrier_angle / DEGREE
            axis, y_label = "carrier angle [°]", "transmission error [arcsec]"
        else:
            place, x = f"{read.carrier_angle / DEGREE:.0f}°", read.torque
            axis, y_label = "torque on the carrier [N·m]", "twist less its mean [arcsec]"
        name = _say("unit_at", unit=measurements.units[read.unit].name, place=place)
        drawn = Series.line("measured", x, measured) if kind == CURVE else Series.points("measured", x, measured)
        shape = Figure(
            name=f"measured_{kind}",
            title=_say("curve_figure" if kind == CURVE else "loop_figure", unit=name),
            x_label=axis,
            y_label=y_label,
            series=(drawn, Series.line("model", x, model)),
        )
        lines = tuple(Series.line(label, x, own) for label, own in self._left(block.rows))
        title, y_label = _say("left_figure", unit=name), "model less measured [arcsec]"
        return shape, replace(shape, name=f"{kind}_left", title=title, y_label=y_label, series=lines)

    def _residual_figure(self, kind: str) -> Figure:
        data, own = self.result.data, self.result.data.rows(kind)
        names = [f"unit {self.result.measurements.units[unit].name}" for unit in data.units]
        series = []
        for label, left in self._left(own):
            rms = [float(np.sqrt((left[data.unit[own] == unit] ** 2).mean())) for unit in data.units]
            series.append(Series.bars(label, names, rms))
        return Figure(
            name=f"{kind}_residuals",
            title=_say("residuals_figure", kind=kind),
            x_label="rms [arcsec]",
            series=tuple(series),
        )


def _yes(so: bool) -> str:
    return "yes" if so else "no"


def _interval(ends: tuple[float, float]) -> str:
    return " to ".join(number(end, ".4g") for end in ends)


def _span(item: Parameter, interval: Float[np.ndarray, "2"]) -> str:
    """Return an interval of coordinates as values."""
    low, high = (item.value(float(end)) for end in interval)
    return _interval((low, high))


def _with_unit(item: Parameter, value: str) -> str:
    """Return a value with its unit of measurement, if it has one."""
    return value if item.unit == "-" else f"{value} {item.unit}"


def _as_row(item: ParameterEstimate) -> dict[str, Any]:
    kind, unit = ("standard", "arcsec") if item.parameter.name == BIAS else ("relative standard", "-")
    return {
        "name": item.parameter.name,
        "unit": item.parameter.unit,
        "start": item.parameter.start,
        "value": item.value,
        f"{kind} uncertainty [{unit}]": item.uncertainty,
        "interval": list(item.interval),
        "identified": item.identified,
        "on bound": item.on_bound,
    }

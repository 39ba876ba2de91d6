"""Tables and figures of an identification: parameters, directions, choices, measured against modelled readings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from tolalloc.bench.information import LEVEL
from tolalloc.bench.parameters import BIAS, Parameter
from tolalloc.bench.prediction import CURVE, LOOP, PEAK_TO_PEAK, ReadingBlock
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    from tolalloc.bench.identification_answer import IdentificationAnswer

_OPEN = 10.0  # width of an interval of a logarithm beyond which it says nothing [-]
_TOP = 4.0  # a profile is drawn up to so many times its threshold


def _span(item: Parameter, interval: Float[np.ndarray, "2"]) -> str:
    """Return an interval of coordinates as values."""
    low, high = (item.value(float(end)) for end in interval)
    return f"{low:.4g}…{high:.4g}"


def _left(
    answer: IdentificationAnswer, rows: slice | Int[np.ndarray, " row"]
) -> Iterator[tuple[str, Float[np.ndarray, " row"]]]:
    """Yield model less measured of some readings, before and after [arcsec]."""
    for label, prediction in (("before", answer.at_start), ("after", answer.at_found)):
        yield label, (prediction.values - answer.data.measured)[rows] / ARCSECOND


def parameters_table(answer: IdentificationAnswer) -> pd.DataFrame:
    """Return every parameter with all its intervals."""
    rows, first_order = [], answer.information.interval
    resampled = None
    if answer.bootstrap is not None:
        resampled = np.quantile(answer.bootstrap, (0.5 - LEVEL / 2, 0.5 + LEVEL / 2), axis=0)
    for at, (item, estimate) in enumerate(zip(answer.parameters, answer.estimates, strict=True)):
        bounded = item.name == BIAS or np.ptp(first_order[:, at]) < _OPEN
        rows.append(
            {
                "parameter": f"{item.symbol} [{item.unit}], {item.name.replace('_', ' ')}",
                "given": f"{item.start:.4g}",
                "bounds": f"{item.low:.4g}…{item.high:.4g}",
                "least objective at": f"{item.value(float(answer.found.coordinates[at])):.4g}",
                "95 % profile": f"{estimate.interval[0]:.4g}…{estimate.interval[1]:.4g}",
                "95 % first order": _span(item, first_order[:, at]) if bounded else "no limit",
                "95 % bootstrap": "" if resampled is None else _span(item, resampled[:, at]),
                "identified": "yes" if estimate.identified else "no",
                "on a bound": "yes" if estimate.on_bound else "no",
                "written": f"{estimate.value:.4g}",
                "standard uncertainty": f"{estimate.uncertainty:.3g} arcsec"
                if item.name == BIAS
                else f"{100 * estimate.uncertainty:.3g} %",
            }
        )
    return pd.DataFrame(rows)


def estimates_table(answer: IdentificationAnswer) -> pd.DataFrame:
    """Return what a person reads first of every parameter."""
    return pd.DataFrame(
        [
            {
                "parameter": f"{item.parameter.symbol} [{item.parameter.unit}]",
                "given": item.parameter.start,
                "identified": item.value if item.identified else "no",
                "95 % interval": f"{item.interval[0]:.4g}…{item.interval[1]:.4g}",
            }
            for item in answer.estimates
        ]
    )


def directions_table(answer: IdentificationAnswer) -> pd.DataFrame:
    """Return the combinations that the data fix, best first."""
    rows = []
    for number, item in enumerate(answer.information.directions, start=1):
        shares = zip(answer.logarithms, item.loading, strict=True)
        rows.append(
            {
                "direction": number,
                **{symbol: round(float(share), 3) + 0.0 for symbol, share in shares},
                "standard error left by the data [%]": 100 * item.deviation
                if item.deviation < item.half_width
                else "no limit",
                "left by the bounds alone [%]": 100 * item.half_width,
                "fixed": "yes" if item.is_fixed else "no",
            }
        )
    return pd.DataFrame(rows)


def choices_table(answer: IdentificationAnswer) -> pd.DataFrame:
    """Return every choice of parameters with what it leaves of units seen and not seen."""
    rows = []
    for item in answer.choices:
        row: dict[str, object] = {"fitted": item.name, "parameters [-]": len(item.parameters)}
        for kind in answer.data.kinds:
            row[f"{kind}, rms [arcsec]"] = item.rms(answer.data, kind, unseen=False) / ARCSECOND
            row[f"{kind}, units left out, rms [arcsec]"] = item.rms(answer.data, kind, unseen=True) / ARCSECOND
        row["units left out, over noise [-]"] = item.score
        row["chosen"] = "yes" if answer.chosen is item else ""
        rows.append(row)
    return pd.DataFrame(rows)


def units_table(answer: IdentificationAnswer) -> pd.DataFrame:
    """Return the residual of every unit before and after."""
    data, rows = answer.data, []
    for unit in data.units:
        row: dict[str, object] = {"unit": answer.measurements.units[unit].name}
        for kind in data.kinds:
            own = data.rows(kind)
            own = own[data.unit[own] == unit]
            if not own.size:
                continue
            for when, left in _left(answer, own):
                value = float(left[0]) if left.size == 1 else float(np.sqrt((left**2).mean()))
                name = "model less measured" if left.size == 1 else "rms of model less measured"
                row[f"{kind}, {name}, {when} [arcsec]"] = value
        rows.append(row)
    return pd.DataFrame(rows)


def profile_figure(answer: IdentificationAnswer) -> Figure:
    """Draw how much worse the fit gets as each stiffness or torque is held away from its best value."""
    series = []
    for item, own in zip(answer.parameters, answer.profiles, strict=True):
        if item.name == BIAS:
            continue
        shown = own.rise <= _TOP * own.threshold
        change = [100 * (item.value(float(at)) / item.start - 1) for at in own.coordinate[shown]]
        series.append(Series(label=item.symbol, kind="line", x=change, y=list(own.rise[shown])))
    return Figure(
        name="profiles",
        title="Profile likelihood: a flat line to both ends is a parameter that the data do not identify",
        x_label="change from the given value [%]",
        y_label="rise of twice the objective [-]",
        series=tuple(series),
        horizontal=((answer.profiles[0].threshold, "95 %"),),
    )


def reading_figures(answer: IdentificationAnswer) -> tuple[Figure, ...]:
    """Draw every kind of reading that there is: the first curve and loop, and what is left of each unit's."""
    drawn, kinds = [], answer.data.kinds
    if PEAK_TO_PEAK in kinds:
        drawn.append(_peak_to_peak_figure(answer))
    for kind in (CURVE, LOOP):
        if kind in kinds:
            drawn += [*_shape_figures(answer, kind), _unit_residual_figure(answer, kind)]
    return tuple(drawn)


def _first(answer: IdentificationAnswer, kind: str) -> ReadingBlock:
    return next(block for block in answer.data.blocks if block.kind == kind)


def _peak_to_peak_figure(answer: IdentificationAnswer) -> Figure:
    rows = _first(answer, PEAK_TO_PEAK).rows
    numbers = [float(unit) + 1 for unit in answer.data.unit[rows]]
    return Figure(
        name="peak_to_peak_residuals",
        title="Peak-to-peak, model less measured, per unit",
        x_label="unit [-]",
        y_label="model less measured [arcsec]",
        series=tuple(
            Series(label=label, kind="points", x=numbers, y=list(left)) for label, left in _left(answer, rows)
        ),
        horizontal=((0.0, ""),),
    )


def _shape_figures(answer: IdentificationAnswer, kind: str) -> tuple[Figure, Figure]:
    """Draw the first curve or loop, and what the model leaves of it before and after the fit."""
    block, measurements = _first(answer, kind), answer.measurements
    drawn: Literal["line", "points"]
    if kind == CURVE:
        curve = measurements.curves[block.number]
        unit, place, x = curve.unit, f"{curve.torque:g} N·m", list(curve.carrier_angle / DEGREE)
        title, axis, y_label, drawn = (
            "measured and modelled",
            "carrier angle [°]",
            "transmission error [arcsec]",
            "line",
        )
    else:
        loop = measurements.loops[block.number]
        unit, place, x = loop.unit, f"{loop.carrier_angle / DEGREE:.0f}°", list(loop.torque)
        title, axis, y_label = "torque and twist", "torque on the carrier [N·m]", "twist less its mean [arcsec]"
        drawn = "points"
    name = f"Unit {measurements.units[unit].name} at {place}"
    both = (answer.data.measured, answer.at_found.values)
    measured, model = (list(values[block.rows] / ARCSECOND) for values in both)
    left = tuple(Series(label=label, kind="line", x=x, y=list(own)) for label, own in _left(answer, block.rows))
    return (
        Figure(
            name=f"measured_{kind}",
            title=f"{name}: {title}",
            x_label=axis,
            y_label=y_label,
            series=(
                Series(label="measured", kind=drawn, x=x, y=measured),
                Series(label="model", kind="line", x=x, y=model),
            ),
        ),
        Figure(
            name=f"{kind}_left",
            title=f"{name}: model less measured",
            x_label=axis,
            y_label="model less measured [arcsec]",
            series=left,
        ),
    )


def _unit_residual_figure(answer: IdentificationAnswer, kind: str) -> Figure:
    data, own = answer.data, answer.data.rows(kind)
    names = [f"unit {answer.measurements.units[unit].name}" for unit in data.units]
    series = []
    for label, left in _left(answer, own):
        rms = [float(np.sqrt((left[data.unit[own] == unit] ** 2).mean())) for unit in data.units]
        series.append(Series(label=label, kind="bars", x=names, y=rms))
    return Figure(
        name=f"{kind}_residuals",
        title=f"Root-mean-square of model less measured over each unit's {kind}s",
        x_label="rms [arcsec]",
        series=tuple(series),
    )

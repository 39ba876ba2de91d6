"""Figures of an identification: profiles, measured against modelled readings, residuals per unit, convergence."""

from __future__ import annotations

import numpy as np

from tolalloc.bench.identification.answer.results import IdentificationResults
from tolalloc.bench.identification.data import CURVE, LOOP, PEAK_TO_PEAK, Block
from tolalloc.bench.identification.parameters import BIAS
from tolalloc.report.figure import Figure, Series
from tolalloc.rv.modification.history import quartiles
from tolalloc.units import ARCSECOND, DEGREE

_TOP = 4.0  # a profile is drawn up to so many times its threshold


def profile_figure(results: IdentificationResults) -> Figure:
    """Draw how much worse the fit gets as each stiffness or torque is held away from its best value."""
    series = []
    for item, own in zip(results.parameters, results.profiles, strict=True):
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
        horizontal=((results.profiles[0].threshold, "95 %"),),
    )


def peak_to_peak_figure(results: IdentificationResults) -> Figure:
    """Draw model less measured of every unit, before and after."""
    rows = results.blocks(PEAK_TO_PEAK)[0].rows
    numbers = [float(unit) + 1 for unit in results.data.unit[rows]]
    return Figure(
        name="peak_to_peak_residuals",
        title="Peak-to-peak, model less measured, per unit",
        x_label="unit [-]",
        y_label="model less measured [arcsec]",
        series=tuple(
            Series(
                label=label,
                kind="points",
                x=numbers,
                y=list((prediction.values - results.data.measured)[rows] / ARCSECOND),
            )
            for label, prediction in (("before", results.at_start), ("after", results.at_found))
        ),
        horizontal=((0.0, ""),),
    )


def curve_figures(results: IdentificationResults) -> tuple[Figure, Figure]:
    """Draw the first measured curve with the model's, and what is left between them, before and after."""
    block = results.blocks(CURVE)[0]
    curve = results.measurements.curves[block.number]
    name = f"Unit {results.measurements.units[curve.unit].name} at {curve.torque:g} N·m"
    angle, data = list(curve.carrier_angle / DEGREE), results.data
    measured = Series(label="measured", kind="line", x=angle, y=list(data.measured[block.rows] / ARCSECOND))
    model = Series(label="model", kind="line", x=angle, y=list(results.at_found.values[block.rows] / ARCSECOND))
    return (
        Figure(
            name="measured_curve",
            title=f"{name}: measured and modelled",
            x_label="carrier angle [°]",
            y_label="transmission error [arcsec]",
            series=(measured, model),
        ),
        _left_figure(results, block, "curve_left", f"{name}: model less measured", "carrier angle [°]", angle),
    )


def loop_figures(results: IdentificationResults) -> tuple[Figure, Figure]:
    """Draw the first measured loop with the model's, and what is left between them, before and after."""
    block = results.blocks(LOOP)[0]
    loop = results.measurements.loops[block.number]
    torque = list(loop.torque)
    name = f"Unit {results.measurements.units[loop.unit].name} at {loop.carrier_angle / DEGREE:.0f}°"
    measured = list(results.data.measured[block.rows] / ARCSECOND)
    model = list(results.at_found.values[block.rows] / ARCSECOND)
    return (
        Figure(
            name="measured_loop",
            title=f"{name}: torque and twist",
            x_label="torque on the carrier [N·m]",
            y_label="twist less its mean [arcsec]",
            series=(
                Series(label="measured", kind="points", x=torque, y=measured),
                Series(label="model", kind="line", x=torque, y=model),
            ),
        ),
        _left_figure(
            results, block, "loop_left", f"{name}: model less measured", "torque on the carrier [N·m]", torque
        ),
    )


def _left_figure(
    results: IdentificationResults, block: Block, name: str, title: str, x_label: str, x: list[float]
) -> Figure:
    """Draw model less measured of one block, before and after."""
    return Figure(
        name=name,
        title=title,
        x_label=x_label,
        y_label="model less measured [arcsec]",
        series=tuple(
            Series(
                label=label,
                kind="line",
                x=x,
                y=list((prediction.values - results.data.measured)[block.rows] / ARCSECOND),
            )
            for label, prediction in (("before", results.at_start), ("after", results.at_found))
        ),
    )


def unit_residual_figure(results: IdentificationResults, kind: str) -> Figure:
    """Draw the root-mean-square residual of every unit's curves or loops, before and after."""
    data, names = results.data, [results.measurements.units[unit].name for unit in results.data.units]
    chosen = np.zeros(data.measured.size, bool)
    for block in results.blocks(kind):
        chosen[block.rows] = True
    series = []
    for label, prediction in (("before", results.at_start), ("after", results.at_found)):
        left = (prediction.values - data.measured) / ARCSECOND
        rms = [float(np.sqrt((left[chosen & (data.unit == unit)] ** 2).mean())) for unit in data.units]
        series.append(Series(label=label, kind="bars", x=[f"unit {name}" for name in names], y=rms))
    return Figure(
        name=f"{kind}_residuals",
        title=f"Root-mean-square of model less measured over each unit's {kind}s",
        x_label="rms [arcsec]",
        y_label="",
        series=tuple(series),
    )


def convergence_figure(results: IdentificationResults) -> Figure:
    """Draw S above its least after so many evaluations: median and quartiles of the seeds."""
    least = max(min(float(item.objectives.min()) for item in results.comparison), np.finfo(float).tiny)
    series = []
    for item in results.comparison:
        most = max(run.evaluations for run in item.runs)
        first = max(int(run.history.evaluations[0]) for run in item.runs)
        at = np.unique(np.geomspace(max(first, 1), most, 120).astype(int))
        band = np.maximum(np.sqrt(quartiles([run.history for run in item.runs], at) / least) - 1, 1e-9)
        series.append(
            Series(
                label=item.method,
                kind="line",
                x=[float(value) for value in at],
                y=list(band[1]),
                low=list(band[0]),
                high=list(band[2]),
            )
        )
    return Figure(
        name="convergence",
        title=f"Distance of S from its least: median and quartiles of {len(results.comparison[0].runs)} seeds",
        x_label="evaluations of all units [-]",
        y_label="S over its least, less 1 [-]",
        series=tuple(series),
        logarithmic=True,
        logarithmic_x=True,
    )

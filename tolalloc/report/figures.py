"""The figures of a study."""

from __future__ import annotations

import numpy as np

from tolalloc.allocation.answer.before_after import units_figure, zones_figure
from tolalloc.report import tables
from tolalloc.report.figure import Figure, Series
from tolalloc.report.results import StudyResults
from tolalloc.units import ARCSECOND, DEGREE


def study_figures(results: StudyResults) -> tuple[Figure, ...]:
    """Return all figures, in the order of the report."""
    allocation = results.allocation
    return (
        _ranking(results),
        zones_figure(tables.before_after(results), "zone after [µm]"),
        units_figure(
            allocation.baseline.sample.values,
            allocation.chosen.sample.values,
            allocation.chosen.achieved.estimate,
            allocation.limit,
        ),
        _pareto(results),
        _curves(results),
        _orders(results),
    )


def _ranking(results: StudyResults) -> Figure:
    frame = tables.ranking(results)
    bars = Series(
        label="total Sobol index with its 90 % interval",
        kind="bars",
        x=list(frame["source"]),
        y=list(frame["total index ST [-]"]),
        low=list(frame["ST low 5 % [-]"]),
        high=list(frame["ST high 95 % [-]"]),
    )
    return Figure(
        name="ranking",
        title="Which error drives the peak-to-peak, at the zones of the tolerance table",
        x_label="total Sobol index [-]",
        y_label="",
        series=(bars,),
    )


def _pareto(results: StudyResults) -> Figure:
    allocation, front = results.allocation, results.front
    checked = ~np.isnan(front.on_kernel)
    chosen, by_hand, baseline = allocation.chosen, allocation.by_hand, allocation.baseline
    return Figure(
        name="pareto",
        title="Cost against the peak-to-peak that the target yield keeps",
        x_label=f"peak-to-peak kept by {results.target:.2%} of units [arcsec]",
        y_label="cost [cost units]",
        series=(
            Series(label="front (NSGA-II)", kind="line", x=list(front.quantile), y=list(front.cost)),
            Series(
                label="front on the kernel",
                kind="points",
                x=list(front.on_kernel[checked]),
                y=list(front.cost[checked]),
            ),
            Series(label="allocated, verified", kind="points", x=[chosen.quantile_bound], y=[chosen.cost]),
            Series(
                label="table as it is; scaled alike",
                kind="points",
                x=[baseline.quantile_bound, by_hand.quantile_bound],
                y=[baseline.cost, by_hand.cost],
            ),
        ),
        vertical=((results.limit, f"limit {results.limit:g}″"),),
    )


def _curves(results: StudyResults) -> Figure:
    return Figure(
        name="transmission_error",
        title=f"Transmission error over one output turn at {results.torque:g} N·m",
        x_label="carrier angle [°]",
        y_label="transmission error, output side [arcsec]",
        series=tuple(
            Series(
                label=example.label,
                kind="line",
                x=list(example.curves.carrier_angle / DEGREE),
                y=list(example.curves.transmission_error[0] / ARCSECOND),
            )
            for example in results.examples
        ),
    )


def _orders(results: StudyResults) -> Figure:
    frame = tables.orders(results)
    return Figure(
        name="orders",
        title=(
            f"Orders: multiples of {results.reducer.cycloid_stage.disc_teeth} stand still with the housing, "
            f"of {results.reducer.cycloid_stage.pin_count} turn with disc or carrier"
        ),
        x_label="order of the output turn [-]",
        y_label="amplitude, output side [arcsec]",
        series=tuple(
            Series(
                label=example.label,
                kind="stems",
                x=list(frame["order of the output turn [-]"]),
                y=list(frame[f"{example.label} [arcsec]"]),
            )
            for example in results.examples
        ),
    )

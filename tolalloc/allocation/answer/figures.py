"""The figures of an allocation."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.answer import tables, what_if_tables
from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.report.figure import Figure, HeatMap, Series
from tolalloc.units import MICROMETRE


def front_figure(results: AllocationResults) -> Figure:
    """Return cost against the peak-to-peak that is kept."""
    fronts, limit = results.fronts, results.joint.limit
    searched, exact = fronts.searched, fronts.exact
    checked = ~np.isnan(searched.on_kernel)
    compared = tables.designs(results)
    others = "; the search keeps the other requirements by their local models" if len(results.requirements) > 1 else ""
    knee = searched.knee
    return Figure(
        name="front",
        title=f"What a limit costs, dashed: {limit:g}″{others}",
        x_label=f"peak-to-peak kept by {results.target:.2%} of units [arcsec]",
        y_label="cost [cost units]",
        series=(
            Series(
                label=f"exact by the local models (±{results.chosen.sides[0].doubt:.2g}″)",
                kind="line",
                x=list(exact.limits),
                y=list(exact.cost),
            ),
            Series(label="NSGA-II, told", kind="line", x=list(searched.quantile), y=list(searched.cost)),
            Series(
                label="NSGA-II, on the kernel",
                kind="points",
                x=list(searched.on_kernel[checked]),
                y=list(searched.cost[checked]),
            ),
            *(
                Series(label=label, kind="points", x=[design.quantile_bound], y=[design.cost])
                for label, design in compared.items()
            ),
            Series(label="knee of NSGA-II", kind="points", x=[searched.quantile[knee]], y=[searched.cost[knee]]),
        ),
        vertical=((limit, ""),),  # a label would stand among the legend's
    )


def trade_figures(results: AllocationResults) -> tuple[Figure | HeatMap, ...]:
    """Return what the modification is worth, nothing where no pair of clearances has a cost."""
    return (trade_figure(results), trade_map(results)) if np.isfinite(results.trade.cost).any() else ()


def trade_map(results: AllocationResults) -> HeatMap:
    """Return the cost of the cheapest zones over both clearances."""
    trade = results.trade
    return HeatMap(
        name="modification_cost",
        title="Cost of the cheapest zones; an empty cell: none found that keep all requirements",
        columns=[f"{value:.3g}" for value in trade.radial],
        rows=[f"flank {value:.3g} µm" for value in trade.flank],
        x_label="radial clearance at tip and root [µm]",
        label="cost [cost units]",
        values=[[float(value) for value in row] for row in trade.cost],
    )


def trade_figure(results: AllocationResults) -> Figure:
    """Return the cost of the cheapest zones over the radial clearance."""
    trade, now = results.trade, results.reducer.modification
    return Figure(
        name="modification_trade",
        title="What one micrometre of modification buys in zones",
        x_label="radial clearance at tip and root [µm]",
        y_label="cost of the cheapest zones [cost units]",
        series=tuple(
            _where_known(f"flank clearance {flank:.3g} µm", trade.radial, cost)
            for flank, cost in zip(trade.flank, trade.cost, strict=True)
            if np.isfinite(cost).any()
        ),
        vertical=((now.radial_clearance / MICROMETRE, "as it is"), (float(results.chosen.design[-1]), "chosen")),
    )


def _where_known(label: str, x: Float[np.ndarray, " step"], y: Float[np.ndarray, " step"]) -> Series:
    """Return a line through what is known, a point where that is one value."""
    known = np.isfinite(y)
    return Series(label=label, kind="line" if known.sum() > 1 else "points", x=list(x[known]), y=list(y[known]))


def robustness_figure(results: AllocationResults) -> Figure:
    """Return how far every free zone moves when an assumption is wrong."""
    frame = what_if_tables.robustness_table(results)
    bars = Series(
        label="free zone; between its smallest and largest under all changed assumptions",
        kind="bars",
        x=list(frame["group"]),
        y=list(frame["free zone [µm]"]),
        low=list(np.minimum(frame["smallest under all changes [µm]"], frame["free zone [µm]"])),
        high=list(np.maximum(frame["largest under all changes [µm]"], frame["free zone [µm]"])),
    )
    return Figure(
        name="robustness",
        title="Free zones when costs, stiffness or processes are not what was assumed",
        x_label="zone [µm]",
        y_label="",
        series=(bars,),
    )

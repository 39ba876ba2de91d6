"""The figures of an allocation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.allocation.answer import tables
from tolalloc.allocation.front.pareto_front import Fronts
from tolalloc.allocation.front.what_if import SettingTrade
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.reading.units import unit_of
from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.wording import quantity, short, with_unit

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer


def front_figure(answer: AllocationAnswer, fronts: Fronts) -> Figure:
    """Return cost against what is kept of the leading output."""
    limit, unit = answer.free.limit, unit_of(answer.leading)
    error = with_unit(f"{answer.chosen.constraints[0].standard_error:.2g}", answer.leading)
    guarantee = answer.requirements[0].guarantee
    by = f" by {guarantee.target:.2%} of units" if isinstance(guarantee, AtYield) else ""
    searched, exact = fronts.searched, fronts.exact
    checked = ~np.isnan(searched.on_kernel)
    compared = tables.designs(answer)
    others = "; the search keeps the other requirements by their local models" if len(answer.requirements) > 1 else ""
    knee = searched.knee
    return Figure(
        name="front",
        title=f"What a limit costs, dashed: {with_unit(f'{limit:g}', answer.leading)}{others}",
        x_label=f"{short(answer.leading)} kept{by} [{unit}]",
        y_label="cost [cost units]",
        series=(
            Series(
                label=f"cheapest by the local models (±{error})",
                kind="line",
                x=list(exact.limits),
                y=list(exact.cost),
            ),
            Series(
                label="NSGA-II, as its stand-in tells",
                kind="line",
                x=list(searched.quantile),
                y=list(searched.cost),
            ),
            Series(
                label="NSGA-II, solved on the kernel",
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


def trade_figures(answer: AllocationAnswer, trade: SettingTrade) -> tuple[Figure | HeatMap, ...]:
    """Return what the settings are worth, nothing where no choice has a cost."""
    if not np.isfinite(trade.cost).any():
        return ()
    curves = _trade_figure(answer, trade)
    return (curves, _trade_map(trade)) if len(trade.names) == 2 else (curves,)


def _trade_map(trade: SettingTrade) -> HeatMap:
    """Return the cost of the cheapest zones over both settings."""
    first, second = trade.values
    return HeatMap(
        name="modification_cost",
        title="Cost of the cheapest zones; an empty cell: none found that keep all requirements",
        columns=[f"{value:.3g}" for value in second],
        rows=[f"{quantity(trade.names[0])} {value:.3g} {unit_of(trade.names[0])}" for value in first],
        x_label=trade.names[1],
        label="cost [cost units]",
        values=[[float(value) for value in row] for row in trade.cost],
    )


def _trade_figure(answer: AllocationAnswer, trade: SettingTrade) -> Figure:
    """Return the cost of the cheapest zones over the last setting, a line for each value of the others."""
    along, lines = trade.values[-1], []
    for at in np.ndindex(trade.cost.shape[:-1]):
        chosen = [
            f"{quantity(name)} {values[place]:.3g} {unit_of(name)}"
            for name, values, place in zip(trade.names, trade.values, at, strict=False)
        ]
        if np.isfinite(trade.cost[at]).any():
            lines.append(_where_known(", ".join(chosen) or "cheapest zones", along, trade.cost[at]))
    now = answer.space.settings[-1].value
    return Figure(
        name="modification_trade",
        title="What one unit of a setting buys in zones",
        x_label=trade.names[-1],
        y_label="cost of the cheapest zones [cost units]",
        series=tuple(lines),
        vertical=((now, "as it is"), (float(answer.chosen.settings[-1]), "chosen")),
    )


def _where_known(label: str, x: Float[np.ndarray, " step"], y: Float[np.ndarray, " step"]) -> Series:
    """Return a line through what is known, a point where that is one value."""
    known = np.isfinite(y)
    return Series(label=label, kind="line" if known.sum() > 1 else "points", x=list(x[known]), y=list(y[known]))


def robustness_figure(frame: pd.DataFrame) -> Figure:
    """Return how far every free zone moves when an assumption is wrong, from the table that says so."""
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

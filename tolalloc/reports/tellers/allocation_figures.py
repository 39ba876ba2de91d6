"""The figures of an allocation beside those of its drawing."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.front.cost_front import CostFront
from tolalloc.allocation.front.what_if import SettingTrade
from tolalloc.allocation.result import AllocationResult
from tolalloc.reading.units import unit_of
from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity, short, with_unit

_say = Sentences("allocation")


def units_figure(result: AllocationResult) -> Figure:
    """Return the leading output of random units before and after, with the yield after."""
    limits, leading = result.requirements[0].limits, result.leading
    before, after = result.free.baseline.sample.values, result.chosen.sample.values
    sides = (limit for limit in (limits.upper, limits.lower) if limit is not None)
    return Figure(
        short(leading).replace("-", "_").replace(" ", "_"),
        _say("figure_units", share=result.chosen.achieved.estimate),
        leading,
        "share of the units [%]",
        series=(
            Series(label="before", kind="histogram", x=list(before)),
            Series(label="after", kind="histogram", x=list(after)),
        ),
        vertical=tuple((limit, f"limit {with_unit(f'{limit:g}', leading)}") for limit in sides),
    )


def front_figure(result: AllocationResult, front: CostFront, cost_unit: str) -> Figure:
    """Return cost against the limit of the leading output."""
    leading, points, drawn = result.leading, front.points, front.drawn
    return Figure(
        "front",
        _say("figure_front"),
        f"{short(leading)} limit [{unit_of(leading)}]",
        f"cost [{cost_unit}]",
        series=(
            Series.line(
                _say("figure_front_verified"), [own.limit for own in points], [own.design.cost for own in points]
            ),
            *((Series.points(_say("front_here"), [drawn.limit], [drawn.design.cost]),) if drawn else ()),
        ),
    )


def trade_figures(result: AllocationResult, trade: SettingTrade, cost_unit: str) -> tuple[Figure | HeatMap, ...]:
    """Return what the settings are worth, nothing where no choice has a cost."""
    if not np.isfinite(trade.cost).any():
        return ()
    curves = _trade_figure(result, trade, cost_unit)
    over_two = len(trade.names) > 1 and all(values.size == 1 for values in trade.values[:-2])
    return (curves, _trade_map(trade, cost_unit)) if over_two else (curves,)


def _trade_map(trade: SettingTrade, cost_unit: str) -> HeatMap:
    """Return the cost of the cheapest zones over the last two settings, those before them with one value each."""
    (first, second), name = trade.values[-2:], trade.names[-2]
    return HeatMap(
        "modification_cost",
        _say("figure_trade_map"),
        columns=[f"{value:.3g}" for value in second],
        rows=[f"{quantity(name)} {value:.3g} {unit_of(name)}" for value in first],
        x_label=trade.names[-1],
        label=f"cost [{cost_unit}]",
        values=trade.cost.reshape(first.size, second.size).tolist(),
    )


def _trade_figure(result: AllocationResult, trade: SettingTrade, cost_unit: str) -> Figure:
    """Return the cost of the cheapest zones over the last setting, a line for each value of the others."""
    along, lines = trade.values[-1], []
    for at in np.ndindex(trade.cost.shape[:-1]):
        chosen = [
            f"{quantity(name)} {values[place]:.3g} {unit_of(name)}"
            for name, values, place in zip(trade.names, trade.values, at, strict=False)
        ]
        known = np.isfinite(trade.cost[at])
        if known.any():
            drawn = Series.line if known.sum() > 1 else Series.points
            lines.append(drawn(", ".join(chosen) or "cheapest zones", along[known], trade.cost[at][known]))
    marks = (result.space.settings[-1].value, "before"), (float(result.chosen.settings[-1]), "chosen")
    heads = _say("figure_trade"), trade.names[-1], f"cost of the cheapest zones [{cost_unit}]"
    return Figure("modification_trade", *heads, series=tuple(lines), vertical=marks)


def robustness_figure(frame: pd.DataFrame) -> Figure:
    """Return how far every free zone moves when an assumption is wrong, from the table that says so."""
    _, best, low, high, *_ = frame.columns
    label = "free zone; between its smallest and largest under all changed assumptions"
    ends = np.minimum(frame[low], frame[best]), np.maximum(frame[high], frame[best])
    bars = Series.bars(label, frame["group"], frame[best], *ends)
    return Figure("robustness", _say("figure_robustness"), f"zone [{unit_of(best)}]", series=(bars,))

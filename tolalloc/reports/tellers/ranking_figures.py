"""The figures of a ranking: drivers, requirements, orders, the leading output, rejects, and zones that may open."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tolalloc.drawings.sources import zone_in, zone_unit
from tolalloc.reading.units import unit_of
from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers import ranking_tables as tables
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number, quantity, sign_of
from tolalloc.sensitivity.result import RankingResult

_SHOWN = 20
"""Rows of a picture; the table has all [-]."""
_DRIVERS = 10
"""Drivers of a picture [-]."""
_LINE = 14
"""Letters of a line in the head of a heat map [-]."""
_say = Sentences("ranking")


def _output(result: RankingResult) -> str:
    """Return what a sentence calls the leading output."""
    return portrait_of(result.model).display_name(result.leading)


def ranking_figure(result: RankingResult) -> Figure:
    """Return total and first-order indices of the leading output with their intervals."""
    indices = result.indices
    rows, changes = indices.order[:_DRIVERS], tables.per_micrometre(result)
    names, largest = [indices.sources[at] for at in rows], max(changes.values(), default=0.0) or 1.0
    bars = (
        ("total-effect index", indices.total, indices.total_interval),
        ("first-order index", indices.first, indices.first_interval),
    )
    series = [
        Series.bars(_say("with_interval", name=name), names, np.clip(values[rows], 0.0, 1.0), *interval[:, rows])
        for name, values, interval in bars
    ]
    series.append(Series.bars(_say("per_micrometre_bars"), names, [changes.get(own, 0.0) / largest for own in names]))
    title = _say("ranking_figure", output=_output(result))
    return Figure("ranking", title, _say("ranking_axis"), series=tuple(series))


def requirements_figure(result: RankingResult) -> HeatMap:
    """Return the total index of everything that is ranked for every requirement."""
    sobol = result.sobol
    outputs = [name for name in result.outputs if name not in sobol.constant]
    rows = sobol.overall.order[:_SHOWN]
    return HeatMap(
        "requirements",
        _say("requirements_figure"),
        columns=[_broken(quantity(name)) for name in outputs],
        rows=[sobol.sources[at] for at in rows],
        label="total-effect index [-]",
        values=[[float(sobol.indices.total[sobol.position(name), at]) for name in outputs] for at in rows],
    )


def orders_figure(result: RankingResult) -> HeatMap:
    """Return the share of everything that is ranked in the wave of every order."""
    found, sign = result.orders, sign_of(tables.wave_unit(result))
    assert found is not None
    first = np.nan_to_num(found.first)
    rows = tables.largest_first(first.max(axis=0))[:_SHOWN]
    return HeatMap(
        "orders",
        _say("orders_figure"),
        columns=[
            f"{order}\n{number(own, '.2g')}{sign}" for order, own in zip(found.orders, found.deviation, strict=True)
        ],
        rows=[found.sources[at] for at in rows],
        x_label=_say("orders_axis"),
        label="share of the wave's variance [-]",
        values=[[max(float(value), 0.0) for value in first[:, at]] for at in rows],
    )


def sample_figure(result: RankingResult) -> Figure:
    """Return the leading output of the random units."""
    limits, name, sign = result.limits[result.leading], _output(result), sign_of(unit_of(result.leading))
    sides = (limit for limit in (limits.lower, limits.upper) if limit is not None)
    return Figure(
        name.replace("-", "_").replace(" ", "_"),
        _say("sample_figure", output=f"{name[0].upper()}{name[1:]}"),
        result.leading,
        "share of the units [%]",
        series=(Series(label="random units", kind="histogram", x=list(result.sample.values)),),
        vertical=tuple((limit, _say("limit_line", limit=limit, sign=sign)) for limit in sides),
    )


def reject_figure(result: RankingResult) -> Figure:
    """Return how much larger the deviations of the units outside are, summed over the columns of each source."""
    found = result.reject
    rows = tables.largest_first(found.excess)[: _SHOWN // 2]
    names, label = [found.sources[at] for at in rows], _say("with_interval", name="excess")
    bars = Series.bars(label, names, found.excess[rows], *found.excess_interval[:, rows])
    heads = _say("rejects_figure"), _say("rejects_axis")
    return Figure("rejects", *heads, series=(bars,), vertical=((0.0, "no part"),))


def inverse_figures(result: RankingResult) -> Iterator[Figure]:
    """Yield the zones now and what they may be alone; nothing if no zone has such a value."""
    found = result.inverse
    rows = [at for at in tables.tightest_first(found) if np.isfinite(found.zone[at])][:_SHOWN]
    if not rows:
        return
    active = result.errors.active
    unit = zone_unit(active)
    now = np.array([zone_in(source, unit) for source in active])[rows]
    names, alone = [found.sources[at] for at in rows], [zone_in(active[at], unit, found.zone[at]) for at in rows]
    interval = now * found.low[rows], now * found.high[rows]
    bars = Series.bars("now", names, now), Series.bars("alone, with its 90 % interval", names, alone, *interval)
    title = _say("alone_may_open" if found.meets else "alone_may_stay")
    yield Figure("alone", title, f"zone [{unit}]", series=bars)


def _broken(name: str) -> str:
    """Return a name on several lines."""
    lines = [""]
    for word in name.split():
        if len(lines[-1]) + len(word) > _LINE and lines[-1]:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)

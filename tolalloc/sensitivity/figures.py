"""The pictures of a ranking."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.wording import quantity, sign_of

if TYPE_CHECKING:
    from tolalloc.sensitivity.answer import RankingAnswer

_SHOWN = 24
"""Rows of a picture; the table has all [-]."""


def ranking_figure(answer: RankingAnswer) -> Figure:
    """Draw total and first-order indices of the leading output with their intervals."""
    frame = answer.ranking.head(_SHOWN)
    return Figure(
        name="ranking",
        title=f"Which error drives the {answer.spoken}, at the zones of the tolerance table",
        x_label="Sobol index [-]",
        series=tuple(
            Series(
                label=f"{label} with its 90 % interval",
                kind="bars",
                x=list(frame["source"]),
                y=[max(value, 0.0) for value in frame[column]],
                low=[max(value, 0.0) for value in frame[f"{short} low 5 % [-]"]],
                high=[max(value, 0.0) for value in frame[f"{short} high 95 % [-]"]],
            )
            for label, column, short in (
                ("total index", "total index ST [-]", "ST"),
                ("first-order index", "first index S1 [-]", "S1"),
            )
        ),
    )


def requirements_figure(answer: RankingAnswer) -> HeatMap:
    """Draw the total index of every source for every requirement."""
    sobol = answer.sobol
    outputs = [name for name in answer.outputs if name not in sobol.constant]
    rows = sobol.overall.order[:_SHOWN]
    return HeatMap(
        name="requirements",
        title="Which error drives which requirement",
        columns=[_broken(quantity(name)) for name in outputs],
        rows=[sobol.sources[at] for at in rows],
        label="total Sobol index [-]",
        values=[[float(sobol.indices.total[sobol.position(name), at]) for name in outputs] for at in rows],
    )


def _broken(name: str) -> str:
    """Return a name on several lines."""
    words, lines = name.split(), [""]
    for word in words:
        if len(lines[-1]) + len(word) > 14 and lines[-1]:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)


def orders_figure(answer: RankingAnswer) -> HeatMap:
    """Draw the share of every source in the wave of every order."""
    found, sign = answer.orders, sign_of(answer.wave_unit)
    assert found is not None
    largest = np.nan_to_num(found.first).max(axis=0)
    rows = [int(at) for at in np.argsort(-largest, kind="stable")[:_SHOWN]]
    return HeatMap(
        name="orders",
        title="Which error makes which order of the output turn, alone",
        columns=[
            f"{order}\n{deviation:.2g}{sign}" for order, deviation in zip(found.orders, found.deviation, strict=True)
        ],
        rows=[found.sources[at] for at in rows],
        x_label="order of the output turn [-], standard deviation of its wave",
        label="share of the wave's variance [-]",
        values=[[max(float(value), 0.0) for value in np.nan_to_num(found.first[:, at])] for at in rows],
    )


def sample_figure(answer: RankingAnswer) -> Figure:
    """Draw the leading output of the random units."""
    limits = answer.limits[answer.leading]
    lines = [(limit, f"limit {limit:g}{answer.sign}") for limit in (limits.lower, limits.upper) if limit is not None]
    return Figure(
        name=answer.spoken.replace("-", "_").replace(" ", "_"),
        title=f"{answer.spoken[0].upper()}{answer.spoken[1:]} of random units at the zones of the tolerance table",
        x_label=answer.leading,
        y_label="share of the units [%]",
        series=(Series(label="random units", kind="histogram", x=list(answer.sample.values)),),
        vertical=tuple(lines),
    )


def reject_figure(answer: RankingAnswer) -> Figure:
    """Draw how much larger the deviations of the units outside are, summed over the columns of each source."""
    frame = answer.rejects.head(_SHOWN // 2)
    return Figure(
        name="rejects",
        title="What the units outside have in common",
        x_label="mean square deviation outside beyond that of all units, sum over columns [-]",
        series=(
            Series(
                label="excess with its 90 % interval",
                kind="bars",
                x=list(frame["source"]),
                y=list(frame["excess [-]"]),
                low=list(frame["excess low 5 % [-]"]),
                high=list(frame["excess high 95 % [-]"]),
            ),
        ),
        vertical=((0.0, "no part"),),
    )


def inverse_figure(answer: RankingAnswer) -> Figure | None:
    """Draw the zones now and what they may be alone; none if no zone has such a value."""
    frame = answer.alone
    frame = frame[np.isfinite(frame["zone alone [µm]"])].head(_SHOWN)
    if frame.empty:
        return None
    return Figure(
        name="alone",
        title=f"How far each zone may {'open' if answer.inverse.meets else 'stay'} alone, all others as they are",
        x_label="zone [µm]",
        series=(
            Series(label="now", kind="bars", x=list(frame["source"]), y=list(frame["zone now [µm]"])),
            Series(
                label="alone, with its 90 % interval",
                kind="bars",
                x=list(frame["source"]),
                y=list(frame["zone alone [µm]"]),
                low=list(frame["zone now [µm]"] * frame["factor low 5 % [-]"]),
                high=list(frame["zone now [µm]"] * frame["factor high 95 % [-]"]),
            ),
        ),
    )

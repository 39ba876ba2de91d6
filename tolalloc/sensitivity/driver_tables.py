"""The tables of what drives the outputs, as frames with a unit in every header."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import with_own_words
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.feature_frame import Frames, callout
from tolalloc.sensitivity.ranking import Neighbours
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.sensitivity.sobol import SobolIndices

if TYPE_CHECKING:
    from tolalloc.sensitivity.answer import RankingAnswer


def _blocks(pair: Neighbours | None) -> str:
    """Return how many more Sobol blocks would tell a source from the next one."""
    if pair is None or pair.more_blocks is None:
        return ""
    return "told apart" if pair.separated else f"about {float(f'{pair.more_blocks:.2g}'):.0f}"


def sobol_table(sobol: SobolIndices) -> pd.DataFrame:
    """Return the sources, largest total Sobol index first, with intervals and the confidence of every place."""
    share = sobol.total / sobol.total.sum() * 100
    first, total, rank = sobol.first_interval, sobol.total_interval, sobol.rank_interval
    among, following = sobol.among_first(min(3, len(sobol.sources))), {pair.before: pair for pair in sobol.neighbours}
    rows = [
        {
            "rank [-]": place + 1,
            "source": sobol.sources[at],
            "contribution [%]": share[at],
            "cumulative [%]": share[sobol.order[: place + 1]].sum(),
            "total index ST [-]": sobol.total[at],
            "ST low 5 % [-]": total[0, at],
            "ST high 95 % [-]": total[1, at],
            "first index S1 [-]": sobol.first[at],
            "S1 low 5 % [-]": first[0, at],
            "S1 high 95 % [-]": first[1, at],
            "S1 reading": "indistinguishable from 0" if sobol.first_is_zero[at] else "above 0",
            "rank low 5 % [-]": rank[0, at],
            "rank high 95 % [-]": rank[1, at],
            "P(among first 3) [%]": among[at] * 100,
            "P(before the next) [%]": following[at].probability * 100 if at in following else np.nan,
            "more blocks to tell it from the next [-]": _blocks(following.get(at)),
        }
        for place, at in enumerate(sobol.order)
    ]
    return pd.DataFrame(rows)


def ranking_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return the ranking of the leading output, with the zone and the root mean square derivative beside it."""
    frame = sobol_table(answer.indices)
    zones = dict(zip((source.name for source in answer.errors.active), answer.errors.zones / MICROMETRE, strict=False))
    sens = dict(zip(answer.local.sources, answer.local.root_mean_square, strict=True))
    frame = frame.assign(
        **{
            "zone [µm]": [zones.get(name, np.nan) for name in frame["source"]],
            f"Sens, root mean square [{answer.unit}/µm]": [sens.get(name, np.nan) for name in frame["source"]],
        }
    )
    return with_own_words(frame, "source", {own.name: (own,) for own in answer.errors.active})


def dimensions_table(answer: RankingAnswer, found: SobolIndices) -> pd.DataFrame:
    """Return the dimensions of the drawing, largest part in the variance first, with what stands on the drawing."""
    members: dict[str, list[Source]] = {}
    for source in answer.errors.active:
        members.setdefault(source.group or source.name, []).append(source)
    low, high = found.total_interval
    rows = []
    for at in found.order:
        own = [source for name in found.sources[at].split(" + ") for source in members.get(name, ())]
        rows.append(
            {
                "dimension": found.sources[at],
                "places [-]": len(own),
                "as written [mm]": Frames(dict.fromkeys(map(callout, own))),
                "part in the variance (total index) [%]": found.total[at] * 100,
                "low 5 % [%]": low[at] * 100,
                "high 95 % [%]": high[at] * 100,
                "alone (first-order index) [%]": max(found.first[at], 0.0) * 100,
            }
        )
    return with_own_words(pd.DataFrame(rows), "dimension", members)


def pairs_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return what pairs of sources add only together, the largest first; empty unless second order was asked for."""
    sobol = answer.indices
    low, high = sobol.second_interval
    return pd.DataFrame(
        [
            {
                "source": sobol.sources[sobol.pairs[at][0]],
                "with": sobol.sources[sobol.pairs[at][1]],
                "second index S2 [-]": sobol.second[at],
                "S2 low 5 % [-]": low[at],
                "S2 high 95 % [-]": high[at],
            }
            for at in np.argsort(-sobol.second, kind="stable")
        ]
    )


def overall_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return one ranking over all outputs with a limit: the largest total index of each source and where it has it."""
    overall, sobol = answer.sobol.overall, answer.sobol
    interval, rank = overall.total_interval, overall.rank_interval
    rows = []
    for place, at in enumerate(overall.order):
        row: dict[str, object] = {
            "rank [-]": place + 1,
            "source": overall.sources[at],
            "largest ST where limited [-]": overall.total[at],
            "low 5 % [-]": interval[0, at],
            "high 95 % [-]": interval[1, at],
            "rank low 5 % [-]": rank[0, at],
            "rank high 95 % [-]": rank[1, at],
            "drives most": overall.drives[at].split(" [")[0],
        }
        for output in answer.outputs:
            if output not in sobol.constant:
                row[f"ST {output.split(' [')[0]} [-]"] = sobol.indices.total[sobol.position(output), at]
        rows.append(row)
    return pd.DataFrame(rows)


def convergence_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return how the first places settled as the blocks grew."""
    names = answer.sobol.sources
    return pd.DataFrame(
        [
            {
                "blocks [-]": step.blocks,
                "first places": ", ".join(names[at] for at in step.first),
                "share of the resamples with this order [%]": step.probability * 100,
            }
            for step in answer.sobol.convergence.history
        ]
    )


def orders_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return what each source adds to the wave of each order, alone and with others."""
    found, rows = answer.orders, list[dict[str, object]]()
    assert found is not None
    first, total = found.first_interval, found.total_interval
    for at, order in enumerate(found.orders):
        for source in np.argsort(-found.total[at], kind="stable"):
            rows.append(
                {
                    "order of the output turn [-]": order,
                    f"standard deviation of the wave [{answer.wave_unit}]": found.deviation[at],
                    "source": found.sources[source],
                    "share alone [-]": found.first[at, source],
                    "alone low 5 % [-]": first[at, 0, source],
                    "alone high 95 % [-]": first[at, 1, source],
                    "share with others [-]": found.total[at, source],
                    "with others low 5 % [-]": total[at, 0, source],
                    "with others high 95 % [-]": total[at, 1, source],
                }
            )
    return pd.DataFrame(rows)


def shapley_table(found: ShapleyEffects) -> pd.DataFrame:
    """Return the Shapley effects on the leading output, the largest first."""
    interval, rank = found.interval(0), found.rank_interval(0)
    order = np.argsort(-found.effects[0], kind="stable")
    return pd.DataFrame(
        {
            "source": [found.sources[at] for at in order],
            "Shapley effect [-]": found.effects[0][order],
            "low 5 % [-]": interval[0][order],
            "high 95 % [-]": interval[1][order],
            "rank low 5 % [-]": rank[0][order],
            "rank high 95 % [-]": rank[1][order],
        }
    )

"""The tables of what drives the outputs, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.rv.response.kernel import PEAK_TO_PEAK
from tolalloc.sensitivity.answer.results import RankingResults
from tolalloc.sensitivity.answer.sobol_table import sobol_table
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.units import MICROMETRE


def ranking_table(results: RankingResults) -> pd.DataFrame:
    """Return the ranking for the peak-to-peak, with the zone and the root mean square derivative beside it."""
    frame = sobol_table(results.sobol.of(PEAK_TO_PEAK))
    zones = dict(
        zip((source.name for source in results.errors.active), results.errors.zones / MICROMETRE, strict=False)
    )
    sens = dict(zip(results.local.sources, results.local.root_mean_square, strict=True))
    return frame.assign(
        **{
            "zone [µm]": [zones.get(name, np.nan) for name in frame["source"]],
            "Sens, root mean square [arcsec/µm]": [sens.get(name, np.nan) for name in frame["source"]],
        }
    )


def pairs_table(results: RankingResults) -> pd.DataFrame:
    """Return what pairs of sources add only together, the largest first; empty unless second order was asked for."""
    sobol = results.sobol.of(PEAK_TO_PEAK)
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


def overall_table(results: RankingResults) -> pd.DataFrame:
    """Return one ranking over all outputs with a limit: the largest total index of each source and where it has it."""
    overall, sobol = results.sobol.overall, results.sobol
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
        for output in results.outputs:
            if output not in sobol.constant:
                row[f"ST {output.split(' [')[0]} [-]"] = sobol.indices.total[sobol.position(output), at]
        rows.append(row)
    return pd.DataFrame(rows)


def growth_table(results: RankingResults) -> pd.DataFrame:
    """Return how the first places settled as the blocks grew."""
    names = results.sobol.sources
    return pd.DataFrame(
        [
            {
                "blocks [-]": step.blocks,
                "first places": ", ".join(names[at] for at in step.first),
                "share of the resamples with this order [%]": step.probability * 100,
            }
            for step in results.sobol.growth.history
        ]
    )


def orders_table(results: RankingResults) -> pd.DataFrame:
    """Return what each source adds to the wave of each order, alone and with others."""
    found, rows = results.orders, []
    first, total = found.first_interval, found.total_interval
    for at, order in enumerate(found.orders):
        for source in np.argsort(-found.total[at], kind="stable"):
            rows.append(
                {
                    "order of the output turn [-]": order,
                    "standard deviation of the wave [arcsec]": found.deviation[at],
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
    """Return the Shapley effects on the peak-to-peak, the largest first."""
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

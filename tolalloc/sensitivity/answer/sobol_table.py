"""The table of one ranking, the same in every report."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.sensitivity.ranking import Neighbours
from tolalloc.sensitivity.sobol_analysis import SobolIndices


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

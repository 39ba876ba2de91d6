"""
Simulated reducers and the limit
================================

The peak-to-peak transmission error of random reducers whose part errors have the zones of a drawing. The shape of a small
study: a reducer, a drawing, a limit, a seed.

**Read off it:** how many lie beyond the limit, and how the classical sums compare: the root sum square, and the worst case.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020"),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
ranking = study.rank(effort="quick")
ranking.plot("peak_to_peak")

"""
Which tolerance drives the error
================================

Each bar is the part of the variance of the peak-to-peak in which one source takes part, with its 90 % interval; the dark
part is what it does alone.

**Read off it:** where intervals of neighbours overlap, their order is not settled. A longer run settles it.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020"),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
ranking = study.rank(effort="quick")
print(ranking.sentences[0])
ranking.plot("ranking")

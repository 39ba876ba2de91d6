"""
Which tolerance drives the error
================================

Three bars for each line of the drawing: its part in the variance of the peak-to-peak (total-effect index), what it
does alone (first-order index), each with its 90 % interval, and the effect of one micrometre, relative to the
largest.

**Read off it:** the first bar says which tolerance to improve. Where intervals of neighbours overlap, their order is
not settled; a longer run settles it.
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

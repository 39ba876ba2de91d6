"""
Simulated reducers and the limit
================================

The peak-to-peak transmission error of random reducers whose part errors have the zones of a drawing. The table above
the picture has the classical sums beside it: root sum square and worst case.

**Read off it:** the share to the right of the limit is scrap. The classical sums say little here, because pins change
their contact.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020"),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
ranking = study.rank(effort="quick")
print(ranking.to_frame("stack-up").to_string(index=False))
ranking.plot("peak_to_peak")

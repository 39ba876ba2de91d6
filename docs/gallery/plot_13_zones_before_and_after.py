"""
Zones before and after
======================

The zones of an RV-20E as drawn and as allocated, so that 99.73 % of reducers stay below 60″ at the lowest cost.

**Read off it:** which zones become wider, because they cost much and matter little, and which become tighter.
"""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020", flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0)),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    questions=[ta.Allocation(fixed_first=False, front=False, what_if=False)],
    seed=1,
)
found = study.allocate(effort="quick")
print(found.sentences[3])
found.plot("zones")

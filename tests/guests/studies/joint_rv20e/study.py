"""A maker's RV-20E, tested without load: pins and grooves alone vary, all else is taken as exact."""

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e", flank_clearance=(1.0, 8.0), radial_clearance=(5.0, 20.0)),
    ta.drawing("zones.csv"),
    limits={ta.RADIAL_CLEARANCE: ta.Limit(lower=3.0), ta.PRELOAD: None},
    neglected=["*"],
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
    name="joint_rv20e",
)

"""An RV reducer with a centre gear: cables go through the joint."""

import tolalloc as ta

ROW = {"plus": 3, "minus": -3, "unit": "µm", "min": 1, "max": 30, "cost": 3}
study = ta.Study(
    ta.reducer("rv27c"),
    ta.Drawing.of_rows([{"id": "pin.diameter", **ROW}, {"id": "housing.groove.radius", **ROW}]),
    limits={ta.RADIAL_CLEARANCE: ta.Limit(lower=1.0), ta.PRELOAD: None},
    neglected=["*"],
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
    name="hollow_rv27c",
)

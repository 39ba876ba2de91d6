"""A single-stage drive for a cobot joint whose output pins are what varies."""

import tolalloc as ta

ROW = {"plus": 2.5, "minus": -2.5, "unit": "µm", "min": 1, "max": 30, "cost": 3}
study = ta.Study(
    ta.reducer("cd29"),
    ta.Drawing.of_rows([{"id": "pin.diameter", **ROW}]),
    limits={ta.RADIAL_CLEARANCE: ta.Limit(lower=1.0), ta.PRELOAD: None},
    neglected=["*"],
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
    name="cobot_cd29",
)

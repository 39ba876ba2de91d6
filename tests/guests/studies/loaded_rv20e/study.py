"""The same reducer at its rated torque, and warm: peak-to-peak of a crank with eccentric journals."""

import tolalloc as ta

WARM = ta.LoadCase("warm", disc_temperature=5)
ROW = {"feature": "position", "plus": 6, "minus": 0, "unit": "µm", "min": 1, "max": 20, "cost": 4}
study = ta.Study(
    ta.reducer("rv20e", torque=-167, flank_clearance=(1.0, 8.0), load_cases=[WARM]),
    ta.Drawing.of_rows(
        [{"id": "4x crank*.journal*.eccentricity", **ROW}, {"id": "carrier.bore.position", "places": 2, **ROW}]
    ),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=90), ta.at(ta.PEAK_TO_PEAK, WARM): ta.Limit(upper=90), ta.PRELOAD: None},
    neglected=["*"],
    questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
    name="loaded_rv20e",
)

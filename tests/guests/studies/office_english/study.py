"""An English office: its own heads, a drawing number, hole and shaft of 40 H8/f7 by their deviations in thou of mm."""

import tolalloc as ta

HEADS = {"Characteristic": "id", "Drawing no.": "drawing", "Nominal size": "nominal", "Upper deviation": "plus"}
HEADS |= {"Lower deviation": "minus", "Unit": "unit", "Smallest": "min", "Largest": "max", "Price": "cost"}
study = ta.Study(
    ta.model(
        lambda hole, shaft: hole - shaft, inputs=("hole", "shaft"), outputs=("clearance [mm]",), name="running fit"
    ),
    ta.drawing("fits.csv", columns=HEADS),
    limits={"clearance [mm]": ta.Limit(lower=0.03, upper=0.085)},
    name="office_english",
)

"""A function whose parameters have places and no names, as those of C have."""

import tolalloc as ta


def gap(a, b, c, /):
    return a - b - c


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(gap, inputs={"frame": 60, "door": 58, "seal": 1.8}, outputs=("gap [mm]",)),
    ta.Drawing.of_rows([{"id": "seal", **ROW}, {"id": "frame", **ROW, "plus": 0.08}, {"id": "door", **ROW}]),
    limits={"gap [mm]": ta.Limit(lower=0.11, upper=0.32)},
    name="by_place_alone",
)

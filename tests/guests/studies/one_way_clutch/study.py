"""Contact angle of a one-way clutch, the textbook case of tolerance design."""

import math

import tolalloc as ta


def angle(hub, roller, cage):
    return math.degrees(math.acos((hub + roller) / (cage - roller)))


ROW = {"plus": 0.03, "minus": -0.03, "unit": "mm", "min": 0.01, "max": 0.2, "cost": 5}
study = ta.Study(
    ta.model(angle, inputs={"hub": 55.29, "roller": 22.86, "cage": 101.69}, outputs=("contact angle [deg]",)),
    ta.Drawing.of_rows([{"id": name, **ROW} for name in ("hub", "roller", "cage")]),
    limits={"contact angle [deg]": ta.Limit(lower=6.4, upper=7.7)},
    name="one_way_clutch",
)

"""Distance of two bores, each with a tolerance of position."""

import tolalloc as ta

ROW = {"feature": "position", "plus": 0.1, "minus": 0, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 4}


def distance(left, right):
    return ((right[0] - left[0]) ** 2 + (right[1] - left[1]) ** 2) ** 0.5


study = ta.Study(
    ta.model(
        lambda x1, y1, x2, y2: distance((x1, y1), (80 + x2, y2)),
        inputs=("left.x", "left.y", "right.x", "right.y"),
        outputs=("distance [mm]",),
        name="distance",
    ),
    ta.Drawing.of_rows([{"id": "left", **ROW}, {"id": "right", **ROW}]),
    limits={"distance [mm]": ta.Limit(lower=79.93, upper=80.07)},
    name="hole_pattern",
)

"""Axial play of a bearing in its housing, in millimetres, one part with deviations to one side."""

import tolalloc as ta


def play(housing, bearing, spacer, ring):
    return housing - bearing - spacer - ring


ROW = {"unit": "mm", "min": 0.02, "max": 0.4, "cost": 2}
study = ta.Study(
    ta.model(play, inputs=("housing", "bearing", "spacer", "ring"), outputs=("play [mm]",)),
    ta.Drawing.of_rows(
        [
            {"id": "housing", "nominal": 50, "plus": 0.1, "minus": -0.1, **ROW},
            {"id": "bearing", "nominal": 15, "plus": 0, "minus": -0.12, "locked": True, **ROW},
            {"id": "spacer", "nominal": 33, "plus": 0.1, "minus": -0.1, **ROW},
            {"id": "ring", "nominal": 1.5, "plus": 0.05, "minus": -0.05, **ROW},
        ]
    ),
    limits={"play [mm]": ta.Limit(lower=0.4, upper=0.72)},
    name="bearing_seat",
)

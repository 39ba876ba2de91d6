"""Two sleeves of one lot, which deviate alike."""

import tolalloc as ta

ROW = {"plus": 30, "minus": -30, "unit": "µm", "min": 10, "max": 200, "cost": 1}
study = ta.Study(
    ta.model(
        lambda left, right, pipe: pipe - left - right,
        inputs={"left": 12, "right": 12, "pipe": 30},
        outputs=("gap [mm]",),
        name="gap",
    ),
    ta.Drawing.of_rows([{"id": name, **ROW} for name in ("left", "right", "pipe")], correlations="like.csv"),
    limits={"gap [mm]": ta.Limit(lower=5.93, upper=6.07)},
    name="like_lots",
)

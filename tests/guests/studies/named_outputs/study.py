"""Two outputs that a table returns by name, in another order than the study states them."""

import pandas as pd

import tolalloc as ta


def play(shaft, hub, key):
    return pd.DataFrame({"key play": key - 8.0 + 0.0 * shaft, "seat": hub - shaft})


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(play, inputs={"hub": 30.08, "shaft": 30, "key": 8.05}, outputs=("seat [mm]", "key play [mm]")),
    ta.Drawing.of_rows([{"id": "shaft", **ROW}, {"id": "hub", **ROW}, {"id": "key", **ROW}]),
    limits={
        "seat [mm]": ta.Limit(lower=0, upper=0.16, show=ta.AtYield(target=0.98)),
        "key play [mm]": ta.Limit(upper=0.1, show=ta.AtYield(target=0.98)),
    },
    name="named_outputs",
)

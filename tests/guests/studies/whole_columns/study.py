"""A function of whole columns, with a branch by where."""

import numpy as np

import tolalloc as ta


def overlap(width, slot):
    gap = slot - width
    return np.where(gap > 0, 0.0, -gap), gap


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(overlap, inputs={"width": 19.9, "slot": 20}, outputs=("overlap [mm]", "gap [mm]")),
    ta.Drawing.of_rows([{"id": "width", **ROW}, {"id": "slot", **ROW}]),
    limits={"gap [mm]": ta.Limit(lower=0.03), "overlap [mm]": ta.Limit(upper=0.01)},
    name="whole_columns",
)

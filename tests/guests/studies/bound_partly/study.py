"""A helper of the office with one argument already given."""

from functools import partial

import tolalloc as ta


def ratio(first, second, scale):
    return scale * first / second


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(partial(ratio, scale=100), inputs={"first": 25, "second": 50}, outputs=("ratio [%]",), name="ratio"),
    ta.Drawing.of_rows([{"id": "first", **ROW}, {"id": "second", **ROW}]),
    limits={"ratio [%]": ta.Limit(lower=49.9, upper=50.1)},
    name="bound_partly",
)

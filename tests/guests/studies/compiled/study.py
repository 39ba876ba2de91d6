"""A function that its author compiled with numba, and its compiled helper."""

import numba

import tolalloc as ta


@numba.njit
def _half(length):
    return 0.5 * length


@numba.njit
def middle(left, right):
    return _half(left + right)


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(middle, inputs={"left": 10, "right": 30}, outputs=("middle [mm]",)),
    ta.Drawing.of_rows([{"id": "left", **ROW}, {"id": "right", **ROW}]),
    limits={"middle [mm]": ta.Limit(lower=19.96, upper=20.04)},
    name="compiled",
)

"""How much a better drawing could save at most: the centre distance of two bores, and a cost that none undercuts.

tolalloc run studies/bores_lower_bound.py --quick

A function that is not linear has only a local bound, which is not proven for drawings far from the answer. With `boxes`
and bounds of the slopes, the whole range of zones is searched. All numbers are assumed.
"""

import numpy as np

import tolalloc as ta

DISTANCE = "centre distance [mm]"
SIZES = {"x1": 10.0, "y1": 12.0, "x2": 40.0, "y2": 52.0}
COSTS = {"x1": 2.0, "y1": 1.0, "x2": 2.0, "y2": 0.5}
ROW = {"plus": 0.03, "minus": -0.03, "unit": "mm", "min": 0.01, "max": 0.2, "provenance": "assumed"}
ALONG, UP = (0.59, 0.61), (0.79, 0.81)  # smallest and largest slope wherever the zones may lie
SLOPES = {"x1": (-0.61, -0.59), "y1": (-0.81, -0.79), "x2": ALONG, "y2": UP}


def centre_distance(x1, y1, x2, y2):
    """Return the distance of bore 1 at x1, y1 and bore 2 at x2, y2 [mm]."""
    return np.hypot(x2 - x1, y2 - y1)


study = ta.Study(
    ta.model(centre_distance, inputs=tuple(SIZES), outputs=(DISTANCE,), slopes={DISTANCE: SLOPES}),
    ta.Drawing.of_rows([{"id": own, "nominal": size, "cost": COSTS[own], **ROW} for own, size in SIZES.items()]),
    limits={DISTANCE: ta.Limit(lower=49.95, upper=50.05)},
    questions=[ta.Allocation(front=False, what_if=False, boxes=3000)],
    name="bores_lower_bound",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()

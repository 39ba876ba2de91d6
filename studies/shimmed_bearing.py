"""We shim the bearing: what a washer chosen for the measured gap saves, and which zones the parts need then.

tolalloc run studies/shimmed_bearing.py --quick

The axial play of one bearing; all numbers are assumed. On a reducer the same line names its sources, and takes minutes:
`ta.Shim("pin.diameter", step=1.0, sizes=(1, 3), against={"housing.groove.radius": -1.0})`.
"""

import tolalloc as ta

PLAY = "axial play [µm]"
SIZES = {"housing": 30.01, "bearing": 28.0, "washer": 2.0}
COSTS = {"housing": 6.0, "bearing": 3.0, "washer": 1.0}
ROW = {"plus": 5, "minus": -5, "unit": "µm", "min": 2, "max": 60, "provenance": "assumed"}


def axial_play(housing, bearing, washer):
    """Return the axial play [µm] that is left beside bearing and washer, of these widths [mm]."""
    return 1000 * (housing - bearing - washer)


study = ta.Study(
    ta.model(axial_play, inputs=SIZES, outputs=(PLAY,)),
    ta.Drawing.of_rows([{"id": part, "nominal": size, "cost": COSTS[part], **ROW} for part, size in SIZES.items()]),
    limits={PLAY: ta.Limit(lower=2.0, upper=18.0)},
    compensators=[ta.Shim("washer", step=5.0, sizes=(1, 3), against={"bearing": 1.0, "housing": -1.0}, size_cost=0.2)],
    questions=[ta.Allocation(front=False, what_if=False)],
    name="shimmed_bearing",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()

"""My pins come in classes: what sorting them to their bores saves, and which zones the parts need then.

tolalloc run studies/sorted_pins.py --quick

One pin and its bore; all numbers are assumed. On a reducer the same line names its sources, and takes minutes:
`ta.Sorting("pin.diameter", "housing.groove.radius", classes=(1, 2, 4))`.
"""

import tolalloc as ta

CLEARANCE = "pin clearance [µm]"
SIZES, COSTS = {"bore": 10.005, "pin": 10.0}, {"bore": 10.0, "pin": 4.0}
ROW = {"plus": 2, "minus": -2, "unit": "µm", "min": 1, "max": 30, "provenance": "assumed"}


def clearance(bore, pin):
    """Return the clearance [µm] of a pin in its bore, of these diameters [mm]."""
    return 1000 * (bore - pin)


study = ta.Study(
    ta.model(clearance, inputs=SIZES, outputs=(CLEARANCE,)),
    ta.Drawing.of_rows([{"id": part, "nominal": size, "cost": COSTS[part], **ROW} for part, size in SIZES.items()]),
    limits={CLEARANCE: ta.Limit(lower=2.0, upper=8.0)},
    compensators=[ta.Sorting("pin", "bore", classes=(1, 2, 4), class_cost=0.5, leftover_cost=4.0)],
    questions=[ta.Allocation(front=False, what_if=False)],
    name="sorted_pins",
    seed=1,
)

if __name__ == "__main__":
    ta.run_script()

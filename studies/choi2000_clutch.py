"""A one-way clutch as a model of one's own: tolerances of hub, rollers and cage for its contact angle at least cost.

tolalloc run studies/choi2000_clutch.py --quick

Problem and costs: Choi, Park & Salisbury 2000, J. Manuf. Sci. Eng. 122(3), with quality loss 0. A cage of 101.6 mm
(4 in) gives the published optimum, one of 101.69 mm, as some papers print it, does not. Steps of 1 pm leave its zones
as they are found; without them the drawing has three figures and costs 0.08 % more.
"""

import numpy as np

import tolalloc as ta


def contact_angle(hub, roller, other, cage):
    """Return the angle at which the rollers touch hub and cage [rad], from dimensions [mm]."""
    rollers = (roller + other) / 2
    return np.arccos((hub + rollers) / (cage - rollers))


nominal = {"hub": 55.29, "roller": 22.86, "other roller": 22.86, "cage": 101.6}
ways = {  # process, A and B of the cost A + B/t, smallest and largest t [mm] of a tolerance ± t
    "hub": [("grind", 10, 0.015, 0.015, 0.08), ("turn", 5, 0.5, 0.06, 0.15), ("rough", 3.5, 0.75, 0.12, 0.25)],
    "roller": [("lap", 8, 0.25, 0.02, 0.15), ("grind", 3, 0.65, 0.08, 0.3)],
    "other roller": [("lap", 2.5, 0.3, 0.04, 0.2), ("grind", 5, 0.045, 0.12, 0.25)],
    "cage": [("grind", 4, 0.56, 0.08, 0.12), ("turn", 6, 0.16, 0.15, 0.25), ("press", 0.5, 0.88, 0.2, 0.4)],
}
as_today = {"plus": 0.15, "minus": -0.15, "unit": "mm", "min": 0.03, "max": 0.8, "cost": 10, "step": 1e-9}
angle = contact_angle(*nominal.values())
study = ta.Study(
    ta.model(contact_angle, inputs=nominal, outputs=("contact angle [rad]",)),
    ta.Drawing.of_rows(
        [{"id": part, "nominal": size, **as_today} for part, size in nominal.items()],
        costs=ways,
    ),
    limits={"contact angle [rad]": ta.Limit(lower=angle - 0.035, upper=angle + 0.035, show=ta.RootSumSquare())},
    questions=[ta.Ranking(), ta.Allocation()],
    name="choi2000_clutch",
    largest_failed_share=0.05,  # rollers far outside their zones find no angle
)

if __name__ == "__main__":
    ta.run_script()

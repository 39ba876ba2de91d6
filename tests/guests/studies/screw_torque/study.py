"""Tightening torque of a screw: flank angle of 60°, friction in thread and under head, scattering diameters."""

from math import cos, pi, radians

import tolalloc as ta

PITCH, FRICTION, FORCE = 1.25, 0.14, 17_000.0


def torque(flank, head):
    return FORCE * (PITCH / (2 * pi) + FRICTION * (flank / 2 / cos(radians(30)) + head / 2)) / 1000


ROW = {"unit": "mm", "min": 0.02, "max": 0.6, "cost": 0.2}
study = ta.Study(
    ta.model(torque, inputs=("flank", "head"), outputs=("torque [N·m]",)),
    ta.Drawing.of_rows(
        [
            {"id": "flank", "nominal": 7.188, "plus": 0, "minus": -0.118, **ROW},
            {"id": "head", "nominal": 10.7, "plus": 0.2, "minus": -0.2, **ROW},
        ]
    ),
    limits={"torque [N·m]": ta.Limit(lower=25.7, upper=26.3)},
    name="screw_torque",
)

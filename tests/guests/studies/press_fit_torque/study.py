"""Torque that a press fit carries: interference of shaft and hub, thick-walled ring, T = µ·p·π·d²·l/2."""

from math import pi

import tolalloc as ta

MODULUS, FRICTION, DIAMETER, LENGTH, OUTER = 206e3, 0.12, 30.0, 25.0, 60.0


def torque(shaft, bore):
    widening = (OUTER**2 + DIAMETER**2) / (OUTER**2 - DIAMETER**2) + 1  # of a hub and a solid shaft of one steel
    pressure = MODULUS * (shaft - bore) / (DIAMETER * widening)
    return FRICTION * pressure * pi * DIAMETER**2 * LENGTH / 2 / 1000


study = ta.Study(
    ta.model(torque, inputs={"shaft": 30, "bore": 30}, outputs=("torque [N·m]",)),
    ta.drawing("fit.csv"),
    limits={"torque [N·m]": ta.Limit(lower=250)},
    name="press_fit_torque",
)

"""Height of a ball in a cone, as the root of an equation, one unit a call."""

from math import sin

from scipy.optimize import brentq

import tolalloc as ta


def height(ball, cone):
    return brentq(lambda h: h * sin(cone) - ball / 2, 0.0, 100.0)  # the ball touches the cone of half angle


study = ta.Study(
    ta.model(
        lambda ball, width: height(ball, 0.5 + width / 100),
        inputs={"ball": 10, "width": 0},
        outputs=("height [mm]",),
        name="ball in cone",
    ),
    ta.Drawing.of_rows(
        [
            {"id": "ball", "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.01, "max": 0.2, "cost": 2},
            {"id": "width", "plus": 0.3, "minus": -0.3, "unit": "mm", "min": 0.1, "max": 1, "cost": 2},
        ]
    ),
    limits={"height [mm]": ta.Limit(lower=10.35, upper=10.51)},
    name="root_of_an_equation",
)

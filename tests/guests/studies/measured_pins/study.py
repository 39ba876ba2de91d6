"""Pins that the measuring room has seen, on top of a plate of the drawing."""

import tolalloc as ta

study = ta.Study(
    ta.model(lambda pin, plate: pin + plate, inputs={"pin": 10, "plate": 5}, outputs=("height [mm]",), name="height"),
    ta.drawing("parts.csv"),
    limits={"height [mm]": ta.Limit(lower=14.96, upper=15.05)},
    name="measured_pins",
)

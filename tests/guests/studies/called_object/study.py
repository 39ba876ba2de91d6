"""An object that is called: a lever of a given ratio."""

from dataclasses import dataclass

import tolalloc as ta


@dataclass(frozen=True)
class Lever:
    ratio: float

    def __call__(self, pin, fork):
        return self.ratio * (fork - pin)


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(Lever(ratio=3.0), inputs={"pin": 6, "fork": 6.1}, outputs=("stroke [mm]",), name="lever"),
    ta.Drawing.of_rows([{"id": "pin", **ROW}, {"id": "fork", **ROW}]),
    limits={"stroke [mm]": ta.Limit(lower=0.1, upper=0.5)},
    name="called_object",
)

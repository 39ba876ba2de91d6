"""A stack with a shim that the designer chooses beside the zones."""

import tolalloc as ta


def preload(case, pack, shim):
    return shim + pack - case


ROW = {"plus": 0.05, "minus": -0.05, "unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
study = ta.Study(
    ta.model(
        preload,
        inputs={"case": 40, "pack": 39},
        outputs=("preload [mm]",),
        settings=[ta.Setting(name="shim", value=1.1, lower=0.9, upper=1.3, step=0.01)],
    ),
    ta.Drawing.of_rows([{"id": "case", **ROW}, {"id": "pack", **ROW}]),
    limits={"preload [mm]": ta.Limit(lower=0.02, upper=0.2)},
    name="with_setting",
)

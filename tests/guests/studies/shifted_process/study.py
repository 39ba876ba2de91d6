"""A process whose mean drifted by half of half its zone, and one that is sorted."""

import tolalloc as ta

ROW = {"nominal": 20, "plus": 0.06, "minus": -0.06, "unit": "mm", "min": 0.02, "max": 0.3, "cost": 1}
study = ta.Study(
    ta.model(lambda turned, ground: turned - ground, inputs=("turned", "ground"), outputs=("step [mm]",), name="step"),
    ta.Drawing.of_rows(
        [{"id": "turned", **ROW, "Cp": 1.5, "shift": 0.5}, {"id": "ground", **ROW, "Cp": 0.5, "sorted": True}]
    ),
    limits={"step [mm]": ta.Limit(lower=-0.09, upper=0.11)},
    name="shifted_process",
)

"""
Two limits at once
==================

A gap and a stroke of the same four parts are both limited. Each row is a part, each column a limit.

**Read off it:** a part that matters for one limit alone can be left wide for the other; a part dark in both columns
is the one to improve.
"""

import tolalloc as ta


def both(housing, shaft, ring, lever):
    return housing - shaft - ring, lever * ring / 30


zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
sizes = {"housing": 60.0, "shaft": 39.9, "ring": 20.0, "lever": 30.0}
study = ta.Study(
    ta.model(both, inputs=tuple(sizes), outputs=("gap [mm]", "stroke [mm]")),
    ta.Drawing.of_rows([{"id": name, "nominal": size, **zone} for name, size in sizes.items()]),
    limits={"gap [mm]": ta.Limit(lower=0.06, upper=0.14), "stroke [mm]": ta.Limit(upper=20.03)},
    seed=1,
)
study.rank(effort="quick").plot("requirements")

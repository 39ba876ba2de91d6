"""
ISO grades only
===============

Zones that may come from ISO 286 grades alone, before and after.

**Read off it:** the zone of each grade that was chosen. Steps of the ladder are wide, so a grade often leaves part of
the limit unused.
"""

import tolalloc as ta


def gap(housing, shaft, ring):
    return housing - shaft - ring


zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.2}
sizes = {"housing": (60.0, 1), "shaft": (39.9, 3), "ring": (20.0, 2)}
drawing = ta.Drawing.of_rows(
    [{"id": name, "nominal": size, "cost": cost, **zone} for name, (size, cost) in sizes.items()]
)
study = ta.Study(
    ta.model(gap, inputs=tuple(sizes), outputs=("gap [mm]",)),
    drawing,
    limits={"gap [mm]": ta.Limit(lower=0.04, upper=0.16)},
    questions=[ta.Allocation(grades=True, front=False, what_if=False)],
    seed=1,
)
found = study.allocate(effort="quick")
print(found.to_frame("drawing")[["source", "zone [µm]", "grade"]].to_string(index=False))
found.plot("zones")

"""
A zone that is locked
=====================

The same drawing allocated twice: with all zones free, and with the zone of the shaft locked at today's value.

**Read off it:** the zone that the others have to give up for the one that may not move, and what that costs.
"""

import matplotlib.pyplot as plt

import tolalloc as ta


def gap(housing, shaft, ring):
    return housing - shaft - ring


def allocated(locked):
    zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1}
    sizes = {"housing": (60.0, 1), "shaft": (39.9, 3), "ring": (20.0, 2)}
    drawing = ta.Drawing.of_rows(
        [
            {"id": name, "nominal": size, "cost": cost, "locked": "yes" if name in locked else "", **zone}
            for name, (size, cost) in sizes.items()
        ]
    )
    study = ta.Study(
        ta.model(gap, inputs=tuple(sizes), outputs=("gap [mm]",)),
        drawing,
        limits={"gap [mm]": ta.Limit(lower=0.05, upper=0.15)},
        questions=[ta.Allocation(front=False, what_if=False)],
        seed=1,
    )
    return study.allocate(effort="quick")


figure, axes = plt.subplots(figsize=(8, 3.6), constrained_layout=True)
for row, (label, locked) in enumerate({"all free": (), "shaft locked": ("shaft",)}.items()):
    found = allocated(locked)
    table = found.to_frame("drawing")
    places = [place + 0.4 * row - 0.2 for place in range(len(table))]
    colour = ("#1f4e79", "#d9822b")[row]
    axes.barh(places, table["zone [µm]"], 0.36, color=colour, label=f"{label}: cost {found.result.cost:.2f}")
axes.set_yticks(range(len(table)), table["source"])
axes.set(xlabel="zone [µm]")
axes.legend()
plt.show()

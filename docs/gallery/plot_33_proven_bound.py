"""
What does no drawing cost less than?
====================================

A chain of three sizes with a gap, whose derivatives are known. The more boxes of zones are looked at, the higher lies
the cost that no drawing undercuts, and the less is left to find.

**Read off it:** between both lines lies what a better drawing could save at most.
"""

import matplotlib.pyplot as plt

import tolalloc as ta

GAP = "gap [mm]"
sizes = {"housing": (40.0, 2.0), "bearing": (18.0, 1.0), "spacer": (22.0, 0.5)}
fit = ta.model(
    lambda housing, bearing, spacer: housing - bearing - spacer,
    inputs=tuple(sizes),
    outputs=(GAP,),
    slopes={GAP: {"housing": (1, 1), "bearing": (-1, -1), "spacer": (-1, -1)}},
    name="gap",
)
drawing = ta.Drawing.of_rows(
    [
        {
            "id": name,
            "nominal": nominal,
            "plus": 0.05,
            "minus": -0.05,
            "unit": "mm",
            "min": 0.01,
            "max": 0.2,
            "cost": cost,
        }
        for name, (nominal, cost) in sizes.items()
    ]
)
counts, proven = (10, 30, 100, 300, 1000, 3000), []
for boxes in counts:
    study = ta.Study(
        fit,
        drawing,
        limits={GAP: ta.Limit(lower=-0.1, upper=0.1)},
        questions=[ta.Allocation(front=False, what_if=False, boxes=boxes)],
        seed=1,
    )
    found = study.allocate(effort="quick").result
    proven.append(found.proven.cost)
figure, axes = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
axes.semilogx(counts, proven, "o-", label="no drawing costs less (95 % confidence)")
axes.axhline(found.cost, color="tab:orange", label="the drawing that was found")
axes.set(xlabel="boxes of zones [-]", ylabel="cost [cost units]", ylim=(0, 1.1 * found.cost))
axes.legend(loc="lower right")
plt.show()

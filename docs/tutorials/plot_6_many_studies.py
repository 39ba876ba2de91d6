"""
Many studies
============

A product series, or a grid of limits: many studies that differ in a few numbers, one table of answers, and two of
them side by side.
"""

# %%
# The model is a plain function, so that the page takes seconds; with reducers only the first line changes. A limit of
# the gap is tightened step by step.

from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import tolalloc as ta


def gap(housing, shaft, ring):
    return housing - shaft - ring


names = {"housing": (60.0, 1), "shaft": (39.9, 3), "ring": (20.0, 2)}
zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1}
drawing = ta.Drawing.of_rows(
    [{"id": name, "nominal": size, "cost": cost, **zone} for name, (size, cost) in names.items()]
)
model = ta.model(gap, inputs=tuple(names), outputs=("gap [mm]",))
base = ta.Study(
    model,
    drawing,
    limits={"gap [mm]": ta.Limit(lower=0.06, upper=0.14)},
    questions=[ta.Allocation(front=False, what_if=False)],
    name="gap_40",
    seed=1,
)
studies = [
    replace(base, limits={"gap [mm]": ta.Limit(lower=0.1 - half / 1000, upper=0.1 + half / 1000)}, name=f"gap_{half}")
    for half in (20, 30, 40)
]

# %%
# ``series`` runs them all, each into a run folder of its own. A study that cannot be run does not stop the others; the
# same call again reads what is finished and runs the rest.

runs = Path(mkdtemp()) / "runs"
answer = ta.series(studies, runs, effort="quick")
print(*answer.sentences, sep="\n")
table = answer.to_frame()
print(table.iloc[:, :5].to_string(index=False))

# %%
# **What does the limit cost?**

cost = next(head for head in table if head.startswith("cost"))
figure, axes = plt.subplots(figsize=(7, 4), constrained_layout=True)
axes.plot([20, 30, 40], table[cost], "o-", color="#1f4e79")
axes.set(xlabel="limit of the gap, ± [µm]", ylabel=cost)
plt.show()

# %%
# **Two of them side by side:** answers, rankings and zones.

both = ta.compare(runs / "gap_20", runs / "gap_40")
print(*both.sentences, sep="\n")

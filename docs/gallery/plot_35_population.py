"""
What parts do to a promise
==========================

Share of gaps inside their limits for four populations of the parts of one drawing, all of which keep its zones or what
it demands of them.

**Read off it:** parts spread evenly obey every zone, yet one gap in twelve is lost, more than at Cp 0.67, where some
parts lie outside their zones.
"""

import matplotlib.pyplot as plt

import tolalloc as ta
from tolalloc.drawings.population import populated
from tolalloc.drawings.seeds import SeedTree

NAMES = ("housing", "ring", "bearing", "shoulder")
row = {"unit": "µm", "plus": 12, "minus": -12, "min": 5, "max": 120, "cost": 10.0}
drawing = ta.Drawing.of_rows([{"id": name, "nominal": 10.0, **row} for name in NAMES])
limit, shares = 24e-6, {}
for label, population in (
    ("Cp 1.33", 1.33),
    ("Cp 1, as demanded", 1.0),
    ("spread evenly", "uniform"),
    ("Cp 0.67", 0.67),
):
    units = populated(drawing.errors, population).random_units(200_000, SeedTree(1))
    gaps = units[:, 0] - units[:, 1:].sum(axis=1)
    shares[label] = 100 * (abs(gaps) < limit).mean()
figure, axes = plt.subplots(figsize=(8, 3), constrained_layout=True)
bars = axes.barh(list(shares), list(shares.values()), color=["#3a8f5c", "#1f4e79", "#d9822b", "#b00020"])
axes.bar_label(bars, fmt="%.2f %%", padding=3)
axes.set(xlabel="gaps inside ±24 µm [%]", xlim=(85, 102))
axes.invert_yaxis()
plt.show()

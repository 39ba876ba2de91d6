"""
Has the ranking converged?
==========================

The blocks of a ranking double until the order of the first places stays the same. The model here is a plain function, a gap
over four parts, so that it takes a second.

**Read off it:** the share of resamples with the same order; at 95 % or more the order may be trusted.
"""

import matplotlib.pyplot as plt

import tolalloc as ta


def gap(housing, shaft, ring, cover):
    return housing - shaft - 0.8 * ring - 0.65 * cover


names = ("housing", "shaft", "ring", "cover")
zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
sizes = dict(zip(names, (60.0, 30.0, 20.0, 10.0), strict=True))
drawing = ta.Drawing.of_rows([{"id": name, "nominal": size, **zone} for name, size in sizes.items()])
study = ta.Study(
    ta.model(gap, inputs=names, outputs=("gap [mm]",)),
    drawing,
    limits={"gap [mm]": ta.Limit(lower=7.45, upper=7.55)},
    seed=1,
)
effort = ta.Effort(ranking=ta.RankingEffort(units=2000, sobol=ta.SobolEffort(start=16, limit=2048)), is_quick=True)
steps = study.rank(effort=effort).to_frame("convergence")
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.semilogx(steps["blocks [-]"], steps["share of the resamples with this order [%]"], "o-", base=2, color="#1f4e79")
axes.axhline(95, color="#b00020", linestyle="--")
axes.set(xlabel="blocks of the ranking", ylabel="resamples with this order [%]", ylim=(0, 103))
plt.show()

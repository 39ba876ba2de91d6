"""
Has the ranking converged?
==========================

The blocks of a ranking double until the order of the first three places is stable. The model here is a plain
function, the offset of two pins in two bores, so that it takes seconds.

**Read off it:** the share of resamples with the same order. Above the dashed line, the probability that was asked
for, the order may be trusted, and the ranking stops.
"""

import matplotlib.pyplot as plt
import numpy as np

import tolalloc as ta


def offset(left_pin, right_pin, left_bore, right_bore):
    along = left_pin - 1.3 * left_bore + 3.0
    across = 0.8 * right_pin - 0.55 * right_bore - 2.5
    return 1000 * np.hypot(along, across)  # sizes in mm, offset in µm


names = ("left pin", "right pin", "left bore", "right bore")
zone = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 1}
study = ta.Study(
    ta.model(offset, inputs=names, outputs=("offset [µm]",)),
    ta.Drawing.of_rows([{"id": name, "nominal": 10.0, **zone} for name in names]),
    limits={"offset [µm]": ta.Limit(upper=40.0)},
    seed=1,
)
blocks = ta.SobolEffort(start=16, limit=1024)
effort = ta.Effort(ranking=ta.RankingEffort(units=2000, sobol=blocks), is_quick=True)
steps = study.rank(effort=effort).to_frame("convergence")
print(steps.to_string(index=False))
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.plot(steps["blocks [-]"], steps["share of the resamples with this order [%]"], "o-", color="#1f4e79")
axes.set_xscale("log", base=2)
axes.axhline(100 * blocks.probability, color="#b00020", linestyle="--")
axes.set(xlabel="blocks of the ranking", ylabel="resamples with this order [%]", ylim=(0, 103))
plt.show()

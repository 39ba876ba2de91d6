"""
Clearance at tip and root
=========================

The smallest gap between a tooth's tip or root and the housing, in random reducers made to a drawing.

**Read off it:** how far the smallest of them are from zero, where teeth would press although they should be free.
"""

import matplotlib.pyplot as plt
import numpy as np

import tolalloc as ta
from tolalloc.study.prepared import Prepared

study = ta.Study(
    ta.reducer("rv20e"),
    ta.drawing("rv20e_drawing"),
    limits={ta.RADIAL_CLEARANCE: ta.Limit(lower=0.0)},
    questions=[ta.Ranking()],
)
prepared = Prepared(study=study)
errors = prepared.errors
uniform = np.random.default_rng(1).random((2000, len(errors.columns)))
units = errors.deviations(errors.standard_values(uniform), errors.zones)
clearance = prepared.model.reading((ta.RADIAL_CLEARANCE,))(units).values[:, 0]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.hist(clearance, bins=50, color="#1f4e79")
axes.axvline(0.0, color="#b00020", linestyle="--", label="teeth touch")
axes.set(xlabel=ta.RADIAL_CLEARANCE, ylabel="simulated reducers")
axes.legend()
plt.show()
print(f"{clearance.size} reducers, smallest clearance {clearance.min():.2f} µm, mean {clearance.mean():.2f} µm")

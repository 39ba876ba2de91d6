"""
Measured profile of a disc
==========================

Points of a gear measuring machine around one tooth space: how far they stand out of the theoretical profile, the
smoothing spline that the model takes, and the profile of the drawing.

**Read off it:** on which flank the disc is thick, and how little of the noise is left.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

from tolalloc.reducers.cycloid.clearance import removed
from tolalloc.reducers.cycloid.measured_profile import MeasuredProfile
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, profile_points
from tolalloc.reducers.reducer.files import load_reducer

drawn = ToothProfile.of(load_reducer("rv20e"))
place = profile_points(drawn, 200).place
place += (0.004, 0.002) * np.array([1e-3]) + 1e-6 * np.random.default_rng(1).standard_normal(place.shape)
path = Path(mkdtemp()) / "disc1.csv"
np.savetxt(path, place * 1e3, delimiter=",", header="x [mm],y [mm]", comments="", fmt="%.6f")

figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
angle = np.linspace(-np.pi, np.pi, 721)
for spans, style in ((0, {"color": "#9bb7d4", "linewidth": 0.8}), (40, {"color": "#1f4e79"})):
    form, _ = MeasuredProfile(path=path, spans=spans).form(drawn, 1)
    stands_out = form.at(angle) - removed(drawn, np.abs(angle))
    axes.plot(np.degrees(angle), 1e6 * stands_out, label=f"{spans} spans" if spans else "through all points", **style)
axes.plot(np.degrees(angle), -1e6 * removed(drawn, np.abs(angle)), color="#b00020", linestyle="--", label="drawing")
axes.set(xlabel="φ: 0° in the root, ±180° at the tips [deg]", ylabel="outward of the theoretical profile [µm]")
axes.legend()
plt.show()

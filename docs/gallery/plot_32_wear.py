"""
Wear of an RV-20E over hours
============================

Depth that wear takes off the flanks along a tooth space, and what it makes of lost motion and peak-to-peak of 64
simulated reducers, at 167 N·m and 15 rpm. Archard's coefficient is assumed: the hours may be ten times as many.

**Read off it:** where along the tooth the wear lies, and which output it moves first.
"""

import matplotlib.pyplot as plt
import numpy as np

import tolalloc as ta
from tolalloc.reducers.equivalent.wear import wear_of

hours = (1000.0, 3000.0, 6000.0)
work = ta.LoadCase("work", torque=-167.0, speed=15.0)
cases = [ta.LoadCase(f"{own:.0f} h", hours=own) for own in hours]
drawing = ta.drawing("rv20e_drawing")
errors = drawing.errors
model = ta.reducer("rv20e", neglected=("disc*.tilt",), load_cases=(work, *cases)).bound(errors, "gallery")
uniform = next(ta.SeedTree(1).uniform_chunks(64, len(errors.columns)))
units = errors.deviations(errors.standard_values(uniform), errors.zones)

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
for own in hours:
    worn = wear_of(model.reducer, (work,), own)
    order = np.argsort(np.remainder(worn.angle, 2 * np.pi))
    left.plot(np.degrees(worn.angle[order]), 1e6 * worn.depth[order], label=f"{own:,.0f} h")
left.set(xlabel="angle of the pin that grinds the point [°]", ylabel="depth off the flank [µm]", xlim=(0, 360))
left.legend()
for output, unit in ((ta.LOST_MOTION, "lost motion"), (ta.PEAK_TO_PEAK, "peak-to-peak")):
    means = model.reading((output, *(ta.at(output, case) for case in cases)))(units).values.mean(axis=0)
    right.plot((0.0, *hours), 100 * means / means[0], marker="o", label=unit)
right.set(xlabel="hours", ylabel="mean over that of new reducers [%]")
right.legend()
plt.show()

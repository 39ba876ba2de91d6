"""
Lives of an RV-20E's bearings over the torque
=============================================

Basic rating life of each kind of bearing and of all together at 15 rpm of the output, by ISO 281 from the preset's
dimensions, beside the makers' formula. The dimensions of the preset are assumed.

**Read off it:** which bearing decides at which torque, and how steeply life falls with the load.
"""

import matplotlib.pyplot as plt
import numpy as np

import tolalloc as ta
from tolalloc.wings.motion.duty import duty_of

reducer = ta.reducer("rv20e").reducer
torques = np.geomspace(20, 400, 12)
found = [duty_of(reducer, [ta.LoadCase("one", torque=-torque, speed=15.0)], 0.0) for torque in torques]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
for kind in range(2):
    label = found[0].bearings[kind].kind.replace("_", " ")
    axes.loglog(torques, [own.bearings[kind].life for own in found], label=label)
axes.loglog(torques, [own.life for own in found], label="all bearings together", color="black")
axes.loglog(torques, [own.catalogue_life for own in found], "--", label="makers' formula", color="grey")
axes.axvline(reducer.load.rated_torque, color="lightgrey")
axes.text(reducer.load.rated_torque, 1e7, " rated", va="top")
axes.set(xlabel="torque on the carrier [N·m]", ylabel="life L10 [h]")
axes.legend()
plt.show()

"""
Stiffness over the load
=======================

The torsional stiffness of an RV-20E with exact parts at several torques. Under more load more pins carry, and a rolling
bearing stiffens.

**Read off it:** one number for the stiffness holds for one torque only.
"""

from itertools import pairwise

import matplotlib.pyplot as plt

import tolalloc as ta

torques, twists = [8, 25, 50, 84, 125, 167], []
for torque in torques:  # rated torque is 167 N·m
    table = ta.te(reducer="rv20e", torque=-torque).to_frame("one turn").set_index("quantity")["value"]
    twists.append(-float(table["mean transmission error [arcsec]"]) / 60)

middle = [(one + two) / 2 for one, two in pairwise(torques)]
stiffness = [
    (two - one) / (far - near) for (one, two), (near, far) in zip(pairwise(torques), pairwise(twists), strict=True)
]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.plot(middle, stiffness, "o-", color="#1f4e79")
axes.set(xlabel="torque [N·m]", ylabel="torsional stiffness [N·m/arcmin]", ylim=(0, None))
plt.show()

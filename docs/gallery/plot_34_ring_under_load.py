"""
A ring that gives
=================

Peak-to-peak of exact RV-160E parts over the torque, on a rigid ring of pins and on one that tilts more easily along one
direction of the housing than across it.

**Read off it:** the rigid one stays below half an arcsecond; the other grows with the torque, and no tolerance takes
it away.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

import tolalloc as ta
from tolalloc.reducers.reducer.files import PRESETS

HOUSING = """
[housing]
direction_deg = -14
tilt_along_nm_per_arcmin = 150
tilt_across_nm_per_arcmin = 1500
turn_per_tilt_across = 0.18
"""
torques = [50, 400, 800, 1200, 1568]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
with TemporaryDirectory() as folder:
    soft = Path(folder) / "soft.reducer.toml"
    soft.write_text((PRESETS / "rv160e.reducer.toml").read_text(encoding="utf-8") + HOUSING, encoding="utf-8")
    for label, reducer in (("rigid ring", "rv160e"), ("ring that tilts", str(soft))):
        spans = []
        for torque in torques:
            table = ta.te(reducer=reducer, torque=-torque).to_frame("one turn").set_index("quantity")["value"]
            spans.append(float(table["peak-to-peak over one output turn [arcsec]"]))
        axes.plot(torques, spans, "o-", label=label)
axes.set(xlabel="torque [N·m]", ylabel="peak-to-peak of exact parts [arcsec]", ylim=(0, None))
axes.legend()
plt.show()

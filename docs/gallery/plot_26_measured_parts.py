"""
Measured parts and the zone
===========================

Deviations of pins from the measuring machine, beside the normal distribution that the zone alone would assume.

**Read off it:** whether the process is centred, and whether it fills its zone.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
pins = pd.read_csv(folder / "pin_diameters.csv", comment="#").iloc[:, 0].to_numpy()
rows = ta.drawing(folder / "zones.csv").to_frame().set_index("id")
zone = rows.loc["pin.diameter", "plus [unit]"] - rows.loc["pin.diameter", "minus [unit]"]  # µm, the full width
sigma, along = zone / 6, np.linspace(-zone, zone, 200)
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.hist(pins, bins=15, density=True, color="#9bb7d4", label=f"{pins.size} measured pins")
axes.plot(along, np.exp(-0.5 * (along / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi)), color="#1f4e79", label="assumed")
for edge in (-zone / 2, zone / 2):
    axes.axvline(edge, color="#b00020", linestyle="--")
axes.set(xlabel="deviation of the diameter [µm]", ylabel="density [1/µm]")
axes.legend()
plt.show()

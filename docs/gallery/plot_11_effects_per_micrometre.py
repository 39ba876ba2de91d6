"""
Effect of one micrometre
========================

How much the peak-to-peak changes for one micrometre of each tolerance: sensitivity without the size of the zone. A
ranking weighs it with the zone.

**Read off it:** a long bar here with a short one in the ranking is a tolerance that is tight already.
"""

import matplotlib.pyplot as plt

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e_liu2020"),
    ta.drawing("rv20e_table4"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
table = study.rank(effort="quick").to_frame("dimensions")
effect = "rms change per µm in every place [arcsec/µm]"
table = table.sort_values(effect)
figure, axes = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
axes.barh(table["dimension"], table[effect], color="#1f4e79")
axes.set(xlabel="root-mean-square change of the peak-to-peak [arcsec/µm]", title="Effect of one micrometre")
plt.show()

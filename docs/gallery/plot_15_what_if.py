"""
What if one zone changes?
=========================

Four changes of the drawing, one at a time, each solved on the same random reducers as the drawing as it is, so that
small differences show.

**Read off it:** dearer is to the right, a larger error is up; what lies below and to the left is better and cheaper.
"""

import matplotlib.pyplot as plt

import tolalloc as ta

study = ta.Study(
    ta.reducer("rv20e"),
    ta.drawing("rv20e_drawing"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
changes = {
    "pins 3 µm": {"pin.diameter": 3.0},
    "disc pitch 6 µm": {"disc*.pitch": 6.0},
    "housing pitch 6 µm": {"housing.pitch": 6.0},
    "disc pitch 10 µm": {"disc*.pitch": 10.0},
}
figure, axes = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
for name, zones in changes.items():
    rows = ta.whatif(study, zones, units=512).to_frame("changes").set_index("what")
    cost = rows.loc["cost", "change [unit]"]
    _, _, _, change, low, high = rows.loc["99.73 % of peak-to-peak"]
    axes.errorbar(cost, change, [[change - low], [high - change]], fmt="o", capsize=4, label=name)
axes.axhline(0, color="grey", linewidth=0.8)
axes.axvline(0, color="grey", linewidth=0.8)
axes.set(xlabel="change of cost [cost units]", ylabel="change of the 99.73 % quantile [arcsec]")
axes.legend()
plt.show()

"""
Which error makes which order
=============================

The strongest orders of one measured reducer, divided among the errors of its parts. The shares of an order add up to
its amplitude; a bar to the left works against the others.

**Read off it:** which part to measure again if one order of the bench curve is too large.
"""

import matplotlib.pyplot as plt

import tolalloc as ta

turn = ta.te(reducer="rv20e_liu2020", unit="table4", attributed=True)
table = turn.to_frame("attribution")
parts = table[~table["source"].str.startswith("modification")].head(8).iloc[::-1]
orders = [name for name in table.columns if name.startswith("order")][:3]
colours = ("#1f4e79", "#d9822b", "#3a8f5c")
figure, axes = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
for number, order in enumerate(orders):
    places = [row + 0.27 * (1 - number) for row in range(len(parts))]
    axes.barh(places, parts[order], 0.25, color=colours[number], label=order.split(" [")[0])
axes.set_yticks(range(len(parts)), parts["source"])
axes.set(
    xlabel="share of the amplitude [arcsec]", title="Errors of the parts; the modification of the teeth is left out"
)
axes.legend()
plt.show()

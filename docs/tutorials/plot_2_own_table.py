"""
An Excel workbook with your office's headings
=============================================

An office's table of tolerances has a title, its own headings, columns of its own and one row for six like bores. This
page writes such a workbook, has it read as it is, and asks what a change of one row does.
"""

# %%
# **The workbook.** Nobody renamed anything: a title above the headings, deviations in mm, a fit, prices in EUR, a
# column for the gauge.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import pandas as pd
from openpyxl import Workbook

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", like="rv40e", cranks=3)
heads = ["Drawing no.", "Characteristic", "Type", "Nominal", "Upper", "Lower", "Unit", "Cpk", "Tightest", "Loosest"]
heads += ["Price (EUR)", "Gauge"]
characteristics = [
    ("22-11", "eccentricity of journals", "position", None, 0.004, 0, "mm", 1.33, 0.001, 0.010, 6.5, "CMM"),
    ("22-12", "bearing bores of discs", "position", None, 0.005, 0, "mm", 1.33, 0.001, 0.010, 5.0, "CMM"),
    ("22-12", "disc pitch Fp", "pitch", None, 0.009, 0, "mm", 1.0, 0.003, 0.040, 45.0, "gear tester"),
    ("22-12", "disc run-out Fr", "runout", None, 0.008, 0, "mm", 1.0, 0.003, 0.040, 30.0, "gear tester"),
    ("22-13", "bearing seats", "position", None, 0.010, 0, "mm", 1.0, 0.001, 0.015, 4.0, "CMM"),
    ("22-10", "offset of carrier", "position", None, 0.012, 0, "mm", 1.0, 0.002, 0.025, 7.5, None),
    ("22-14", "housing pitch Fp", "pitch", None, 0.010, 0, "mm", 1.0, 0.003, 0.040, 55.0, "gear tester"),
    ("22-14", "housing run-out Fr", "runout", None, 0.008, 0, "mm", 1.0, 0.003, 0.040, 45.0, "gear tester"),
    ("22-14", "groove radius", "size", 3, "± 0.0015", None, "mm", 1.0, 0.0005, 0.005, 8.0, None),
    ("22-15", "pin diameter", "size", 6, "h5", None, "mm", 1.33, 0.001, 0.009, 10.0, "comparator"),
]


def write(path, heads, rows):
    """Write a workbook with a title above its headings."""
    book = Workbook()
    for row in (["Tolerances of the RV-40X, rev. C"], [], heads, *rows):
        book.active.append(list(row))
    book.save(path)
    return path


table = write(folder / "tolerances.xlsx", heads, characteristics)

# %%
# **What does it mean?** Read as it is, the table is refused, and the refusal ends with a line to paste, as far as it
# knows the words of offices.


def refusal(path):
    """Return why a table is refused."""
    try:
        ta.drawing(path)
    except ta.TolallocError as refused:
        return str(refused).replace(str(folder), "mine")


print(refusal(table))

# %%
# Put that line into ``tolerances.toml`` beside the workbook, and correct it where it guessed wrong:

line = refusal(table).rpartition("beside it: ")[2]
(folder / "tolerances.toml").write_text(line, encoding="utf-8")
print(refusal(table))

# %%
# **Which error of the reducer is which row?** Three more columns say it. ``source`` is the name of the error; a row for
# several like places gives their number in ``places`` and the name without its numbers. Pitch and run-out need the
# shares of their waves, which ``zones.csv`` of the new folder has. All :doc:`columns </reference/columns>` have a page.

made = pd.read_csv(folder / "zones.csv", comment="#").set_index("id")["spectrum [order:amplitude]"]
meant = [
    ("crank.journal.eccentricity", 6, None),
    ("disc.bore.position", 6, None),
    ("disc.pitch", 2, made["disc1.pitch"]),
    ("disc.runout", 2, made["disc1.runout"]),
    ("carrier.bore.position", 3, None),
    ("carrier.assembly", None, None),
    ("housing.pitch", None, made["housing.pitch"]),
    ("housing.runout", None, made["housing.runout"]),
    ("housing.groove.radius", None, None),
    ("pin.diameter", None, None),
]
both = [(*row, *added) for row, added in zip(characteristics, meant, strict=True)]
drawing = ta.drawing(write(table, [*heads, "source", "places", "spectrum"], both))
frame = drawing.to_frame()
print(frame[["Characteristic", "source", "places [-]", "Upper [unit]"]].to_string(index=False))

# %%
# **Is it understood?** ``neglected=["*"]`` says that what the table leaves out is taken as exact; ``check`` lists it.

study = ta.Study(
    ta.reducer(folder / "reducer.toml", neglected=["*"]),
    drawing,
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)},
    seed=1,
)
print(*ta.check(study).sentences[:8], sep="\n")

# %%
# **What does each row cost?**

dear = frame.sort_values("Price [EUR]")
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.barh(dear["Characteristic"], dear["Price [EUR]"], color="#1f4e79")
axes.set(xlabel="price at today's zone [EUR]")
plt.show()

# %%
# **What if one row changes?** Say it in your own words, in µm. Both drawings are solved with the same random reducers,
# so that a small difference shows.

changed = ta.whatif(study, {"disc pitch Fp": 5.0}, units=512)
print(*changed.sentences, sep="\n")

# %%
# ``tolalloc run`` of such a study writes ``tolerances_allocated.xlsx`` beside its report: your workbook with the new
# zones, changed cells in yellow.

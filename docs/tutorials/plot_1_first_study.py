"""
A first study of your own
=========================

From a reducer like yours, with three zones of your own, to the answer: which tolerance matters, and what the cheapest
drawing is that keeps the limits. :doc:`Your first study </first-study>` does the same in the shell.
"""

# %%
# ``ta.new`` makes a folder that runs at once: a reducer like the size that you name, its tolerance table, a study.
# Every zone and cost in it is assumed, so write your own. Three cells are changed here as a person does it in Excel.

from pathlib import Path
from tempfile import mkdtemp

from openpyxl import load_workbook

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", like="rv20e")
book = load_workbook(folder / "zones.xlsx")
sheet = book.active
columns = {cell.value: cell.column for cell in sheet[1]}
rows = {sheet.cell(row=row, column=columns["id"]).value: row for row in range(2, sheet.max_row + 1)}
own = {"disc1.pitch": 9.0, "disc2.pitch": 9.0, "housing.pitch": 11.0}
for name, zone in own.items():
    sheet.cell(row=rows[name], column=columns["plus [unit]"]).value = zone
book.save(folder / "zones.xlsx")

# %%
# A study has a reducer, a drawing, limits and questions. The two pairs say between which clearances [µm] the tooth
# modification may be chosen, on the flank and at tip and root.

study = ta.Study(
    ta.reducer(folder / "reducer.toml", flank_clearance=(1.0, 8.0), radial_clearance=(3.0, 30.0)),
    ta.drawing(folder / "zones.xlsx"),
    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0), ta.LOST_MOTION: ta.Limit(upper=1.0)},
    questions=[ta.Ranking(), ta.Allocation(fixed_first=False, front=False, what_if=False)],
    seed=1,
)
print(*ta.check(study).sentences[:5], sep="\n")

# %%
# **Which tolerance drives the error?** ``effort="quick"`` is enough for a first look: every number is real, every
# interval wide.

ranking = study.rank(effort="quick")
print(*ranking.sentences[:3], sep="\n")
ranking.plot("ranking")

# %%
# **How many reducers lie beyond the limit today?** The distribution of the lost motion of random reducers made to this
# drawing:

ranking.plot("lost_motion")

# %%
# **Which zones are cheapest?** The allocation chooses zones and tooth modification together, and checks the drawing
# that it found on random reducers that it has not seen before.

found = study.allocate(effort=ta.Effort(seconds=20))
print(*found.sentences[:5], sep="\n")
found.plot("zones")

# %%
# **What goes on the drawing?** The zones as a table; ``found.result.drawing.to_csv("new.csv")`` writes the same
# in the layout of the tolerance table.

shown = ["source", "zone before [µm]", "zone [µm]", "change [%]"]
table = found.to_frame("drawing")[shown]
print(table[table["change [%]"] != 0].to_string(index=False, float_format="%.1f"))

# %%
# Before you set a drawing, leave the efforts out: a full run takes minutes and narrows every interval.
# ``study.run("runs/mine")`` asks every question and writes one folder with the report.

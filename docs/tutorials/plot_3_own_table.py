"""
An Excel table of your own
==========================

The tolerance table may be an Excel file with a row for each tolerance. This page writes one as an office would, reads
it, and asks what a change of one row does.
"""

# %%
# The table has the heads that :doc:`the first study </first-study>` explains. Here it is the shipped one of an RV-20E,
# with a title above the heads, as office tables have.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
from openpyxl import Workbook, load_workbook

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", like="rv20e")
table = folder / "zones.xlsx"
sheet = load_workbook(table).active
rows = [list(row) for row in sheet.iter_rows(values_only=True)]
office = Workbook()
office.active.append(["Tolerances of the RV-20E, second issue"])
office.active.append([])
for row in rows:
    office.active.append(row)
office.save(folder / "office.xlsx")

drawing = ta.drawing(folder / "office.xlsx")
shown = ["id", "plus [unit]", "minus [unit]", "unit", "cost [cost units]"]
frame = drawing.to_frame()
print(frame[[head for head in shown if head in frame]].head(6).to_string(index=False))

# %%
# **What is read of it?** ``check`` says how many tolerances vary, and what each row was taken for.

study = ta.Study(ta.reducer("rv20e"), drawing, limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}, seed=1)
print(*ta.check(study).sentences[:5], sep="\n")

# %%
# **What does each tolerance cost?** The column of costs, the dearest rows first:

dear = frame.nlargest(10, "cost [cost units]").iloc[::-1]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.barh(dear["id"], dear["cost [cost units]"], color="#1f4e79")
axes.set(xlabel="cost at today's zone [cost units]")
plt.show()

# %%
# **What if one row changes?** Both tables are solved with the same random reducers, so that a small difference shows.

changed = ta.whatif(study, {"disc*.pitch": 5.0}, units=512)
print(*changed.sentences, sep="\n")
rows = changed.to_frame("changes").set_index("what")
_, before, after, *_ = rows.loc["99.73 % of peak-to-peak"]
figure, axes = plt.subplots(figsize=(6, 3.2), constrained_layout=True)
axes.barh(["table as it is", "disc pitch 5 µm"], [before, after], color=["#7f7f7f", "#1f4e79"])
axes.axvline(60, color="#b00020", linestyle="--", label="limit")
axes.set(xlabel="99.73 % of reducers lie below [arcsec]")
axes.legend()
plt.show()

# %%
# A cell that cannot be read is refused with file, row, field and value:

broken = load_workbook(table)
heads = [cell.value for cell in broken.active[1]]
broken.active.cell(
    row=2, column=1 + next(i for i, head in enumerate(heads) if str(head).startswith("plus"))
).value = "abc"
broken.save(folder / "broken.xlsx")
try:
    ta.drawing(folder / "broken.xlsx")
except ta.TolallocError as refused:
    print(str(refused).replace(str(folder), "mine"))

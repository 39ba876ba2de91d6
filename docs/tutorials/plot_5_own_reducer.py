"""
A reducer of your own
=====================

Sizes, bearings and tooth modification of a reducer stand in one TOML file. This page makes one, looks at it, and
changes a number in it.
"""

# %%
# ``ta.new`` writes a folder that runs at once: a reducer like the preset that you name, its tolerance table, a study.
# On the command line it is ``tolalloc new mine --like rv40e --cranks 3``.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", like="rv40e", cranks=3)
print(*sorted(path.name for path in folder.iterdir()), sep=", ")

# %%
# The file says every size by name, its unit at the end of the name. What nobody measured stands under ``assumptions``.

text = (folder / "reducer.toml").read_text(encoding="utf-8")
lines = [line for line in text.splitlines() if line and not line.startswith("#")]
print(*[line[:110] for line in lines[:24]], sep="\n")

# %%
# **What do exact parts of it do?** Without any part error, at rest and under rated torque. The sentences hold stiffness
# and lost motion against the catalogue's.

exact = ta.te(reducer=str(folder / "reducer.toml"))
print(*exact.sentences, sep="\n")
exact.plot("hysteresis")

# %%
# **Which part yields how much?** The shares of the twist under rated torque:

shares = exact.to_frame("twist").iloc[::-1]
figure, axes = plt.subplots(figsize=(8, 4), constrained_layout=True)
axes.barh(shares["part"], shares["share of the twist [%]"], color="#1f4e79")
axes.set(xlabel="share of the twist [%]")
plt.show()

# %%
# **What does the tooth modification leave?** Gaps along the tooth, and the pins that carry.

teeth = ta.contact(reducer=str(folder / "reducer.toml"))
print(teeth.sentences[0])
teeth.plot("clearance")

# %%
# **Change a number.** Ask for other clearances; the answer names the amounts to write into the file.

chosen = ta.modify(flank=2.0, radial=10.0, reducer=str(folder / "reducer.toml"))
print(*chosen.sentences[:3], sep="\n")

# %%
# A field that is not known is refused by name, with the nearest known one:

wrong = folder / "wrong.toml"
wrong.write_text(text.replace("crank_count", "crank_number"), encoding="utf-8")
try:
    ta.te(reducer=str(wrong))
except ta.TolallocError as refused:
    print(str(refused).replace(str(folder), "mine"))

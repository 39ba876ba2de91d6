"""
A bad unit
==========

One reducer came out bad. Its transmission error over one turn was read on the bench; the parts are inside. Which part
should be measured first?
"""

# %%
# The curve is a table of two columns. This one is simulated: a unit whose pitch of the pin housing is bad. Every
# twelfth reading is enough for this page.

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
lines = (folder / "unit7.csv").read_text(encoding="utf-8").splitlines()
curve = folder / "unit7_short.csv"
curve.write_text("\n".join(lines[:2] + lines[2::12]) + "\n", encoding="utf-8")
print(*lines[:5], sep="\n")

# %%
# ``diagnose`` looks for the errors of the parts that explain the curve, with the drawing as what is known beforehand.

drawn = {"reducer": str(folder / "reducer.toml"), "tolerances": str(folder / "zones.csv")}
answer = ta.diagnose(curve, **drawn)
print(*answer.sentences, sep="\n")

# %%
# **Does the explanation fit?** The curve that was read, and that of the errors that were found:

answer.plot("curve")

# %%
# **Which part is it?** The probability that each source is the one that drives the peak-to-peak of this unit:

answer.plot("dominant")

# %%
# **What would a gauge show?** For each source, with a 95 % interval. Where the interval is as wide as the zone, the
# curve says nothing of that part.

table = answer.to_frame("sources").drop(columns=["named"])
print(table.iloc[:6, :5].to_string(index=False, float_format="%.1f"))

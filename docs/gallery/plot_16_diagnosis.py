"""
The bench curve of a bad reducer
================================

A reducer with one bad part, its curve as a test bench would read it, and the curve of the errors that explain it
best, joined at the angles that were read.

**Read off it:** the two agree to the noise of the bench, so the errors that were found may be trusted. The tutorial
on a bad unit says which part it is.
"""

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
lines = (folder / "unit7.csv").read_text(encoding="utf-8").splitlines()
curve = folder / "unit7_short.csv"
curve.write_text("\n".join(lines[:2] + lines[2::12]) + "\n", encoding="utf-8")
drawn = {"reducer": str(folder / "reducer.toml"), "tolerances": str(folder / "zones.csv")}
answer = ta.diagnose(curve, **drawn)
print(answer.sentences[0])
answer.plot("curve")

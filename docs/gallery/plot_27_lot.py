"""
A lot against its drawing
=========================

Gauge readings of 25 simulated units whose pins are all too thick: how far the mean of every zone lies from the one that
the drawing's process makes, in standard errors, with 95 % intervals.

**Read off it:** a bar beyond a control limit is a process to look at; the answer says which of them moved, at a stated
rate of false alarms over all zones together.
"""

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
answer = ta.lot(folder / "lot.csv", folder / "zones.csv")
answer.plot("shift")

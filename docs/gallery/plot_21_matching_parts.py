"""
Which part goes where
=====================

Two reducers are to be built from measured parts in stock. The list with the smallest peak-to-peak is compared with
random mountings of the same parts.

**Read off it:** how much choosing is worth against taking parts as they come.
"""

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
best = ta.mount(folder / "parts.csv", reducer="rv20e")
print(best.sentences[0])
best.plot("chance")

"""
What a zone costs in a shop
===========================

Prices that a shop quoted for one feature at several zones, and the cost models that may stand for them. The prices are
invented.

**Read off it:** between which zones the models agree; beyond the outermost price they do not.
"""

from pathlib import Path
from tempfile import mkdtemp

import tolalloc as ta

folder = ta.new(Path(mkdtemp()) / "mine", samples="all")
ta.costs(folder / "shop.csv").plot("costs")

"""A lot of parts was measured: which process moved, and whether the parts keep the zones of the drawing.

tolalloc run studies/rv20e_lot.py

The readings in `rv20e_lot.csv` are simulated, with pins that are too thick. `tolalloc lot LOT.csv ZONES.csv` asks the
same with files of your own. The run folder holds the drawing of the lot, which `ta.drawing` reads.
"""

from dataclasses import dataclass
from pathlib import Path

import tolalloc as ta

READINGS = Path(__file__).with_name("rv20e_lot.csv")


@dataclass(frozen=True, kw_only=True)
class Lot(ta.Question):
    """What moved, capabilities and control limits."""

    kind = "lot"
    reads = frozenset()

    def answer(self, *_):
        """Return the answer that the command gives."""
        return ta.lot(READINGS, "rv20e_drawing")


study = ta.Study(questions=[Lot()], name="rv20e_lot")

if __name__ == "__main__":
    ta.run_script()

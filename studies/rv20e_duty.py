"""How long the bearings of an RV-20E live at the joint of a robot, and which load case uses them up.

tolalloc run studies/rv20e_duty.py

The load cases in `rv20e_joint.cycle.csv` and the dimensions of the preset's bearings are assumed: these lives compare
load cases and promise nothing. `tolalloc duty CYCLE.csv --reducer REDUCER.toml` asks the same with files of your own.
"""

from dataclasses import dataclass
from pathlib import Path

import tolalloc as ta

CYCLE = Path(__file__).with_name("rv20e_joint.cycle.csv")


@dataclass(frozen=True, kw_only=True)
class Duty(ta.Question):
    """Lives, pressures, losses and the temperature of the discs over the duty cycle."""

    kind = "duty"
    reads = frozenset()

    def answer(self, *_):
        """Return the answer that the command gives."""
        return ta.duty(CYCLE, reducer="rv20e")


study = ta.Study(questions=[Duty()], name="rv20e_duty")

if __name__ == "__main__":
    ta.run_script()

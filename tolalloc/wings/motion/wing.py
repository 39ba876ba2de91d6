"""What the motion wing brings."""

from __future__ import annotations

from tolalloc.study.wing import Wing
from tolalloc.wings.motion.ask.duty import Duty
from tolalloc.wings.motion.ask.simulate import Simulate

MOTION = Wing(questions=(Duty, Simulate))

"""Requirements: an output, its limits, and what must be shown of them."""

from __future__ import annotations

from dataclasses import dataclass

from tolalloc.allocation.guarantee import Guarantee
from tolalloc.allocation.local_model import Side
from tolalloc.allocation.trial import OutputTrial
from tolalloc.capability.indices import Limits


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """Limits of an output and what must be shown of them."""

    output: str  # Name of the output with its unit
    limits: Limits  # One or two limits [unit of the output]
    guarantee: Guarantee  # What must be shown

    @property
    def sentence(self) -> str:
        """The requirement in words."""
        ends = {"at least": self.limits.lower, "at most": self.limits.upper}
        said = " and ".join(f"{word} {end:g}" for word, end in ends.items() if end is not None)
        return f"{self.output}: {said}, shown for {self.guarantee.words}"

    def check(self, trial: OutputTrial) -> Check:
        """Return how a design stands against the requirement."""
        return Check(requirement=self, sides=self.guarantee.judge(trial, self.limits))


@dataclass(frozen=True, kw_only=True)
class Check:
    """How a verified design stands against one requirement."""

    requirement: Requirement  # The requirement
    sides: tuple[Side, ...]  # Its limited sides, the upper one first

    @property
    def met(self) -> bool:
        """Whether the guarantee is shown."""
        return all(side.excess <= 0 for side in self.sides)

    @property
    def tightest(self) -> Side:
        """The side with the largest relative excess."""
        return max(self.sides, key=lambda side: side.relative_excess)

    @property
    def slack(self) -> float:
        """What is left to the nearer limit, negative beyond it [unit of the output]."""
        return -max(side.excess for side in self.sides)

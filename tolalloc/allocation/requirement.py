"""Requirements: an output, its limits, and what must be shown of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.guarantee import AtYield, Guarantee
from tolalloc.allocation.local_model import Side
from tolalloc.allocation.trial import FreshUnits, OutputTrial
from tolalloc.capability.indices import Limits

JOINT = "largest excess over all limits [-]"
"""What a yield of all limits together judges: the excess over a limit, relative to it, below zero in a good unit."""


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

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs of the model that it reads."""
        return (self.output,)

    def read(self, values: Mapping[str, Float[np.ndarray, " unit"]]) -> Float[np.ndarray, " unit"]:
        """Return what is limited, of the units whose outputs are given, NaN where a unit has none."""
        return values[self.output]

    def trial(self, units: FreshUnits, confidence: float) -> OutputTrial:
        """Return what units say of it."""
        return OutputTrial(units=units, output=self.output, confidence=confidence)

    def check(self, trial: OutputTrial) -> Check:
        """Return how a design stands against the requirement."""
        return Check(requirement=self, sides=self.guarantee.judge(trial, self.limits))


@dataclass(frozen=True, kw_only=True)
class JointRequirement(Requirement):
    """The limits of several requirements, which so many units keep all at once.

    Notes
    -----
    What is limited is the largest excess of a unit over any limit, relative to the limit, which is at most zero in a
    good unit. Its derivative is that of the limit that is exceeded most.
    """

    requirements: tuple[Requirement, ...]  # Whose limits must be kept at once

    @classmethod
    def of(cls, requirements: tuple[Requirement, ...], shown: AtYield) -> JointRequirement:
        """Return the requirement that a share of the units keeps the limits of all others."""
        return cls(output=JOINT, limits=Limits(upper=0.0), guarantee=shown, requirements=requirements)

    @property
    def sentence(self) -> str:
        """The requirement in words."""
        return f"all limits at once, shown for {self.guarantee.words}"

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs of the model that it reads."""
        return tuple(own.output for own in self.requirements)

    def read(self, values: Mapping[str, Float[np.ndarray, " unit"]]) -> Float[np.ndarray, " unit"]:
        """Return the largest excess of every unit [-]."""
        return np.asarray(self.excesses(values).max(axis=0))

    def excesses(self, values: Mapping[str, Float[np.ndarray, " unit"]]) -> Float[np.ndarray, "side unit"]:
        """Return how far every unit lies beyond every limit, relative to it [-]."""
        return np.array(
            [
                sign * (values[own.output] - limit) / (abs(limit) or 1.0)
                for own in self.requirements
                for sign, limit in own.limits.turned
            ]
        )

    def trial(self, units: FreshUnits, confidence: float) -> OutputTrial:
        """Return what units say of it."""
        return JointTrial(units=units, output=self.output, confidence=confidence, requirement=self)


@dataclass(frozen=True, kw_only=True)
class JointTrial(OutputTrial):
    """What fresh units of a design say of all limits at once."""

    requirement: JointRequirement  # The limits

    @cached_property
    def values(self) -> Float[np.ndarray, " good"]:
        """The largest excess of the units that have all outputs [-]."""
        found = self.requirement.read({own: self.units.values(own) for own in self.requirement.outputs})
        return np.asarray(found[np.isfinite(found)])

    def derived(self) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return the largest excess of some units and its derivative by every variable [-]."""
        first = {own: self.units.of_first(own) for own in self.requirement.outputs}
        units = min(values.size for values, _ in first.values())
        excesses = self.requirement.excesses({own: values[:units] for own, (values, _) in first.items()})
        slopes = np.array(
            [
                sign * first[own.output][1][:units] / (abs(limit) or 1.0)
                for own in self.requirement.requirements
                for sign, limit in own.limits.turned
            ]
        )
        known = np.isfinite(excesses).all(axis=0) & np.isfinite(slopes).all(axis=(0, 2))
        nearest = excesses[:, known].argmax(axis=0)
        at = np.arange(nearest.size)
        return excesses[:, known][nearest, at], slopes[:, known][nearest, at]


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

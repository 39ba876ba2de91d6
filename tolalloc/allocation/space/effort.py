"""How much an allocation may compute."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields
from tolalloc.sensitivity.surrogate import validation

_FEWEST_ALLOCATING = {
    "": {
        "verification_units": 1,
        "confirmation_units": 1,
        "shared_units": 2,
        "graded_steps": 1,
        "exact_points": 2,
        "changed_costs": 1,
        "changed_stiffnesses": 1,
        "stiffness_units": 100,
    },
    "search.": {"steps": 1},
    "search.front.": {
        # Three objectives need four designs, and both fronts have the same effort.
        "population": 4,
        "generations": 1,
        "population_on_kernel": 4,
        "generations_on_kernel": 1,
        "designs": validation.FEWEST_OF_FOLD * validation.FOLDS,
        "rounds": 1,
        "points": 2,
    },
}
"""Smallest numbers with which an allocation has an answer in every stage [-]."""


def _require_enough(effort: object, prefix: str) -> None:
    """Raise unless the numbers of an effort are whole and no stage of an allocation would stop with them.

    Raises
    ------
    InputError
        A number that is too small or not whole.
    """
    for name, fewest in _FEWEST_ALLOCATING[prefix].items():
        value = getattr(effort, name)
        if not isinstance(value, int) or value < fewest:
            raise InputError.at(
                "study", f"effort.allocation.{prefix}{name}", value, f"a whole number, {fewest} or more"
            )


@dataclass(frozen=True, kw_only=True)
class FrontEffort(NamedFields):
    """How much the search for the front may spend.

    Parameters
    ----------
    population, generations
        Size of the search on the surrogate [-].
    population_on_kernel, generations_on_kernel
        The same where the surrogate does not earn its place and the kernel itself runs [-].
    designs
        Designs around the chosen one that the first surrogate learns from [-].
    rounds
        Searches, each followed by kernel runs along its front that improve the next surrogate [-].
    points
        Kernel runs along the front after each search [-].
    """

    called: ClassVar[str] = "effort of a front"

    population: int = 80
    generations: int = 100
    population_on_kernel: int = 20
    generations_on_kernel: int = 3
    designs: int = 36
    rounds: int = 2
    points: int = 12


@dataclass(frozen=True, kw_only=True)
class SearchEffort(NamedFields):
    """How much the search may spend.

    Parameters
    ----------
    steps
        Largest number of verified steps of each search [-].
    reach
        Factor by which a scale may change in the first step; later ones reach less [-].
    front
        Effort of the Pareto front.
    """

    called: ClassVar[str] = "effort of a search"

    steps: int = 8
    reach: float = 2.5
    front: FrontEffort = field(default_factory=FrontEffort)


@dataclass(frozen=True, kw_only=True)
class AllocationEffort(NamedFields):
    """How much an allocation may compute.

    Parameters
    ----------
    verification_units
        Fresh units per design of a search [-].
    confirmation_units
        Largest number of fresh units that are solved to confirm a design in the end; the more, the nearer it lies to
        its limits [-].
    shared_units
        Common random units of the quantile surrogate [-].
    search
        Effort of the searches.
    graded_steps
        Largest number of verified choices of grades [-].
    exact_points
        Limits of the exact front of the local models [-].
    setting_steps
        Values of each setting for which the cheapest zones are looked for, the first setting's first [-].
    changed_costs
        Random corners of the box in which every cost is wrong [-].
    changed_stiffnesses, stiffness_units
        Stiffnesses drawn from what is not known of them, and fresh units for each [-].
    share_blocks
        Blocks of the Sobol analysis at the zones of the drawing, a power of two [-].
    yields
        Yield targets among which the cheapest good unit is looked for [-].
    gain
        Relative gain of cost that a cheaper design must promise to be judged after a confirmed one [-].
    error
        Probability up to which an answer may be wrong that says a drawing keeps its limits; at one half, even odds,
        small samples aim at the limit itself instead of buying a margin [-].

    Raises
    ------
    InputError
        A number with which a stage would stop, often after long work of others.
    """

    called: ClassVar[str] = "effort of an allocation"

    verification_units: int = 6144
    confirmation_units: int = 32_768
    shared_units: int = 256
    search: SearchEffort = field(default_factory=SearchEffort)
    graded_steps: int = 8
    exact_points: int = 50
    setting_steps: tuple[int, ...] = (5, 6)
    changed_costs: int = 40
    changed_stiffnesses: int = 6
    stiffness_units: int = 2048
    share_blocks: int = 256
    yields: tuple[float, ...] = (0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.9973, 0.999)
    gain: float = 0.005
    error: float = 0.05

    @property
    def of_fast_model(self) -> AllocationEffort:
        """The effort for a model that answers for whole arrays, unless its numbers are the user's own.

        Quick or full, so many units then show a drawing kept with the usual error, at hardly any margin.
        """
        if self not in (AllocationEffort(), QUICK_ALLOCATION):
            return self
        return replace(
            self,
            verification_units=2**16,
            confirmation_units=2**20 if self == QUICK_ALLOCATION else 2**22,
            search=replace(self.search, steps=AllocationEffort().search.steps),
            gain=0.002,
            error=AllocationEffort().error,
        )

    def __post_init__(self) -> None:
        _require_enough(self, "")
        _require_enough(self.search, "search.")
        _require_enough(self.search.front, "search.front.")
        if not 1.0 < self.search.reach < np.inf:
            raise InputError.at("study", "effort.allocation.search.reach", self.search.reach, "a number above 1")
        if not all(isinstance(steps, int) and steps >= 1 for steps in self.setting_steps):
            raise InputError.at(
                "study", "effort.allocation.setting_steps", self.setting_steps, "whole numbers, 1 or more"
            )
        blocks = self.share_blocks
        if blocks < 2 or blocks & (blocks - 1):
            raise InputError.at("study", "effort.allocation.share_blocks", blocks, "a power of two, 2 or more")
        if not 0 < self.gain < 1:
            raise InputError.at("study", "effort.allocation.gain", self.gain, "a share above 0 up to below 1")
        if not 0 < self.error <= 0.5:
            raise InputError.at("study", "effort.allocation.error", self.error, "a share above 0 up to 0.5")
        if not self.yields or not all(0 < target < 1 for target in self.yields):
            raise InputError.at("study", "effort.allocation.yields", self.yields, "one share or more between 0 and 1")


QUICK_ALLOCATION = AllocationEffort(
    verification_units=2304,
    confirmation_units=4608,
    shared_units=48,
    search=SearchEffort(
        steps=2,
        front=FrontEffort(population=40, generations=40, population_on_kernel=8, designs=16, rounds=1, points=6),
    ),
    graded_steps=3,
    exact_points=20,
    setting_steps=(2, 3),
    changed_costs=10,
    changed_stiffnesses=2,
    stiffness_units=1152,
    share_blocks=32,
    yields=(0.7, 0.8, 0.9, 0.95, 0.99, 0.9973),
    gain=0.05,
    error=0.5,
)
"""Effort of a quick run: every stage is real, every interval wide."""

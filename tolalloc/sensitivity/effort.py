"""How much a ranking may compute."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import ceil
from typing import ClassVar

from tolalloc.capability.experiment import FEWEST_RUNS
from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields
from tolalloc.sensitivity.surrogate import validation

WORST_SHARE = 0.05
"""Share of the units, largest output first, that is looked at where too few are beyond the limit [-]."""
FEWEST_OUTSIDE = 50
"""Units needed on either side of the threshold [-]."""
FEWEST_TRAJECTORIES = 2
"""Trajectories without which the effects have no scatter [-]."""
FEWEST_UNITS_OF_CLASS = 10
"""Units of a class of PAWN, below which its distance to the whole sample is chance [-]."""
CLASSES = 10
"""Classes of equal size that PAWN divides each measure into, SALib's number [-]."""


def fewest_units() -> int:
    """Return the fewest units whose worst share is as many as are needed, whatever the limit [-]."""
    return ceil(FEWEST_OUTSIDE / WORST_SHARE)


_FEWEST = {
    "units": fewest_units(),
    "trajectories": FEWEST_TRAJECTORIES,
    "moment_units": FEWEST_UNITS_OF_CLASS * CLASSES,
    # A bootstrap resample of fewer could be one unit again and again, and would not vary.
    "derivative_units": 10,
    "inverse_units": 1,
    "surrogate_units": validation.FEWEST_OF_FOLD * validation.FOLDS,
    "level_units": 100,
    "level_runs": FEWEST_RUNS,
    "widened_units": 100,
    "permutations": 2,
}
"""Smallest numbers that the estimators take [-]."""
_CHAIN = 10
"""Units of a level or width come in chains of so many [-]."""


@dataclass(frozen=True, kw_only=True)
class SobolEffort(NamedFields):
    """How much a Sobol analysis may compute.

    Parameters
    ----------
    start
        First number of Saltelli blocks, a power of two [-].
    limit
        Largest number of them; as the first one for a fixed number [-].
    places
        First places whose order must be stable in the ranking over all outputs [-].
    probability
        Share of resamples that must have that order [-].
    resamples
        Bootstrap resamples [-].
    second_order
        Whether pairs of sources get an index, at nearly twice the samples.
    """

    called: ClassVar[str] = "effort of Sobol indices"

    start: int = 512
    limit: int = 65_536
    places: int = 3
    probability: float = 0.9
    resamples: int = 400
    second_order: bool = False

    def __post_init__(self) -> None:
        if self.start < 2 or self.start & (self.start - 1):
            raise InputError.at("Sobol indices", "first number of blocks", self.start, "a power of two, 2 or more")
        if self.places < 1:
            raise InputError.at("Sobol indices", "number of stable places", self.places, "1 or more")


@dataclass(frozen=True, kw_only=True)
class RankingEffort(NamedFields):
    """How much a ranking may compute.

    Parameters
    ----------
    units
        Random units behind yields, capabilities and what the units out of the limit share [-].
    design
        How these units are spread; yields have an interval for the Monte Carlo design alone.
    sobol
        Blocks of the Sobol analysis, and what stops their growth.
    trajectories
        Trajectories of Morris' elementary effects [-].
    moment_units
        Units behind PAWN and delta [-].
    derivative_units
        Units behind derivatives [-].
    inverse_units
        Units behind every trial zone; the yield target may ask for more [-].
    surrogate_units
        Units behind the surrogates [-].
    level_units
        Units of a level of the subset simulation, for limits that are rarely exceeded [-].
    level_runs
        Runs of it, and of the widened sampling that checks it [-].
    widened_units
        Units of a width of that sampling [-].
    permutations
        Permutations behind Shapley effects, where sources are correlated [-].

    Raises
    ------
    InputError
        A number with which an estimator would stop, often after long work of others.
    """

    called: ClassVar[str] = "effort of a ranking"

    units: int = 16_384
    design: SamplingDesign = SamplingDesign.MONTE_CARLO
    sobol: SobolEffort = field(default_factory=lambda: SobolEffort(start=256, limit=1024))
    trajectories: int = 32
    moment_units: int = 4096
    derivative_units: int = 1024
    inverse_units: int = 2048
    surrogate_units: int = 2048
    level_units: int = 4000
    level_runs: int = 5
    widened_units: int = 2000
    permutations: int = 1000

    def __post_init__(self) -> None:
        for field_name, fewest in _FEWEST.items():
            value = getattr(self, field_name)
            if type(value) is not int or value < fewest:
                raise self._refusal(field_name, value, f"{fewest} or more, a whole number")
        for field_name in ("level_units", "widened_units"):
            if getattr(self, field_name) % _CHAIN:
                raise self._refusal(field_name, getattr(self, field_name), f"a multiple of {_CHAIN}")
        sobol = self.sobol
        if sobol.limit < sobol.start:
            raise self._refusal("sobol.limit", sobol.limit, f"the first number of blocks, {sobol.start}, or more")
        if not 0.0 < sobol.probability < 1.0:
            raise self._refusal("sobol.probability", sobol.probability, "a number between 0 and 1")
        if sobol.resamples < 2:
            raise self._refusal("sobol.resamples", sobol.resamples, "2 or more")

    @staticmethod
    def _refusal(field_name: str, value: object, allowed: str) -> InputError:
        return InputError.at("study", f"effort.ranking.{field_name}", value, allowed)


QUICK_RANKING = RankingEffort(
    units=2048,
    sobol=SobolEffort(start=32, limit=64),
    trajectories=8,
    moment_units=512,
    derivative_units=128,
    inverse_units=400,
    surrogate_units=512,
    level_units=200,
    level_runs=3,
    widened_units=100,
    permutations=100,
)
"""Effort of a quick run: every measure is real, every interval wide."""

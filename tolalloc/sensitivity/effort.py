"""How much a ranking may compute."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import ceil
from typing import Annotated, ClassVar

from tolalloc.capability.experiment import FEWEST_RUNS
from tolalloc.drawings.seeds import SamplingDesign
from tolalloc.models.model import ARRAY_RATE
from tolalloc.reading.named_fields import NamedFields, Rule, a, flag, number, whole
from tolalloc.sensitivity.surrogate import validation

WORST_SHARE = 0.05
"""Share of the units, largest output first, that is looked at where too few are beyond the limit [-]."""
FEWEST_OUTSIDE = 50
"""Units needed on either side of the threshold [-]."""
FAST_SECONDS = {True: 0.25, False: 1.0}
"""Whether a run is quick → what the Sobol analysis of such a model may take at that rate [s]."""
FEWEST_UNITS = ceil(FEWEST_OUTSIDE / WORST_SHARE)
"""Fewest units whose worst share is as many as are needed, whatever the limit [-]."""
_FEWEST_BLOCKS = 16
"""Blocks of a Sobol analysis that is given too little time for more [-]."""
_MOST_UNITS, _MOST_SAMPLES = 2**17, 2**26
"""Random units, and samples of a Sobol analysis, that memory holds however long a run may take [-]."""
_CHAIN = 10
"""Units of a level or width come in chains of so many [-]."""


def _least(fewest: int) -> Rule:
    """Return the rule of a number with which an estimator has an answer."""
    return whole(f"{fewest} or more, a whole number", fewest)


BY_DIMENSION, BY_SOURCE = "dimension", "source"
"""What a ranking may rank: dimensions of the drawing with all their places together, or every source alone."""
LARGEST = 8
"""Groups of columns that further blocks tell apart: as many as a first page names, more would halve the blocks [-]."""


_IN_CHAINS = whole(f"a multiple of {_CHAIN}", 0, multiple=_CHAIN)


def _power(number: int) -> int:
    """Return the largest power of two up to a number, at least 1 [-]."""
    return 1 << max(number.bit_length() - 1, 0)


@dataclass(frozen=True, kw_only=True)
class SobolEffort(NamedFields):
    """How much a Sobol analysis may compute.

    Parameters
    ----------
    start
        First number of Saltelli blocks, a power of two; they tell everything apart for all outputs [-].
    limit
        Largest number of them; as the first one for a fixed number. Those after the first are for the order of the
        eight largest of one output [-].
    places
        First places whose order must be stable in the ranking of the leading output [-].
    probability
        Share of resamples that must have that order [-].
    resamples
        Draws from the errors of the indices [-].
    second_order
        Whether pairs of sources get an index, at nearly twice the samples.
    """

    called: ClassVar[str] = "effort of Sobol indices"
    written_in: ClassVar[tuple[str, str]] = ("Sobol indices", "")

    start: Annotated[int, whole("a power of two, 2 or more", 2, power_of_two=True, name="first number of blocks")] = 512
    limit: int = 65_536
    places: Annotated[int, whole("1 or more", 1, name="number of stable places")] = 3
    probability: float = 0.9
    resamples: int = 400
    second_order: bool = False

    def counted(self, groups: int) -> int:
        """Return how many samples the largest number of blocks has of so many groups of columns [-].

        n₁·(G + 2) of the first blocks and, where there are more than K + 1 groups, n₁ that exchange all but K = 8
        together and (n − n₁)·(K + 3) of further blocks.

        Examples
        --------
        >>> SobolEffort(start=32, limit=256).counted(48), SobolEffort(start=32, limit=256).counted(5)
        (4096, 1792)
        """
        further = self.limit - self.start
        parted = groups > LARGEST + 1 and further and not self.second_order
        rest = self.start + further * (LARGEST + 3) if parted else further * (groups + 2)
        return self.start * (groups + 2) + rest


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
    derivative_units
        Units behind derivatives [-].
    inverse_units
        Units behind every trial zone; the yield target may ask for more [-].
    surrogate_units
        Units behind the surrogates [-].
    rare
        Whether methods for rare failures are asked where few random units lie beyond a limit.
    level_units
        Units of a level of the subset simulation, for limits that are rarely exceeded [-].
    level_runs
        Runs of it, and of the scaled-sigma sampling that checks it [-].
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
    written_in: ClassVar[tuple[str, str]] = ("study", "effort.ranking.")

    units: Annotated[int, _least(FEWEST_UNITS)] = 16_384
    design: Annotated[SamplingDesign, a(SamplingDesign)] = SamplingDesign.MONTE_CARLO
    sobol: Annotated[SobolEffort, a(SobolEffort)] = field(default_factory=lambda: SobolEffort(start=256, limit=2048))
    derivative_units: Annotated[int, _least(10)] = 1024
    inverse_units: Annotated[int, _least(1)] = 2048
    surrogate_units: Annotated[int, _least(validation.FEWEST_OF_FOLD * validation.FOLDS)] = 2048
    rare: Annotated[bool, flag()] = True
    level_units: Annotated[int, _least(100), _IN_CHAINS] = 4000
    level_runs: Annotated[int, _least(FEWEST_RUNS)] = 5
    widened_units: Annotated[int, _least(100), _IN_CHAINS] = 2000
    permutations: Annotated[int, _least(2)] = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        first = self.sobol.start
        for rule, name in (
            (whole(f"the first number of blocks, {first}, or more", first), "limit"),
            (number("a number between 0 and 1", above=0, below=1), "probability"),
            (whole("2 or more", 2), "resamples"),
        ):
            rule.check("study", f"effort.ranking.sobol.{name}", getattr(self.sobol, name))

    def counted(self, sources: int) -> int:
        """Return about how many units a ranking of so many sources solves, the methods for rare failures left out [-].

        Random units, Saltelli blocks, derivatives and surrogates with their trials, own count.
        """
        return self.units + self.sobol.counted(sources) + 2 * self.derivative_units + 9 * self.surrogate_units

    def within(self, units: float, sources: int) -> RankingEffort:
        """Return this effort scaled to about so many units in all, each number at least what its measure needs.

        Random units and blocks times units/`counted` (own derivation), blocks down to a power of two; the other numbers
        likewise where that is less.

        Examples
        --------
        >>> effort = QUICK_RANKING.within(2 * QUICK_RANKING.counted(48), 48)
        >>> effort.units, effort.sobol.limit, effort.sobol.start
        (4096, 512, 64)
        """
        share = units / self.counted(sources)
        start, limit = (
            max(_power(min(int(share * blocks), _MOST_SAMPLES // (sources + 2))), _FEWEST_BLOCKS)
            for blocks in (self.sobol.start, self.sobol.limit)
        )

        def scaled(number: int, fewest: int) -> int:
            return max(round(min(share, 1.0) * number), fewest)

        return replace(
            self,
            units=min(max(round(share * self.units), FEWEST_UNITS), max(_MOST_UNITS, self.units)),
            sobol=replace(self.sobol, start=start, limit=limit),
            derivative_units=scaled(self.derivative_units, 10),
            inverse_units=scaled(self.inverse_units, 100),
            surrogate_units=scaled(self.surrogate_units, validation.FEWEST_OF_FOLD * validation.FOLDS),
            level_units=_CHAIN * scaled(self.level_units // _CHAIN, _CHAIN),
            widened_units=_CHAIN * scaled(self.widened_units // _CHAIN, _CHAIN),
            permutations=scaled(self.permutations, 100),
        )

    def until_order(self, places: int) -> RankingEffort:
        """Return the effort whose blocks grow until the order of so many first places is stable [-]."""
        most = max(self.sobol.limit, SobolEffort().limit)
        return replace(self, sobol=replace(self.sobol, places=places, limit=most))

    def of_fast_model(self, sources: int) -> RankingEffort:
        """Return the effort for a model that answers for whole arrays, unless its numbers are the user's own.

        The Sobol analysis has as many blocks of sources + 2 units, a power of two, as the stated rate allows, and at
        least those of any model: counted work and no clock decides, so the same study has the same bits. Shapley
        effects have a quarter as many permutations.

        Examples
        --------
        >>> QUICK_RANKING.of_fast_model(4).sobol.limit, QUICK_RANKING.of_fast_model(100).sobol.limit
        (16384, 1024)
        >>> QUICK_RANKING.permutations, QUICK_RANKING.of_fast_model(4).permutations
        (100, 4096)
        """
        if self not in (RankingEffort(), QUICK_RANKING):
            return self
        allowed = int(ARRAY_RATE * FAST_SECONDS[self == QUICK_RANKING]) // (sources + 2)
        blocks = max(self.sobol.limit, _power(allowed))
        sobol = replace(self.sobol, start=blocks, limit=blocks)
        return replace(self, sobol=sobol, permutations=max(self.permutations, blocks // 4))


QUICK_RANKING = RankingEffort(
    units=2048,
    sobol=SobolEffort(start=32, limit=256),
    derivative_units=128,
    inverse_units=400,
    surrogate_units=512,
    rare=False,
    level_units=200,
    level_runs=3,
    widened_units=100,
    permutations=100,
)
"""Effort of a quick run: every measure is real, every interval wide."""

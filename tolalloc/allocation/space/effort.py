"""How much an allocation may compute."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar

from tolalloc.reading.named_fields import NamedFields, Rule, a, each, number, whole

FEWEST_FOR_YIELD = 1152
"""Units of a design in the shortest run: 1,109 just show the usual yield, 99.73 %, with 95 % confidence [-]."""
_MOST_OF_DESIGN, _MOST_CONFIRMED = 2**16, 2**23
"""Units of a design, and those that confirm one, that memory holds however long a run may take [-]."""
_OF_SEARCH, _OF_CONFIRMATION, _OF_FRONT = 2.5, 4.0, 1.1
"""Time of a unit of a search, a confirmation and a front over that of one with all limited outputs [-]."""


def _least(fewest: int) -> Rule:
    """Return the rule of a number with which an allocation has an answer in every stage."""
    return whole(f"a whole number, {fewest} or more", fewest)


@dataclass(frozen=True, kw_only=True)
class SearchEffort(NamedFields):
    """How much the search may spend.

    Parameters
    ----------
    steps
        Largest number of verified steps of each search [-].
    reach
        Factor by which a scale may change in the first step; later ones reach less [-].
    """

    called: ClassVar[str] = "effort of a search"
    written_in: ClassVar[tuple[str, str]] = ("study", "effort.allocation.search.")

    steps: Annotated[int, _least(1)] = 8
    reach: Annotated[float, number("a number above 1", above=1)] = 2.5


@dataclass(frozen=True, kw_only=True)
class AllocationEffort(NamedFields):
    """How much an allocation may compute.

    Parameters
    ----------
    verification_units
        Independent units per design of a search [-].
    confirmation_units
        Most independent units that are solved to confirm a design in the end; the more, the nearer it is to
        its limits [-].
    shared_units
        Common random units of the quantile surrogate [-].
    search
        Effort of the searches.
    graded_steps
        Largest number of verified choices of grades [-].
    front_limits
        Limits of the leading output for which the cheapest drawing is looked for too, over the limit asked for [-].
    front_units
        Independent units per design there [-].
    front_steps
        Largest number of verified steps at each of them [-].
    setting_steps
        Values of each of the last settings for which the cheapest zones are looked for, one number for each [-].
    price_nodes
        Most nodes of the search for the prices at which the answer loses most [-].
    stiffness_units
        Units on which every change of a stiffness that is not known is seen [-].
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
    written_in: ClassVar[tuple[str, str]] = ("study", "effort.allocation.")

    verification_units: Annotated[int, _least(1)] = 6144
    confirmation_units: Annotated[int, _least(1)] = 32_768
    shared_units: Annotated[int, _least(2)] = 256
    search: Annotated[SearchEffort, a(SearchEffort)] = field(default_factory=SearchEffort)
    graded_steps: Annotated[int, _least(1)] = 8
    front_limits: Annotated[
        tuple[float, ...], each("one number or more between 0.5 and 2", number("", least=0.5, most=2), fewest=1)
    ] = (0.85, 0.9, 0.95, 1.05, 1.1, 1.2)
    front_units: Annotated[int, _least(1)] = 3072
    front_steps: Annotated[int, _least(1)] = 2
    setting_steps: Annotated[tuple[int, ...], each("whole numbers, 1 or more", whole("", 1))] = (5, 6)
    price_nodes: Annotated[int, _least(1)] = 100
    stiffness_units: Annotated[int, _least(100)] = 2048
    share_blocks: Annotated[int, whole("a power of two, 2 or more", 2, power_of_two=True)] = 512
    yields: Annotated[
        tuple[float, ...], each("one share or more between 0 and 1", number("", above=0, below=1), fewest=1)
    ] = (0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.9973, 0.999)
    gain: Annotated[float, number("a share above 0 up to below 1", above=0, below=1)] = 0.005
    error: Annotated[float, number("a share above 0 up to 0.5", above=0, most=0.5)] = 0.05

    @property
    def counted(self) -> int:
        """About how many units with all limited outputs an allocation takes the time of [-].

        Steps of its search, its confirmation and its front, as counted and timed in quick runs of shipped studies.
        """
        search = (self.search.steps + 2) * self.verification_units
        front = len(self.front_limits) * (self.front_steps + 1) * self.front_units
        return round(_OF_SEARCH * search + _OF_CONFIRMATION * self.confirmation_units + _OF_FRONT * front)

    def within(self, units: float) -> AllocationEffort:
        """Return this effort scaled to about so many units in all, each number at least what its stage needs.

        Every number of units times units/`counted` (own derivation); steps and points stay.

        Examples
        --------
        >>> AllocationEffort().within(AllocationEffort().counted / 2).confirmation_units
        16384
        """
        share = units / self.counted

        def scaled(number: int, fewest: int, most: int = _MOST_OF_DESIGN) -> int:
            return min(max(round(share * number), fewest), most)

        return replace(
            self,
            verification_units=scaled(self.verification_units, FEWEST_FOR_YIELD),
            confirmation_units=scaled(self.confirmation_units, 2 * FEWEST_FOR_YIELD, _MOST_CONFIRMED),
            shared_units=scaled(self.shared_units, 48),
            front_units=scaled(self.front_units, FEWEST_FOR_YIELD),
            stiffness_units=scaled(self.stiffness_units, FEWEST_FOR_YIELD),
            share_blocks=min(max(1 << max(int(share * self.share_blocks).bit_length() - 1, 0), 16), 2**12),
        )

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
            front_units=2**16,
            search=replace(self.search, steps=AllocationEffort().search.steps),
            share_blocks=2**12,
            gain=0.002,
            error=AllocationEffort().error,
        )


QUICK_ALLOCATION = AllocationEffort(
    verification_units=2304,
    confirmation_units=4608,
    shared_units=48,
    search=SearchEffort(steps=4),
    graded_steps=3,
    front_limits=(0.9, 0.95, 1.1, 1.2),
    front_units=2304,
    front_steps=1,
    setting_steps=(2, 3),
    price_nodes=12,
    stiffness_units=1152,
    share_blocks=64,
    yields=(0.7, 0.8, 0.9, 0.95, 0.99, 0.9973),
    gain=0.05,
    error=0.5,
)
"""Effort of a quick run: every stage is real, every interval wide."""

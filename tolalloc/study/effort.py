"""How much a study may compute: full, quick, or numbers of the user's own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from tolalloc.allocation.space.effort import QUICK_ALLOCATION, AllocationEffort
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields
from tolalloc.sensitivity.effort import QUICK_RANKING, RankingEffort


@dataclass(frozen=True, kw_only=True)
class Effort(NamedFields):
    """How much a study may compute.

    Parameters
    ----------
    ranking
        Effort of a ranking.
    allocation
        Effort of an allocation.
    is_quick
        Whether reports shall say that the run is a quick one.

    Raises
    ------
    InputError
        A field of another kind.
    """

    called: ClassVar[str] = "effort"

    ranking: RankingEffort = field(default_factory=RankingEffort)
    allocation: AllocationEffort = field(default_factory=AllocationEffort)
    is_quick: bool = False

    def __post_init__(self) -> None:
        for name, kind in (("ranking", RankingEffort), ("allocation", AllocationEffort), ("is_quick", bool)):
            if not isinstance(getattr(self, name), kind):
                raise InputError.at("effort", name, getattr(self, name), f"a {kind.__name__}")


QUICK = Effort(ranking=QUICK_RANKING, allocation=QUICK_ALLOCATION, is_quick=True)
"""Effort of a quick run: every stage is real, every interval wide."""

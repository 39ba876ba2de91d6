"""What a limit costs: the cheapest drawings that are verified to keep other limits of the leading output."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from tolalloc.allocation.search.discrete import allocate_grades
from tolalloc.allocation.search.zone_allocation import step_to_optimum
from tolalloc.allocation.space.output_sample import DesignSample
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier, cheapest_met
from tolalloc.exceptions import FailedUnitsError, SolveError


@dataclass(frozen=True, kw_only=True)
class PricedLimit:
    """A limit of the leading output, and the cheapest drawing known to keep it with all other limits."""

    limit: float  # [unit of the output]
    design: VerifiedDesign


@dataclass(frozen=True, kw_only=True)
class CostFront:
    """Cost against the limit of the leading output."""

    points: tuple[PricedLimit, ...]  # The tightest limit first
    drawn: PricedLimit | None  # The drawing, one of them; none where it was not shown to keep all limits
    missed: tuple[float, ...]  # Limits that no design was verified to keep [unit of the output]


@dataclass(frozen=True, kw_only=True)
class FrontSearch:
    """Looks for the cheapest drawings at other limits, each from the one at hand."""

    verifier_of: Callable[[float], Verifier]  # Limit → verifies designs that must keep it, on units of its own
    steps: int  # Verified steps at every limit [-]
    reach: float  # Factor by which a scale may change in the first step [-]
    graded_steps: int  # Verified choices of grades at every limit; 0 where zones are free [-]

    def around(self, drawn: VerifiedDesign, limit: float, shares: Sequence[float]) -> CostFront:
        """Return the front around a drawing.

        Parameters
        ----------
        drawn
            The drawing.
        limit
            What it keeps, or may be hoped to keep where it misses a limit [unit of the output].
        shares
            Other limits over that one [-].

        Notes
        -----
        Every search begins at the drawing, judged against each limit on the same units, and ends after a step or two.
        What keeps a limit keeps every wider one, so cost never rises with the limit. A design for a tighter limit that
        seems cheaper than the drawing does so by what the units of a search err, and does not count.
        """
        own = PricedLimit(limit=limit, design=drawn) if drawn.accepted else None
        found, missed = [own] if own else [], list[float]()
        at_hand = self.verifier_of(limit)
        units = at_hand.sampled(drawn.design_in(at_hand.space), "drawn")
        for share in sorted({*shares} - {1.0}):
            best = self._cheapest(share * limit, units, drawn.cost * (1 - _SAME) if own and share < 1 else 0.0)
            if best is None and own and share > 1:
                best = drawn  # which keeps the wider limit too
            if best:
                found.append(PricedLimit(limit=share * limit, design=best))
            else:
                missed.append(share * limit)
        points = list[PricedLimit]()
        for point in sorted(found, key=lambda one: one.limit):
            tighter = points[-1].design if points else point.design  # on a ladder it may well be the same zones
            points.append(replace(point, design=tighter) if tighter.cost < point.design.cost * (1 - _SAME) else point)
        return CostFront(points=tuple(points), drawn=own, missed=tuple(missed))

    def _cheapest(self, limit: float, units: DesignSample, floor: float) -> VerifiedDesign | None:
        """Return the cheapest design of a cost or more that units show to keep a limit, none where none was found."""
        verifier = self.verifier_of(limit)
        try:
            first = verifier.judged(units, "drawn").evenly_divided()
            tried = (first, *step_to_optimum(verifier, first, self.steps, self.reach))
            if self.graded_steps:
                best = cheapest_met(tried)
                tried = (allocate_grades(verifier.dividing_as(best), best, self.graded_steps).chosen,)
        except (FailedUnitsError, SolveError):
            return None
        kept = [own for own in tried if own.met and own.cost >= floor]
        return min(kept, key=lambda one: one.cost, default=None)


_SAME = 1e-9
"""Relative difference of costs that is rounding [-]."""

"""What is tried after a design that was judged: a cheaper one near it, a safer one, or one that a search had found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tolalloc.allocation.attempts import Attempt
from tolalloc.allocation.candidates import ALIKE, ALONE, FREE, GRADES, TABLE, Candidates
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.graded import choice_beside
from tolalloc.allocation.judging import Judge
from tolalloc.allocation.trust_region import step_from
from tolalloc.allocation.verification import VerifiedDesign, Verifier
from tolalloc.models.settings import DrawnAmounts

_REACH = 1.1
"""Factor by which a variable may change from a judged design to the next one [-]."""
_MARGIN = 1.0
"""How far inside what must be shown the next design is aimed while nothing is confirmed, half as far again after each
miss but the first [standard errors of what its units and those of the judged one say]."""


@dataclass(frozen=True, kw_only=True)
class NextDesign:
    """Makes the design that follows a judged one, for `tolalloc.allocation.confirmation.confirm`."""

    found: Candidates  # What the searches found
    judge: Judge  # Judges the designs
    drawn: DrawnAmounts  # What the drawing says of the settings
    space: DesignSpace  # Design variables with every setting free
    verifier: Callable[[DesignSpace], Verifier]  # Returns what makes the models of a design

    def __call__(
        self, kind: str, judged: VerifiedDesign, attempt: Attempt, worth: float
    ) -> tuple[str, VerifiedDesign] | None:
        """Return the design that the search of a judged one would try next, none where it would try no other.

        After a miss that may be one that the search has tried, where it is cheaper than what the models make. From a
        drawing that no search made and that is not good enough, the search for free zones goes on.
        """
        found = self.found
        searches = {ALONE: found.fixed, FREE: found.free}
        if kind in (TABLE, ALIKE) and not judged.confirmed and not found.graded:
            kind = FREE
        margin = self.judge.margin(judged, self._errors_inside(judged, attempt, worth))
        seen = self.judge.foreseen(judged, attempt)
        if kind == GRADES and found.graded:
            tried = found.graded.tried[1:]
            design = choice_beside(self.drawn, seen, tried, margin)
        elif search := searches.get(kind):
            tried = search.tried
            design = step_from(seen, tried, margin, _REACH)
        else:
            return None
        known = () if judged.confirmed else _still_kept(tried, seen)
        cheapest = min(known, key=lambda own: own.cost, default=None)
        if cheapest and cheapest.cost <= worth and (design is None or cheapest.cost < judged.space.cost(design)):
            return kind, cheapest
        if design is None or judged.space.cost(design) > worth:
            return None
        space = self.space if kind == FREE else judged.space
        return kind, self.verifier(space).verify(design, f"attempt {attempt.number}")

    def _errors_inside(self, judged: VerifiedDesign, attempt: Attempt, worth: float) -> float:
        """Return how far inside what must be shown the next design is aimed [standard errors of both samples]."""
        if np.isinf(worth):  # nothing is confirmed
            return _MARGIN * (1 + attempt.missed) / 2
        # A miss costs nothing then, so at even odds the next one is aimed at the limit itself, but after a miss.
        errors = _MARGIN * 2 * (0.5 - self.judge.error)
        return errors if judged.confirmed else max(errors, _MARGIN / 2)


def _still_kept(tried: tuple[VerifiedDesign, ...], judged: VerifiedDesign) -> tuple[VerifiedDesign, ...]:
    """Return the dearer designs of a search that were met, and still are with what a judged one says of them.

    What both say is weighed by their variances. The judged one itself is none of them.
    """
    return tuple(
        own
        for own in tried
        if own.met
        and own.cost > judged.cost
        and all(
            side.excess * other.standard_error**2 + other.predicted(own.design) * side.standard_error**2 <= 0
            for side, other in zip(own.sides, judged.sides, strict=True)
        )
    )

"""The last stretch of a search: along designs fixed beforehand, to the cheapest that the units of a test show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search.zone_allocation import step_from
from tolalloc.allocation.verify.acceptance import AcceptanceTest, AlphaSpending
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.settings import DrawnAmounts

_APART = 3.0
"""How far inside and beyond the limits the ends of a line are aimed [standard errors of its first design]."""
_LEAST = 0.03
"""How far at least, over the deviation of an output [-]."""
_REACH = 1.25
"""Factor by which a variable may change from that design to an end [-]."""
_TESTS = 4
"""Designs of a line that are tested at most [-]."""
_FIRST_STEP = 0.25
"""Part of a line by which the second of them lies on [-]."""
_SETTLED = 0.005
"""Relative difference of cost between a design that is shown and one that is not below which no further is tested."""


@dataclass(frozen=True, kw_only=True)
class CostLine:
    """Designs from a safe one to a cheap one, found before any unit of the test is drawn.

    Notes
    -----
    All designs of a line are tested on the same units. Where a unit that fails goes on failing towards the cheap end,
    the cheapest design that these units show is where the first unit more fails than may: an order statistic of where
    each unit begins to fail, so it is shown with the confidence of one test, however it is found. A unit's zones and
    settings there:

    z(p) = z₀^(1 − p)·z₁^p, s(p) = (1 − p)·s₀ + p·s₁ (own derivation).

    References
    ----------
    S. S. Wilks, Ann. Math. Stat. 12 (1941) 91–96, for limits by order statistics.
    """

    around: VerifiedDesign  # Design of a search
    drawn: DrawnAmounts  # What the drawing says of the settings
    safe: Float[np.ndarray, " variable"]  # Scales [-] and settings
    cheap: Float[np.ndarray, " variable"]  # The same

    @classmethod
    def through(cls, around: VerifiedDesign, known: Sequence[VerifiedDesign], drawn: DrawnAmounts) -> CostLine:
        """Return the line around a design of a search; known ones near by, itself among them, correct its models."""
        error = max((own.error for own in around.quantiles), default=0.0)
        apart = max(_APART, _LEAST / error) if error > 0 else _APART
        safe, cheap = (step_from(around, known, margin, _REACH) for margin in (apart, -apart))
        return cls(around=around, drawn=drawn, safe=safe, cheap=cheap)

    def at(self, position: float) -> VerifiedDesign:
        """Return the design at a position from 0, the safe end, to 1, with the models of the search."""
        groups, other = len(self.around.space.groups), 1 - position
        zones = self.safe[:groups] ** other * self.cheap[:groups] ** position
        design = np.append(zones, other * self.safe[groups:] + position * self.cheap[groups:])
        space, stated = self.around.space.rounded_down(design, self.drawn)
        before = float(self.around.space.cost(design))
        return replace(self.around, space=space, design=stated, cost=float(space.cost(stated)), unrounded_cost=before)

    def cheapest_shown(self, test: AcceptanceTest, spending: AlphaSpending) -> VerifiedDesign | None:
        """Return the cheapest design that the units of a test show, none where they show none.

        Nor where nothing is to be gained along the line, as where laws tell its limits.
        """
        costs = [self.at(end).cost for end in (0.0, 1.0)]
        if costs[0] <= (1 + _SETTLED) * costs[1]:
            return None
        shown, missed, position = (0.0, np.nan), (1.0, np.nan), 0.5
        for _ in range(_TESTS):
            found = _excess(self.at(position), test, spending)
            if found <= 0.0:
                shown = position, found
            else:
                missed = position, found
            apart = self.at(shown[0]).cost / self.at(missed[0]).cost - 1
            if shown[0] == 1.0 or missed[0] == 0.0 or (apart < _SETTLED and np.isfinite(shown[1])):
                break
            position = _between(shown, missed) if apart > _SETTLED else 0.0
        return None if np.isnan(shown[1]) else self.at(shown[0])


def _excess(design: VerifiedDesign, test: AcceptanceTest, spending: AlphaSpending) -> float:
    """Return how far beyond what it must show a design lies by the units of a test, above 0 where it is not shown [-].

    Over the scale of the limit that it is furthest beyond.
    """
    try:
        found = test.run(design, spending)
    except FailedUnitsError:
        return np.inf
    excess = max(side.excess / side.scale for check in found.checks for side in check.constraints)
    return min(excess, 0.0) if found.accepted else max(excess, np.finfo(float).tiny)


def _between(shown: tuple[float, float], missed: tuple[float, float]) -> float:
    """Return where a line is tested next, or on by a quarter: between the middle and where a chord is zero."""
    ends = shown[0], missed[0]
    if np.isnan(missed[1]):
        return min(ends[0] + _FIRST_STEP, 1.0)
    if np.isnan(shown[1]):
        return max(ends[1] - _FIRST_STEP, 0.0)
    chord = shown[1] / (shown[1] - missed[1]) if np.isfinite(missed[1]) else 0.5
    return float(ends[0] + (0.5 + chord) / 2 * (ends[1] - ends[0]))

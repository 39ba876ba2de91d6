"""The last stretch of a search: along designs fixed beforehand, to the cheapest that the units of a test show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.search.pattern_search import jumps
from tolalloc.allocation.search.zone_allocation import step_from
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.verify.acceptance import AcceptanceTest, AlphaSpending
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.model import is_fast
from tolalloc.models.settings import DrawnAmounts

_APART = 3.0
"""How far inside and beyond the limits the ends of a line are aimed [standard errors of its first design]."""
_LEAST = 0.03
"""How far at least, over the deviation of an output [-]."""
_REACH = 1.25
"""Factor by which a variable may change from that design to an end [-]."""
_ALIKE = 1.05
"""The same where all zones are scaled alike [-]."""
_TESTS, _TESTS_OF_FAST = 4, 12
"""Designs of a line that are tested at most, and of a fast model [-]."""
_FIRST_STEP = 0.25
"""Part of a line by which the second of them lies on [-]."""
_SETTLED, _SETTLED_OF_FAST = 0.005, 0.0005
"""Relative difference of cost between a design that is shown and one that is not below which no further is tested, and
of a fast model."""


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
    verifier: Callable[[DesignSpace], Verifier]  # Returns what makes the models of a design
    safe: Float[np.ndarray, " variable"]  # Scales [-] and settings
    cheap: Float[np.ndarray, " variable"]  # The same

    @classmethod
    def through(
        cls,
        around: VerifiedDesign,
        known: Sequence[VerifiedDesign],
        drawn: DrawnAmounts,
        verifier: Callable[[DesignSpace], Verifier],
    ) -> CostLine:
        """Return the line around a design of a search; known ones near by, itself among them, correct its models.

        Where an output jumps with the zones, and derivatives say little of it, all zones are scaled alike.
        """
        if jumps(verifier(around.space), around):
            groups = len(around.scales)
            low, high = around.space.lower[:groups], around.space.upper[:groups]
            safe, cheap = (
                np.append(np.clip(around.scales * by, low, high), around.settings) for by in (1 / _ALIKE, _ALIKE)
            )
            return cls(around=around, drawn=drawn, verifier=verifier, safe=safe, cheap=cheap)
        error = max((own.error for own in around.quantiles), default=0.0)
        apart = max(_APART, _LEAST / error) if error > 0 else _APART
        safe, cheap = (step_from(around, known, margin, _REACH) for margin in (apart, -apart))
        if around.met and around.space.cost(safe) < around.cost:  # what was verified is safer than what models say
            safe = around.design
        return cls(around=around, drawn=drawn, verifier=verifier, safe=safe, cheap=cheap)

    def at(self, position: float) -> VerifiedDesign:
        """Return the design at a position from 0, the safe end, to 1, with the models of the search.

        With models of its own where laws tell some of its limits and settings move what they are laws of.
        """
        space, stated = self._stated(position)
        before = float(self.around.space.cost(self._design(position)))
        if self.around.laws and self.around.settings.size:
            found = self.verifier(space).dividing_as(self.around).verify(stated, self.around.name)
            return replace(found, unrounded_cost=before)
        return replace(
            self.around,
            space=space,
            design=stated,
            processes=space.process_names(stated),
            cost=float(space.cost(stated)),
            unrounded_cost=before,
        )

    def cost(self, position: float) -> float:
        """Return what the design at a position costs, as a drawing states it [cost units]."""
        space, stated = self._stated(position)
        return float(space.cost(stated))

    def _design(self, position: float) -> Float[np.ndarray, " variable"]:
        groups, other = len(self.around.space.groups), 1 - position
        zones = self.safe[:groups] ** other * self.cheap[:groups] ** position
        return np.append(zones, other * self.safe[groups:] + position * self.cheap[groups:])

    def _stated(self, position: float) -> tuple[DesignSpace, Float[np.ndarray, " variable"]]:
        return self.around.space.rounded_down(self._design(position), self.drawn)

    def cheapest_shown(self, test: AcceptanceTest, spending: AlphaSpending) -> VerifiedDesign | None:
        """Return the cheapest design that a test shows, as tested, the safest that was tested where it shows none.

        None where nothing is to be gained along the line, as where laws tell its limits.
        """
        many, settled = (_TESTS_OF_FAST, _SETTLED_OF_FAST) if is_fast(test.model) else (_TESTS, _SETTLED)
        alone = self.around.jointly is None and len(self.around.laws) == len(self.around.checks_alone)
        if alone or self.cost(0.0) <= (1 + settled) * self.cost(1.0):
            return None
        shown, missed, position, designs = (0.0, np.nan), (1.0, np.nan), 0.5, dict[float, VerifiedDesign]()
        for _ in range(many):
            try:
                designs[position] = test.run(self.at(position), spending)
                found = _excess(designs[position])
            except FailedUnitsError:
                found = np.inf
            if found <= 0.0:
                shown = position, found
            else:
                missed = position, found
            apart = self.cost(shown[0]) / self.cost(missed[0]) - 1
            if shown[0] == 1.0 or missed[0] == 0.0 or (apart < settled and np.isfinite(shown[1])):
                break
            position = _between(shown, missed) if apart > settled else 0.0
        return designs.get(shown[0]) or designs.get(min(designs, default=0.0))


def _excess(found: VerifiedDesign) -> float:
    """Return how far beyond what it must show a tested design lies, above 0 where it is not shown [-].

    Over the scale of the limit that it is furthest beyond.
    """
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

"""Every drawing that was verified on the way, and what is tried after one that was tested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tolalloc.allocation.search.discrete import GradedAllocation, choice_beside
from tolalloc.allocation.search.steering import explained_by
from tolalloc.allocation.search.zone_allocation import ZoneAllocation, step_from
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.verify.acceptance import Acceptance, AcceptanceTest, AlphaSpending
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier, cheapest_met
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.settings import DrawnAmounts

_ROUNDING = 1e-9
"""Distance of a cost from its bound, over the bound, up to which it is rounding [-]."""

TABLE, ALIKE, ALONE = "tolerance table as it is", "all zones scaled alike", "tolerances alone"
FREE, GRADES = "everything free", "grades"
"""What the drawings that are compared are called; a model has its own word for everything free."""


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """What the searches of one question found."""

    fixed: ZoneAllocation | None  # Settings as they are, if the question asks for it and the model has any
    free: ZoneAllocation  # Tolerances and settings together
    graded: GradedAllocation | None  # The same on ladders of zones, if the question asks for it

    def designs(self, free_label: str = FREE) -> dict[str, VerifiedDesign]:
        """Return the designs that a report compares, by what they are called."""
        alone = {ALONE: self.fixed.chosen} if self.fixed else {}
        grades = {GRADES: self.graded.chosen} if self.graded else {}
        return {
            TABLE: self.free.baseline,
            ALIKE: self.free.proportional,
            **alone,
            free_label: self.free.chosen,
            **grades,
        }

    def admitted(self) -> dict[str, VerifiedDesign]:
        """Return those that may be drawn: the table always, the others where their zones and amounts may be so.

        Where grades are asked for, nothing but them and the table may.
        """
        found = self.designs()
        if self.graded:
            return {TABLE: found[TABLE], GRADES: found[GRADES]}
        return {
            name: own  # its members may be rounded each on their own
            for name, own in found.items()
            if name == TABLE or replace(self._space, errors=own.space.errors).allows(own.design)
        }

    @property
    def shown(self) -> tuple[str, VerifiedDesign]:
        """Kind and design of the cheapest admitted one that was accepted; of the least violating one if none was."""
        admitted = self.admitted()
        accepted = {name: own for name, own in admitted.items() if own.accepted}
        among = accepted or {name: own for name, own in admitted.items() if not own.met} or admitted
        found = cheapest_met(tuple(among.values()))
        return next((name, own) for name, own in among.items() if own is found)

    @property
    def drawn(self) -> VerifiedDesign:
        """The design of `shown`."""
        return self.shown[1]

    def with_acceptance(self, found: Acceptance, drawn_amounts: DrawnAmounts) -> Candidates:
        """Return the candidates with what became of those that were tested."""
        free, last = self.free, {name: found.last(name) for name, _ in found.tested}
        hands = {id(own): last[name] for name, own in self.designs().items() if name in (TABLE, ALIKE) and name in last}
        free = replace(free, proportional_tried=tuple(hands.get(id(own)) or own for own in free.proportional_tried))
        tried = {name: tuple(own for kind, own in found.tested if kind == name) for name in last}
        fixed = self.fixed
        if fixed and (design := last.get(ALONE)):
            fixed = fixed.with_chosen(design, tried[ALONE])
        if design := last.get(FREE):
            free = free.with_chosen(design, tried[FREE])
        graded = self.graded
        if graded and (design := last.get(GRADES)):
            graded = graded.with_chosen(drawn_amounts, design, tried[GRADES])
        return Candidates(fixed=fixed, free=free, graded=graded)

    @property
    def unrestricted(self) -> ZoneAllocation:
        """The search that found the cheaper zones off the ladders: with the settings as they are, or with them free."""
        met = (own for own in self._searches.values() if own.chosen.met)
        return min(met, key=lambda own: own.chosen.cost, default=self.free)

    @property
    def bound(self) -> float | None:
        """Least cost that the models around the verified designs hold for possible; nothing if one undercuts it.

        The models hold near their designs, and what they say is no better than they are.
        """
        free = min(own.bound for own in self._searches.values())
        bound = self.graded.bound if self.graded else free
        kept = [own.cost for own in self.admitted().values() if own.met]
        return None if kept and min(kept) < bound * (1 - _ROUNDING) else bound

    @property
    def _searches(self) -> dict[str, ZoneAllocation]:
        """The searches whose zones and settings may be drawn, off the ladders."""
        alone = self.fixed if self.fixed and self._space.holds_present_settings else None
        return {FREE: self.free, **({ALONE: alone} if alone else {})}

    @property
    def _space(self) -> DesignSpace:
        """The design variables with every setting free."""
        return self.free.chosen.space


_REACH = 1.1
"""Factor by which a variable may change from a tested design to the next one [-]."""
_MARGIN = 1.0
"""How far inside what must be shown the next design is aimed while nothing is accepted, half as far again after each
miss but the first [standard errors of what its units and those of the tested one say]."""


@dataclass(frozen=True, kw_only=True)
class NextCandidate:
    """Makes the design that follows a tested one, for `tolalloc.allocation.verify.acceptance.accept_cheapest`."""

    found: Candidates  # What the searches found
    test: AcceptanceTest  # Tests the designs
    drawn: DrawnAmounts  # What the drawing says of the settings
    space: DesignSpace  # Design variables with every setting free
    verifier: Callable[[DesignSpace], Verifier]  # Returns what makes the models of a design

    def __call__(
        self, kind: str, every: tuple[VerifiedDesign, ...], spending: AlphaSpending, worth: float
    ) -> tuple[str, VerifiedDesign] | None:
        """Return the design that the search of tested ones would try after the last, none where it would try no other.

        After a miss that may be one that the search has tried, where it is cheaper than what the models make. From a
        drawing that no search made and that is not good enough, the search for free zones goes on.
        """
        found, tested = self.found, every[-1]
        searches = {ALONE: found.fixed, FREE: found.free}
        if kind in (TABLE, ALIKE) and not tested.accepted and not found.graded:
            kind = FREE
        errors = self._errors_inside(tested, spending, worth)
        *before, seen = (self.test.foreseen(own, spending) for own in every)
        if kind == GRADES and found.graded:
            tried = found.graded.tried[1:]
            design = choice_beside(self.drawn, seen, tried, self.test.margin(tested, errors))
        elif search := searches.get(kind):
            tried = search.tried
            known = explained_by(seen, (*tried, *before, seen))
            design = step_from(seen, known, self.test.margin(tested, errors, known), _REACH)
        else:
            return None
        kept = () if tested.accepted else _still_kept(tried, seen)
        cheapest = min(kept, key=lambda own: own.cost, default=None)
        if cheapest and cheapest.cost <= worth and (design is None or cheapest.cost < tested.space.cost(design)):
            return kind, cheapest
        if design is None or tested.space.cost(design) > worth:
            return None
        space = self.space if kind == FREE else tested.space
        try:
            return kind, self.verifier(space).dividing_as(tested).verify(design, f"attempt {spending.number}")
        except FailedUnitsError:  # too many of its units have no answer
            return None

    def _errors_inside(self, tested: VerifiedDesign, spending: AlphaSpending, worth: float) -> float:
        """Return how far inside what must be shown the next design is aimed [standard errors of both samples]."""
        if np.isinf(worth):  # nothing is accepted
            return _MARGIN * (1 + spending.missed) / 2
        # A miss costs nothing then, so at even odds the next one is aimed at the limit itself, but after a miss.
        errors = _MARGIN * 2 * (0.5 - self.test.error)
        return errors if tested.accepted else max(errors, _MARGIN / 2)


def _still_kept(tried: tuple[VerifiedDesign, ...], tested: VerifiedDesign) -> tuple[VerifiedDesign, ...]:
    """Return the dearer designs of a search that were met, and still are with what a tested one says of them.

    What both say is weighed by their variances. The tested one itself is none of them.
    """
    return tuple(
        own
        for own in (own.divided(tested.parts) for own in tried)
        if own.met
        and own.cost > tested.cost
        and all(
            constraint.excess * other.standard_error**2 + other.predicted(own.design) * constraint.standard_error**2
            <= 0
            for constraint, other in zip(own.constraints, tested.constraints, strict=True)
        )
    )

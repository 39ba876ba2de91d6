"""Every drawing that was verified on the way, whoever made it: the cheapest one that keeps the limits is the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from tolalloc.allocation.confirmation import Confirmed
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.graded import GradedAllocation
from tolalloc.allocation.search import ZoneAllocation
from tolalloc.allocation.verification import VerifiedDesign, answer
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

    def admitted(self, free_label: str = FREE) -> dict[str, VerifiedDesign]:
        """Return those that may be drawn: the table always, the others where their zones and amounts may be so.

        Where grades are asked for, nothing but them and the table may.
        """
        found = self.designs(free_label)
        if self.graded:
            return {TABLE: found[TABLE], GRADES: found[GRADES]}
        return {name: design for name, design in found.items() if name == TABLE or self._space.allows(design.design)}

    @property
    def drawn(self) -> VerifiedDesign:
        """The cheapest admitted design that was confirmed; the least violating one if none was."""
        admitted = tuple(self.admitted().values())
        confirmed = tuple(own for own in admitted if own.confirmed)
        return answer(confirmed or tuple(own for own in admitted if not own.met) or admitted)

    def with_confirmed(self, found: Confirmed, drawn_amounts: DrawnAmounts) -> Candidates:
        """Return the candidates with what became of those that were judged."""
        free, last = self.free, {name: found.last(name) for name, _ in found.judged}
        hands = {id(own): last[name] for name, own in self.designs().items() if name in (TABLE, ALIKE) and name in last}
        free = replace(free, proportional_tried=tuple(hands.get(id(own)) or own for own in free.proportional_tried))
        tried = {name: tuple(own for kind, own in found.judged if kind == name) for name in last}
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
        cheapest = _cheapest({name: own.chosen for name, own in self._searches.items()})
        return next((own for own in self._searches.values() if own.chosen is cheapest), self.free)

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


def _cheapest(designs: Mapping[str, VerifiedDesign]) -> VerifiedDesign | None:
    """Return the cheapest design that was shown to keep the limits."""
    return min((own for own in designs.values() if own.met), key=lambda own: own.cost, default=None)

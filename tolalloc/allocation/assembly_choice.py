"""Zones, classes and sizes chosen together: one allocation for every number of them, and the cheapest of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tolalloc.allocation.drawing_question import DrawingQuestion, allocate_drawing
from tolalloc.allocation.result import AllocationResult, AssembledDrawing, AssemblyChoice
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.capability.monte_carlo import KeptLimits
from tolalloc.drawings.compensators import Compensator, assembly_cost, choice_label
from tolalloc.running.progress import RunRecord


@dataclass(frozen=True, kw_only=True)
class AssembledQuestion:
    """What is asked of the cheapest drawing whose parts are chosen at assembly."""

    question: DrawingQuestion  # What is asked of every choice
    choices: Sequence[tuple[Compensator, ...]]  # What acts in each, nothing where parts are taken as they come

    def of(self, acting: tuple[Compensator, ...]) -> DrawingQuestion:
        """Return the question with units assembled so."""
        space = self.question.space
        return replace(self.question, space=replace(space, errors=replace(space.errors, compensators=acting)))

    def tried(self, acting: tuple[Compensator, ...], found: AllocationResult) -> AssemblyChoice:
        """Return what became of a choice."""
        return AssemblyChoice(
            compensators=acting,
            label=choice_label(acting),
            met=found.met,
            zones_cost=found.cost,
            assembly_cost=assembly_cost(acting, found.space.errors.sources),
            bound=found.bound,
            joint=found.chosen.joint,
        )

    def as_they_come(self, found: AllocationResult) -> KeptLimits:
        """Return which random units of a drawing keep its limits if nothing is chosen."""
        design, question = found.chosen, self.question
        errors = replace(design.space.errors, compensators=())
        asked = [own for own in found.requirements if not isinstance(own, JointRequirement)]
        limits = {own.output: own.limits for own in asked}
        units = replace(design.space, errors=errors).units(
            design.design, question.seeds("as they come"), question.effort.verification_units
        )
        response = question.model.at(design.settings).reading(tuple(limits))
        return KeptLimits.of(response(units), response.outputs, limits)


def allocate_assembled(
    asked: AssembledQuestion, record: RunRecord, name: str, digest: str = "", checkpoint: Path | None = None
) -> AllocationResult:
    """Return the cheapest drawing over all choices, zones and assembly together.

    Parameters
    ----------
    asked
        What is asked, with what may be chosen.
    record, name, digest, checkpoint
        As of `allocate_drawing`.

    Notes
    -----
    Every choice has the same random numbers. Of choices that keep the limits the cheapest sum of zones and assembly
    wins; of none, the first is shown. What is asked around the drawing is asked of it alone.
    """
    if len(asked.choices) == 1 and not asked.choices[0]:
        return allocate_drawing(asked.question, record, name, digest, checkpoint)
    tried = []
    for acting in asked.choices:
        record.progress.tell(f"parts: {choice_label(acting)}")
        alone = replace(asked.of(acting), front=False, what_if=False)
        tried.append(asked.tried(acting, allocate_drawing(alone, record, name)))
    best = min(range(len(tried)), key=lambda at: (not tried[at].met, tried[at].cost if tried[at].met else at))
    found = allocate_drawing(asked.of(asked.choices[best]), record, name, digest, checkpoint)
    with record.stage("parts as they come"):
        kept = asked.as_they_come(found)
    return replace(found, assembled=AssembledDrawing(choices=tuple(tried), chosen=best, as_they_come=kept))

"""What a search has found: its front, or the design that comes nearest to being allowed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.pareto.indicators import nondominated, thinned
from tolalloc.allocation.pareto.problem import Objectives, ParetoProblem
from tolalloc.exceptions import SolveError


@dataclass(frozen=True, kw_only=True)
class LeastViolating:
    """The design whose violations sum up to the least.

    Parameters
    ----------
    design
        Its genes [unit of the gene].
    violation
        Violation of every constraint, as a share of what it allows; 0 or below is kept [-].
    blocking
        The constraint that is violated most, none if all are kept.
    """

    design: Float[np.ndarray, " gene"]
    violation: Float[np.ndarray, " constraint"]
    blocking: str | None


@dataclass(frozen=True, kw_only=True)
class SearchedDesigns:
    """Designs with their answers.

    Parameters
    ----------
    problem
        What was searched.
    designs
        Genes [unit of the gene].
    answers
        Objectives and violations.
    """

    problem: ParetoProblem
    designs: Float[np.ndarray, "design gene"]
    answers: Objectives

    @property
    def losses(self) -> Float[np.ndarray, "design objective"]:
        """Objectives with the sign that makes small good [as their names state]."""
        return np.asarray(self.answers.values * np.array([objective.sign for objective in self.problem.objectives]))

    @property
    def failed(self) -> int:
        """Designs that failed [-]."""
        return int(np.count_nonzero(~self.answers.good))

    def front(self, number: int) -> SearchedDesigns:
        """Return allowed designs that no other one beats, in the order of the first objective, possibly none.

        Where there are more than the number [-], those in the densest places are left out.
        """
        allowed = self._at(np.flatnonzero(self.answers.kept))
        front = allowed._at(np.flatnonzero(nondominated(allowed.losses)))
        few = front._at(thinned(front.losses, number))
        return few._at(np.argsort(few.losses[:, 0], kind="stable"))

    def least_violating(self) -> LeastViolating:
        """Return the design that comes nearest to keeping every constraint, and what blocks it.

        Raises
        ------
        SolveError
            Every design failed.
        """
        at = int(np.argmin(self.answers.total_violation))
        if not self.answers.good[at]:
            raise SolveError(f"Pareto search: all of {len(self.designs)} designs failed.")
        violation = self.answers.violation[at]
        blocked = bool((violation > 0).any())
        return LeastViolating(
            design=self.designs[at],
            violation=violation,
            blocking=self.problem.constraints[int(np.argmax(violation))] if blocked else None,
        )

    def _at(self, which: Int[np.ndarray, " kept"]) -> SearchedDesigns:
        answers = self.answers
        return SearchedDesigns(
            problem=self.problem,
            designs=self.designs[which],
            answers=Objectives(
                values=answers.values[which], violation=answers.violation[which], status=answers.status[which]
            ),
        )

"""What a search has found: its front, or the design that comes nearest to being allowed; how good a front is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.pareto.problem import Objectives, ParetoProblem
from tolalloc.exceptions import SolveError


def nondominated(losses: Float[np.ndarray, "design objective"]) -> Bool[np.ndarray, " design"]:
    """Return which designs no other one beats in one objective without losing in another; equal ones stay both."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    front = np.zeros(len(losses), bool)
    front[NonDominatedSorting().do(losses, only_non_dominated_front=True)] = True
    return front


def thinned(losses: Float[np.ndarray, "design objective"], number: int) -> Int[np.ndarray, " kept"]:
    """Return the positions of at most so many designs of a front, those in the densest places left out one by one.

    References
    ----------
    Kukkonen & Deb 2006, CEC, 1179–1186, for two objectives; Kukkonen & Deb 2006, PPSN IX, 553–562, for more.
    """
    from pymoo.operators.survival.rank_and_crowding.metrics import get_crowding_function

    if len(losses) <= number:
        return np.arange(len(losses))
    crowding = get_crowding_function("pcd" if losses.shape[1] == 2 else "mnn")
    distance = crowding.do(losses, n_remove=len(losses) - number)
    return np.asarray(np.sort(np.argsort(-distance, kind="stable")[:number]))


def normalised(
    losses: Float[np.ndarray, "design objective"], front: Float[np.ndarray, "point objective"]
) -> Float[np.ndarray, "design objective"]:
    """Return losses where 0 is the best and 1 the worst value on a front [-]."""
    ideal, nadir = front.min(axis=0), front.max(axis=0)
    return np.asarray((losses - ideal) / np.where(nadir > ideal, nadir - ideal, 1.0))


def knee(losses: Float[np.ndarray, "design objective"]) -> int:
    """Return the position of the knee: the design farthest below the plane through the ends of the front.

    Parameters
    ----------
    losses
        Losses of a front.

    Notes
    -----
    The ends of a normalised front of two objectives are (0, 1) and (1, 0), so the distance grows as the sum of the
    objectives falls; with more of them the plane is that through the unit points. Unlike the bend angle it depends on
    the whole front, not on the noise and the spacing of three neighbours. A front that bends nowhere gives one of its
    ends.

    References
    ----------
    Das 1999, Struct. Optim. 18:107–115.
    """
    return int(np.argmin(normalised(losses, losses).sum(axis=1)))


def spread_over(count: int, number: int) -> list[int]:
    """Return at most so many positions among ``count``, evenly spread, the first and the last among them."""
    return [int(at) for at in np.unique(np.linspace(0, count - 1, min(number, count)).astype(int))]


@dataclass(frozen=True, kw_only=True)
class SearchedDesigns:
    """Designs with their answers."""

    problem: ParetoProblem  # What was searched
    designs: Float[np.ndarray, "design gene"]  # Genes [unit of the gene]
    answers: Objectives  # Objectives and violations

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

    @property
    def least_violating(self) -> int:
        """Position of the design whose violations sum up to the least; where every design failed, a `SolveError`."""
        at = int(np.argmin(self.answers.total_violation))
        if not self.answers.good[at]:
            raise SolveError(f"Pareto search: all of {len(self.designs)} designs failed.")
        return at

    def _at(self, which: Int[np.ndarray, " kept"]) -> SearchedDesigns:
        answers = self.answers
        return SearchedDesigns(
            problem=self.problem,
            designs=self.designs[which],
            answers=Objectives(
                values=answers.values[which], violation=answers.violation[which], status=answers.status[which]
            ),
        )

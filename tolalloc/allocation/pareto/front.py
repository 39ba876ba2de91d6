"""The Pareto front of cost against the quantile: found on a surrogate, improved and judged by the real kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.effort import FrontEffort
from tolalloc.allocation.local_model import Side
from tolalloc.allocation.pareto.answers import RememberedResponse
from tolalloc.allocation.pareto.found import SearchedDesigns, knee, spread_over
from tolalloc.allocation.pareto.problem import DesignProblem, Ladders
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2, Baseline, RegressionCandidate, gaussian_process
from tolalloc.sensitivity.surrogate.validation import FOLDS, Score, answers_of, cross_validate


@dataclass(frozen=True, kw_only=True)
class Front:
    """Designs of which none is better in every objective, smallest quantile first."""

    designs: Float[np.ndarray, "design variable"]  # Scales [-] and clearances [µm]
    cost: Float[np.ndarray, " design"]  # Cost [cost units]
    quantile: Float[np.ndarray, " design"]  # Quantile of the peak-to-peak that the search was told [arcsec]
    on_kernel: Float[np.ndarray, " design"]  # The same on the real kernel where it was run, NaN elsewhere [arcsec]
    further: Float[np.ndarray, "design criterion"]  # Further objectives [as their names state]
    knee: int  # Position of the design where the front bends most [-]
    failed: int  # Designs that failed on the kernel, in all rounds [-]

    @property
    def rms_error(self) -> float:
        """Root-mean-square difference between what the search was told and the kernel, along the front [arcsec]."""
        return float(np.sqrt(np.nanmean((self.quantile - self.on_kernel) ** 2)))


def _front(found: SearchedDesigns, problem: DesignProblem, number: int) -> Front:
    """Return the front of a search, not yet judged by the kernel."""
    front = found.front(number)
    if not len(front.designs):
        violation = found.answers.violation[found.least_violating]
        raise SolveError(
            "Pareto search: no design keeps every limit; the nearest one exceeds "
            f"{problem.constraints[int(np.argmax(violation))]} by {violation.max():.3g} of it."
        )
    order = np.argsort(front.answers.values[:, 1], kind="stable")
    values = front.answers.values[order]
    return Front(
        designs=problem.designs_of(front.designs[order]),
        cost=values[:, 0],
        quantile=values[:, 1],
        on_kernel=np.full(order.size, np.nan),
        further=values[:, 2:],
        knee=knee(front.losses[order]),
        failed=0,
    )


def pareto_front(
    space: DesignSpace,
    kernel: RememberedResponse,
    baseline: Baseline,
    floor: float,
    designs: Float[np.ndarray, "design variable"],
    convex_front: Float[np.ndarray, "known variable"],
    seeds: SeedTree,
    effort: FrontEffort,
    ladders: Ladders | None = None,
    large: tuple[str, ...] = (),
    sides: tuple[Side, ...] = (),
    largest_failed_share: float = 0.05,
) -> tuple[Front, Score]:
    """Return the front, improved by kernel runs along it, and what the surrogate that it was found on is worth.

    Parameters
    ----------
    space
        The design variables.
    kernel
        Quantile of a design on the real kernel; several searches may share what it remembers.
    baseline
        Convex model of the quantile, which the surrogate corrects.
    floor
        Smallest value of it that is believed [unit of the output].
    designs
        First designs to run on the kernel.
    convex_front
        Designs of the convex program, run on the kernel too and part of every first population.
    seeds
        Node of the seed tree.
    effort
        How much may be spent.
    ladders
        Group → the scales that it may have, rising [-].
    large
        Settings that shall be large, further objectives.
    sides
        Limited sides of other requirements, kept by their local models.
    largest_failed_share
        Share of the kernel's designs that may fail; a design fails with the first of its units [-].

    Raises
    ------
    SolveError
        More designs failed, or none is allowed.
    """
    from tolalloc.allocation.pareto.genetic import search

    problem = DesignProblem(space=space, quantile=kernel, ladders=ladders or {}, large=large, sides=sides)
    known = problem.genes_of(convex_front)
    asked = np.concatenate([designs, problem.designs_of(known)])
    candidate = RegressionCandidate(
        name="corrected convex model",
        columns=kernel.columns,
        outputs=kernel.outputs,
        estimator=lambda: gaussian_process(len(kernel.columns)),
        # Far from its design the convex model may fall below zero.
        baseline=lambda x: np.maximum(baseline(x), floor),
    )
    for number in range(effort.rounds):
        own = seeds.child(str(number))
        answers = answers_of(kernel, asked, own.child("surrogate"), FOLDS, largest_failed_share)
        score = cross_validate(candidate, answers)
        trusted = score.q2 >= NEEDED_Q2
        found = search(
            replace(problem, quantile=candidate.fit(answers.x, answers.y)) if trusted else problem,
            known,
            own,
            effort.population if trusted else effort.population_on_kernel,
            effort.generations if trusted else effort.generations_on_kernel,
        )
        front = _front(found, problem, effort.population)
        picked = spread_over(front.cost.size, effort.points)
        evaluation = kernel(front.designs[picked])
        front.on_kernel[picked] = np.where(evaluation.good, evaluation.values[:, 0], np.nan)
        asked = np.concatenate([asked, front.designs[picked]])
        known = np.concatenate([known, problem.genes_of(front.designs[picked])])
    kernel.answers.write()
    return replace(front, failed=int(np.count_nonzero(~kernel(asked).good))), score

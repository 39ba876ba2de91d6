"""Fronts around a verified allocation: exact by the convex models, searched on a surrogate and on the kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from tolalloc.allocation.front.pareto_problem import (
    DesignProblem,
    Ladders,
    SearchedDesigns,
    from_genes,
    knee,
    spread_over,
    to_genes,
)
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.steering import Programs
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.effort import FrontEffort
from tolalloc.allocation.space.problem import LeastInfeasible, OneSidedConstraint, Solution, Stack
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.models.checkpoint import CachedResponse
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2, Baseline, RegressionCandidate, gaussian_process
from tolalloc.sensitivity.surrogate.validation import FOLDS, Score, answers_of, cross_validate

_LARGEST_FAILED_SHARE = 0.05
"""Share of the kernel's designs that may fail [-]."""


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
    """Return the front of a search, not yet run on the kernel."""
    from tolalloc.allocation.front.genetic import best_front

    front = best_front(found, number)
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
    kernel: CachedResponse,
    baseline: Baseline,
    floor: float,
    designs: Float[np.ndarray, "design variable"],
    convex_front: Float[np.ndarray, "known variable"],
    seeds: SeedTree,
    effort: FrontEffort,
    ladders: Ladders | None = None,
    large: tuple[str, ...] = (),
    others: tuple[OneSidedConstraint, ...] = (),
) -> tuple[Front, Score]:
    """Return the front, improved by kernel runs along it, and what the surrogate that it was found on is worth.

    Parameters
    ----------
    kernel
        Quantile of a design on the real kernel; several searches may share its cached answers.
    baseline
        Convex model of the quantile, which the surrogate corrects.
    floor
        Smallest value of it that is believed [unit of the output].
    designs
        First designs to run on the kernel.
    convex_front
        Designs of the convex program, run on the kernel too and part of every first population.
    ladders
        Group → the scales that it may have, rising [-].
    large
        Settings that shall be large, further objectives.
    others
        Limits of other requirements, kept by their local models.
    """
    from tolalloc.allocation.front.genetic import search

    problem = DesignProblem(space=space, quantile=kernel, ladders=ladders or {}, large=large, others=others)
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
        answers = answers_of(kernel, asked, own.child("surrogate"), FOLDS, _LARGEST_FAILED_SHARE)
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


_SPAN = 2.5
"""Factor around the scales of a design within which the surrogate learns [-]."""


@dataclass(frozen=True, kw_only=True)
class ConvexFront:
    """The cheapest designs for several limits of the peak-to-peak, by the convex models around one design."""

    limits: Float[np.ndarray, " limit"]  # The limits that can be kept [arcsec]
    designs: Float[np.ndarray, "limit variable"]  # Scales [-] and settings
    # Cost, and a lower bound on it over all processes that takes no solver's word [cost units]
    cost: Float[np.ndarray, " limit"]
    bound: Float[np.ndarray, " limit"]


def exact_front(
    space: DesignSpace, stacks: tuple[Stack, ...], limit: float, shares: Float[np.ndarray, " share"]
) -> ConvexFront:
    """Return the cheapest designs for several limits of the peak-to-peak, leaving out those that cannot be kept.

    Parameters
    ----------
    stacks
        Convex models with the budget of the limits, that of the peak-to-peak first.
    limit
        Largest peak-to-peak allowed [arcsec].
    shares
        The limits over that one [-].
    """
    budgets = stacks[0].budget + (shares - 1) * limit
    solved: tuple[Solution | LeastInfeasible | None, ...]
    if space.has_choices:
        solved = process_choice.front(space.problem(stacks), 0, budgets)
    else:
        program = Programs(space).of(np.zeros(len(space.groups), dtype=int), len(stacks))
        solved = tuple(program.solve((replace(stacks[0], budget=own), *stacks[1:])) for own in budgets.tolist())
    known = [(share, own) for share, own in zip(shares.tolist(), solved, strict=True) if isinstance(own, Solution)]
    designs = [np.concatenate([found.zones, found.shared]) for _, found in known]
    return ConvexFront(
        limits=np.array([share * limit for share, _ in known]),
        designs=np.array(designs).reshape(-1, space.lower.size),
        cost=np.array([found.cost + space.locked_cost for _, found in known]),
        bound=np.array([found.bound + space.locked_cost for _, found in known]),
    )


def _designs_around(
    space: DesignSpace, centre: Float[np.ndarray, " variable"], count: int, seeds: SeedTree
) -> Float[np.ndarray, "design variable"]:
    """Return space-filling designs around a centre; settings vary over their whole range."""
    groups = len(space.groups)
    genes = to_genes(centre, groups)
    reach = np.append(np.full(groups, np.log(_SPAN)), np.full(genes.size - groups, np.inf))
    lower = np.maximum(to_genes(space.lower, groups), genes - reach)
    upper = np.maximum(np.minimum(to_genes(space.upper, groups), genes + reach), lower)
    unit = qmc.LatinHypercube(genes.size, rng=seeds.generator()).random(count)
    return from_genes(lower + unit * (upper - lower), groups)


def searched_front(
    space: DesignSpace,
    kernel: CachedResponse,
    best: VerifiedDesign,
    stacks: tuple[Stack, ...],
    exact: ConvexFront,
    seeds: SeedTree,
    effort: FrontEffort,
    ladders: Ladders | None = None,
    large: tuple[str, ...] = (),
) -> tuple[Front, Score]:
    """Return the front of cost against the quantile of the output around a verified design, and its surrogate's score.

    Parameters
    ----------
    kernel
        Quantile of a design on the real kernel, common random numbers, at the spread of the verified design.
    best
        The verified design.
    stacks
        Its local models with at least the budget that it takes; designs must keep those of the other requirements.
    exact
        Exact front of its models, from which the search starts.
    ladders
        Group → the scales that it may have, rising [-].
    large
        Settings that shall be large, further objectives.
    """
    # A load that is its own budget may lie beyond it by rounding.
    others = tuple(
        replace(other, stack=replace(own, budget=own.budget + 1e-9 * other.scale))
        for other, own in zip(best.constraints[1:], stacks[1:], strict=True)
    )
    return pareto_front(
        space,
        kernel,
        best.constraints[0].predicted_value,
        best.constraints[0].limit / 60,
        _designs_around(space, best.design, effort.designs, seeds.child("designs")),
        np.concatenate([best.design[np.newaxis], exact.designs[spread_over(len(exact.designs), effort.points)]]),
        seeds.child("pareto"),
        effort,
        ladders=ladders,
        large=large,
        others=others,
    )


@dataclass(frozen=True, kw_only=True)
class Fronts:
    """What can be had at which cost."""

    exact: ConvexFront  # The convex program's front around the chosen design, with its certificate
    # The front of NSGA-II on the corrected model, cost against quantile, with runs of the real model along it
    searched: Front
    # The front of NSGA-III with the last setting as a third objective, to be large; none without settings
    with_setting: Front | None
    score: Score  # What the surrogate is worth that the searches ran on if its Q² is high enough

"""Fronts around a verified allocation: exact by the convex models, searched on the kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.effort import FrontEffort
from tolalloc.allocation.pareto import Front, from_genes, pareto_front, to_genes
from tolalloc.allocation.pareto.answers import RememberedResponse
from tolalloc.allocation.pareto.found import spread_over
from tolalloc.allocation.pareto.problem import Ladders
from tolalloc.allocation.program import process_choice
from tolalloc.allocation.program.convex import front
from tolalloc.allocation.program.problem import Solution, Stack
from tolalloc.allocation.programs import Programs
from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.drawings.seeds import SeedTree
from tolalloc.sensitivity.surrogate.validation import Score

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
    space
        The design variables.
    stacks
        Convex models with the budget of the limits, that of the peak-to-peak first.
    limit
        Largest peak-to-peak allowed [arcsec].
    shares
        The limits over that one [-].
    """
    budgets = stacks[0].budget + (shares - 1) * limit
    if space.has_choices:
        chosen = process_choice.front(space.problem(stacks), 0, budgets)
        solved = [found if isinstance(found, Solution) else None for found in chosen]
    else:
        program = Programs(space, len(stacks)).of(np.zeros(len(space.groups), dtype=int))
        solved = [*front(program, stacks, 0, budgets)]
    known = [(share, found) for share, found in zip(shares.tolist(), solved, strict=True) if found]
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
    kernel: RememberedResponse,
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
    space
        The design variables.
    kernel
        Quantile of a design on the real kernel, common random numbers, at the spread of the verified design.
    best
        The verified design.
    stacks
        Its local models with at least the budget that it takes; designs must keep those of the other requirements.
    exact
        Exact front of its models, from which the search starts.
    seeds
        Node of the seed tree.
    effort
        How much may be spent.
    ladders
        Group → the scales that it may have, rising [-].
    large
        Settings that shall be large, further objectives.
    """
    # A load that is its own budget may lie beyond it by rounding.
    others = zip(best.sides[1:], stacks[1:], strict=True)
    sides = tuple(replace(side, stack=replace(own, budget=own.budget + 1e-9 * side.scale)) for side, own in others)
    return pareto_front(
        space,
        kernel,
        best.sides[0].predicted_value,
        best.sides[0].limit / 60,
        _designs_around(space, best.design, effort.designs, seeds.child("designs")),
        np.concatenate([best.design[np.newaxis], exact.designs[spread_over(len(exact.designs), effort.points)]]),
        seeds.child("pareto"),
        effort,
        ladders=ladders,
        large=large,
        sides=sides,
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

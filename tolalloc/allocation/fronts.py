"""Fronts around a verified allocation: exact by the convex models, searched on the kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from tolalloc.allocation.by_hand import scale_by_hand
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.pareto import Front, from_genes, pareto_front, to_genes
from tolalloc.allocation.program.front import front
from tolalloc.allocation.quantile import LocalQuantile, QuantileResponse
from tolalloc.allocation.search import Allocation, SearchEffort, allocate, cheapest_by_models
from tolalloc.allocation.trust_region import SETTLED, Programs
from tolalloc.allocation.verification import VerifiedDesign, Verifier, answer
from tolalloc.reducer.design import Modification
from tolalloc.surrogate.regression import Surrogate
from tolalloc.uncertainty.seeds import SeedTree


@dataclass(frozen=True, kw_only=True)
class ConvexFront:
    """The cheapest designs for several limits of the peak-to-peak, by the convex models around one design.

    Parameters
    ----------
    limits
        The limits that can be kept [arcsec].
    designs
        Scales [-] and clearances [µm].
    cost, bound
        Cost, and a lower bound on it that takes no solver's word [cost units].
    """

    limits: Float[np.ndarray, " limit"]
    designs: Float[np.ndarray, "limit variable"]
    cost: Float[np.ndarray, " limit"]
    bound: Float[np.ndarray, " limit"]


@dataclass(frozen=True, kw_only=True)
class AllocationWithFront(Allocation):
    """The same with the Pareto front of cost against the quantile of the peak-to-peak.

    Parameters
    ----------
    surrogate
        Surrogate of the quantile over designs, with its Q².
    front
        Pareto front of cost against the quantile.
    exact
        Front of the convex program, the seed of NSGA-II.
    """

    surrogate: Surrogate
    front: Front
    exact: ConvexFront


def exact_front(space: DesignSpace, best: VerifiedDesign, shares: Float[np.ndarray, " share"]) -> ConvexFront:
    """Return the cheapest designs for several limits of the peak-to-peak, leaving out those that cannot be kept.

    Parameters
    ----------
    space
        The design variables.
    best
        The verified design whose models count; its processes stay.
    shares
        The limits over the one asked for [-].
    """
    program = Programs(space, len(best.sides)).of(space.process_positions(best.design))
    first, stacks = best.sides[0], [side.stack for side in best.sides]
    solved = front(program, stacks, 0, first.stack.room + (shares - 1) * first.limit)
    known = [(share, found) for share, found in zip(shares.tolist(), solved, strict=True) if found]
    designs = [np.concatenate([found.zones, found.shared]) for _, found in known]
    return ConvexFront(
        limits=np.array([share * first.limit for share, _ in known]),
        designs=np.array(designs).reshape(-1, space.lower.size),
        cost=np.array([found.cost + space.locked_cost for _, found in known]),
        bound=np.array([found.bound + space.locked_cost for _, found in known]),
    )


def designs_around(
    space: DesignSpace, centre: Float[np.ndarray, " variable"], span: float, count: int, seeds: SeedTree
) -> Float[np.ndarray, "design variable"]:
    """Return space-filling designs around a centre; clearances vary over their whole range."""
    genes = to_genes(centre)
    reach = np.append(np.full(genes.size - 2, np.log(span)), [np.inf, np.inf])
    lower = np.maximum(to_genes(space.lower), genes - reach)
    upper = np.maximum(np.minimum(to_genes(space.upper), genes + reach), lower)
    unit = qmc.LatinHypercube(genes.size, rng=seeds.generator()).random(count)
    return from_genes(lower + unit * (upper - lower))


def allocate_with_front(
    response: QuantileResponse,
    verifier: Verifier,
    modification: Modification,
    seeds: SeedTree,
    effort: SearchEffort,
) -> AllocationWithFront:
    """Return the cheapest verified allocation, and the front of cost against the quantile of the peak-to-peak.

    Parameters
    ----------
    response
        Quantile of a design on the real kernel, common random numbers.
    verifier
        Judges designs on fresh units.
    modification
        The reducer's own modification, kept by the scaling by hand.
    seeds
        Node of the seed tree.
    effort
        How much may be spent.
    """
    space = verifier.space
    found = allocate(verifier, scale_by_hand(verifier, modification, effort.steps), effort)
    best = found.chosen
    exact = exact_front(space, best, np.linspace(0.6, 1.5, effort.front.points))
    pareto, surrogate = pareto_front(
        replace(response, spread=best.spread),
        LocalQuantile(side=best.sides[0]),
        designs_around(space, best.design, 2.5, effort.front.designs, seeds.child("designs")),
        exact.designs,
        seeds.child("pareto"),
        effort.front,
    )
    # The front may have found something cheaper; it counts only if fresh units say so.
    cheaper = (pareto.quantile <= best.quantile_bound) & (pareto.cost < (1 - SETTLED) * best.cost)
    tried, chosen, optimum = found.tried, found.chosen, found.optimum
    if cheaper.any():
        tried += (verifier.verify(pareto.designs[cheaper][np.argmin(pareto.cost[cheaper])], "front"),)
        chosen = answer(tried)
        optimum = cheapest_by_models(space, chosen, tried)
    return AllocationWithFront(
        limit=found.limit,
        groups=found.groups,
        chosen=chosen,
        tried=tried,
        hand_tried=found.hand_tried,
        optimum=optimum,
        locked_cost=found.locked_cost,
        surrogate=surrogate,
        front=pareto,
        exact=exact,
    )

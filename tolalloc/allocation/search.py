"""From a requirement to a verified allocation: steps of the convex program, by hand beside it, and the front."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from tolalloc.allocation.convex import ConvexAllocation, cost_bound
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.pareto import Front, FrontEffort, from_genes, pareto_front, to_genes
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.verification import Requirement, VerifiedDesign, Verifier, answer
from tolalloc.exceptions import InputError
from tolalloc.reducer.design import Modification
from tolalloc.surrogate.regression import Surrogate
from tolalloc.uncertainty.seeds import SeedTree

AIM = 0.985
"""Internal limit over the limit: about one standard error of the verified quantile inside it [-]."""

SETTLED = 0.01
"""Relative gain of cost that the next step must promise for a search to go on from a met design [-]."""


_SIMILAR = 0.1
"""Relative difference of cost within which designs share one convex model [-]."""


@dataclass(frozen=True, kw_only=True)
class SearchEffort:
    """How much the search may spend.

    Parameters
    ----------
    steps
        Largest number of verified steps of each search [-].
    reach
        Factor by which a scale may change in the first step; later ones reach less [-].
    front
        Effort of the Pareto front.
    """

    steps: int = 8
    reach: float = 2.5
    front: FrontEffort = field(default_factory=FrontEffort)


@dataclass(frozen=True, kw_only=True)
class Allocation:
    """Everything that the search found.

    Parameters
    ----------
    limit
        Largest peak-to-peak allowed [arcsec].
    chosen
        The cheapest design that fresh units on the real kernel show to be met, or the least violating one.
    tried
        All designs verified on the way, in order.
    by_hand
        Zones of the tolerance table scaled alike until met, modification as it was.
    baseline
        The tolerance table as it is, modification as it was.
    bound
        Lower bound on the cost of every design to which the chosen design's convex model gives its own quantile
        [cost units].
    surrogate
        Surrogate of the quantile over designs, with its Q².
    front
        Pareto front of cost against the quantile.
    convex_front
        Designs of the convex program for a ladder of limits, the seed of NSGA-II [-, µm].
    """

    limit: float
    chosen: VerifiedDesign
    tried: tuple[VerifiedDesign, ...]
    by_hand: VerifiedDesign
    baseline: VerifiedDesign
    bound: float
    surrogate: Surrogate
    front: Front
    convex_front: Float[np.ndarray, "design variable"]

    @property
    def gap(self) -> float:
        """Cost of the chosen design over the bound, minus one [-]."""
        return self.chosen.cost / self.bound - 1

    @property
    def saving(self) -> float:
        """Cost saved against uniform scaling, as a share of its cost [-]."""
        return 1 - self.chosen.cost / self.by_hand.cost

    @property
    def saving_at_least(self) -> float:
        """The same had uniform scaling used the limit to its last arcsecond: so its cost moved with it [-].

        The quantile grows nearly in proportion to a common scale of all zones, and the cost falls with it.
        """
        unused = min(1.0, self.by_hand.quantile_bound / self.limit)
        return 1 - self.chosen.cost / (self.by_hand.cost * unused)


def require_reachable(response: QuantileResponse, requirement: Requirement, place: str) -> None:
    """Raise unless the smallest zones of the table, with the best corner of the clearances, can keep the limit.

    Raises
    ------
    InputError
        The limit is below what the smallest zones leave, or no zone may change.
    """
    if not response.space.groups:
        raise InputError(f"{place}, tolerance table: every zone is locked or zero, so there is nothing to allocate.")
    lower, upper = response.space.lower, response.space.upper
    corners = [[*lower[:-2], flank, radial] for flank in (lower[-2], upper[-2]) for radial in (lower[-1], upper[-1])]
    least = float(response(np.array(corners)).values.min())
    if not least <= requirement.limit:
        raise InputError(
            f"{place}: limit_arcsec is {requirement.limit:g}; allowed is {least:.3g} or more, the peak-to-peak that "
            f"{requirement.target:.2%} of units keep with every zone at its smallest (min in the tolerance table)."
        )


def scale_by_hand(verifier: Verifier, modification: Modification, steps: int) -> tuple[VerifiedDesign, ...]:
    """Return designs with all zones scaled alike, the first the tolerance table as it is.

    Notes
    -----
    The scale follows the design's own gradient until a met design has next to nothing left to gain: what an
    engineer does with a few Monte Carlo runs.
    """
    space, limit, scale = verifier.space, verifier.requirement.limit, 1.0
    tried: list[VerifiedDesign] = []
    for step in range(steps):
        tried.append(verifier.verify(space.uniform(scale, modification), f"by hand {step + 1}"))
        bound = tried[-1].quantile_bound
        rise = max(float(tried[-1].by_zone @ space.errors.zones) * scale, 0.1 * bound)
        factor = float(np.clip(1 + (AIM * limit - bound) / rise, 0.4, 2.5))
        if tried[-1].met and factor < 1 + SETTLED:
            break
        scale *= factor
    return tuple(tried)


def step_to_optimum(
    verifier: Verifier, program: ConvexAllocation, start: VerifiedDesign, effort: SearchEffort
) -> tuple[VerifiedDesign, ...]:
    """Return the designs of a trust-region sequence; each is verified on fresh units before the next is made.

    Parameters
    ----------
    verifier
        Judges the designs and gives the convex model around each.
    program
        The convex program.
    start
        A verified design to start from.
    effort
        Steps and first reach.

    Notes
    -----
    A quantile bound of a few thousand units is uncertain by a percent or two. Where the model of the last design also
    explains earlier ones of similar cost, their mean deviation from it corrects it, so the noise averages out.
    """
    space, limit, reach = verifier.space, verifier.requirement.limit, effort.reach
    tried = [start]
    for step in range(effort.steps):
        last = tried[-1]
        design = np.clip(last.design, space.lower, space.upper)
        lower, upper = np.maximum(space.lower, design / reach), np.minimum(space.upper, design * reach)
        similar = [item for item in tried if abs(item.cost / last.cost - 1) < _SIMILAR]
        correction = float(np.mean([item.quantile_bound - last.local(item.design) for item in similar]))
        found = program.solve(last.local, AIM * limit - correction, lower, upper)
        if found is None:  # even the region's smallest zones do not reach the limit: they are the step to take
            found = np.append(lower[:-2], np.where(last.local.slopes > 0, lower[-2:], upper[-2:]))
        if step > 0 and last.met and space.cost(found) > (1 - SETTLED) * last.cost:
            break
        tried.append(verifier.verify(found, f"convex {step + 1}"))
        reach = max(1.25, float(np.sqrt(reach)))
    return tuple(tried[1:])


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


def allocate(
    response: QuantileResponse,
    verifier: Verifier,
    modification: Modification,
    seeds: SeedTree,
    effort: SearchEffort,
) -> Allocation:
    """Return the cheapest verified allocation and what it is compared with.

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
    space, limit = response.space, verifier.requirement.limit
    by_hand, program = scale_by_hand(verifier, modification, effort.steps), ConvexAllocation(space)
    tried = step_to_optimum(verifier, program, answer(by_hand), effort)
    best = answer(tried)
    convex_front = program.front(best.local, np.linspace(0.6, 1.5, effort.front.points) * limit)
    front, surrogate = pareto_front(
        replace(response, spread=best.spread),
        best.local,
        designs_around(space, best.design, 2.5, effort.front.designs, seeds.child("designs")),
        convex_front,
        seeds.child("pareto"),
        effort.front,
    )
    # The front may have found something cheaper; it counts only if fresh units say so.
    cheaper = (front.quantile <= best.quantile_bound) & (front.cost < (1 - SETTLED) * best.cost)
    if cheaper.any():
        tried += (verifier.verify(front.designs[cheaper][np.argmin(front.cost[cheaper])], "front"),)
    chosen = answer(tried)
    return Allocation(
        limit=limit,
        chosen=chosen,
        tried=tried,
        by_hand=answer(by_hand),
        baseline=by_hand[0],
        bound=cost_bound(space, chosen.local, float(chosen.local(chosen.design)), chosen.design),
        surrogate=surrogate,
        front=front,
        convex_front=convex_front,
    )

"""Whether assemblies built at random with allocated tolerances keep the limits of the final angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.assembly.angular.allocation import AngularAllocation
from tolalloc.assembly.gains import assembled
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.trajectory import random_numbers
from tolalloc.capability.indices import ShareInterval, wilson_interval
from tolalloc.drawing.seeds import CHUNK, SeedTree


@dataclass(frozen=True, kw_only=True)
class AngularVerification:
    """What a sample of assemblies shows of an allocation.

    Parameters
    ----------
    assemblies
        Number of assemblies [-].
    spread
        Three standard deviations of what is limited [rad].
    standard_error
        Standard error of the spread [rad].
    shares
        Share of the assemblies within each limit.
    share
        Share within all limits at once.
    """

    assemblies: int
    spread: Float[np.ndarray, " limit"]
    standard_error: Float[np.ndarray, " limit"]
    shares: tuple[ShareInterval, ...]
    share: ShareInterval


def verify_angles(
    plan: AssemblyPlan, allocation: AngularAllocation, seeds: SeedTree, assemblies: int = 100_000
) -> AngularVerification:
    """Return what assemblies of normally distributed parts, readings and adjustments show of an allocation.

    Parameters
    ----------
    plan
        What is assembled.
    allocation
        Its tolerances and gains.
    seeds
        Node of the seed tree.
    assemblies
        Number of assemblies [-].

    Notes
    -----
    An assembly is within a tilt limit where √(x² + y²) is, which is not what three standard deviations of x and y
    together promise of one normal angle: of assemblies that just keep a limit 99.73 % are within it where the tilt has
    one direction only, and 1 − exp(−9) = 99.988 % where it has none.
    """
    squares = np.concatenate(
        [
            _final(plan, allocation, seeds.generator(index), min(CHUNK, assemblies - start)) ** 2
            for index, start in enumerate(range(0, assemblies, CHUNK))
        ]
    )
    limited = squares @ allocation.limits.counted.T
    variance = limited.mean(axis=0)
    within: Bool[np.ndarray, "assembly limit"] = limited <= allocation.limits.values**2
    return AngularVerification(
        assemblies=assemblies,
        spread=3 * np.sqrt(variance),
        # That of a mean, through the derivative of the square root.
        standard_error=3 * limited.std(axis=0, ddof=1) / np.sqrt(assemblies) / (2 * np.sqrt(variance)),
        shares=tuple(wilson_interval(assemblies, int(each)) for each in within.sum(axis=0)),
        share=wilson_interval(assemblies, int(within.all(axis=1).sum())),
    )


def _final(
    plan: AssemblyPlan, allocation: AngularAllocation, generator: np.random.Generator, assemblies: int
) -> Float[np.ndarray, "assembly state"]:
    """Return final states of one chunk of assemblies [rad]."""
    # A whole chunk is drawn, so that the first assemblies are the same however many follow.
    standard = generator.standard_normal((CHUNK, random_numbers(plan.space)))[:assemblies]
    return np.asarray(assembled(plan, allocation.gains, allocation.tolerances, standard).adjusted[:, -1])

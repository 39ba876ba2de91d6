"""Tolerance stacks by the usual methods: how the zones of features add up to that of a requirement.

Every stack has the name of what it keeps; `sensitivities`, the change of the requirement with every feature [unit of
the requirement per unit of the feature]; and the budget, which is the zone of the requirement [unit of the
requirement]. Zones and budgets are counted alike: all of them are ± tolerances, or all of them full widths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import brentq
from scipy.stats import norm

from tolalloc.allocation.space.problem import Stack
from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError


def worst_case(name: str, sensitivities: Float[np.ndarray, " feature"], budget: float) -> Stack:
    """Return the stack in which all zones are used up on the bad side at once."""
    return mean_shift(name, sensitivities, budget, shift=1.0)


def root_sum_square(name: str, sensitivities: Float[np.ndarray, " feature"], budget: float) -> Stack:
    """Return the stack of independent, centred features whose zones hold equally many standard deviations."""
    return mean_shift(name, sensitivities, budget, shift=0.0)


def inflated(name: str, sensitivities: Float[np.ndarray, " feature"], budget: float, factor: float) -> Stack:
    """Return the root sum square times a factor, such as Bender's 1.5.

    Parameters
    ----------
    factor
        What the root sum square is multiplied by, 1 or above [-].

    Raises
    ------
    InputError
        A factor below 1.

    References
    ----------
    Bender 1962.
    """
    if not factor >= 1:
        raise InputError.at(f"stack {name}", "factor", factor, "1 or above")
    return root_sum_square(name, factor * sensitivities, budget)


def modified_root_sum_square(name: str, sensitivities: Float[np.ndarray, " feature"], budget: float) -> Stack:
    """Return the modified root sum of squares, which lies between the root sum square and the worst case.

    Raises
    ------
    InputError
        Fewer than three features count; for two the method leaves the worst case behind.

    Notes
    -----
    The root sum square R is multiplied by 0.5·(W − R)/(R·(√n − 1)) + 1, where W is the worst case. That factor changes
    with the zones, but the product is h·W + (1 − h)·R with the constant h = 0.5/(√n − 1): a mean shift of h.

    References
    ----------
    Dimensioning and Tolerancing Handbook 1999, chapter 9.
    """
    count = np.count_nonzero(sensitivities)
    if count < 3:
        raise InputError.at(f"stack {name}", "number of features that count", count, "3 or more")
    return mean_shift(name, sensitivities, budget, shift=float(0.5 / (np.sqrt(count) - 1)))


def mean_shift(
    name: str,
    sensitivities: Float[np.ndarray, " feature"],
    budget: float,
    shift: float | Float[np.ndarray, " feature"],
) -> Stack:
    """Return the stack of features whose means may be off by a share of the zone, all on the bad side.

    Parameters
    ----------
    shift
        Largest shift of the mean over half the width of the zone, one for all features or one each: 0 is the root sum
        square, 1 the worst case [-].

    Raises
    ------
    InputError
        A shift that is not between 0 and 1.

    References
    ----------
    Greenwood & Chase 1987, the estimated mean shift.
    """
    if not np.all((np.asarray(shift) >= 0) & (np.asarray(shift) <= 1)):
        raise InputError.at(f"stack {name}", "shift", np.asarray(shift).tolist(), "a share between 0 and 1")
    weights = np.abs(sensitivities)
    return Stack(name=name, worst_case=shift * weights, root_sum_square=(1 - shift) * weights, budget=budget)


def inertial(name: str, sensitivities: Float[np.ndarray, " feature"], budget: float, capability: float) -> Stack:
    """Return the stack of inertias that guarantees a Cpk of the requirement, however each is split.

    Parameters
    ----------
    budget
        Half the width between the limits of the requirement, which is centred [unit of the requirement].
    capability
        Least Cpk of the requirement, 0 or above [-].

    Raises
    ------
    InputError
        A negative Cpk.

    Notes
    -----
    The zone of a feature is its largest inertia I, with I² = σ² + δ² for its standard deviation σ and the distance δ
    of its mean from the target. The requirement has δ_Y ≤ Σ|D_i|δ_i and σ_Y² = ΣD_i²σ_i², and Cpk ≥ C asks for
    δ_Y + 3C·σ_Y ≤ T. With a_i = |D_i|δ_i and V² = ΣD_i²I_i² the left side is at most √n·‖a‖ + 3C·√(V² − ‖a‖²), and
    that at most √(n + 9C²)·V (Cauchy's inequality twice), n being the number of features that count. So
    √(n + 9C²)·‖D∘I‖ ≤ T guarantees the Cpk for every split. It is attained, and no wider inertias would do, where
    every |D_i|I_i reaches V/√(n + 9C²), as where all are equal. The plain sum of squares, 3C·‖D∘I‖ ≤ T, guarantees
    it only for centred means.

    References
    ----------
    Pillet 2004, inertial tolerancing.
    """
    if not capability >= 0:
        raise InputError.at(f"stack {name}", "capability", capability, "a Cpk of 0 or above")
    factor = np.sqrt(np.count_nonzero(sensitivities) + 9 * capability**2)
    return root_sum_square(name, factor * sensitivities, budget)


def yield_root_sum_square(
    name: str,
    sensitivities: Float[np.ndarray, " feature"],
    limits: Limits,
    mean: float,
    share: float,
    deviations: float = 3.0,
) -> Stack:
    """Return the stack that keeps the yield of a normal requirement; its budget is the largest standard deviation.

    Parameters
    ----------
    limits
        Limits of the requirement.
    mean
        Its mean, between the limits [unit of the requirement].
    share
        Share of the units inside the limits, above a half [-].
    deviations
        Standard deviations of a feature in its zone [-].

    Raises
    ------
    InputError
        The mean is not between the limits, or the share not between a half and 1.

    Notes
    -----
    The share outside grows with the standard deviation. It is too large where the nearer limit alone cuts it off, and
    small enough where both cut off half of it each.
    """
    distance = limits.distance(mean)
    if not distance > 0:
        raise InputError.at(f"stack {name}", "mean", mean, "a number between the limits")
    if not 0.5 < share < 1:
        raise InputError.at(f"stack {name}", "share", share, "a share between 0.5 and 1")
    budget = brentq(
        lambda deviation: limits.normal_share_outside(mean, deviation) - (1 - share),
        0.999 * distance / norm.ppf((1 + share) / 2),
        1.001 * distance / norm.ppf(share),
        xtol=1e-14 * distance,
        rtol=1e-14,
    )
    return root_sum_square(name, sensitivities / deviations, float(budget))


@dataclass(frozen=True, kw_only=True)
class StackLimits:
    """Between which values a requirement lies [unit of the requirement]."""

    nominal: float  # Value at the nominal sizes
    worst_case: tuple[float, float]  # Smallest and largest value inside all limits
    root_sum_square: tuple[float, float]  # Nominal less and plus the quadrature of what each side may add
    centred: tuple[float, float]  # Middle of the worst case less and plus the quadrature of half the zones


def stack_limits(
    sensitivities: Float[np.ndarray, " feature"],
    nominal: Float[np.ndarray, " feature"],
    plus: Float[np.ndarray, " feature"],
    minus: Float[np.ndarray, " feature"],
) -> StackLimits:
    """Return the limits of a requirement whose features may deviate by unequal amounts upwards and downwards.

    Parameters
    ----------
    nominal
        Nominal sizes of the features, without the direction in which they count [unit of the feature].
    plus, minus
        Upper and lower limit deviation of each, the lower one with its sign [unit of the feature].

    Raises
    ------
    InputError
        A zone beside its nominal size, from which no quadrature can start.

    Notes
    -----
    The quadrature side by side from the nominal takes each half of a zone as that of a symmetrical one, so it is not
    centred on the mean that features have in the middle of their zones. The centred one is: features that are normal
    there, with half the zone three standard deviations, lie inside it in 99.73 % of all units.

    Examples
    --------
    A housing of 10 mm (+50, −50 µm) less a part of 9.8 mm (+30, −20 µm):

    >>> size, plus, minus = np.array([10.0, 9.8]), np.array([0.05, 0.03]), np.array([-0.05, -0.02])
    >>> found = stack_limits(np.array([1.0, -1.0]), size, plus, minus)
    >>> [f"{value:.3f}" for value in found.worst_case + found.root_sum_square]
    ['0.120', '0.270', '0.142', '0.254']
    """
    if not np.all((plus >= 0) & (minus <= 0)):
        limits = [list(pair) for pair in zip(minus.tolist(), plus.tolist(), strict=True)]
        raise InputError.at("stack", "limit deviations", limits, "zones that hold their nominal size")
    value, ends = float(sensitivities @ nominal), np.sort([sensitivities * minus, sensitivities * plus], axis=0)
    middle, half = value + float(ends.mean(axis=0).sum()), float(np.linalg.norm(np.ptp(ends, axis=0) / 2))
    return StackLimits(
        nominal=value,
        worst_case=(value + float(ends[0].sum()), value + float(ends[1].sum())),
        root_sum_square=(value - float(np.linalg.norm(ends[0])), value + float(np.linalg.norm(ends[1]))),
        centred=(middle - half, middle + half),
    )

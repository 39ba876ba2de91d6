"""What measuring does to a limit: guard bands, the risks of both sides, and parts enough to show a capability."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np
from jaxtyping import Float

from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError

COVERAGE = 2.0
"""Coverage factor of an expanded uncertainty, U = 2·u [-]."""
CONFORMANCE = 0.95
"""Probability with which an accepted part at the edge of the guard band keeps the limit; ISO 14253-1:2017 [-]."""
FEWEST, MOST = 5, 10_000
"""Parts between which a sample is stated [-]."""
_REACH, _POINTS = 8.0, 4001
"""Standard deviations up to which a process is integrated, and points of that [-]."""


def guard_band(expanded: float, conformance: float = CONFORMANCE) -> float:
    """Return how far inside a limit a reading must lie to show that the part keeps it.

    Parameters
    ----------
    expanded
        Expanded uncertainty U with the coverage factor 2, of any unit.
    conformance
        Probability that a part just accepted keeps the limit, from one half to below 1 [-].

    Returns
    -------
    float
        g = z(conformance)·U/2, 0.82·U at 95 % [unit of the uncertainty].

    References
    ----------
    ISO 14253-1:2017, Decision rules for verifying conformity or nonconformity with specifications.

    Examples
    --------
    >>> round(guard_band(1.0), 4)
    0.8224
    """
    from scipy.special import ndtri

    if not 0.5 <= conformance < 1.0:
        raise InputError.at("guard band", "conformance", conformance, "0.5 to below 1")
    return float(ndtri(conformance)) * expanded / COVERAGE


@dataclass(frozen=True, kw_only=True)
class Risks:
    """Shares of all parts on which a gauge decides wrongly [-]."""

    consumer: float  # Accepted although they miss a limit
    producer: float  # Rejected although they keep both
    accepted: float  # All that are accepted


def risks(mean: float, deviation: float, limits: Limits, expanded: float, guard: float = 0.0) -> Risks:
    """Return the global risks of a normal process that is measured with a normal error.

    Parameters
    ----------
    mean, deviation
        Of the true values, the deviation above 0 [unit of the limits].
    limits
        Those of the drawing.
    expanded
        Expanded uncertainty of a reading, U = 2·u [unit of the limits].
    guard
        How far inside the limits a reading must lie to be accepted, negative outside [unit of the limits].

    Notes
    -----
    R_C = ∫outside φ(x)·P(accepted | x) dx and R_P = ∫inside φ(x)·P(rejected | x) dx [-], theory page equation (109), as
    JCGM 106, (17) and (19); process and reading normal, over 8 standard deviations to either side by Simpson's rule.

    References
    ----------
    JCGM 106:2012, The role of measurement uncertainty in conformity assessment.
    """
    from scipy.integrate import simpson
    from scipy.special import ndtr
    from scipy.stats import norm

    lower = -np.inf if limits.lower is None else limits.lower
    upper = np.inf if limits.upper is None else limits.upper
    error = expanded / COVERAGE

    process = norm(mean, deviation)
    if not lower + guard < upper - guard:  # no reading is accepted
        return Risks(consumer=0.0, producer=float(process.cdf(upper) - process.cdf(lower)), accepted=0.0)
    if not error > 0.0:
        inside = process.cdf(upper - guard) - process.cdf(lower + guard)
        both = process.cdf(min(upper, upper - guard)) - process.cdf(max(lower, lower + guard))
        kept = process.cdf(upper) - process.cdf(lower)
        return Risks(consumer=float(inside - both), producer=float(kept - both), accepted=float(inside))

    def accepted(x: Float[np.ndarray, " point"]) -> Float[np.ndarray, " point"]:
        return np.asarray(ndtr((upper - guard - x) / error) - ndtr((lower + guard - x) / error))

    def share(low: float, high: float, *, rejected: bool = False) -> float:
        low, high = max(low, mean - _REACH * deviation), min(high, mean + _REACH * deviation)
        if not low < high:
            return 0.0
        x = np.linspace(low, high, _POINTS)
        return float(simpson(process.pdf(x) * (1.0 - accepted(x) if rejected else accepted(x)), x=x))

    consumer = share(-np.inf, lower) + share(upper, np.inf)
    return Risks(
        consumer=consumer,
        producer=share(lower, upper, rejected=True),
        accepted=share(lower, upper) + consumer,
    )


def capability_bound(shown: float, parts: int, confidence: float = 0.95) -> float:
    """Return what a Cpk shown by a sample is at least, with one-sided confidence [-].

    Notes
    -----
    Cpk − z·√(1/(9n) + Cpk²/(2(n − 1))).

    References
    ----------
    A. F. Bissell, How reliable is your capability index?, Applied Statistics 39 (1990) 331–340.
    """
    from scipy.special import ndtri

    error = sqrt(1.0 / (9.0 * parts) + shown**2 / (2.0 * (parts - 1)))
    return shown - float(ndtri(confidence)) * error


def parts_to_show(demanded: float, shown: float, confidence: float = 0.95) -> int:
    """Return how many parts with a Cpk of so much show another one with one-sided confidence [-].

    Parameters
    ----------
    demanded, shown
        What must be shown, and what the sample has; the latter is the larger one.
    confidence
        [-]

    Returns
    -------
    int
        From 5; 10,000 where that is not enough.

    Examples
    --------
    A sample of 53 parts with Cpk 1.6 shows 1.33, by Bissell's bound:

    >>> parts_to_show(1.33, 1.6)
    53
    """
    if not (0 < demanded < shown and isfinite(shown)):
        raise InputError.at("sample", "shown Cpk", shown, f"more than the {demanded:g} that must be shown")
    low, high = FEWEST, MOST
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if capability_bound(shown, middle, confidence) >= demanded else (middle + 1, high)
    return low

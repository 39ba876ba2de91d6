"""Which gauge pays: what a reading costs, against good parts that it rejects and bad ones that it passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, ClassVar

from tolalloc.capability.conformity import COVERAGE, Risks, risks
from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields, a, is_number, number

_FAR = 4.0
"""Standard uncertainties to either side of a limit between which the cheapest guard band is searched [-]."""
_AMOUNT = number("a finite number, 0 or above", least=0)


@dataclass(frozen=True, kw_only=True)
class Gauge(NamedFields):
    """A gauge that a line of the drawing could be measured with.

    Parameters
    ----------
    name
        As the measuring room calls it.
    uncertainty
        Expanded uncertainty of a reading, U = 2·u [unit of the limits].
    price
        What a reading costs, the gauge's own price spread over its readings [cost units].
    """

    called: ClassVar[str] = "gauge"

    name: Annotated[str, a(str, "a name")]
    uncertainty: Annotated[float, _AMOUNT]
    price: Annotated[float, _AMOUNT]


@dataclass(frozen=True, kw_only=True)
class GaugeCost:
    """What measuring every part with a gauge costs at the guard band that makes it cheapest."""

    gauge: Gauge
    guard: float  # How far inside a limit a reading must lie; negative outside [unit of the limits]
    risks: Risks
    cost: float  # Per part: the reading, rejected parts, bad parts that pass [cost units]


def costs_of_gauges(
    gauges: Sequence[Gauge],
    mean: float,
    deviation: float,
    *,
    lower: float | None = None,
    upper: float | None = None,
    rejected: float,
    escaped: float,
) -> tuple[GaugeCost, ...]:
    """Return what gauges cost for parts of a normal process that are all measured, the cheapest first.

    Parameters
    ----------
    gauges
        Those to choose from.
    mean, deviation
        Of the true values, the deviation above 0 [unit of the limits].
    lower, upper
        Limits of the drawing, one of which may be absent.
    rejected, escaped
        Cost of a part that is rejected, and of a bad part that passes [cost units].

    Returns
    -------
    tuple of GaugeCost

    Raises
    ------
    InputError
        No gauge, no limit, or a deviation or a cost that is not allowed.

    Notes
    -----
    c(g) = price + rejected·(1 − P(accepted)) + escaped·R_C, at the guard band g that makes it least. With one limit U a
    reading y is accepted where P(x > U | y) ≤ rejected/escaped, so that with λ = σ²/(σ² + u²)
    g = (U − mean)·(1 − 1/λ) + z(1 − rejected/escaped)·u/√λ (own derivation, tested).

    References
    ----------
    JCGM 106:2012, The role of measurement uncertainty in conformity assessment, for the risks.
    """
    if not gauges:
        raise InputError.at("gauges", "gauges", "none", "one or more")
    if not is_number(mean) or not isfinite(mean):
        raise InputError.at("gauges", "mean", mean, "a finite number")
    for name, value in {"deviation": deviation, "rejected": rejected, "escaped": escaped}.items():
        if not is_number(value) or not 0.0 < value < float("inf"):
            raise InputError.at("gauges", name, value, "a finite number above 0")
    limits = Limits(lower=lower, upper=upper)
    found = [_cheapest(own, mean, deviation, limits, rejected, escaped) for own in gauges]
    return tuple(sorted(found, key=lambda own: own.cost))


def _cheapest(
    gauge: Gauge, mean: float, deviation: float, limits: Limits, rejected: float, escaped: float
) -> GaugeCost:
    from scipy.optimize import minimize_scalar

    def at(guard: float) -> GaugeCost:
        found = risks(mean, deviation, limits, gauge.uncertainty, guard)
        cost = gauge.price + rejected * (1.0 - found.accepted) + escaped * found.consumer
        return GaugeCost(gauge=gauge, guard=guard, risks=found, cost=cost)

    if gauge.uncertainty == 0.0:
        return at(0.0)
    reach = _FAR * gauge.uncertainty / COVERAGE
    search = minimize_scalar(lambda guard: at(reach * float(guard)).cost, bounds=(-1.0, 1.0), method="bounded")
    return at(reach * float(search.x))

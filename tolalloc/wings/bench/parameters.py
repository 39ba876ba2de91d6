"""What may be identified: stiffnesses, an instrument's bias, the test torque; bounds and what is known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, isfinite, log
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.families.known import INTERFACES
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.housing import GIVES, RING

SYMBOLS = {
    **{own.stiffness: own.symbol for own in INTERFACES if own.symbol},
    **{f"{RING}{way}": f"ring {way.replace('_', ' ')}" for way in GIVES},
    "pin_contact": "C",
    "torque": "torque",
    "bias": "bias",
}
"""Name of each parameter → its symbol; stiffnesses are fields of `tolalloc.reducers.reducer.stiffness.Stiffness`."""

BIAS, TORQUE = "bias", "torque"

_WIDEST = {BIAS: (-60.0, 60.0), TORQUE: (0.1, 10.0)}
_ALLOWED = {BIAS: "two numbers from -3600 to 3600 arcsec", TORQUE: "two positive factors up to 1000"}
_NARROWEST = 1.01
_SMALLEST_PRIOR = 1e-4  # what is known better is known [-]
_STIFFNESS_SPAN = 2.0  # bounds of a stiffness unless told otherwise: half to double its value in the reducer file


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One unknown. Searches move its coordinate, which is of order one for every kind of parameter."""

    name: str  # One of `SYMBOLS`
    # Bounds: a stiffness [N/m], the bias [arcsec], the torque over the stated one [-]
    low: float
    high: float
    start: float  # Where searches begin, and what the parameter stays at when it is not identified [as low]
    # Standard deviation of the coordinate around ``start`` that is known beforehand; infinite if nothing is [-]
    prior: float = inf

    @property
    def symbol(self) -> str:
        """Short name for tables and figures."""
        return SYMBOLS[self.name]

    @property
    def unit(self) -> str:
        """Unit of measurement of bounds and value."""
        return {BIAS: "arcsec", TORQUE: "-"}.get(self.name, "N/m")

    @property
    def is_stiffness(self) -> bool:
        """Whether it is a stiffness."""
        return self.name not in (BIAS, TORQUE)

    def coordinate(self, value: float) -> float:
        """Return the logarithm of the value over the start, or the bias in arcseconds from the start [-]."""
        return value - self.start if self.name == BIAS else log(value / self.start)

    def value(self, coordinate: float) -> float:
        """Return the value at a coordinate [as low]."""
        return self.start + coordinate if self.name == BIAS else self.start * exp(coordinate)

    @property
    def lower(self) -> float:
        """Coordinate of the lower bound [-]."""
        return self.coordinate(self.low)

    @property
    def upper(self) -> float:
        """Coordinate of the upper bound [-]."""
        return self.coordinate(self.high)


def parameter(
    name: str, reducer: Reducer, bounds: tuple[float, float] | None = None, prior: float = inf, place: str = "identify"
) -> Parameter:
    """Return a parameter of `SYMBOLS` that begins at the reducer's value, or at no bias and the stated torque.

    Bounds are half to double a stiffness, ±60 arcsec, a tenth to ten times the torque unless given; the prior is a
    relative standard deviation, of the bias one in arcseconds.
    """
    # What a reducer lacks has no stiffness, and what does not give an infinite one.
    known = [own for own in SYMBOLS if own in (BIAS, TORQUE) or 0.0 < getattr(reducer.stiffness, own) < inf]
    UnknownNameError.require(place, "parameter", name, known)
    starts = {BIAS: 0.0, TORQUE: 1.0}
    start = starts[name] if name in starts else float(getattr(reducer.stiffness, name))
    low, high = bounds or _WIDEST.get(name) or (start / _STIFFNESS_SPAN, start * _STIFFNESS_SPAN)
    floor, ceiling = {BIAS: (-3600.0, 3600.0), TORQUE: (1e-3, 1e3)}.get(name, (1e4, 1e13))
    allowed = _ALLOWED.get(name, "two stiffnesses from 1e4 to 1e13 N/m") + ", the smaller one first"
    if not floor <= low < high <= ceiling:
        raise InputError.at(place, name, f"{low:g}:{high:g}", allowed)
    if not prior >= _SMALLEST_PRIOR:
        raise InputError.at(place, f"prior of {name}", prior, f"{_SMALLEST_PRIOR:g} or more")
    if name != BIAS and high < _NARROWEST * low:
        raise InputError.at(place, name, f"{low:g}:{high:g}", "bounds at least 1 % apart")
    if not low <= start <= high:
        raise InputError.at(place, name, f"{low:g}:{high:g}", f"bounds around the start, which is {start:g}")
    return Parameter(name=name, low=low, high=high, start=start, prior=prior)


def values_at(
    parameters: Sequence[Parameter], coordinates: Float[np.ndarray, " parameter"]
) -> tuple[dict[str, Any], float, float]:
    """Return stiffnesses by name [N/m], the bias [rad] and the torque over the stated one [-] at coordinates.

    A bias that is not asked for is 0, a torque that is not asked for the stated one.
    """
    found = {item.name: item.value(float(at)) for item, at in zip(parameters, coordinates, strict=True)}
    bias, torque = found.pop(BIAS, 0.0) * ARCSECOND, found.pop(TORQUE, 1.0)
    return found, bias, torque


def box(parameters: Sequence[Parameter]) -> tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, " parameter"]]:
    """Return the coordinates of all lower and of all upper bounds [-]."""
    return np.array([item.lower for item in parameters]), np.array([item.upper for item in parameters])


def prior_weights(parameters: Sequence[Parameter]) -> Float[np.ndarray, " parameter"]:
    """Return one over the prior standard deviation of each coordinate, 0 where nothing is known [-]."""
    return np.array([1.0 / item.prior if isfinite(item.prior) else 0.0 for item in parameters])

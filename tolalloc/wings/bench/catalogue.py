"""The one factor on the stiffness of the bearings with which a reducer has the rigidity of its catalogue."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, isnan, log
from typing import Any

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.hysteresis import HysteresisLoop
from tolalloc.reducers.equivalent.outputs import bearings_of
from tolalloc.reducers.equivalent.perfect import exact_loop
from tolalloc.reducers.reducer.bearings import RollingBearing
from tolalloc.reducers.reducer.design import Catalogue, Reducer, at_torque
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness

RIGIDITY_UNCERTAINTY = 0.1
"""Relative standard uncertainty of a rigidity that a catalogue states without one; an assumption [-]."""
_FARTHEST = 1000.0
"""Factor on the stiffness up and down to which is searched [-]."""
_STEP = 0.05
"""Step of a difference by the logarithm of the factor [-]."""


def with_bearings(reducer: Reducer, factor: float) -> Reducer:
    """Return the reducer with rolling bearings so many times as stiff; other parts of their interfaces stay."""
    with_parts = {part.interface for part in reducer.parts}
    parts = tuple(
        replace(part, stiffer=part.stiffer * factor) if isinstance(part.yields, RollingBearing) else part
        for part in reducer.parts
    )
    own: dict[str, Any] = {
        name: factor * getattr(reducer.stiffness, name)
        for name in bearings_of(reducer).values()
        if name not in with_parts
    }
    changed = replace(reducer, parts=parts, stiffness=replace(reducer.stiffness, **own))
    return at_torque(changed, reducer.load.rated_torque)


def _rigidity(reducer: Reducer, factor: float) -> float:
    """Return the torsional stiffness with bearings so many times as stiff [N·m/rad]."""
    return float(exact_loop(with_bearings(reducer, factor)).torsional_stiffness[0])


@dataclass(frozen=True, kw_only=True)
class CatalogueResult:
    """The factor, and what one datum leaves open."""

    catalogue: Catalogue  # What was stated
    before: Reducer  # As its file says
    after: Reducer  # With the factor
    factor: float  # On the stiffness of every rolling bearing [-]
    slope: float  # d ln rigidity / d ln factor: how much the rigidity feels the bearings at all [-]

    @cached_property
    def loops(self) -> tuple[HysteresisLoop, HysteresisLoop]:
        """Hysteresis of exact parts, before and after."""
        return exact_loop(self.before), exact_loop(self.after)

    @property
    def uncertainty(self) -> float:
        """Relative standard uncertainty of the factor, from that of the catalogue's rigidity [-]."""
        return RIGIDITY_UNCERTAINTY / self.slope

    @property
    def stiffness(self) -> IdentifiedStiffness:
        """The interfaces with rolling bearings at rated torque, to be reused by studies; one factor, so correlated."""
        values = {name: float(getattr(self.after.stiffness, name)) for name in bearings_of(self.after).values()}
        return IdentifiedStiffness(
            source=f"catalogue rigidity of {self.before.name}",
            values=values,
            standard_uncertainty={name: self.uncertainty * value for name, value in values.items()},
            correlation=np.ones((len(values), len(values))),
            notes=(
                "one datum, one factor on all rolling bearings; stiffness at rated torque, bodies in series included",
                f"standard uncertainty of the catalogue's rigidity {RIGIDITY_UNCERTAINTY:.0%} (assumption)",
            ),
        )


def identify_from_catalogue(reducer: Reducer) -> CatalogueResult:
    """Return the factor on the stiffness of all rolling bearings that gives the catalogue's torsional rigidity."""
    from scipy.optimize import brentq

    stated = reducer.catalogue
    if stated is None:
        raise InputError(f"{reducer.name}: it has no table [catalogue]; state torsional_rigidity_nm_per_arcmin there.")

    def off(exponent: float) -> float:
        return log(_rigidity(reducer, exp(exponent)) / stated.torsional_rigidity)

    near, far = 0.0, 0.0
    direction = 1.0 if off(0.0) < 0 else -1.0
    while (last := direction * off(far)) < 0:
        near, far = far, far + direction * log(2.0)
        if abs(far) > log(_FARTHEST) or isnan(off(far)):
            limit = exp(direction * last) * stated.torsional_rigidity * ARCMINUTE
            allowed = f"at {'most' if direction > 0 else 'least'} {limit:.3g}, with bearings of any stiffness"
            value = round(stated.torsional_rigidity * ARCMINUTE, 6)
            raise InputError.at(reducer.name, "[catalogue] torsional_rigidity_nm_per_arcmin", value, allowed)
    exponent = near if near == far else float(brentq(off, near, far, xtol=1e-10))
    return CatalogueResult(
        catalogue=stated,
        before=reducer,
        after=with_bearings(reducer, exp(exponent)),
        factor=exp(exponent),
        slope=(off(exponent + _STEP) - off(exponent - _STEP)) / (2 * _STEP),
    )

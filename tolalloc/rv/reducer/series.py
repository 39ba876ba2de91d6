"""Interfaces as springs in series: what every part adds to the way of a bearing, at the load that it carries."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.rv.reducer.rolling_bearing import RollingBearing
from tolalloc.rv.reducer.stiffness import Stiffness

if TYPE_CHECKING:
    from tolalloc.rv.reducer.design import Reducer

_PHASES = 2.0 * np.pi * np.arange(64) / 64


@dataclass(frozen=True)
class Part:
    """A part that yields in an interface: a rolling bearing, or a body with a constant compliance."""

    interface: str  # Field of `tolalloc.rv.reducer.stiffness.Stiffness` that it belongs to
    name: str  # What it is, such as ``crank bending``
    yields: RollingBearing | float  # The bearing, or what the body yields [m/N]

    def compliance(self, force: float) -> float:
        """Return the way over the force [m/N]."""
        return _bearing(self.yields, force) if isinstance(self.yields, RollingBearing) else self.yields


@lru_cache(maxsize=256)
def _bearing(bearing: RollingBearing, force: float) -> float:
    """Return what a bearing yields; loops of torque ask the same few forces again and again."""
    return bearing.compliance(force)


def interface_forces(reducer: Reducer, torque: float) -> dict[str, float]:
    """Return the mean force in each interface under a torque on the carrier by statics alone [N].

    Without part errors: each crank holds its part of the torque against the carrier and a share of that against every
    disc, beside its share of the disc's pin forces, T/(e·zp) across the crank direction, which turn against it. The
    first stage carries the torque over the ratio; the carrier bearing holds none.
    """
    size, stage = abs(torque), reducer.cycloid_stage
    crank = size / (reducer.crank_count * reducer.crank_circle_radius)
    tangential = crank / reducer.disc_count
    pins = size / (reducer.disc_count * reducer.crank_count * stage.eccentricity * stage.pin_count)
    first = reducer.first_stage
    sun_base = reducer.planet_base_radius * first.sun_teeth / first.planet_teeth
    return {
        "crank_carrier_bearing": crank,
        "crank_disc_bearing": float(np.abs(tangential + pins * np.exp(1j * _PHASES)).mean()),
        "gear_mesh": size / (reducer.ratio * reducer.crank_count * sun_base),
        "sun_support": 0.0,
        "carrier_bearing": 0.0,
    }


_SMALLEST = 1e-3
"""Share of the rated torque whose forces a secant stiffness is taken at for smaller ones [-]."""


def compliances(reducer: Reducer, torque: float) -> dict[str, dict[str, float]]:
    """Return what every part yields by interface, at the forces of a torque on the carrier [m/N]."""
    least = _SMALLEST * reducer.load.rated_torque
    forces = interface_forces(reducer, max(abs(torque), least))
    unloaded = forces["crank_carrier_bearing"] * _SMALLEST
    found: dict[str, dict[str, float]] = {}
    for part in reducer.parts:
        force = forces[part.interface] or unloaded
        found.setdefault(part.interface, {})[part.name] = part.compliance(force)
    return found


def stiffness_at(reducer: Reducer, torque: float) -> Stiffness:
    """Return the reducer's stiffness with the secant of its parts at the forces of a torque on the carrier."""
    own: dict[str, Any] = {
        interface: 1.0 / sum(parts.values()) for interface, parts in compliances(reducer, torque).items()
    }
    return replace(reducer.stiffness, **own)

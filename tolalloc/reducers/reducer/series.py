"""Interfaces as springs in series: what every part adds to the way of a bearing, at the load that it carries."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tolalloc.reducers.reducer.design import Reducer

_PHASES = 2.0 * np.pi * np.arange(64) / 64


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


def at_torque(reducer: Reducer, torque: float) -> Reducer:
    """Return the reducer with the secant stiffness of its parts at the forces of a torque on the carrier [N·m]."""
    if not reducer.parts:
        return reducer
    own: dict[str, Any] = {
        interface: 1.0 / sum(parts.values()) for interface, parts in compliances(reducer, torque).items()
    }
    return replace(reducer, stiffness=replace(reducer.stiffness, **own))

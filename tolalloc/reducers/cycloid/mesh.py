"""Where a pin and the exact tooth of a disc touch, by the pin's angle from the crank direction."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.reducer.design import CycloidStage

Angles = Float[np.ndarray, "*angles"]
"""Angles φ of pins from the crank direction [rad], and what has their shape."""


@dataclass(frozen=True, kw_only=True)
class Normals:
    """Directions of the common normal, from the pin into the disc."""

    # cos a and sin a, components along the crank direction and across it [-]
    towards_crank: Angles
    towards_tangent: Angles
    # cos κ and sin κ, components against the pin's own radius, inward, and across it [-]
    along_radius: Angles
    across_radius: Angles
    # S = sin φ/√s, lever of the normal about the disc's centre over r_d; positive where the pin resists a
    # counter-clockwise rotation [-]
    lever: Angles


def normals(shortening: float, pin_angle: Angles) -> Normals:
    """Return the normals at pins, theory page equations (13) and (14)."""
    cosine, sine = np.cos(pin_angle), np.sin(pin_angle)
    root = np.sqrt(1 + shortening**2 - 2 * shortening * cosine)
    return Normals(
        towards_crank=(shortening - cosine) / root,
        towards_tangent=-sine / root,
        along_radius=(1 - shortening * cosine) / root,
        across_radius=shortening * sine / root,
        lever=sine / root,
    )


def path_curvature(stage: CycloidStage, pin_angle: Angles) -> Float[np.ndarray, "*angles"]:
    """Return the curvature of the pin centre's path on the disc, concave positive, theory page equation (33) [1/m]."""
    shortening, pins, cosine = stage.shortening, stage.pin_count, np.cos(pin_angle)
    bend = shortening * (1 + pins) * cosine - (1 + pins * shortening**2)
    length = stage.pin_circle_radius * (1 + shortening**2 - 2 * shortening * cosine) ** 1.5
    return np.asarray(bend / length)


def flank_angle(stage: CycloidStage) -> float:
    """Return φ0 = arccos K1, where the lever is longest [rad]."""
    return acos(stage.shortening)


def pin_angles(stage: CycloidStage, phase: Float[np.ndarray, " phase"]) -> Float[np.ndarray, "phase pin"]:
    """Return φ of every pin, from −π up to π, for phases: angles of the pin that was in the crank direction [rad]."""
    pins = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count
    return np.asarray(np.remainder(pins + phase[:, np.newaxis] + np.pi, 2 * np.pi) - np.pi)

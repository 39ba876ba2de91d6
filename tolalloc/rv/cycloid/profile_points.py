"""A tooth profile as points for a drawing or a machine, dense where it bends most."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.rv.cycloid.tooth_profile import ToothProfile

FEWEST, MOST = 8, 20_000

_DENSE = 20_001  # angles of the dense tabulation that the points are chosen from


@dataclass(frozen=True, kw_only=True)
class ProfilePoints:
    """Points around a whole disc, clockwise, the first one not repeated."""

    per_tooth: int  # Points of one tooth [-]
    place: Float[np.ndarray, "point 2"]  # x and y [m]
    # φ at each point, negative on the flank at the counter-clockwise side of its root [rad]
    angle: Float[np.ndarray, " point"]
    chord_error: float  # Largest distance of the profile from the straight line between neighbouring points [m]


def _flank_angles(profile: ToothProfile, count: int) -> Float[np.ndarray, " point"]:
    """Return φ from root to tip such that all chords are about equally wrong [rad]."""
    dense = np.linspace(*profile.edges, _DENSE)
    place = profile.points(dense)
    length = np.hypot(*np.diff(place, axis=0).T)
    bend = np.sqrt(np.abs(profile.curvature((dense[1:] + dense[:-1]) / 2)))
    # A chord's error is curvature·length²/8; a fifth of the mean keeps points on the flat of the flank.
    weight = np.concatenate([[0.0], np.cumsum((bend + 0.2 * bend.mean()) * length)])
    return np.interp(np.linspace(0.0, weight[-1], count), weight, dense)


def _chord_error(profile: ToothProfile, angle: Float[np.ndarray, " point"]) -> float:
    """Return the largest distance of the flank from its chords [m]."""
    between = angle[:-1, np.newaxis] + np.diff(angle)[:, np.newaxis] * np.linspace(0.1, 0.9, 9)
    start, end, curve = profile.points(angle[:-1]), profile.points(angle[1:]), profile.points(between)
    along = (end - start) / np.hypot(*(end - start).T)[:, np.newaxis]
    offset = curve - start[:, np.newaxis]
    return float(np.abs(offset[..., 0] * along[:, 1:] - offset[..., 1] * along[:, :1]).max())


def require_points(per_tooth: int) -> None:
    """Raise unless a drawing can use so many points per tooth.

    Raises
    ------
    InputError
        Too few, too many, or an odd number.
    """
    if not FEWEST <= per_tooth <= MOST or per_tooth % 2:
        raise InputError.at("profile", "points per tooth", per_tooth, f"an even number from {FEWEST} to {MOST}")


def profile_points(profile: ToothProfile, per_tooth: int) -> ProfilePoints:
    """Return the points of a whole disc with a sound profile, an even number of them per tooth.

    Raises
    ------
    InputError
        A number of points that no drawing can use.
    """
    require_points(per_tooth)
    angle = _flank_angles(profile, per_tooth // 2 + 1)
    flank = profile.points(angle)
    mirrored = flank[::-1] * (1.0, -1.0)
    # Root and tip belong to two flanks each; the tip is the next space's first point.
    space = np.concatenate([mirrored, flank[1:]])[:-1]
    angles = np.concatenate([-angle[::-1], angle[1:]])[:-1]
    turned = np.exp(-2j * pi * np.arange(profile.stage.disc_teeth) / profile.stage.disc_teeth)
    points = (turned[:, np.newaxis] * (space[:, 0] + 1j * space[:, 1])).ravel()
    return ProfilePoints(
        per_tooth=space.shape[0],
        place=np.stack([points.real, points.imag], axis=1),
        angle=np.tile(angles, profile.stage.disc_teeth),
        chord_error=_chord_error(profile, angle),
    )

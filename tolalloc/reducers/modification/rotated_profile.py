"""Equidistant and shift amounts whose profile comes closest to a rotated one, the problem of song2019."""

from __future__ import annotations

from typing import Literal

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.exceptions import InputError
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.modification.problem import Amounts, ModificationProblem
from tolalloc.reducers.reducer.design import CycloidStage, Modification

Metric = Literal["same_angle", "normal", "nearest"]

METRICS: dict[Metric, str] = {
    "same_angle": "mean distance of the points with the same φ on the two profiles",
    "normal": "mean distance of the points with the same φ along the modified profile's normal",
    "nearest": "mean distance of the rotated profile's points from the modified profile",
}

_REACH = np.pi / 2  # the nearest point of the modified profile is at most that far in φ [rad]
_CLOSE = 1e-8  # a step of Newton's method after which the next one is rounding [rad]


def rotated_profile_fit(
    stage: CycloidStage,
    shift_sign: int = 1,
    metric: Metric = "same_angle",
    rotation: float = 0.005,
    points: int = 180,
    radial_clearance: float = 0.0,
    require_gap: bool = False,
) -> ModificationProblem:
    """Return the problem of the modified profile that comes closest to the one that is rotated by δ and nothing else.

    Parameters
    ----------
    stage
        Cycloid stage.
    shift_sign
        1 for a positive and −1 for a negative shift [-].
    metric
        Distance of the two profiles, `METRICS`; song2019 takes ``same_angle``.
    rotation
        δ of the profile to come close to [rad].
    points
        m: the mean is over φ = iπ/m, i = 1…m as in the source's sum, so the tip counts and the root does not [-].
    radial_clearance, require_gap
        As in `ModificationProblem` [m].

    Raises
    ------
    InputError
        A rotation that is not above 0 and up to a sixteenth of a tooth pitch.

    Notes
    -----
    ``same_angle`` is mostly slip along the profile, which is no error of the profile. ``nearest`` carries the modified
    profile on beyond root and tip. Δr_rp goes from 0 to 1 mm and Δr_p from 0 to 1 mm or, by its sign, to −1 mm, a box
    that is assumed. The source prints Δr_rp − |Δr_p| > 0 as its condition of a radial clearance (equation (11)), which
    for a negative shift is none; here it is Δr_rp − Δr_p ≥ j for both signs.

    References
    ----------
    song2019, equation (10).
    """
    name = f"rotated profile, {'positive' if shift_sign > 0 else 'negative'} shift, {metric}"
    largest, shift = np.pi / (8 * stage.disc_teeth), np.array([0.0, np.sign(shift_sign) * MILLIMETRE])
    if not 0 < rotation <= largest:
        raise InputError.at(
            name, "rotation", rotation, f"above 0 and up to a sixteenth of a tooth pitch, {largest:.4g} rad"
        )
    angles = np.arange(1, points + 1) * np.pi / points
    turned = Modification(equidistant=0.0, shift=0.0, rotation=rotation)
    place = ToothProfile(stage=stage, modification=turned).points(angles)
    rotated = place[:, 0] + 1j * place[:, 1]

    def mean_distance(amounts: Amounts) -> Float[np.ndarray, " n"]:
        angle = _nearest(stage, rotated, angles, amounts) if metric == "nearest" else angles
        path, slope, _ = _path(stage, amounts, angle)
        normal = -1j * slope / np.abs(slope)
        difference = rotated - path - (stage.pin_radius + amounts[:, :1]) * normal
        if metric != "same_angle":
            # Where the nearest point is, all of the difference is along the normal.
            difference = (difference * normal.conj()).real
        return np.asarray(np.abs(difference).mean(axis=-1))

    return ModificationProblem(
        name=name,
        description=f"{METRICS[metric]}; δ = {rotation:g} rad, φ = iπ/{points}, i = 1…{points}",
        stage=stage,
        objective=mean_distance,
        lower=np.array([0.0, shift.min()]),
        upper=np.array([MILLIMETRE, shift.max()]),
        radial_clearance=radial_clearance,
        require_gap=require_gap,
    )


def _nearest(
    stage: CycloidStage, points: Complex[np.ndarray, " point"], angles: Float[np.ndarray, " point"], amounts: Amounts
) -> Float[np.ndarray, "n point"]:
    """Return φ of the modified profiles' points that are nearest to points of another with these φ [rad].

    There (P − w)·w′ of a point P and the path w falls through zero; profile and path share their normals.
    """
    angle = np.tile(angles, (len(amounts), 1))
    low, high = angle - _REACH, angle + _REACH
    for _ in range(60):
        path, slope, bend = _path(stage, amounts, angle)
        offset = (points - path).conj()
        value, change = (offset * slope).real, (offset * bend - slope * slope.conj()).real
        low, high = np.where(value > 0, angle, low), np.where(value > 0, high, angle)
        falls = change < 0
        new = angle - value / np.where(falls, change, 1.0)
        new = np.where(falls & (low <= new) & (new <= high), new, (low + high) / 2)
        step, angle = np.abs(new - angle).max(), new
        if step < _CLOSE:
            break
    return angle


def _path(
    stage: CycloidStage, amounts: Amounts, angle: Float[np.ndarray, "*n point"]
) -> tuple[Complex[np.ndarray, "n point"], Complex[np.ndarray, "n point"], Complex[np.ndarray, "n point"]]:
    """Return the path of the grinding pin's centre on the disc and its first two derivatives by φ, x + iy [m].

    The normal into the disc is the direction of its derivative, turned by −90°: theory page (34) for many modifications
    at once, where `tolalloc.reducers.cycloid.tooth_profile.ToothProfile` is one.
    """
    pin = (stage.pin_circle_radius + amounts[:, 1:]) * np.exp(-1j * angle / stage.disc_teeth)
    crank = stage.eccentricity * np.exp(-1j * angle * (stage.pin_count / stage.disc_teeth))
    slope = 1j / stage.disc_teeth * (stage.pin_count * crank - pin)
    return pin - crank, slope, (stage.pin_count**2 * crank - pin) / stage.disc_teeth**2

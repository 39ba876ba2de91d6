"""Equidistant and shift amounts whose profile comes closest to a rotated one, the problem of song2019."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.exceptions import InputError
from tolalloc.rv.cycloid.tooth_profile import ToothProfile
from tolalloc.rv.modification.problem import Amounts, ModificationProblem
from tolalloc.rv.reducer.design import CycloidStage, Modification
from tolalloc.units import MILLIMETRE

Metric = Literal["same_angle", "normal", "nearest"]

METRICS: dict[Metric, str] = {
    "same_angle": "mean distance of the points with the same φ on the two profiles",
    "normal": "mean distance of the points with the same φ along the modified profile's normal",
    "nearest": "mean distance of the rotated profile's points from the modified profile",
}

_REACH = np.pi / 2  # the nearest point of the modified profile is at most that far in φ [rad]
_CLOSE = 1e-8  # a step of Newton's method after which the next one is rounding [rad]


@dataclass(frozen=True, kw_only=True)
class RotatedProfileFit(ModificationProblem):
    """Fit the profile with equidistant and shift modification to the one that is rotated by δ and nothing else.

    Notes
    -----
    ``same_angle`` is mostly slip along the profile, which is no error of the profile. ``nearest`` carries the modified
    profile on beyond root and tip.

    References
    ----------
    song2019, equation (10).
    """

    metric: Metric = "same_angle"  # Distance of the two profiles, `METRICS`; song2019 takes ``same_angle``
    rotation: float = 0.005  # δ of the profile to come close to [rad]
    # m: the mean is over φ = iπ/m, i = 1…m as in the source's sum, so the tip counts and the root does not [-]
    points: int = 180

    def __post_init__(self) -> None:
        largest = np.pi / (8 * self.stage.disc_teeth)
        if not 0 < self.rotation <= largest:
            allowed = f"above 0 and up to a sixteenth of a tooth pitch, {largest:.4g} rad"
            raise InputError.at(self.name, "rotation", self.rotation, allowed)

    @property
    def description(self) -> str:
        """What the objective measures."""
        return f"{METRICS[self.metric]}; δ = {self.rotation:g} rad, φ = iπ/{self.points}, i = 1…{self.points}"

    @cached_property
    def _angles(self) -> Float[np.ndarray, " point"]:
        return np.arange(1, self.points + 1) * np.pi / self.points

    @cached_property
    def _rotated(self) -> Complex[np.ndarray, " point"]:
        rotated = Modification(equidistant=0.0, shift=0.0, rotation=self.rotation)
        points = ToothProfile(stage=self.stage, modification=rotated).points(self._angles)
        return np.asarray(points[:, 0] + 1j * points[:, 1])

    def objective(self, amounts: Amounts) -> Float[np.ndarray, " n"]:
        """Return the mean distance of the two profiles [m]."""
        angle = self._nearest(amounts) if self.metric == "nearest" else self._angles
        path, slope, _ = _path(self.stage, amounts, angle)
        normal = -1j * slope / np.abs(slope)
        difference = self._rotated - path - (self.stage.pin_radius + amounts[:, :1]) * normal
        if self.metric != "same_angle":
            # Where the nearest point is, all of the difference is along the normal.
            difference = (difference * normal.conj()).real
        return np.asarray(np.abs(difference).mean(axis=-1))

    def _nearest(self, amounts: Amounts) -> Float[np.ndarray, "n point"]:
        """Return φ of the modified profiles' points that are nearest to the rotated profile's points [rad].

        There (P − w)·w′ of a point P and the path w falls through zero; profile and path share their normals.
        """
        angle = np.tile(self._angles, (len(amounts), 1))
        low, high = angle - _REACH, angle + _REACH
        for _ in range(60):
            path, slope, bend = _path(self.stage, amounts, angle)
            offset = (self._rotated - path).conj()
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
    at once, where `tolalloc.rv.cycloid.tooth_profile.ToothProfile` is one.
    """
    pin = (stage.pin_circle_radius + amounts[:, 1:]) * np.exp(-1j * angle / stage.disc_teeth)
    crank = stage.eccentricity * np.exp(-1j * angle * (stage.pin_count / stage.disc_teeth))
    slope = 1j / stage.disc_teeth * (stage.pin_count * crank - pin)
    return pin - crank, slope, (stage.pin_count**2 * crank - pin) / stage.disc_teeth**2


def rotated_profile_fit(
    stage: CycloidStage,
    shift_sign: int = 1,
    metric: Metric = "same_angle",
    rotation: float = 0.005,
    points: int = 180,
    radial_clearance: float = 0.0,
    require_gap: bool = False,
) -> RotatedProfileFit:
    """Return the problem in song2019's box: Δr_rp from 0 to 1 mm and Δr_p from 0 to 1 mm or, by its sign, to −1 mm.

    Notes
    -----
    The source prints Δr_rp − |Δr_p| > 0 as its condition of a radial clearance (equation (11)), which for a negative
    shift is none; here it is Δr_rp − Δr_p ≥ j for both signs. The box is assumed.
    """
    shift = np.array([0.0, np.sign(shift_sign) * MILLIMETRE])
    return RotatedProfileFit(
        name=f"rotated profile, {'positive' if shift_sign > 0 else 'negative'} shift, {metric}",
        stage=stage,
        lower=np.array([0.0, shift.min()]),
        upper=np.array([MILLIMETRE, shift.max()]),
        radial_clearance=radial_clearance,
        require_gap=require_gap,
        metric=metric,
        rotation=rotation,
        points=points,
    )

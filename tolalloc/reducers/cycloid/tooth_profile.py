"""The tooth profile of a disc, exact or modified: a parametric curve, points dense where it bends most, and normals."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import acos, pi

import numpy as np
from jaxtyping import Complex, Float

from tolalloc.exceptions import InputError
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.design import CycloidStage, Modification, Reducer
from tolalloc.reducers.reducer.form import FlankForm, Points

Angles = Float[np.ndarray, "*angles"]
"""Angles φ of pins from the crank direction [rad], and what has their shape."""

Amounts = Float[np.ndarray, "n 2"]
"""Pairs of Δr_rp and Δr_p, `tolalloc.reducers.reducer.design.Modification` [m]."""
_REACH = np.pi / 2  # the nearest point of the modified profile is at most that far in φ [rad]
_CLOSE = 1e-8  # a step of Newton's method after which the next one is rounding [rad]
FEWEST, MOST = 8, 20_000
_DENSE = 20_001  # angles of the dense tabulation that the points are chosen from


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


def pole_distance(shortening: float, pin_angle: Angles) -> Angles:
    """Return √s, s = 1 + K1² − 2·K1·cos φ, the distance of pin and pole over R_p [-]."""
    return np.asarray(np.sqrt(1 + shortening**2 - 2 * shortening * np.cos(pin_angle)))


def normals(shortening: float, pin_angle: Angles) -> Normals:
    """Return the normals [-] at pins, φ [rad], theory page equations (13) and (14); for 0 < K1 < 1.

    The common normal passes through the pole, so with s = 1 + K1² − 2·K1·cos φ its lever about the disc's centre over
    r_d is S = sin φ/√s, and the cosine against the pin's radius is cos κ = (1 − K1·cos φ)/√s.

    References
    ----------
    liu2020 for the angle a (its α_jk); xi2015, equation (3), for S and cos κ. Exact for 0 < K1 < 1, where
    cos²κ + K1²·S² = 1.
    """
    cosine, sine, root = np.cos(pin_angle), np.sin(pin_angle), pole_distance(shortening, pin_angle)
    return Normals(
        towards_crank=(shortening - cosine) / root,
        towards_tangent=-sine / root,
        along_radius=(1 - shortening * cosine) / root,
        across_radius=shortening * sine / root,
        lever=sine / root,
    )


def path_curvature(stage: CycloidStage, pin_angle: Angles) -> Angles:
    """Return the curvature of the pin centre's path on the disc, concave positive, theory page equation (33) [1/m].

    κ = (K1(1 + zp)·cos φ − 1 − zp·K1²)/(Rp·s^1.5), s = 1 + K1² − 2K1·cos φ, φ [rad].

    References
    ----------
    liu2020, Table 2 (the T of K_djk). Exact for 0 < K1 < 1.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> stage = load_reducer("rv40e_xi2015").cycloid_stage
    >>> round(float(1e3 / path_curvature(stage, np.array([np.pi]))[0]), 3)  # radius at the tip [mm], convex
    -6.276
    """
    shortening, pins, cosine = stage.shortening, stage.pin_count, np.cos(pin_angle)
    bend = shortening * (1 + pins) * cosine - (1 + pins * shortening**2)
    length = stage.pin_circle_radius * (1 + shortening**2 - 2 * shortening * cosine) ** 1.5
    return np.asarray(bend / length)


def flank_angle(stage: CycloidStage) -> float:
    """Return φ0 = arccos K1, where the lever is longest [rad].

    References
    ----------
    xi2015 and Li Lixing, who close the gap there; there S = 1, for 0 < K1 < 1.
    """
    return acos(stage.shortening)


def pin_angles(stage: CycloidStage, phase: Float[np.ndarray, " phase"]) -> Float[np.ndarray, "phase pin"]:
    """Return φ of every pin, from −π up to π, for phases: angles of the pin that was in the crank direction [rad].

    φ_k = 2πk/zp + phase, own derivation: pins are equally spaced.
    """
    pins = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count
    return np.asarray(np.remainder(pins + phase[:, np.newaxis] + np.pi, 2 * np.pi) - np.pi)


@dataclass(frozen=True, kw_only=True)
class ToothProfile:
    """Profile ground by a pin of radius r_rp + Δr_rp on the circle Rp + Δr_p, turned by the rotation modification.

    The frame is the disc's: its centre, and the middle of a root at angle 0. The parameter φ is the angle of the pin
    that grinds the point: 0 at the root, π at the tip [rad]. Theory page equation (34), exact; points [m].
    """

    stage: CycloidStage  # Cycloid stage
    # Tooth modification; none unless given
    modification: Modification = field(default_factory=lambda: Modification(equidistant=0.0, shift=0.0))
    form: FlankForm | None = None  # Free form that is added, alike on both flanks of all teeth; none unless given

    @classmethod
    def of(cls, reducer: Reducer) -> ToothProfile:
        """Return the profile that the drawing of a reducer's discs states."""
        form = reducer.form.designed if reducer.form else None
        return cls(stage=reducer.cycloid_stage, modification=reducer.modification, form=form)

    @cached_property
    def ground(self) -> CycloidStage:
        """The stage with the pin radius and pin circle of the grinding."""
        return replace(
            self.stage,
            pin_circle_radius=self.stage.pin_circle_radius + self.modification.shift,
            pin_radius=self.stage.pin_radius + self.modification.equidistant,
        )

    @property
    def tip_radius(self) -> float:
        """Radius r_ac of the tip circle [m]."""
        amounts = self.ground.pin_circle_radius + self.ground.eccentricity - self.ground.pin_radius
        return amounts + self._stands_out(pi)

    @property
    def root_radius(self) -> float:
        """Radius r_fc of the root circle [m]."""
        amounts = self.ground.pin_circle_radius - self.ground.eccentricity - self.ground.pin_radius
        return amounts + self._stands_out(0.0)

    @property
    def flank_clearance(self) -> float:
        """The gap on the flank where cos φ = K1 [m]."""
        return self.modification.flank_clearance(self.stage) - self._stands_out(flank_angle(self.stage))

    def _stands_out(self, angle: float) -> float:
        """Return the free form at φ, outward positive [m]."""
        return 0.0 if self.form is None else float(self.form.at(np.array([angle]))[0])

    @property
    def inflection_angle(self) -> float:
        """φ where the flank turns from concave to convex, 0 where it is convex all over [rad]."""
        pins, shortening = self.ground.pin_count, self.ground.shortening
        return acos(min((1 + pins * shortening**2) / (shortening * (1 + pins)), 1.0))

    @cached_property
    def edges(self) -> tuple[float, float]:
        """φ where a flank meets its mirror image at root and at tip: 0 and π unless a rotation turns it [rad]."""
        if self.modification.rotation == 0.0:
            return 0.0, pi
        from scipy.optimize import brentq

        def beyond(angle: float, middle: float) -> float:
            x, y = self.points(np.array([angle]))[0]
            return float(np.arctan2(y, x)) + middle

        half_tooth = pi / self.stage.disc_teeth
        if not abs(self.modification.rotation) < half_tooth / 4:
            allowed = f"below {half_tooth / 4:.3g} rad"
            raise InputError.at("modification", "rotation", self.modification.rotation, allowed)
        return brentq(beyond, -pi / 2, pi / 2, args=(0.0,)), brentq(beyond, pi / 2, 3 * pi / 2, args=(half_tooth,))

    def points(self, angle: Angles) -> Float[np.ndarray, "*angles 2"]:
        """Return x and y of the flank of 0 ≤ φ ≤ π [m]; the other flank is its mirror image about y = 0."""
        ground, direction = self.ground, normals(self.ground.shortening, angle)
        pin = ground.pin_circle_radius * np.exp(-1j * angle / ground.disc_teeth)
        into = direction.towards_crank + 1j * direction.towards_tangent
        contact = (ground.pin_radius * into - ground.eccentricity) * np.exp(-1j * angle * self._turns)
        if self.form is not None:
            contact = contact - self.form.at(angle) * into * np.exp(-1j * angle * self._turns)
        point = (pin + contact) * np.exp(-1j * self.modification.rotation)
        return np.stack([point.real, point.imag], axis=-1)

    @property
    def _turns(self) -> float:
        """Turns of the crank direction on the disc per turn of φ [-]."""
        return self.stage.pin_count / self.stage.disc_teeth

    def normals(self, angle: Angles) -> Float[np.ndarray, "*angles 2"]:
        """Return the unit normals into the disc [-]."""
        direction = normals(self.ground.shortening, angle)
        turned = angle * self._turns + self.modification.rotation
        into = (direction.towards_crank + 1j * direction.towards_tangent) * np.exp(-1j * turned)
        return np.stack([into.real, into.imag], axis=-1)

    def curvature(self, angle: Angles) -> Angles:
        """Return the curvature of the profile without its free form, convex positive [1/m]."""
        path = path_curvature(self.ground, angle)
        return np.asarray(-path / (1 + self.ground.pin_radius * path))


def require_sound(profile: ToothProfile, place: str) -> None:
    """Raise unless the profile can be ground and mounted."""
    ground = profile.ground
    if not 0 < ground.shortening < 1:
        raise InputError.at(place, "K1 = eccentricity·pin_count/pin_circle_radius", ground.shortening, "below 1")
    if not 0 < ground.pin_radius < ground.smallest_convex_radius:
        limit = ground.smallest_convex_radius / MILLIMETRE
        raise InputError(
            f"{place}: the grinding pin of radius {ground.pin_radius / MILLIMETRE:.4g} mm undercuts the teeth; "
            f"allowed is a radius above 0 and below {limit:.4g} mm."
        )
    if profile.form is not None:
        return  # what touches then is seen along the whole flank, `tolalloc.reducers.cycloid.clearance.clearance_of`
    stage, amounts = profile.stage, profile.modification
    radial, flank = amounts.radial_clearance / MICROMETRE, amounts.flank_clearance(stage) / MICROMETRE
    for value, where, formula in (
        (radial, "tip and root", "Δr_rp − Δr_p"),
        (flank, "the flank", f"Δr_rp − {stage.flank_ratio:.3f}·Δr_p"),
    ):
        if value < 0:
            raise InputError(
                f"{place}: the modification is an interference of {-value:.3g} µm at {where}; allowed is {formula} of "
                "0 or more, in the convention r_rp + Δr_rp, Rp + Δr_p (xi2015 and li2018 write Rp − Δr_p; "
                'say so by convention = "minus").'
            )


def nearest_angles(
    stage: CycloidStage, points: Complex[np.ndarray, " point"], angles: Points, amounts: Amounts
) -> Float[np.ndarray, "n point"]:
    """Return φ of the modified profiles' points that are nearest to points of another with these φ [rad].

    There (P − w)·w′ of a point P and the path w falls through zero; profile and path share their normals. Newton's
    method from the angles given, which are at most a quarter of a turn of φ away; own derivation.
    """
    angle = np.tile(angles, (len(amounts), 1))
    low, high = angle - _REACH, angle + _REACH
    for _ in range(60):
        path, slope, bend = path_of(stage, amounts, angle)
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


def path_of(
    stage: CycloidStage, amounts: Amounts, angle: Float[np.ndarray, "*n point"]
) -> tuple[Complex[np.ndarray, "n point"], Complex[np.ndarray, "n point"], Complex[np.ndarray, "n point"]]:
    """Return the path of the grinding pin's centre on the disc and its first two derivatives by φ, x + iy [m].

    The normal into the disc is the direction of its derivative, turned by −90°: theory page equation (34) for many
    modifications at once, where `ToothProfile` is one; own derivation.
    """
    pin = (stage.pin_circle_radius + amounts[:, 1:]) * np.exp(-1j * angle / stage.disc_teeth)
    crank = stage.eccentricity * np.exp(-1j * angle * (stage.pin_count / stage.disc_teeth))
    slope = 1j / stage.disc_teeth * (stage.pin_count * crank - pin)
    return pin - crank, slope, (stage.pin_count**2 * crank - pin) / stage.disc_teeth**2


@dataclass(frozen=True, kw_only=True)
class ProfilePoints:
    """Points around a whole disc, clockwise, the first one not repeated."""

    per_tooth: int  # Points of one tooth [-]
    place: Float[np.ndarray, "point 2"]  # x and y [m]
    # φ at each point, negative on the flank at the counter-clockwise side of its root [rad]
    angle: Float[np.ndarray, " point"]
    chord_error: float  # Largest distance of the profile from the straight line between neighbouring points [m]


def _flank_angles(profile: ToothProfile, count: int) -> Points:
    """Return φ from root to tip such that all chords are about equally wrong [rad]."""
    dense = np.linspace(*profile.edges, _DENSE)
    place = profile.points(dense)
    length = np.hypot(*np.diff(place, axis=0).T)
    bend = np.sqrt(np.abs(profile.curvature((dense[1:] + dense[:-1]) / 2)))
    # A chord's error is curvature·length²/8; a fifth of the mean keeps points on the flat of the flank.
    weight = np.concatenate([[0.0], np.cumsum((bend + 0.2 * bend.mean()) * length)])
    return np.interp(np.linspace(0.0, weight[-1], count), weight, dense)


def _chord_error(profile: ToothProfile, angle: Points) -> float:
    """Return the largest distance of the flank from its chords [m]."""
    between = angle[:-1, np.newaxis] + np.diff(angle)[:, np.newaxis] * np.linspace(0.1, 0.9, 9)
    start, end, curve = profile.points(angle[:-1]), profile.points(angle[1:]), profile.points(between)
    along = (end - start) / np.hypot(*(end - start).T)[:, np.newaxis]
    offset = curve - start[:, np.newaxis]
    return float(np.abs(offset[..., 0] * along[:, 1:] - offset[..., 1] * along[:, :1]).max())


def require_points(per_tooth: int) -> None:
    """Raise unless a drawing can use so many points per tooth."""
    if not FEWEST <= per_tooth <= MOST or per_tooth % 2:
        raise InputError.at("profile", "points per tooth", per_tooth, f"an even number from {FEWEST} to {MOST}")


def profile_points(profile: ToothProfile, per_tooth: int) -> ProfilePoints:
    """Return the points of a whole disc with a sound profile, an even number of them per tooth."""
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

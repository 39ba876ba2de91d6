"""The clearance that a modification leaves between pins and teeth, by the linear formula and exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.reading.units import DEGREE, MICROMETRE
from tolalloc.reducers.cycloid.tooth_profile import Angles, ToothProfile, normals
from tolalloc.reducers.reducer.design import CycloidStage, Modification

_ROUNDING = 1e-13  # clearance that counts as none [m]

Rotation = float | Float[np.ndarray, "*angles"]

LARGE = 50 * MICROMETRE
"""Modification above which the linear formula is no longer trusted [m]."""

FLANK = np.linspace(0.0, pi, 721)
"""Angles φ at which the clearance of a flank is tabulated [rad]."""

_TURNED = FLANK[4:-4]
"""The same without the pins within 1° of root and tip, whose clearance a rotation of the disc does not close [rad]."""
Gap = Callable[[Angles, Rotation], Float[np.ndarray, "*angles"]]
"""Clearance of pins at angles φ on a disc rotated by an angle [m]."""


def is_large(stage: CycloidStage, modification: Modification) -> bool:
    """Return whether the modification is too large for the linear formula.

    Own derivation: max(|Δr_rp|, |Δr_p|, |δ|·r_d) > 50 µm, where the linear formula misses exact distances by more
    than about 0.3 µm.
    """
    amounts = (modification.equidistant, modification.shift, modification.rotation * stage.disc_pitch_radius)
    return max(abs(amount) for amount in amounts) > LARGE


def linear_clearance(stage: CycloidStage, modification: Modification, pin_angle: Angles) -> Angles:
    """Return the material removed along the normal, Δr_rp − Δr_p·cos κ + δ·r_d·|S|, theory page equation (35) [m].

    First order in the amounts: good to 0.3 µm on the working flanks up to `LARGE`; cos κ and S of `normals`, φ [rad].

    References
    ----------
    xi2015 and li2018 for Δr_rp and Δr_p (both write Rp − Δr_p); the rotation's term is an own derivation.

    Examples
    --------
    At root and tip, where cos κ is 1, equidistant less shift amount.

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> stage = load_reducer("rv20e").cycloid_stage
    >>> amounts = Modification(equidistant=20e-6, shift=12e-6)
    >>> (1e6 * linear_clearance(stage, amounts, np.array([0.0, np.pi]))).round(6).tolist()
    [8.0, 8.0]
    """
    into = normals(stage.shortening, pin_angle)
    turned = modification.rotation * stage.disc_pitch_radius * np.abs(into.lever)
    return np.asarray(modification.equidistant - modification.shift * into.along_radius + turned)


def removed(profile: ToothProfile, pin_angle: Angles) -> Angles:
    """Return the material that a drawing's profile removes, `linear_clearance` less a free form [m].

    Theory page equations (35) and (83), own derivation, first order in amounts and form; φ [rad].
    """
    found = linear_clearance(profile.stage, profile.modification, pin_angle)
    return found if profile.form is None else found - profile.form.at(pin_angle)


def formula_gap(stage: CycloidStage, modification: Modification, pin_angle: Angles) -> Angles:
    """Return Li Lixing's gap after closing at φ0, Δr_rp(1 − S) − Δr_p(cos κ − q·S) [m].

    Right only if Δr_rp·q ≥ Δr_p; otherwise another pin touches first and the formula goes negative.

    References
    ----------
    xi2015, equation (3).
    """
    into = normals(stage.shortening, pin_angle)
    shift = into.along_radius - stage.flank_ratio * into.lever
    return np.asarray(modification.equidistant * (1 - into.lever) - modification.shift * shift)


def exact_clearance(
    profiles: Sequence[ToothProfile], pin_angle: Float[np.ndarray, " pin"], rotation: Rotation = 0.0
) -> Float[np.ndarray, "profile pin"]:
    """Return exact distances of pins from the teeth of discs turned by the rotations [rad], overlap negative [m].

    Own derivation: the nearest point lies where (P − w)·w′ = 0 on the path w of the grinding pin's centre; exact to
    rounding.
    """
    from tolalloc.reducers.cycloid.solvers.pins import FIELDS, pin_clearances

    designs, clearance = np.empty((len(profiles), FIELDS)), np.empty((len(profiles), pin_angle.size))
    for row, profile in zip(designs, profiles, strict=True):
        stage, ground = profile.stage, profile.ground
        row[:] = (
            stage.pin_circle_radius, stage.pin_radius, stage.eccentricity, stage.disc_teeth,
            ground.pin_circle_radius, ground.pin_radius, profile.modification.rotation,
            *profile.edges, 1 / ground.smallest_convex_radius,
        )  # fmt: skip
    turned = np.ascontiguousarray(np.broadcast_to(rotation, clearance.shape), float)
    angle = np.ascontiguousarray(np.remainder(pin_angle + pi, 2 * pi) - pi)
    pin_clearances(designs, angle, turned, clearance)
    return clearance


def gap_of(profile: ToothProfile, exact: bool) -> Gap:
    """Return the clearance as a function of the pins' angles and of the disc's rotation, exact or linear.

    A free form of the profile is taken off along the normal at the pin's φ in either case, theory page equation (83).

    Linear: `linear_clearance` − β·r_d·S [m] (own derivation), β the disc's rotation, φ [rad], within `is_large`.
    """
    stage, lever, form = profile.stage, profile.stage.disc_pitch_radius, profile.form

    def linear(pin_angle: Angles, rotation: Rotation) -> Angles:
        closing = lever * normals(stage.shortening, pin_angle).lever * rotation
        return np.asarray(linear_clearance(stage, profile.modification, pin_angle) - closing)

    def distance(pin_angle: Angles, rotation: Rotation) -> Angles:
        by = np.broadcast_to(rotation, pin_angle.shape).ravel()
        return np.asarray(exact_clearance([profile], pin_angle.ravel(), by)[0].reshape(pin_angle.shape))

    known: Gap = distance if exact else linear
    return known if form is None else lambda pin_angle, rotation: known(pin_angle, rotation) - form.at(pin_angle)


@dataclass(frozen=True, kw_only=True)
class FlankClearance:
    """What a modification leaves between one flank and the pins."""

    pin_angle: Float[np.ndarray, " angle"]  # Angle φ of the pins from the crank direction [rad]
    # Clearance of the centred disc, and after its rotation until the first pin touches [m]
    before: Float[np.ndarray, " angle"]
    after: Float[np.ndarray, " angle"]
    formula: Float[np.ndarray, " angle"]  # The same as ``after`` by Li Lixing's formula, which closes at φ0 [m]
    rotation: float  # Free rotation to one side, with a pin at every angle [rad]
    first_contact: float  # φ of the pin that touches first [rad]
    radial: float  # Clearance at tip and root, Δr_rp − Δr_p [m]
    exact: bool  # Whether the distances are exact

    @property
    def free_rotation(self) -> float:
        """Of the disc on its pins alone, from one side to the other [rad]."""
        return 2 * self.rotation

    @property
    def formula_error(self) -> float:
        """Largest difference of the formula, which closes at φ0, from the clearance after the first contact [m]."""
        return float(np.abs(self.formula - self.after).max())


def _narrowest(gap: Gap, rotation: float, angles: Angles = FLANK) -> tuple[float, float]:
    """Return the angle of the pin with the smallest clearance on a rotated disc, and that clearance [rad, m]."""
    from scipy.optimize import minimize_scalar

    gaps = gap(angles, rotation)
    at = int(np.argmin(gaps))
    found = minimize_scalar(
        lambda angle: gap(np.array([angle]), rotation)[0],
        bounds=(angles[max(at - 1, 0)], angles[min(at + 1, angles.size - 1)]),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return (float(found.x), float(found.fun)) if found.fun < gaps[at] else (float(angles[at]), float(gaps[at]))


def clearance_of(profile: ToothProfile, exact: bool | None = None) -> FlankClearance:
    """Return the clearance of a sound profile and where the first pin truly touches.

    Distances are exact by default only where the modification is too large for the linear formula.
    """
    from scipy.optimize import brentq

    stage, modification = profile.stage, profile.modification
    exact = is_large(stage, modification) if exact is None else exact
    gap = gap_of(profile, exact)
    angle, narrowest = _narrowest(gap, 0.0)
    if narrowest < -_ROUNDING:
        raise InputError(
            f"modification: interference of {-narrowest / MICROMETRE:.3g} µm with the pin at {angle / DEGREE:.1f}°; "
            "allowed is a clearance of 0 or more at every pin."
        )
    one_sided = max(gap(FLANK, 0.0).max(), MICROMETRE) / stage.disc_pitch_radius
    while _narrowest(gap, one_sided, _TURNED)[1] > 0:
        one_sided *= 2
    rotation, first_contact = 0.0, _narrowest(gap, 0.0, _TURNED)
    if first_contact[1] > _ROUNDING:
        rotation = float(brentq(lambda by: _narrowest(gap, by, _TURNED)[1], 0.0, one_sided, xtol=1e-15, rtol=1e-12))
        first_contact = _narrowest(gap, rotation, _TURNED)
    return FlankClearance(
        pin_angle=FLANK,
        before=gap(FLANK, 0.0),
        after=gap(FLANK, rotation),
        formula=formula_gap(stage, modification, FLANK),
        rotation=rotation,
        first_contact=first_contact[0],
        radial=modification.radial_clearance if profile.form is None else float(min(gap(FLANK[[0, -1]], 0.0))),
        exact=exact,
    )

"""Pins and teeth under torque: how stiff one pin against one tooth is, rotation, forces, loaded zone and pressure.

By Li Lixing's linear method and by the contact law at every pin, at every phase of the pins; with the clearance of a
modification it is one record.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, inf, pi

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.halving import halved
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.clearance import FLANK, LARGE, FlankClearance, Gap, clearance_of, gap_of, is_large
from tolalloc.reducers.cycloid.line_contact import LineContact
from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.cycloid.solvers.pins import pin_forces
from tolalloc.reducers.cycloid.tooth_profile import (
    Angles,
    ToothProfile,
    flank_angle,
    normals,
    path_curvature,
    pin_angles,
    require_sound,
)
from tolalloc.reducers.reducer.design import CycloidStage, Reducer
from tolalloc.reducers.reducer.stiffness import Stiffness

AtPhases = Float[np.ndarray, " phase"]
AtPins = Float[np.ndarray, "phase disc pin"]
APPROACH = 2.0 / 3.0
"""Constant of the approach F/c·(ln(cL/F) + 2/3) of pin and tooth: Roark's and Li Lixing's, who write it
2/3 + ln(16·r·ρ/(2a)²) with Hertz's half width a [-]."""
PAIR_SHARE = 0.55
"""Share of the torque on the more loaded disc of a pair, Li Lixing's assumption [-]."""
_HALVINGS = 45  # from a quarter of a degree down to rounding
_ITERATIONS = 500
_SHORTEST = 1e-6  # lever below which a pin at tip or root carries no torque [-]
_ROUNDING = 1e-12  # difference of amounts that counts as none [m]


def contact_stiffness(stage: CycloidStage, stiffness: Stiffness, pin_angle: Angles) -> tuple[Angles, Angles]:
    """Return what `pin_force` takes of pins against the teeth that they meet.

    First of the linear laws the stiffness, of the logarithmic one its scale C; bending in series [N/m]. Then ln(λ/1 m)
    of the logarithmic law [-].

    1/K = 1/C + 1/k for the linear laws; ln λ + c/k with c = 2C for the logarithmic one, which has the same effect on
    F/c·ln(cλ/F) (own derivation); k the bending of a pin.
    """
    contact, law = np.full_like(pin_angle, stiffness.pin_contact), stiffness.pin_contact_law
    if law == "table2":
        contact = pin_contact_table2(stage, stiffness.pin_contact, pin_angle)
    log_length = np.log(equivalent_length(stage, pin_angle))
    if law == "logarithmic":
        # A spring in series adds F/k to F/c·ln(cλ/F), which a longer λ does as well.
        log_length = log_length + 2.0 * stiffness.pin_contact / stiffness.pin_bending
    else:
        contact = contact / (1.0 + contact / stiffness.pin_bending)
    return contact, log_length


def crowned_contact(
    reducer: Reducer, pin_angle: Angles, force: Float[np.ndarray, "..."], slope: Float[np.ndarray, "..."]
) -> LineContact:
    """Return pins on the crowned teeth that they meet at φ under forces [rad, N], tilted by slopes [rad].

    Slices are as stiff as the law's secant at the force, F/δ (assumed). The bending of a pin is left out: it gives way
    to the whole force and does not level what the crowning leaves.

    K = F/δ of the law, C, C(ρ−r)/(ρ+r) or c/ln(cλ/F) [N/m].

    Theory page equation (31), own derivation; within 7 % of Hertz's ellipse under the logarithmic law.
    """
    stage, shape = reducer.cycloid_stage, np.broadcast_shapes(pin_angle.shape, force.shape)
    stiffness, log_length = contact_stiffness(stage, replace(reducer.stiffness, pin_bending=inf), pin_angle)
    if LAWS[reducer.stiffness.pin_contact_law] != LINEAR:
        scale = 2.0 * stiffness
        stiffness = scale / (np.log(scale / np.where(force > 0, force, 1.0)) + log_length)
    return LineContact(
        force=force,
        stiffness=np.broadcast_to(stiffness, shape),
        slope=slope,
        face_width=stage.face_width,
        crowning=stage.crowning,
    )


def pin_contact_table2(stage: CycloidStage, convex_stiffness: float, pin_angle: Angles) -> Angles:
    """Return K_djk along the tooth: C(ρ−r)/(ρ+r) on the concave part, C on the convex part [N/m].

    With the curvature κ of the pin centre's path it is C/(1 + 2rκ). The printed formula with its signed curvature is
    singular or negative on the convex part for pin radii above about 2.5 mm on an RV-20E, so only the concave part
    follows the print.

    References
    ----------
    liu2020, Table 2 (K_djk).

    K = C/(1 + 2·r_rp·max(κ, 0)), C and K in N/m, for 0 < K1 < 1.
    """
    return np.asarray(convex_stiffness / (1 + 2 * stage.pin_radius * np.maximum(path_curvature(stage, pin_angle), 0.0)))


def equivalent_length(stage: CycloidStage, pin_angle: Angles) -> Angles:
    """Return λ = L·exp(2/3) of the approach F/c·ln(cλ/F), theory page equation (30) [m].

    L is the radius of curvature of the path of the pin's centre on the disc: the flank's radius plus r_rp where the
    flank is convex and minus r_rp where it is concave; with Hertz's half width the approach depends on the radii by L
    alone. Near the inflection L grows without bound and the approach only with its logarithm; Rp as the largest length
    is an assumption. φ [rad].

    References
    ----------
    Hertz's line contact; the constant 2/3 is Li Lixing's and Roark's, L an own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = equivalent_length(load_reducer("rv40e_xi2015").cycloid_stage, np.array([np.pi]))
    >>> round(1e3 * float(found[0]) / exp(APPROACH), 3)  # L at the tip [mm]
    6.276
    """
    bend = np.abs(path_curvature(stage, pin_angle))
    return np.asarray(exp(APPROACH) / np.maximum(bend, 1 / stage.pin_circle_radius))


def peak_pressure(stage: CycloidStage, contact_modulus: float, pin_angle: Angles, force: Angles) -> Angles:
    """Return Hertz's peak pressure √(F·E*/(πb·R)), R from the pin and the tooth's own curvature where it touches [Pa].

    E* is that of pin and disc, the angle φ that of the pins from the crank direction [rad], the force theirs [N].

    1/R = 1/r_rp + 1/ρ. For elastic bodies whose contact is narrow against R.

    References
    ----------
    Hertz's line contact, p = √(F·E*/(πbR)).

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> stage = load_reducer("rv40e_xi2015").cycloid_stage
    >>> found = peak_pressure(stage, 206e9 / (2 * (1 - 0.3**2)), np.radians([54.0]), np.array([900.0]))
    >>> round(float(found[0]) / 1e6)  # of 900 N at 54° [MPa]
    1539
    """
    path, pin = path_curvature(stage, pin_angle), stage.pin_radius
    # 1/R = 1/r + 1/ρ with ρ = −1/κ − r of the tooth, convex positive.
    sum_of_curvatures = 1 / pin - path / (1 + pin * path)
    return np.asarray(np.sqrt(force * contact_modulus * sum_of_curvatures / (np.pi * stage.face_width)))


@dataclass(frozen=True, kw_only=True)
class LoadedContact:
    """Discs pressed against the pins, at phases that divide the pin pitch."""

    method: str  # How it was found
    phase: Float[np.ndarray, " phase"]  # Angle from the crank direction of disc 1 to the next pin [rad]
    pin_angle: Float[np.ndarray, "phase disc pin"]  # Angle φ of the pins from their disc's crank direction [rad]
    # Clearance after the first contact, with a pin at every angle, before the load [m]
    gap: Float[np.ndarray, "phase disc pin"]
    # δ_max = r_d·rotation under the load, what a pin with the longest lever yields [m]
    deflection: Float[np.ndarray, " phase"]
    # Force and Hertz's peak pressure of every pin, torque of the pins on each disc [N, Pa, N·m]
    force: Float[np.ndarray, "phase disc pin"]
    pressure: Float[np.ndarray, "phase disc pin"]
    torque: Float[np.ndarray, "phase disc"]
    # First and last angle at which a pin would carry; where two places touch first, pins between may be free [rad]
    zone: Float[np.ndarray, "phase 2"]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "phase disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.force > 0).sum(axis=2))

    @property
    def most_loaded(self) -> float:
        """Angle of the pin under the largest force of all phases [rad]."""
        return float(self.pin_angle.ravel()[np.argmax(self.force)])

    @property
    def most_pressed(self) -> float:
        """Angle of the pin under the largest pressure of all phases [rad]."""
        return float(self.pin_angle.ravel()[np.argmax(self.pressure)])


@dataclass(frozen=True, kw_only=True)
class PressedDiscs:
    """Discs of a reducer that share a torque, ready to be pressed against their pins."""

    reducer: Reducer  # Nominal design; its contact law, bending of the pins and modification are used
    torque: float  # Torque of the pins on all discs together [N·m]
    discs: int = 1  # Number of discs that share it [-]
    # Whether clearances are exact distances; by default where the modification is too large for the formula
    exact: bool | None = None

    def __post_init__(self) -> None:
        if not self.torque > 0:
            raise InputError.at(self.reducer.name, "torque on the discs", self.torque, "above 0 N·m")

    @cached_property
    def profile(self) -> ToothProfile:
        """The ground profile."""
        return ToothProfile.of(self.reducer)

    @cached_property
    def clearance(self) -> FlankClearance:
        """What the modification leaves, and where the first pin touches."""
        return clearance_of(self.profile, self.exact)

    @cached_property
    def gap(self) -> Gap:
        """Clearance of pins at their angles on a disc rotated by an angle [m]."""
        return gap_of(self.profile, self.clearance.exact)

    def pin_angles(self, phase: AtPhases) -> AtPins:
        """Return φ of every pin from its disc's crank direction [rad]."""
        stage = self.reducer.cycloid_stage
        turned = 2 * pi * np.arange(self.discs) / self.discs
        return np.stack([pin_angles(stage, phase - direction) for direction in turned], axis=1)


def default_phases(reducer: Reducer, count: int = 72) -> AtPhases:
    """Return equally spaced phases over one pin pitch, the first with a pin in the crank direction [rad].

    Phase k is 2π·k/(zp·count), own derivation: after one pin pitch everything repeats.
    """
    return 2 * pi / reducer.cycloid_stage.pin_count * np.arange(count) / count


def _zones(gap: Gap, rotation: AtPhases, contact: float) -> Float[np.ndarray, "phase 2"]:
    """Return the first and the last angle of compression, tabulated and then bisected for all phases at once [rad]."""
    table = np.sort(np.append(FLANK, contact))  # a light load may press nothing but the first contact
    shape = (rotation.size, table.size)
    pressed = gap(np.broadcast_to(table, shape), np.broadcast_to(rotation[:, np.newaxis], shape)) <= 0
    pressed[:, table == contact] = True
    first, last = pressed.argmax(axis=1), table.size - 1 - pressed[:, ::-1].argmax(axis=1)
    edges = []
    for own, outer in ((first, np.maximum(first - 1, 0)), (last, np.minimum(last + 1, table.size - 1))):
        edges.append(halved(lambda at: gap(at, rotation) <= 0, table[own], table[outer], _HALVINGS))
    return np.stack(edges, axis=1)


def _loaded(discs: PressedDiscs, method: str, phase: AtPhases, deflection: AtPhases, force: AtPins) -> LoadedContact:
    """Return the contact whose deflection and forces a method has found.

    Phases are angles from the crank direction of disc 1 to the next pin [rad], deflections δ_max [m], forces those of
    the pins [N].

    Own derivation: the disc has turned by β + δ_max/r_d, β that of the first contact; the torque is r_d·Σ S·F.
    """
    reducer, stage, closed = discs.reducer, discs.reducer.cycloid_stage, discs.clearance
    angles = discs.pin_angles(phase)
    lever = normals(stage.shortening, angles).lever
    rotations = closed.rotation + deflection / stage.disc_pitch_radius
    evenly = force  # What the even load would have to be for the pressure where it is largest
    if stage.crowning:
        evenly = crowned_contact(reducer, angles, force, np.zeros_like(force)).peak * stage.face_width
    return LoadedContact(
        method=method,
        phase=phase,
        pin_angle=angles,
        gap=discs.gap(angles, closed.rotation),
        deflection=deflection,
        force=force,
        pressure=peak_pressure(stage, reducer.contact_modulus, angles, evenly),
        torque=stage.disc_pitch_radius * (lever * force).sum(axis=2),
        zone=_zones(discs.gap, rotations, closed.first_contact),
    )


def pressed_linear(discs: PressedDiscs, phase: AtPhases, deflection: float | None = None) -> LoadedContact:
    """Return the contact by Li Lixing's method: forces in proportion to the compressions.

    Without a deflection δ_max [m] it is iterated until it is the approach under the largest force, by the reducer's
    law with the curvature at φ0.

    Theory page equation (36): F_i = F_max·(δ_max·S_i − gap_i)/δ_max [N] with F_max from the balance of torques;
    phases [rad].

    References
    ----------
    xi2015, equations (5)–(7); Li Lixing (1984).

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> discs = PressedDiscs(reducer=load_reducer("rv40e_xi2015"), torque=0.55 * 572.0)
    >>> found = pressed_linear(discs, np.array([0.0]), deflection=17.603e-6)
    >>> round(float(found.force.max()), 1), int(found.pins_in_contact[0, 0])  # [N, -]
    (707.2, 16)
    """
    stage, angles = discs.reducer.cycloid_stage, discs.pin_angles(phase)
    lever, distance = normals(stage.shortening, angles).lever, discs.gap(angles, discs.clearance.rotation)

    def shares(depth: AtPhases) -> AtPins:
        return np.asarray(np.maximum(lever - distance / depth[:, np.newaxis, np.newaxis], 0.0))

    def largest_force(depth: AtPhases) -> AtPhases:
        return np.asarray(discs.torque / (stage.disc_pitch_radius * (shares(depth) * lever).sum(axis=(1, 2))))

    nearest = np.where(lever > _SHORTEST, distance / np.maximum(lever, _SHORTEST), np.inf).min(axis=(1, 2))
    if deflection is not None:
        if deflection <= nearest.max():
            raise InputError(
                f"{discs.reducer.name}: a deflection of {deflection / MICROMETRE:.3g} µm reaches no pin; "
                f"allowed is above {nearest.max() / MICROMETRE:.3g} µm."
            )
        depth = np.full(phase.size, deflection)
        method = "Li Lixing's linear method, deflection given"
    else:
        depth = _iterated(discs, nearest, largest_force)
        method = "Li Lixing's linear method"
    force = largest_force(depth)[:, np.newaxis, np.newaxis] * shares(depth)
    return _loaded(discs, method, phase, depth, force)


def _iterated(discs: PressedDiscs, nearest: AtPhases, largest_force: Callable[[AtPhases], AtPhases]) -> AtPhases:
    """Return the deflections that are the approach under their own largest force [m].

    The plain iteration swings from too many pins to too few, or to none; so the mean of old and new is taken, and the
    middle of what brackets the answer where that mean leaves it and at every third step, as the mean may creep.
    """
    low, high = nearest, np.full(nearest.size, np.inf)
    lever = discs.reducer.cycloid_stage.disc_pitch_radius
    depth = nearest + _approach(discs.reducer, np.full(nearest.size, discs.torque / lever))
    for step in range(1, _ITERATIONS + 1):
        wanted = _approach(discs.reducer, largest_force(depth))
        if (np.abs(wanted - depth) <= 1e-13 * depth).all() or (high - low <= 1e-15 * depth).all():
            return np.asarray(depth)
        low, high = np.where(wanted > depth, depth, low), np.where(wanted > depth, high, depth)
        mean, middle = 0.5 * (depth + wanted), 0.5 * (low + np.minimum(high, 4 * depth))
        depth = np.where((low < mean) & (mean < high) & (step % 3 != 0), mean, middle)
    raise SolveError(f"{discs.reducer.name}: Li Lixing's iteration did not settle in {_ITERATIONS} steps.")


def _approach(reducer: Reducer, force: AtPhases) -> AtPhases:
    """Return how far pin and tooth at φ0 approach each other under forces [m]."""
    stage, stiffness = reducer.cycloid_stage, reducer.stiffness
    contact, log_length = contact_stiffness(stage, stiffness, np.array([flank_angle(stage)]))
    if LAWS[stiffness.pin_contact_law] == LINEAR:
        return np.asarray(force / contact)
    scale = 2 * contact
    return np.asarray(force / scale * (np.log(scale / force) + log_length))


def _balancing(
    discs: PressedDiscs, torque: Callable[[AtPhases, Int[np.ndarray, " some"]], AtPhases], phases: int
) -> AtPhases:
    """Return the deflections at which the torques balance [m], given that of the pins under some at some phases."""
    from scipy.optimize import elementwise

    wanted, deepest = discs.torque, discs.reducer.cycloid_stage.pin_radius
    phase = np.arange(phases)
    high, short = np.full(phases, MICROMETRE), phase
    while (short := short[torque(high[short], short) < wanted]).size:
        if high[short].max() >= deepest:
            raise InputError(
                f"{discs.reducer.name}: torque {wanted:.6g} N·m on the discs is beyond any contact: pins would be "
                f"pressed in by more than their radius; allowed is below {torque(high[short], short).min():.3g} N·m."
            )
        high[short] = np.minimum(2 * high[short], deepest)
    found = elementwise.find_root(
        lambda depth, at: torque(depth, at) - wanted,
        (np.zeros(phases), high),
        args=(phase,),
        tolerances={"xrtol": 1e-13},
    )
    return np.asarray(found.x)


def pressed(discs: PressedDiscs, phase: AtPhases) -> LoadedContact:
    """Return the contact of every pin by the reducer's own law, the rotation bracketed until the torques balance.

    Theory page equation (37): Σ r_d·S·F = T [N·m] at phases [rad], each tooth with its own curvature. All discs turn
    by the same angle; a single one carries the whole torque.

    Own derivation; Li Lixing's method, xi2015, takes the curvature at φ0 for all.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> design = load_reducer("rv40e_xi2015")
    >>> lines = replace(design, stiffness=replace(design.stiffness, pin_contact_law="logarithmic"))
    >>> found = pressed(PressedDiscs(reducer=lines, torque=0.55 * 572.0), np.array([0.0]))
    >>> round(float(found.force.max())), round(float(found.torque[0, 0]), 3)  # [N, N·m]
    (1144, 314.6)
    """
    stage, stiffness, angles = discs.reducer.cycloid_stage, discs.reducer.stiffness, discs.pin_angles(phase)
    pins, law = angles.reshape(phase.size, -1), stiffness.pin_contact_law
    lever = stage.disc_pitch_radius * normals(stage.shortening, pins).lever
    contact, log_length = contact_stiffness(stage, stiffness, pins)

    def forces(deflection: AtPhases, at: Int[np.ndarray, " some"]) -> Float[np.ndarray, "some pin"]:
        """Return the forces of all pins at some phases, each under its own deflection [N]."""
        rotation = discs.clearance.rotation + deflection / stage.disc_pitch_radius
        compression = -discs.gap(pins[at], np.repeat(rotation[:, np.newaxis], pins.shape[1], axis=1))
        return np.asarray(pin_forces(LAWS[law], contact[at], log_length[at], compression)[0])

    def torque(deflection: AtPhases, at: Int[np.ndarray, " some"]) -> AtPhases:
        return np.asarray((lever[at] * forces(deflection, at)).sum(axis=1))

    deflection = _balancing(discs, torque, phase.size)
    force = forces(deflection, np.arange(phase.size))
    return _loaded(discs, f"{law} law at every pin", phase, deflection, force.reshape(angles.shape))


@dataclass(frozen=True, kw_only=True)
class Assessment:
    """One modification under one torque."""

    reducer: Reducer  # The reducer, with the contact law in use
    torque: float  # Torque on the carrier [N·m]
    share: float  # Share of it on the more loaded disc [-]
    profile: ToothProfile  # The ground profile
    clearance: FlankClearance  # Clearance in use, linear or exact
    exact_clearance: FlankClearance  # Clearance by exact distances, to compare with
    linear: LoadedContact  # The more loaded disc by Li Lixing's linear method
    single: LoadedContact  # The more loaded disc by the contact law at every pin
    together: LoadedContact  # All discs turning by the same angle, their bearings rigid

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before trusting the numbers."""
        stage, amounts, found = self.reducer.cycloid_stage, self.reducer.modification, []
        if is_large(stage, amounts):
            found.append(
                f"The modification is above {LARGE / MICROMETRE:g} µm, too large for the linear formula: "
                + ("exact distances were taken." if self.clearance.exact else "ask for exact distances.")
            )
        if amounts.shift > amounts.equidistant * stage.flank_ratio + _ROUNDING:
            found.append(
                "Δr_rp·√(1−K1²) is below Δr_p: the first contact is not at arccos K1, where Li Lixing's formula "
                f"closes the gap, and the formula is off by up to {self.clearance.formula_error / MICROMETRE:.2g} µm."
            )
        if self.torque > self.reducer.load.rated_torque:
            found.append(f"The torque is above the rated {self.reducer.load.rated_torque:g} N·m.")
        return tuple(found)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        count, law = self.reducer.disc_count, self.reducer.stiffness.pin_contact_law
        supports = "half grooves" if self.reducer.stiffness.pin_bending == float("inf") else "two supports"
        return (
            f"the most loaded of {count} discs carries {self.share:.3g} of the torque ({PAIR_SHARE:g} of two)",
            f"{law} contact law; the pins rest in {supports}",
            "no errors: every pin and tooth at its place, discs turning about their centres",
            "lever arm of a pin force: taken from the exact tooth",
            *self.reducer.assumptions,
        )


def pin_moment(reducer: Reducer, torque: float) -> float:
    """Return the moment of all pin forces about the centres of their discs under a torque on the carrier [N·m].

    The housing holds what the sun does not, T·(1 − 1/i). All pin forces pass through the pole, e·zp from the housing's
    centre and e·zc from the disc's, so of that moment zc/zp is left about the disc.

    T_pins = T·(1 − 1/i)·zc/zp; exact without friction and tilt.

    Own derivation, from the balance of moments about the housing's centre.
    """
    stage = reducer.cycloid_stage
    return torque * (1.0 - 1.0 / reducer.sun_ratio) * stage.disc_teeth / stage.pin_count


def assess(
    reducer: Reducer, torque: float, *, law: str = "logarithmic", exact: bool | None = None, phases: int = 72
) -> Assessment:
    """Return what the reducer's modification does under a torque.

    Pins bend if the reducer says so; the torque has either sign [N·m], the law is one of
    `tolalloc.reducers.cycloid.solvers.LAWS`, the phases lie within one pin pitch. Distances are exact by default
    where the
    modification is too large for the linear formula.

    References
    ----------
    xi2015 for Li Lixing's method and 572 N·m; the law at every pin and the discs together are own derivations.
    """
    reducer = replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law=law))
    profile, torque = ToothProfile.of(reducer), abs(torque)
    require_sound(profile, reducer.name)
    # Li Lixing's method as xi2015 uses it for a pair; in proportion for other numbers, an assumption
    share = 1.0 if reducer.disc_count == 1 else 2 * PAIR_SHARE / reducer.disc_count
    phase = default_phases(reducer, phases)
    one = PressedDiscs(reducer=reducer, torque=share * torque, exact=exact)
    every = PressedDiscs(reducer=reducer, torque=pin_moment(reducer, torque), discs=reducer.disc_count, exact=exact)
    return Assessment(
        reducer=reducer,
        torque=torque,
        share=share,
        profile=profile,
        clearance=one.clearance,
        exact_clearance=one.clearance if one.clearance.exact else clearance_of(profile, exact=True),
        linear=pressed_linear(one, phase),
        single=pressed(one, phase),
        together=pressed(every, phase),
    )

"""What moves a reducer over time: speed and torque, the nominal motion, masses, damping and the integrator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from math import pi
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.polynomial import Polynomial

from tolalloc.exceptions import InputError
from tolalloc.reducers.equivalent.springs import Coordinates, Positions, SpringGroup
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.housing import ways_of

BLENDS = {"linear": Polynomial([0, 1]), "step": Polynomial([0, 0, 3, -2])}
"""From 0 to 1 between two given times: along a straight line, or by the cubic that starts and ends level."""

_OverTime = Float[np.ndarray, " time"]
_Piece = tuple[Int[np.ndarray, " time"], _OverTime, _OverTime, _OverTime, _OverTime]
"""The piece of a profile that each time lies in: number, first value, rise to the last, length, share gone."""
ASSUMPTIONS = (
    "sun gear and planet gears: solid cylinders of their pitch radius, as wide as a disc; a crankshaft adds nothing to "
    "its planet gear",
    "disc: solid cylinder of the radius Rp − r_rp and its own width; bores are not taken out",
    "carrier: two solid flanges of the radius Rp − r_rp, each as wide as a disc",
    "all parts of steel of one density; the load's inertia turns with the carrier",
)
"""What `inertia_of` supposes, because no source prints a mass."""


@dataclass(frozen=True)
class SpeedProfile:
    """A quantity over time: given at some times, blended in between, held before the first and after the last."""

    times: tuple[float, ...]  # Increasing times [s]
    values: tuple[float, ...]  # The quantity at these times [rad/s or N·m]
    # ``linear``, or ``step`` for the cubic 3s² − 2s³ whose slope vanishes at both ends
    blend: Literal["linear", "step"] = "linear"

    def __post_init__(self) -> None:
        if not self.times or not np.all(np.isfinite(self.times)) or np.any(np.diff(self.times) <= 0.0):
            raise InputError.at("profile", "times", self.times, "one or more increasing times")
        if len(self.values) != len(self.times) or not np.all(np.isfinite(self.values)):
            raise InputError.at("profile", "values", self.values, "one finite value per time")

    @classmethod
    def constant(cls, value: float) -> SpeedProfile:
        """Return the profile that keeps one value [rad/s or N·m]."""
        return cls((0.0,), (value,))

    def at(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the quantity at the times [rad/s or N·m]."""
        _, first, rise, _, share = self._piece(time)
        return np.asarray(first + rise * BLENDS[self.blend](share))

    def slope(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the derivative by time, at a corner the one that follows [rad/s² or N·m/s]."""
        _, _, rise, length, share = self._piece(time)
        slope = rise * BLENDS[self.blend].deriv()(share) / length
        return np.asarray(np.where(time < self.times[0], 0.0, slope))

    def integral(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        """Return the integral from time 0 to the times [rad or N·m·s]."""
        return np.asarray(self._from_first(time) - self._from_first(np.zeros(1)))

    def _from_first(self, time: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
        times, values = np.array(self.times), np.array(self.values)
        whole = np.diff(times) * (values[:-1] + values[1:]) / 2  # both blends are even about the middle
        (number, first, rise, length, share), blend = self._piece(time), BLENDS[self.blend]
        inside = length * (first * share + rise * blend.integ()(share))
        before = np.concatenate([[0.0], np.cumsum(whole)])[number]
        return np.asarray(before + inside + values[0] * np.minimum(time - times[0], 0.0))

    def _piece(self, time: Float[np.ndarray, " time"]) -> _Piece:
        """Return the piece of each time; the last one starts at the last time and does not rise."""
        times, values = np.array(self.times), np.array(self.values)
        number = np.maximum(np.searchsorted(times, time, side="right") - 1, 0)
        length = np.append(np.diff(times), 1.0)[number]
        share = np.maximum(time - times[number], 0.0) / length
        return number, values[number], np.append(np.diff(values), 0.0)[number], length, share


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Nominal motion and load at equally spaced times."""

    time: Float[np.ndarray, " time"]  # Times, the first one 0 [s]
    # θc and its derivatives [rad, rad/s, rad/s²]
    carrier_angle: Float[np.ndarray, " time"]
    carrier_speed: Float[np.ndarray, " time"]
    carrier_acceleration: Float[np.ndarray, " time"]
    # Torque on the carrier; negative resists the positive direction of rotation [N·m]
    torque: Float[np.ndarray, " time"]

    @property
    def step(self) -> float:
        """Time from one step to the next [s]."""
        return float(self.time[1] - self.time[0])


def motion_of(
    reducer: Reducer,
    input_speed: SpeedProfile,
    output_torque: SpeedProfile,
    duration: float,
    steps: int,
    angle: float = 0.0,
) -> Motion:
    """Return the nominal motion under an input speed and an output torque.

    θc = θ0 + ∫Ω dt/i with the ratio i = 1 + (Z2/Z1)·zp, the θc(t) of theory page equation (61); input speed Ω [rad/s],
    torque on the carrier [N·m], duration of all steps [s], θc at time 0 [rad].

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> speed, torque = SpeedProfile.constant(525 * 2 * np.pi / 60), SpeedProfile.constant(-572.0)
    >>> found = motion_of(load_reducer("rv40e_xi2015"), speed, torque, duration=1.0, steps=10)
    >>> round(float(found.carrier_speed[-1]) * 60 / (2 * np.pi), 4)  # 525 rpm over a ratio of 81 [rpm]
    6.4815
    """
    _require_motion(reducer)
    if not 0.0 < duration < np.inf:
        raise InputError.at("motion", "duration", duration, "a positive time")
    if steps < 1:
        raise InputError.at("motion", "steps", steps, "1 or more")
    time = np.linspace(0.0, duration, steps + 1)
    return Motion(
        time=time,
        carrier_angle=angle + input_speed.integral(time) / reducer.ratio,
        carrier_speed=input_speed.at(time) / reducer.ratio,
        carrier_acceleration=input_speed.slope(time) / reducer.ratio,
        torque=output_torque.at(time),
    )


def _require_motion(reducer: Reducer) -> None:
    """Raise where a part of the reducer moves as no equation of motion says, such as a centre gear."""
    if unmoved := reducer.unmoved or ("a ring that gives" if ways_of(reducer.stiffness) else ""):
        raise InputError(f"reducer {reducer.name}: {unmoved} is not moved in time; this needs one without it.")


def nominal_acceleration(at: Positions, motion: Motion) -> Float[np.ndarray, "time coordinate"]:
    """Return the acceleration of every coordinate's part in the nominal motion [m/s², rad/s²].

    Crank axes run on the circle of radius a_sp with the carrier, disc centres on that of radius e with the crank; the
    sun's centre rests. Cranks turn with −zc·θc, discs and carrier with θc. A point on a circle of radius r that
    turns by φ has r·φ̈ along its path and r·φ̇² towards the centre.

    The a of theory page equation (61), own derivation: exact for rigid parts without errors.

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> reducer, steady = load_reducer("rv40e_xi2015"), SpeedProfile.constant(525 * 2 * np.pi / 60)
    >>> motion = motion_of(reducer, steady, SpeedProfile.constant(-572.0), duration=0.1, steps=1)
    >>> found = nominal_acceleration(Positions(reducer, motion.carrier_angle), motion)
    >>> round(float(np.hypot(*found[0, 8:10])), 3)  # disc 1: e·(zc·θ̇c)² = 1.3 mm·(39·0.679/s)² [m/s²]
    0.911
    """
    reducer, coordinates = at.reducer, at.coordinates
    speed, acceleration, stage = motion.carrier_speed, motion.carrier_acceleration, reducer.cycloid_stage
    crank_speed = -float(stage.disc_teeth)  # per carrier speed
    nominal = np.zeros((motion.time.size, coordinates.count))

    def on_circle(radius: float, direction: np.ndarray, per_carrier: float) -> np.ndarray:
        along, towards = radius * per_carrier * acceleration, radius * (per_carrier * speed) ** 2
        cosine, sine = np.cos(direction), np.sin(direction)
        return np.stack([-along * sine - towards * cosine, along * cosine - towards * sine], axis=1)

    for crank in range(coordinates.crank_count):
        own = coordinates.planet(crank)
        nominal[:, own : own + 2] = on_circle(reducer.crank_circle_radius, at.crank_position(crank), 1.0)
        nominal[:, own + 2] = crank_speed * acceleration
    for disc in range(coordinates.disc_count):
        own = coordinates.disc(disc)
        nominal[:, own : own + 2] = on_circle(stage.eccentricity, at.disc_direction(disc), crank_speed)
        nominal[:, own + 2] = acceleration
    nominal[:, coordinates.carrier + 2] = acceleration
    return nominal


@dataclass(frozen=True, kw_only=True)
class Inertia:
    """Masses and moments of inertia of one part of each kind."""

    # Masses; the planet's with its crankshaft [kg]
    sun: float
    planet: float
    disc: float
    carrier: float
    # Moments of inertia about their own axes; the carrier's with all that the output turns [kg·m²]
    planet_moment: float
    disc_moment: float
    carrier_moment: float

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 < value < np.inf:
                raise InputError.at("inertia", name, value, "a positive number")

    def diagonal(self, coordinates: Coordinates) -> Float[np.ndarray, " coordinate"]:
        """Return the mass or moment of inertia of every coordinate [kg, kg·m²]."""
        planet, disc = [self.planet, self.planet, self.planet_moment], [self.disc, self.disc, self.disc_moment]
        carrier = [self.carrier, self.carrier, self.carrier_moment]
        parts = [self.sun, self.sun, *planet * coordinates.crank_count, *disc * coordinates.disc_count, *carrier]
        return np.array(parts)


def inertia_of(reducer: Reducer, density: float = 7850.0, output_inertia: float = 0.0) -> Inertia:
    """Return the inertia of a reducer's parts under `ASSUMPTIONS`.

    Solid cylinders of radius R and width b have m = ρ·π·R²·b and J = m·R²/2. The density ρ is that of all parts
    [kg/m³]; the carrier turns the output inertia besides its own [kg·m²].

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = inertia_of(load_reducer("rv40e_xi2015"))
    >>> f"{found.disc:.3f} kg, {found.disc_moment:.3e} kg·m²"
    '1.101 kg, 2.049e-03 kg·m²'
    """
    _require_motion(reducer)
    if not 0.0 <= output_inertia < np.inf:
        raise InputError.at("inertia", "output_inertia", output_inertia, "0 or a positive number")
    stage, gears = reducer.cycloid_stage, reducer.gears

    def cylinder(radius: float, width: float) -> tuple[float, float]:
        mass = density * pi * radius**2 * width
        return mass, mass * radius**2 / 2

    body = stage.pin_circle_radius - stage.pin_radius
    sun, _ = cylinder(gears.module * gears.sun_teeth / 2, stage.face_width)
    planet, planet_moment = cylinder(gears.module * gears.planet_teeth / 2, stage.face_width)
    disc, disc_moment = cylinder(body, stage.face_width)
    carrier, carrier_moment = cylinder(body, 2 * stage.face_width)
    return Inertia(
        sun=sun,
        planet=planet,
        disc=disc,
        carrier=carrier,
        planet_moment=planet_moment,
        disc_moment=disc_moment,
        carrier_moment=carrier_moment + output_inertia,
    )


@dataclass(frozen=True, kw_only=True)
class Damping:
    """Damping in proportion to masses and to stiffness; pin contacts and interfaces with play have none of the latter.

    The C of theory page equation (62) [N·s/m], an assumption. A mode of angular frequency ω that strains one damped
    interface alone has the damping ratio mass_proportional/(2ω) + (stiffness_proportional + its own)·ω/2.
    """

    mass_proportional: float = 0.0  # Damping per mass of every coordinate [1/s]
    stiffness_proportional: float = 0.0  # Damping per stiffness of every interface without play [s]
    # Further damping per stiffness of single interfaces, by their field of
    # `tolalloc.reducers.reducer.stiffness.Stiffness` [s]
    interfaces: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        general = {name: getattr(self, name) for name in ("mass_proportional", "stiffness_proportional")}
        for name, value in {**general, **self.interfaces}.items():
            if not 0.0 <= value < np.inf:
                raise InputError.at("damping", name, value, "0 or a positive number")

    def check(self, groups: list[SpringGroup]) -> None:
        """Make sure that every interface with damping of its own is there and has no play."""
        allowed = [group.stiffness_name for group in groups if group.contact == "bilateral"]
        for name in self.interfaces:
            if name not in allowed:
                raise InputError.at("damping", "interface", name, f"one without play: {', '.join(allowed)}")


class Integrator(NamedTuple):
    """Constants of a one-step integrator of second order, in the form of Arnold and Brüls (2007).

    Theory page equation (63); the equations of motion hold exactly at every step:
    (1 − αm)·a' + αm·a = (1 − αf)·q̈' + αf·q̈, q' = q + h·q̇ + h²((½ − β)·a + β·a'), q̇' = q̇ + h((1 − γ)·a + γ·a').

    References
    ----------
    Arnold, M. and Brüls, O. (2007), Multibody System Dynamics 18, 185–202.
    """

    # Weights of the old step's accelerations, algorithmic and true [-]
    alpha_m: float
    alpha_f: float
    # Newmark's weights of the new acceleration in displacement and in velocity [-]
    beta: float
    gamma: float

    def rates(self, step: float) -> tuple[float, float, float]:
        """Return what a displacement beyond the predicted one adds to a, q̇ and q̈ [1/s², 1/s, 1/s²]."""
        algorithmic = 1 / (self.beta * step**2)
        return algorithmic, self.gamma * step * algorithmic, (1 - self.alpha_m) / (1 - self.alpha_f) * algorithmic


def newmark() -> Integrator:
    """Return Newmark's method of the average acceleration, which takes no energy away.

    Of theory page equation (63). It is stable at any step for linear springs, and of second order; pins that come and
    go may feed modes that are too fast for the step, which `generalised_alpha` damps.

    References
    ----------
    Newmark, N. M. (1959), Journal of the Engineering Mechanics Division 85, 67–94.

    Examples
    --------
    >>> newmark().rates(step=1e-4)  # 4/h², 2/h, 4/h² [1/s², 1/s, 1/s²]
    (400000000.0, 20000.0, 400000000.0)
    """
    return Integrator(alpha_m=0.0, alpha_f=0.0, beta=0.25, gamma=0.5)


def generalised_alpha(spectral_radius: float) -> Integrator:
    """Return the generalised-α method; a step leaves the spectral radius of an oscillation far too fast for it [-].

    Theory page equation (63): αm = (2ρ − 1)/(ρ + 1), αf = ρ/(ρ + 1), γ = ½ + αf − αm, β = (γ + ½)²/4 with the spectral
    radius ρ from 0 to 1; stable at any step for linear springs, and of second order.

    References
    ----------
    Chung, J. and Hulbert, G. M. (1993), Journal of Applied Mechanics 60, 371–375.

    Examples
    --------
    >>> generalised_alpha(1.0) == newmark()._replace(alpha_m=0.5, alpha_f=0.5)
    True
    >>> round(generalised_alpha(0.9).beta, 4)
    0.277
    """
    if not 0.0 <= spectral_radius <= 1.0:
        raise InputError.at("integrator", "spectral_radius", spectral_radius, "0 to 1")
    alpha_m, alpha_f = (2 * spectral_radius - 1) / (spectral_radius + 1), spectral_radius / (spectral_radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return Integrator(alpha_m=alpha_m, alpha_f=alpha_f, beta=(gamma + 0.5) ** 2 / 4, gamma=gamma)

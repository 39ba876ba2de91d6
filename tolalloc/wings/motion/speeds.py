"""Natural modes, where orders of the transmission error meet their frequencies, and how they grow with the speed."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float, Int, UInt8

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reducers.equivalent.condensation import bilateral_groups
from tolalloc.reducers.equivalent.interfaces import pin_contact
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import fitted_waves, forces
from tolalloc.reducers.equivalent.springs import Positions, vector_columns
from tolalloc.reducers.reducer.housing import ways_of
from tolalloc.wings.motion.motion import Damping, Inertia, Integrator, SpeedProfile, motion_of
from tolalloc.wings.motion.stepping import simulate


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Undamped modes of one unit at carrier angles, by ascending frequency at every angle."""

    carrier_angle: Float[np.ndarray, " angle"]  # θc [rad]
    # Natural frequencies; the first is zero but for rounding where no pin carries [Hz]
    frequency: Float[np.ndarray, "angle mode"]
    # Change of every coordinate of `tolalloc.reducers.equivalent.springs.Coordinates`, of any sign; every mode has unit
    # modal mass [1/√kg, rotations rad/√(kg·m²)]
    shape: Float[np.ndarray, "angle mode coordinate"]
    # Share of the carrier's rotation in the kinetic energy of each mode; over all modes they add up to 1 [-]
    carrier_share: Float[np.ndarray, "angle mode"]


def _check_linear(model: EquivalentModel, errors: Float[np.ndarray, " column"]) -> None:
    reducer = model.reducer
    for interface, clearance in vars(reducer.clearances).items():
        if clearance != 0.0:
            raise InputError.at("modes", f"clearance of {interface}", clearance, "0, for play has no single stiffness")
    if ways_of(reducer.stiffness):
        raise InputError.at("modes", "housing", "a ring that gives", "a rigid one, for its mass is not stated")
    for disc in range(reducer.disc_count):
        for column in vector_columns(f"disc{disc + 1}.tilt"):
            tilt = float(errors[model.columns.index(column)]) if column in model.columns else 0.0
            if tilt != 0.0:
                raise InputError.at("modes", column, tilt, "0, for a tilted tooth has no single stiffness")


def _pushing(
    model: EquivalentModel, errors: Float[np.ndarray, " column"], torque: float, angle: Float[np.ndarray, " angle"]
) -> Float[np.ndarray, "angle disc pin"]:
    """Return the stiffness of the pins that carry in the static equilibrium under their forces, 0 of others [N/m].

    By the logarithmic law δ = F/c·ln(cλ/F) it is c/(ln(cλ/F) − 1), c from where its tangent goes on, theory page
    equation (30).
    """
    equilibria = model.equilibria(errors[np.newaxis], torque, angle)
    worst = Status(int(equilibria.status.max()))
    if worst != Status.CONVERGED:
        raise SolveError(f"Modes: at {int((equilibria.status > 0).sum())} of {angle.size} angles {worst.sentence}.")
    force = forces(equilibria).pins[0]
    stiffness, length = (
        own.reshape(force.shape) for own in (equilibria.tables.contact_stiffness, equilibria.tables.contact_log_length)
    )
    carrying = force > 0.0
    if model.reducer.stiffness.pin_contact_law == "logarithmic":
        logarithm = np.log(2 * stiffness) + length - np.log(np.where(carrying, force, 1.0))
        stiffness = 2 * stiffness / np.maximum(logarithm - 1.0, 1.0)
    return np.asarray(np.where(carrying, stiffness, 0.0))


def _stiffness(
    at: Positions, pushing: Float[np.ndarray, "angle disc pin"]
) -> Float[np.ndarray, "angle coordinate coordinate"]:
    """Return Σk·aaᵀ over all springs that push [N/m, N/rad, N·m/rad]."""
    coordinates, contact = at.coordinates, pin_contact(at)
    stiffness = np.zeros((at.carrier_angle.size, coordinates.count, coordinates.count))
    for group in bilateral_groups(at):
        stiffness += np.swapaxes(group.displacement * group.stiffness[..., np.newaxis], 1, 2) @ group.displacement
    for disc in range(coordinates.disc_count):
        own, by_disc = slice(coordinates.disc(disc), coordinates.disc(disc) + 3), contact.by_disc[:, disc]
        stiffness[:, own, own] += (by_disc * pushing[:, disc, np.newaxis]) @ np.swapaxes(by_disc, 1, 2)
    return stiffness


def modes(
    model: EquivalentModel,
    errors: Float[np.ndarray, " column"],
    torque: float,
    inertia: Inertia,
    carrier_angle: Float[np.ndarray, " angle"],
) -> Modes:
    """Return the natural frequencies [Hz] and modes of one unit, linearised about its static equilibrium.

    K·φ = ω²·M·φ, theory page equation (64), with the pins that carry, each as stiff as it is under its force. The
    sun's rotation is prescribed, so with pins that carry nothing moves freely and all frequencies are positive; where
    no pin carries, discs and carrier turn without resistance and the first one is zero. The modes hold for vibrations
    under which the same pins keep touching, at speeds whose forces of inertia are small beside the load. Errors
    [m, angles rad], torque on the carrier [N·m], carrier angles [rad].

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> from tolalloc.wings.motion.motion import inertia_of
    >>> from tolalloc.reducers.unit_file import load_unit
    >>> reducer = load_reducer("rv40e_xi2015")
    >>> model = EquivalentModel(reducer)
    >>> errors = load_unit("exact").errors(model.columns, reducer.modification.deviations)[0]
    >>> round(float(modes(model, errors, -572.0, inertia_of(reducer), np.zeros(1)).frequency[0, 0]))  # [Hz]
    4461
    """
    _check_linear(model, errors)
    at = Positions(model.reducer, carrier_angle, model.orders)
    mass = inertia.diagonal(at.coordinates)
    unit = 1 / np.sqrt(mass)
    stiffness = _stiffness(at, _pushing(model, errors, torque, carrier_angle))
    square, vector = np.linalg.eigh(stiffness * np.outer(unit, unit))
    shape = vector * unit[:, np.newaxis]
    rotation = at.coordinates.carrier + 2
    return Modes(
        carrier_angle=carrier_angle,
        frequency=np.sqrt(np.maximum(square, 0.0)) / (2 * pi),  # rounding makes a zero one negative
        shape=np.swapaxes(shape, 1, 2),
        carrier_share=mass[rotation] * shape[:, rotation] ** 2,
    )


@dataclass(frozen=True, kw_only=True)
class CriticalSpeed:
    """Output speeds at which an order excites a mode."""

    order: int  # Waves per output turn [-]
    mode: int  # Number of the mode from the lowest frequency on, from 0 [-]
    # Output speeds between which the order meets the mode's frequency at some carrier angle [rad/s]
    slowest: float
    fastest: float
    carrier_share: float  # Share of the carrier's rotation in the mode's kinetic energy, mean over the angles [-]


def critical_speeds(
    modes: Modes, orders: tuple[int, ...], output_speeds: tuple[float, float]
) -> tuple[CriticalSpeed, ...]:
    """Return where orders meet the frequencies of modes, slowest first.

    Looked at are output speeds between a slowest and a fastest one [rad/s]. An order n excites with n·Ω/2π at the
    output speed Ω. A mode is told by its rank in frequency at every angle, not by its shape; where two frequencies
    cross over a turn, their bands share the crossing.

    >>> one = np.array([[100.0]])
    >>> found = Modes(carrier_angle=np.zeros(1), frequency=one, shape=one[np.newaxis], carrier_share=one)
    >>> round(critical_speeds(found, (40,), (0.0, 100.0))[0].slowest, 3)  # 2π·100 Hz/40 [rad/s]
    15.708
    """
    if min(orders, default=1) < 1:
        raise InputError.at("speeds", "orders", orders, "1 or more waves per output turn")
    bands = np.stack([modes.frequency.min(axis=0), modes.frequency.max(axis=0)], axis=1)
    share, found = modes.carrier_share.mean(axis=0).tolist(), []
    for order in orders:
        for mode, band in enumerate(bands):
            slowest, fastest = (float(speed) for speed in 2 * pi * band / order)
            if slowest <= output_speeds[1] and fastest >= output_speeds[0]:
                own = {"slowest": slowest, "fastest": fastest, "carrier_share": share[mode]}
                found.append(CriticalSpeed(order=order, mode=mode, **own))
    return tuple(sorted(found, key=lambda meeting: (meeting.slowest, meeting.fastest)))


@dataclass(frozen=True, kw_only=True)
class OrdersAgainstSpeed:
    """Orders of the transmission error at constant output speeds; NaN where a step found no equilibrium."""

    speed: Float[np.ndarray, " speed"]  # Output speeds [rad/s]
    order: Int[np.ndarray, " order"]  # Waves per output turn [-]
    # Half the peak-to-peak of each wave over the last turn, output side [rad]
    amplitude: Float[np.ndarray, "sample speed order"]
    peak_to_peak: Float[np.ndarray, "sample speed"]  # Peak-to-peak transmission error of the last turn [rad]
    # Largest difference between the second halves of the last turn and of the one before it [rad]
    unsettled: Float[np.ndarray, "sample speed"]
    # Worst value of `tolalloc.reducers.equivalent.model.Status` of all steps [-]
    status: UInt8[np.ndarray, "sample speed"]


def orders_against_speed(
    model: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    torque: float,
    inertia: Inertia,
    damping: Damping,
    integrator: Integrator,
    speeds: Float[np.ndarray, " speed"],
    orders: tuple[int, ...],
    steps_per_turn: int,
    turns: int = 2,
) -> OrdersAgainstSpeed:
    """Return the orders of the transmission error at constant speeds under a constant torque.

    Every run starts at carrier angle 0 in the equilibrium of `tolalloc.wings.motion.stepping.simulate`, and
    what the start sets swinging decays. Where the second half of a turn repeats itself in the next one, it has decayed
    before the last turn begins; this holds for gear ratios that bring the sun back to its place after an output turn.
    Newmark's method may feed modes too fast for the step while pins come and go; the generalised-α method with a
    spectral radius below 1 damps them.

    Output speeds [rad/s], waves per output turn, torque on the carrier [N·m], the others as
    in `tolalloc.wings.motion.stepping.simulate`. A wave at resonance needs some twenty time steps; of the turns
    of each run the last is looked at.

    >>> from tolalloc.wings.motion.motion import inertia_of, newmark
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("rv20e_liu2020"))
    >>> errors, rates = np.zeros((1, len(model.columns))), np.array([-1.0])
    >>> try:  # speeds are positive [rad/s]
    ...     orders_against_speed(model, errors, -1.0, inertia_of(model.reducer), Damping(), newmark(), rates, (1,), 100)
    ... except InputError as error:
    ...     print(error)
    speeds: speeds is [-1.0]; allowed is positive numbers.
    """
    if not np.all((speeds > 0.0) & np.isfinite(speeds)):
        raise InputError.at("speeds", "speeds", speeds.tolist(), "positive numbers")
    if turns < 2:
        raise InputError.at("speeds", "turns", turns, "2 or more")
    if not all(own >= 1 and model.reducer.resolves(own, steps_per_turn) for own in orders):
        allowed = f"1 to less than half of the {steps_per_turn} steps per turn, but none that the contact's fold onto"
        raise InputError.at("speeds", "orders", orders, allowed)
    shape, order = (errors.shape[0], speeds.size), np.array(orders, np.int64)
    peak_to_peak, unsettled, status = np.empty(shape), np.empty(shape), np.empty(shape, np.uint8)
    amplitude = np.empty((*shape, order.size))
    angle = 2 * pi * np.arange(steps_per_turn) / steps_per_turn
    for at, speed in enumerate(speeds):
        sun, duration = SpeedProfile.constant(float(speed) * model.reducer.ratio), turns * 2 * pi / float(speed)
        motion = motion_of(model.reducer, sun, SpeedProfile.constant(torque), duration, turns * steps_per_turn)
        found = simulate(model, errors, motion, inertia, damping, integrator)
        before, last = np.split(found.transmission_error[:, -2 * steps_per_turn :], 2, axis=1)
        difference = (last - before)[:, steps_per_turn // 2 :]
        amplitude[:, at] = np.abs(fitted_waves(angle, last, order))
        peak_to_peak[:, at], unsettled[:, at] = np.ptp(last, axis=1), np.abs(difference).max(axis=1)
        status[:, at] = found.status.max(axis=1)
    return OrdersAgainstSpeed(
        speed=speeds, order=order, amplitude=amplitude, peak_to_peak=peak_to_peak, unsettled=unsettled, status=status
    )

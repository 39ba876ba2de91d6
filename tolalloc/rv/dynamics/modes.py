"""Free vibrations about the static equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.rv.dynamics.properties import Inertia
from tolalloc.rv.equivalent.condensation import bilateral_groups
from tolalloc.rv.equivalent.kinematics import Positions
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import forces
from tolalloc.rv.equivalent.pins import pin_contact
from tolalloc.rv.equivalent.springs import vector_columns
from tolalloc.rv.equivalent.status import Status


@dataclass(frozen=True, kw_only=True)
class Modes:
    """Undamped modes of one unit at carrier angles, by ascending frequency at every angle."""

    carrier_angle: Float[np.ndarray, " angle"]  # θc [rad]
    # Natural frequencies; the first is zero but for rounding where no pin carries [Hz]
    frequency: Float[np.ndarray, "angle mode"]
    # Change of every coordinate of `tolalloc.rv.equivalent.kinematics.Coordinates`, of any sign, such that every mode
    # has unit modal mass [1/√kg, rotations rad/√(kg·m²)]
    shape: Float[np.ndarray, "angle mode coordinate"]
    # Share of the carrier's rotation in the kinetic energy of each mode; over all modes they add up to 1 [-]
    carrier_share: Float[np.ndarray, "angle mode"]


def _check_linear(model: EquivalentModel, errors: Float[np.ndarray, " column"]) -> None:
    reducer = model.reducer
    for interface, clearance in vars(reducer.clearances).items():
        if clearance != 0.0:
            raise InputError.at("modes", f"clearance of {interface}", clearance, "0, for play has no single stiffness")
    if reducer.stiffness.pin_contact_law == "logarithmic":
        raise InputError.at("modes", "pin_contact_law", "logarithmic", "a law of constant stiffness")
    for disc in range(reducer.disc_count):
        for column in vector_columns(f"disc{disc + 1}.tilt"):
            tilt = float(errors[model.columns.index(column)])
            if tilt != 0.0:
                raise InputError.at("modes", column, tilt, "0, for a tilted tooth has no single stiffness")


def _carrying(
    model: EquivalentModel, errors: Float[np.ndarray, " column"], torque: float, angle: Float[np.ndarray, " angle"]
) -> Bool[np.ndarray, "angle disc pin"]:
    """Return which pins carry in the static equilibrium."""
    equilibria = model.equilibria(errors[np.newaxis], torque, angle)
    worst = Status(int(equilibria.status.max()))
    if worst != Status.CONVERGED:
        raise SolveError(f"Modes: at {int((equilibria.status > 0).sum())} of {angle.size} angles {worst.sentence}.")
    return np.asarray(forces(equilibria).pins[0] > 0.0)


def _stiffness(
    at: Positions, carrying: Bool[np.ndarray, "angle disc pin"]
) -> Float[np.ndarray, "angle coordinate coordinate"]:
    """Return Σk·aaᵀ over all springs that push [N/m, N/rad, N·m/rad]."""
    coordinates, contact = at.coordinates, pin_contact(at)
    stiffness = np.zeros((at.carrier_angle.size, coordinates.count, coordinates.count))
    for group in bilateral_groups(at):
        stiffness += np.swapaxes(group.displacement * group.stiffness[..., np.newaxis], 1, 2) @ group.displacement
    pushing = np.where(carrying, contact.stiffness, 0.0)
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
    """Return the natural frequencies and modes of one unit, linearised about its static equilibrium.

    K·φ = ω²·M·φ with the pins that carry. The sun's rotation is prescribed, so with pins that carry nothing moves
    freely and all frequencies are positive; where no pin carries, discs and carrier turn without resistance and the
    first one is zero. The modes hold for vibrations under which the same pins keep touching, at speeds whose forces of
    inertia are small beside the load.

    Raises
    ------
    InputError
        Play, tilted discs or the logarithmic contact law: their stiffness changes with the least vibration.
    SolveError
        An angle without a static equilibrium.
    """
    _check_linear(model, errors)
    at = Positions(model.reducer, carrier_angle, model.orders)
    mass = inertia.diagonal(at.coordinates)
    unit = 1 / np.sqrt(mass)
    stiffness = _stiffness(at, _carrying(model, errors, torque, carrier_angle))
    square, vector = np.linalg.eigh(stiffness * np.outer(unit, unit))
    shape = vector * unit[:, np.newaxis]
    rotation = at.coordinates.carrier + 2
    return Modes(
        carrier_angle=carrier_angle,
        frequency=np.sqrt(np.maximum(square, 0.0)) / (2 * pi),  # rounding makes a zero one negative
        shape=np.swapaxes(shape, 1, 2),
        carrier_share=mass[rotation] * shape[:, rotation] ** 2,
    )

"""Where one disc's pins carry, and how heavily: line load and pressure over pins and the width of the teeth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.rv.cycloid.solvers.contact_law import LAWS, LINEAR
from tolalloc.rv.equivalent.line_load import line_contact, unit_pressure
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import Solved


@dataclass(frozen=True, kw_only=True)
class ContactPattern:
    """Load of one disc on its pins at one carrier angle.

    Parameters
    ----------
    disc
        Number of the disc, 1 for the first [-].
    carrier_angle
        θc [rad].
    position
        Places along the width, 0 in the middle of the tooth [m].
    force
        Normal force of every pin [N].
    deformation
        Largest compression of every pin along its width, 0 without contact [m].
    line_load, pressure
        Along the width of every pin [N/m]; Hertz's peak pressure there [Pa].
    """

    disc: int
    carrier_angle: float
    position: Float[np.ndarray, " position"]
    force: Float[np.ndarray, " pin"]
    deformation: Float[np.ndarray, " pin"]
    line_load: Float[np.ndarray, "pin position"]
    pressure: Float[np.ndarray, "pin position"]


def contact_pattern(
    model: EquivalentModel,
    errors: Float[np.ndarray, " column"],
    torque: float,
    disc: int = 1,
    carrier_angle: float | None = None,
    positions: int = 41,
) -> ContactPattern:
    """Return the load of one disc on its pins.

    Parameters
    ----------
    model
        The reducer.
    errors
        Deviations of one unit in the order of the model's columns [m, angles rad].
    torque
        Torque on the carrier; negative resists the rotation [N·m].
    disc
        Number of the disc, 1 for the first [-].
    carrier_angle
        Carrier angle; unless given, the coarse angle of the model's search at which the disc's line load is largest
        [rad].
    positions
        Places along the width [-].

    Raises
    ------
    InputError
        A disc that the reducer does not have, or a contact law that knows no load along the width.
    SolveError
        No equilibrium at one of the angles.
    """
    reducer, law = model.reducer, model.reducer.stiffness.pin_contact_law
    if not 1 <= disc <= reducer.disc_count:
        raise InputError.at(f"contact pattern of {reducer.name}", "disc", disc, f"1 to {reducer.disc_count}")
    if LAWS[law] != LINEAR:
        linear = " or ".join(name for name in LAWS if LAWS[name] == LINEAR)
        raise InputError.at(f"contact pattern of {reducer.name}", "law of the pin contact", law, linear)
    angles = None if carrier_angle is None else np.array([carrier_angle])
    solved = Solved.of(model.equilibria(errors[np.newaxis], torque, angles))
    failed = np.count_nonzero(solved.equilibria.status)
    if failed:
        raise SolveError(f"Contact pattern of {reducer.name}: no equilibrium at {failed} carrier angles.")
    contact = line_contact(solved.equilibria, solved.forces)
    at = int(np.argmax(contact.peak[0, :, disc - 1].max(axis=1)))
    own = contact.of((0, at, disc - 1))
    position = np.linspace(-0.5, 0.5, positions) * own.face_width
    line_load = own.line_load(position)
    return ContactPattern(
        disc=disc,
        carrier_angle=float(solved.equilibria.carrier_angle[at]),
        position=position,
        force=own.force,
        deformation=own.deformation,
        line_load=line_load,
        pressure=unit_pressure(solved.equilibria)[at, disc - 1, :, np.newaxis] * np.sqrt(line_load),
    )

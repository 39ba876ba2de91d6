"""What the model's equilibria say to a picture: forces and gaps of all pins, and how far every part is displaced."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import SolveError
from tolalloc.rv.equivalent.answers import Equilibria, Status
from tolalloc.rv.equivalent.condensation import bilateral_groups, retained_coordinates, rotation_scale
from tolalloc.rv.equivalent.kinematics import Positions
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import Forces, forces


@dataclass(frozen=True, kw_only=True)
class States:
    """Equilibria of one unit at the angles of a picture, for one direction of rotation."""

    torque: float  # Torque on the carrier, which resists this direction [N·m]
    force: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    gap: Float[np.ndarray, "angle disc pin"]  # Between them, negative where they are compressed [m]
    displacement: Float[np.ndarray, "angle coordinate"]  # All coordinates of the model [m, rad]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond its nominal angle [rad]


def solved_states(
    model: EquivalentModel,
    errors: Float[np.ndarray, " column"],
    torque: float,
    carrier_angle: Float[np.ndarray, " angle"],
) -> States:
    """Return the equilibria of one unit [m, angles rad] under a torque on the carrier [N·m] at carrier angles [rad].

    Raises
    ------
    SolveError
        An angle without equilibrium.
    """
    equilibria = model.equilibria(errors[np.newaxis], torque, carrier_angle)
    worst = Status(int(equilibria.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"picture of {model.reducer.name}: at some angle {worst.sentence}.")
    carried = forces(equilibria)
    return States(
        torque=torque,
        force=carried.pins[0],
        gap=-compressions(equilibria),
        displacement=displacements(model, equilibria, carried),
        transmission_error=equilibria.transmission_error[0],
    )


def compressions(equilibria: Equilibria) -> Float[np.ndarray, "angle disc pin"]:
    """Return the compression at mid-width of every pin and disc of one unit, negative where a gap is left [m].

    Summed in the order of the solver, so that no digit differs from what it balances.
    """
    tables, layout = equilibria.tables, equilibria.columns.layout
    values = _values(equilibria)
    radial, tangential, radius = values[layout.pin : layout.wave].reshape(3, layout.pins)
    found = np.empty((equilibria.carrier_angle.size, *tables.contact_by_disc.shape[1::2]))
    for disc in range(found.shape[1]):
        by_error, by_disc = tables.contact_by_error[:, disc], tables.contact_by_disc[:, disc]
        undisturbed = radius + (by_error[:, 0] * radial + by_error[:, 1] * tangential)
        first = layout.wave + disc * layout.waves
        for wave in np.flatnonzero(values[first : first + layout.waves]):
            undisturbed = undisturbed + by_error[:, 2 + wave] * values[first + wave]
        first = layout.tooth + disc * 2 * layout.teeth
        for kind, own in enumerate(values[first : first + 2 * layout.teeth].reshape(2, layout.teeth)):
            if own.any():
                undisturbed = undisturbed + by_error[:, 2 + layout.waves + kind] * own[tables.tooth[:, disc]]
        x, y, turn = (equilibria.retained[0, :, 3 * disc + axis, np.newaxis] for axis in range(3))
        found[:, disc] = by_disc[:, 0] * x + by_disc[:, 1] * y + by_disc[:, 2] * turn + undisturbed
    return found


def _values(equilibria: Equilibria) -> Float[np.ndarray, " value"]:
    """Return the values that the tables take of one unit, entry by entry as the solver adds them [m, rad]."""
    mapped = equilibria.columns.map
    values = mapped.nominal.copy()
    np.add.at(values, mapped.value, mapped.factor * equilibria.errors[0, mapped.column])
    return values


def displacements(
    model: EquivalentModel, equilibria: Equilibria, carried: Forces
) -> Float[np.ndarray, "angle coordinate"]:
    """Return all coordinates of one unit, of which the equilibria hold those alone that pins and play touch [m, rad].

    The others follow from the ways of the springs, force over stiffness, theory page equation (5).
    """
    reducer, at = model.reducer, Positions(model.reducer, equilibria.carrier_angle, model.orders)
    groups = bilateral_groups(at)
    retained = retained_coordinates(reducer, at.coordinates, groups)
    found = np.zeros((equilibria.carrier_angle.size, at.coordinates.count))
    found[:, retained] = equilibria.retained[0] * rotation_scale(reducer, at.coordinates)[retained]
    rest = np.setdiff1d(np.arange(at.coordinates.count), retained)
    values = _values(equilibria)
    way = carried.rows[0] / equilibria.tables.row_stiffness
    rows, first, row = [], 0, 0
    for group in groups:
        last = first + len(group.columns)
        if group.contact == "bilateral":
            count = group.stiffness.shape[1]
            way[:, row : row + count] -= group.error @ values[first:last]
            rows.append(group.displacement)
            row += count
        first = last
    if rest.size:
        by_coordinate = np.concatenate(rows, axis=1)
        way -= np.einsum("arc,ac->ar", by_coordinate, found)
        found[:, rest] = (np.linalg.pinv(by_coordinate[:, :, rest]) @ way[..., np.newaxis])[..., 0]
    return found

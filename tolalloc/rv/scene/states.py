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
from tolalloc.rv.equivalent.solvers.records import design_of


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

    They are those that the solver balances, made by its own functions, so that no digit differs.
    """
    from tolalloc.rv.equivalent.solvers.energy import compress
    from tolalloc.rv.equivalent.solvers.interpolation import make_memory
    from tolalloc.rv.equivalent.solvers.problem import problem_at_node, values_of

    tables, columns = equilibria.tables, equilibria.columns
    design, layout = design_of(equilibria.reducer), columns.layout
    values = np.empty((1, layout.end))
    values_of(np.ascontiguousarray(equilibria.errors), equilibria.torque, layout, columns.map, values)
    memory, work = make_memory(design.law, tables)[:2]
    found = np.empty((equilibria.carrier_angle.size, *tables.contact_by_disc.shape[1::2]))
    for at in range(equilibria.carrier_angle.size):
        _, problem = problem_at_node(at, tables, layout, design.face_width, values[0], memory)
        compress(problem, equilibria.retained[0, at], work.compression, work.play)
        found[at] = work.compression.reshape(found.shape[1:])
    return found


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
    values = np.asarray(equilibria.columns.matrix @ equilibria.errors[0])
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

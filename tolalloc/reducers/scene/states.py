"""What the model's equilibria say to a picture: forces and gaps of all pins, and how far every part is displaced."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np
from jaxtyping import Float, Int

from tolalloc.exceptions import SolveError
from tolalloc.reducers.equivalent.answers import Equilibria, Status
from tolalloc.reducers.equivalent.condensation import (
    CondensedAngles,
    bilateral_groups,
    retained_coordinates,
    rotation_scale,
)
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Forces, forces
from tolalloc.reducers.equivalent.springs import SpringGroup


@dataclass(frozen=True, kw_only=True)
class States:
    """Equilibria of one unit at the angles of a picture, for one direction of rotation."""

    torque: float  # Torque on the carrier, which resists this direction [N·m]
    force: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    gap: Float[np.ndarray, "angle disc pin"]  # Between them, negative where they are compressed [m]
    displacement: Float[np.ndarray, "angle coordinate"]  # All coordinates of the model [m, rad]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond its nominal angle [rad]


@dataclass(frozen=True, kw_only=True)
class Turn:
    """What all units of a reducer share at the angles of a picture."""

    model: EquivalentModel  # The reducer, its parts as stiff as they are under the torque
    carrier_angle: Float[np.ndarray, " angle"]  # θc, equally spaced over one output turn [rad]
    tables: CondensedAngles  # Its condensed tables
    # Coordinates that pins and play touch, the others, and the lever that makes each a length [-, -, m]
    retained: Int[np.ndarray, " retained"]
    rest: Int[np.ndarray, " rest"]
    scale: Float[np.ndarray, " coordinate"]
    groups: tuple[SpringGroup, ...]  # All spring rows but those of pins
    way_by_coordinate: Float[np.ndarray, "angle row coordinate"]  # Of the bilateral rows [m/m or m/rad]
    rest_by_way: Float[np.ndarray, "angle rest row"]  # The other coordinates that belong to the rows' ways [m/m, rad/m]


@lru_cache(maxsize=4)
def turn_of(model: EquivalentModel, count: int) -> Turn:
    """Return what all units of a model share at equally spaced angles [-]; remembered for the next unit."""
    angle = 2 * pi * np.arange(count) / count
    at = Positions(model.reducer, angle, model.orders)
    groups = bilateral_groups(at)
    retained = retained_coordinates(model.reducer, at.coordinates, groups)
    rest = np.setdiff1d(np.arange(at.coordinates.count), retained)
    rows = np.concatenate([group.displacement for group in groups if group.contact == "bilateral"], axis=1)
    return Turn(
        model=model,
        carrier_angle=angle,
        tables=model.tables_at(angle),
        retained=retained,
        rest=rest,
        scale=rotation_scale(model.reducer, at.coordinates),
        groups=tuple(groups),
        way_by_coordinate=rows,
        rest_by_way=np.linalg.pinv(rows[:, :, rest]),
    )


def solved_states(turn: Turn, errors: Float[np.ndarray, " column"], torque: float) -> States:
    """Return the equilibria of one unit [m, angles rad] under a torque on the carrier [N·m].

    Raises
    ------
    SolveError
        An angle without equilibrium.
    """
    equilibria = turn.model.equilibria_of(turn.tables, errors[np.newaxis], torque, turn.carrier_angle)
    worst = Status(int(equilibria.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"picture of {turn.model.reducer.name}: at some angle {worst.sentence}.")
    carried = forces(equilibria)
    return States(
        torque=torque,
        force=carried.pins[0],
        gap=-compressions(equilibria),
        displacement=displacements(turn, equilibria, carried),
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


def displacements(turn: Turn, equilibria: Equilibria, carried: Forces) -> Float[np.ndarray, "angle coordinate"]:
    """Return all coordinates of one unit, of which the equilibria hold those alone that pins and play touch [m, rad].

    The others follow from the ways of the springs, force over stiffness, theory page equation (5).
    """
    found = np.zeros((equilibria.carrier_angle.size, turn.scale.size))
    found[:, turn.retained] = equilibria.retained[0] * turn.scale[turn.retained]
    values = _values(equilibria)
    way = carried.rows[0] / equilibria.tables.row_stiffness
    first, row = 0, 0
    for group in turn.groups:
        last = first + len(group.columns)
        if group.contact == "bilateral":
            count = group.stiffness.shape[1]
            way[:, row : row + count] -= group.error @ values[first:last]
            row += count
        first = last
    way -= np.einsum("arc,ac->ar", turn.way_by_coordinate, found)
    found[:, turn.rest] = np.einsum("acr,ar->ac", turn.rest_by_way, way)
    return found

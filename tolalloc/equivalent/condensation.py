"""Spring rows condensed, angle by angle, onto the coordinates of the discs.

Geometry and bilateral stiffness do not depend on the errors. So everything but the pin contact is
eliminated once per angle and reducer; what is left for each sample is a small convex problem.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int

from tolalloc.equivalent.bearings import carrier_support, crank_carrier, crank_disc
from tolalloc.equivalent.gears import gear_mesh, sun_support
from tolalloc.equivalent.kinematics import Coordinates, Positions
from tolalloc.equivalent.pins import pin_contact
from tolalloc.equivalent.springs import SpringGroup
from tolalloc.reducer.design import Reducer

GROUPS: tuple[Callable[[Positions], SpringGroup], ...] = (
    sun_support,
    gear_mesh,
    crank_disc,
    crank_carrier,
    carrier_support,
    pin_contact,
)
_ANGLES_AT_ONCE = 512


@dataclass(frozen=True, kw_only=True)
class CondensedAngles:
    """What the contact solver needs at each angle; disc coordinates are (x, y, r_d·θ), all lengths.

    Parameters
    ----------
    stiffness
        Condensed stiffness of the discs, one zero eigenvalue [N/m].
    load
        Force on the discs per error column and per torque, the last column [N/m, last N/(N·m)].
    carrier_by_disc
        Carrier rotation per disc displacement, contact forces at work [rad/m].
    carrier_by_load
        Carrier rotation per error column and per torque at fixed discs [rad/m, last rad/(N·m)].
    contact_by_disc
        Pin compression per disc displacement [m/m].
    contact_by_error
        Pin compression per error column of the disc's own list [m/m].
    contact_stiffness
        Stiffness of each pin contact [N/m].
    """

    stiffness: Float[np.ndarray, "angle coordinate coordinate"]
    load: Float[np.ndarray, "angle load coordinate"]
    carrier_by_disc: Float[np.ndarray, "angle coordinate"]
    carrier_by_load: Float[np.ndarray, "angle load"]
    contact_by_disc: Float[np.ndarray, "angle disc 3 pin"]
    contact_by_error: Float[np.ndarray, "angle disc local pin"]
    contact_stiffness: Float[np.ndarray, "angle contact"]


@dataclass(frozen=True, kw_only=True)
class ColumnLists:
    """Names of all error columns, and where the condensed arrays find theirs among them.

    Parameters
    ----------
    names
        All columns, in the order of X.
    bilateral
        Position in ``names`` of each column of ``CondensedAngles.load`` but the torque [-].
    contact
        Position in ``names`` of each column of ``CondensedAngles.contact_by_error``, per disc [-].
    """

    names: tuple[str, ...]
    bilateral: Int[np.ndarray, " bilateral"]
    contact: Int[np.ndarray, "disc local"]


def spring_groups(reducer: Reducer, carrier_angle: Float[np.ndarray, " angle"]) -> list[SpringGroup]:
    """Return all spring groups of a reducer at the carrier angles [rad]."""
    at = Positions(reducer, carrier_angle)
    return [group(at) for group in GROUPS]


def column_lists(reducer: Reducer) -> ColumnLists:
    """Return the columns that the spring groups of a reducer declare.

    Notes
    -----
    A disc's list leaves out the columns that move none of its contacts, those of the other discs.
    """
    groups = spring_groups(reducer, np.array([0.1, 0.7]))
    names = tuple(name for group in groups for name in group.columns)
    contact = groups[-1]
    moved = np.any(contact.error != 0.0, axis=0).reshape(reducer.disc_count, -1, len(contact.columns)).any(axis=1)
    first = len(names) - len(contact.columns)
    return ColumnLists(
        names=names,
        bilateral=np.arange(first),
        contact=np.stack([first + np.flatnonzero(row) for row in moved]),
    )


def _rotation_scale(reducer: Reducer, coordinates: Coordinates) -> Float[np.ndarray, " coordinate"]:
    """Return the lever by which each coordinate is divided so that all are lengths [m or 1]."""
    scale = np.ones(coordinates.count)
    for crank in range(reducer.crank_count):
        scale[coordinates.planet(crank) + 2] = 1 / reducer.planet_base_radius
    for disc in range(reducer.disc_count):
        scale[coordinates.disc(disc) + 2] = 1 / reducer.cycloid_stage.disc_pitch_radius
    scale[coordinates.carrier + 2] = 1 / reducer.crank_circle_radius
    return scale


def _condense_some(reducer: Reducer, columns: ColumnLists, angle: Float[np.ndarray, " angle"]) -> CondensedAngles:
    """Return the condensed model at a few angles; memory grows with their number."""
    coordinates = Coordinates(reducer.crank_count, reducer.disc_count)
    scale = _rotation_scale(reducer, coordinates)
    groups = spring_groups(reducer, angle)
    bilateral, contact = groups[:-1], groups[-1]
    size, loads = coordinates.count, columns.bilateral.size + 1
    stiffness, load = np.zeros((angle.size, size, size)), np.zeros((angle.size, size, loads))
    start = 0
    for group in bilateral:
        rows = group.displacement * scale
        weighted = np.swapaxes(rows * group.stiffness[..., np.newaxis], 1, 2)
        stiffness += weighted @ rows
        load[:, :, start : start + len(group.columns)] = -(weighted @ group.error)
        start += len(group.columns)
    rotation = coordinates.carrier + 2
    load[:, rotation, -1] = scale[rotation]
    disc = np.arange(coordinates.disc(0), coordinates.disc(reducer.disc_count))
    rest = np.setdiff1d(np.arange(size), disc)
    solved = np.linalg.solve(
        stiffness[:, rest[:, np.newaxis], rest],
        np.concatenate([stiffness[:, rest[:, np.newaxis], disc], load[:, rest]], axis=2),
    )
    to_disc, to_load = solved[..., : disc.size], solved[..., disc.size :]
    coupling = stiffness[:, disc[:, np.newaxis], rest]
    condensed = stiffness[:, disc[:, np.newaxis], disc] - coupling @ to_disc
    last = int(np.flatnonzero(rest == rotation)[0])
    pins, discs = reducer.cycloid_stage.pin_count, reducer.disc_count
    by_disc = (contact.displacement * scale).reshape(angle.size, discs, pins, size)
    by_error = contact.error.reshape(angle.size, discs, pins, len(contact.columns))
    own = columns.contact - columns.bilateral.size
    return CondensedAngles(
        stiffness=0.5 * (condensed + np.swapaxes(condensed, 1, 2)),
        load=np.swapaxes(load[:, disc] - coupling @ to_load, 1, 2),
        carrier_by_disc=-to_disc[:, last] * scale[rotation],
        carrier_by_load=to_load[:, last] * scale[rotation],
        contact_by_disc=np.stack(
            [by_disc[:, d, :, coordinates.disc(d) : coordinates.disc(d) + 3].swapaxes(1, 2) for d in range(discs)],
            axis=1,
        ),
        contact_by_error=np.stack([by_error[:, d][:, :, own[d]].swapaxes(1, 2) for d in range(discs)], axis=1),
        contact_stiffness=contact.stiffness,
    )


def condense(reducer: Reducer, columns: ColumnLists, angle: Float[np.ndarray, " angle"]) -> CondensedAngles:
    """Return the condensed model of a reducer at the carrier angles.

    Parameters
    ----------
    reducer
        Nominal design and stiffness.
    columns
        The reducer's `column_lists`.
    angle
        Carrier angles [rad].

    Notes
    -----
    Theory page, equations (19)–(21).
    """
    parts = [
        _condense_some(reducer, columns, angle[start : start + _ANGLES_AT_ONCE])
        for start in range(0, angle.size, _ANGLES_AT_ONCE)
    ]
    return CondensedAngles(
        **{item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(CondensedAngles)}
    )

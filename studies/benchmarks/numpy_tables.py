"""The tables of the NumPy kernel: spring rows condensed onto the discs, once per angle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.springs import Coordinates, SpringGroup
from tolalloc.reducers.reducer.design import Reducer

_RIDGE = 1e-13  # of the largest stiffness; makes of a singular tangent a long step downhill


class Tables(NamedTuple):
    """What the solve needs at each angle; the tables of one angle have no axis for it.

    Parameters
    ----------
    by_error
        Pin compressions, forces on the discs and carrier rotation at undisplaced discs, per error and torque.
    stiffness, ridged
        Condensed stiffness of the discs; the same with the ridge [N/m].
    by_disc
        Pin compression per coordinate [m/m].
    force_by_pin, tangent_by_pin
        Force on the discs per pin compression; what a pin in contact adds to the stiffness, all entries flat [N/m].
    pin_stiffness
        Stiffness of the pin contacts [N/m].
    rotation_by_disc
        Carrier rotation per coordinate [rad/m].
    """

    by_error: Float[np.ndarray, "*angle row column"]
    stiffness: Float[np.ndarray, "*angle coordinate coordinate"]
    ridged: Float[np.ndarray, "*angle coordinate coordinate"]
    by_disc: Float[np.ndarray, "*angle contact coordinate"]
    force_by_pin: Float[np.ndarray, "*angle coordinate contact"]
    tangent_by_pin: Float[np.ndarray, "*angle contact entry"]
    pin_stiffness: Float[np.ndarray, "*angle contact"]
    rotation_by_disc: Float[np.ndarray, "*angle coordinate"]


def condensed_tables(reducer: Reducer, groups: list[SpringGroup]) -> Tables:
    """Return the tables with all coordinates but the discs' eliminated, theory page equations (19)–(21)."""
    coordinates, (*bilateral, pins) = Coordinates(reducer.crank_count, reducer.disc_count), groups
    angles, contacts, size = pins.displacement.shape
    scale = np.ones(size)  # rotations become lengths
    scale[coordinates.planet(0) + 2 : coordinates.disc(0) : 3] = 1 / reducer.planet_base_radius
    scale[coordinates.disc(0) + 2 : coordinates.carrier : 3] = 1 / reducer.cycloid_stage.disc_pitch_radius
    scale[coordinates.carrier + 2] = 1 / reducer.crank_circle_radius
    stiffness, loads = np.zeros((angles, size, size)), []
    for group in bilateral:
        rows = group.displacement * scale
        weighted = np.swapaxes(rows * group.stiffness[:, :, np.newaxis], 1, 2)
        stiffness += weighted @ rows
        loads.append(-weighted @ group.error)
    torque = np.zeros((angles, size, 1))
    torque[:, -1] = scale[-1]
    load = np.concatenate([*loads, np.zeros((angles, size, len(pins.columns))), torque], axis=2)
    disc = np.arange(coordinates.disc(0), coordinates.carrier)
    rest = np.setdiff1d(np.arange(size), disc)
    across = stiffness[:, disc[:, np.newaxis], rest]
    right = np.concatenate([-np.swapaxes(across, 1, 2), load[:, rest]], axis=2)
    solved = np.linalg.solve(stiffness[:, rest[:, np.newaxis], rest], right)
    by_disc, by_load = solved[:, :, : disc.size], solved[:, :, disc.size :]
    condensed = stiffness[:, disc[:, np.newaxis], disc] + across @ by_disc
    condensed = (condensed + np.swapaxes(condensed, 1, 2)) / 2
    compression = np.zeros((angles, contacts, load.shape[2]))
    compression[:, :, -1 - len(pins.columns) : -1] = pins.error
    rows = pins.displacement[:, :, disc] * scale[disc]
    weighted = rows * pins.stiffness[:, :, np.newaxis]
    return Tables(
        by_error=np.concatenate([compression, load[:, disc] - across @ by_load, by_load[:, -1:] * scale[-1]], axis=1),
        stiffness=condensed,
        ridged=condensed + _RIDGE * np.abs(condensed).max() * np.eye(disc.size),
        by_disc=rows,
        force_by_pin=np.ascontiguousarray(np.swapaxes(weighted, 1, 2)),
        tangent_by_pin=(weighted[..., np.newaxis] * rows[:, :, np.newaxis]).reshape(angles, contacts, -1),
        pin_stiffness=pins.stiffness,
        rotation_by_disc=by_disc[:, -1] * scale[-1],
    )

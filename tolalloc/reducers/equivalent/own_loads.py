"""Torque against twist with every rolling bearing under the load that it carries itself, theory page equation (75).

The springs of the model are secants at the mean forces of statics. Here a bearing's spring is lengthened or shortened
as an error of its place would do, until its way is that of the bearing under its own force.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.condensation import CondensedAngles, bilateral_groups
from tolalloc.reducers.equivalent.hysteresis import READ, HysteresisLoop, loop_torques
from tolalloc.reducers.equivalent.kinematics import Positions
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Forces, forces
from tolalloc.reducers.reducer.parts import Part
from tolalloc.reducers.reducer.rolling_bearing import RollingBearing

_PLACES = {
    "crank_disc_bearing": ".eccentricity",
    "crank_carrier_bearing": ".position",
    "carrier_bearing": "carrier.assembly",
}
"""Interface → what the names of the columns contain that displace its bearings one by one."""

_STEPS, _TOLERANCE = 60, 1e-8
"""Equilibria after which no twist is given, and change of the twist over the largest one at which it is [-]."""


class _Bearings(NamedTuple):
    """The bearings of one interface."""

    interface: str
    parts: tuple[Part, ...]  # What yields in series
    stiffness: float  # Of the springs that stand for them [N/m]
    columns: Int[np.ndarray, " column"]  # Columns x, y of every bearing's place
    place_by_way: Float[np.ndarray, "angle bearing 2 2"]  # Displacement of the place that adds a way [-]

    def displacement(self, carried: Forces, at: int) -> Float[np.ndarray, "sample column"]:
        """Return how far to displace the places so that springs yield as the bearings do under their forces [m].

        The forces are those at one carrier angle, given by its number.
        """
        force = carried.vectors(self.interface)[:, 0]
        size = np.maximum(np.hypot(force[..., 0], force[..., 1]), np.finfo(float).tiny)
        ways = np.sum([part.ways(size) for part in self.parts], axis=0)
        longer = force * (1.0 / self.stiffness - ways / size)[..., np.newaxis]
        return np.asarray(np.einsum("bxy,sby->sbx", self.place_by_way[at], longer).reshape(force.shape[0], -1))


def _bearings(model: EquivalentModel, carrier_angle: Float[np.ndarray, " angle"]) -> Iterator[_Bearings]:
    """Yield the interfaces with rolling bearings."""
    for group in bilateral_groups(Positions(model.reducer, carrier_angle, model.orders)):
        parts = tuple(part for part in model.reducer.parts if part.interface == group.stiffness_name)
        if not any(isinstance(part.yields, RollingBearing) for part in parts):
            continue
        at = [number for number, name in enumerate(group.columns) if _PLACES[group.stiffness_name] in name]
        # Every bearing has two rows, and two columns of its own.
        by_column = group.error[:, :, at].reshape(carrier_angle.size, len(at) // 2, 2, len(at) // 2, 2)
        yield _Bearings(
            interface=group.stiffness_name,
            parts=parts,
            stiffness=float(group.stiffness[0, 0]),
            columns=np.array([model.columns.index(group.columns[number]) for number in at]),
            place_by_way=np.linalg.inv(np.einsum("abxby->abxy", by_column)),
        )


def own_load_loop(
    model: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    carrier_angle: Float[np.ndarray, " angle"],
    shares: Sequence[float] = READ,
) -> HysteresisLoop:
    """Return torque against twist as `tolalloc.reducers.equivalent.hysteresis.hysteresis_loop` does.

    A twist is not a number where it is not found.
    """
    torque = loop_torques(model.reducer, shares)
    twist = [_twist(model.at_torque(level), errors, level, carrier_angle) for level in torque.tolist()]
    return HysteresisLoop(torque=torque, twist=np.stack(twist, axis=1))


def _twist(
    springs: EquivalentModel,
    errors: Float[np.ndarray, "sample column"],
    torque: float,
    carrier_angle: Float[np.ndarray, " angle"],
) -> Float[np.ndarray, "sample angle"]:
    """Return the transmission error [rad]; angle by angle, because at each of them the places are others."""
    bearings, tables = tuple(_bearings(springs, carrier_angle)), springs.tables_at(carrier_angle)
    found = np.full((errors.shape[0], carrier_angle.size), np.nan)
    for at in range(carrier_angle.size):
        here = CondensedAngles(*(field[at : at + 1] for field in tables))
        displaced, twist = errors.copy(), np.full(errors.shape[0], np.inf)
        for _ in range(_STEPS):
            solved = springs.equilibria_of(here, displaced, torque, carrier_angle[at : at + 1])
            before, twist = twist, solved.transmission_error[:, 0]
            moving = np.abs(twist - before) > _TOLERANCE * np.abs(twist)
            if not moving.any():
                break
            carried = forces(solved)
            for each in bearings:
                displaced[:, each.columns] = errors[:, each.columns] + each.displacement(carried, at)
        found[~moving, at] = twist[~moving]
    return found

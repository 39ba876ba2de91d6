"""Torque against twist without friction: lost motion, backlash, torsional stiffness, error in both directions.

The loop is one curve, measured with the torque in either direction; its width is the play of pins, bearings and meshes
and the elastic twist. Springs of the model are secants at the mean forces of statics; for a loop with every rolling
bearing under the load that it carries itself, theory page equation (75), a bearing's spring is lengthened or shortened
as an error of its place would do, until its way is that of the bearing under its own force.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducers.equivalent.condensation import CondensedAngles, bilateral_groups
from tolalloc.reducers.equivalent.model import Curves, EquivalentModel, Errors
from tolalloc.reducers.equivalent.outputs import Forces, forces
from tolalloc.reducers.equivalent.springs import AtAngles, Positions, vector_columns
from tolalloc.reducers.reducer.bearings import Part, RollingBearing
from tolalloc.reducers.reducer.design import Reducer

LOST_MOTION, BACKLASH = 0.03, 1e-4
"""Torque over rated torque at which the loop's width is read; 3 % by custom, 0.01 % for zero is an assumption."""

LOOP_ASSUMPTION = (
    "lost motion and backlash without friction, so the loop is one curve; backlash: width at ±0.01 % of rated torque"
)

LOOP_ANGLES = 2.0 * np.pi * np.arange(180) / 180
"""Angles of one output turn at which a loop is read unless asked otherwise [rad]."""

TURN_ANGLES = 2.0 * np.pi * np.arange(23) / 23
"""Angles of one output turn at which outputs of many units are read [rad].

23 is prime, so no usual number of pins or teeth divides it and every angle is another phase of both: at 20 angles all
of 40 pins would be met at one phase of the crank.
"""

READ = (BACKLASH, LOST_MOTION, 1.0)
"""Torques over rated torque from which all numbers of a loop are read; more of them only draw it."""

DRAWN = (BACKLASH, LOST_MOTION, 0.1, 0.25, 0.5, 0.75, 1.0)
"""Torques over rated torque at which a loop is drawn."""

_LOAD_STEPS, _TOLERANCE = 60, 1e-8
"""Equilibria after which no twist is given, and change of the twist over the largest one at which it is [-]."""


@dataclass(frozen=True, kw_only=True)
class HysteresisLoop:
    """Twist of the carrier against torque, the sun held."""

    torque: Float[np.ndarray, " level"]  # Torques on the carrier, ascending and symmetrical about 0 [N·m]
    twist: Float[np.ndarray, "sample level angle"]  # Transmission error at each torque, output side [rad]

    def _at(self, torque: float) -> Curves:
        return self.twist[:, int(np.argmin(np.abs(self.torque - torque)))]

    def width(self, share: float) -> Curves:
        """Return the twist between both directions of `LOST_MOTION`, `BACKLASH` or 1 times the rated torque [rad]."""
        torque = share * self.torque[-1]
        return np.asarray(self._at(torque) - self._at(-torque))

    @property
    def lost_motion(self) -> Float[np.ndarray, " sample"]:
        """Width of the loop at ±3 % of rated torque, mean over the turn [rad]."""
        return np.asarray(self.width(LOST_MOTION).mean(axis=1))

    @property
    def backlash(self) -> Float[np.ndarray, " sample"]:
        """Width of the loop as the torque goes to zero, mean over the turn [rad]."""
        return np.asarray(self.width(BACKLASH).mean(axis=1))

    @property
    def torsional_stiffness(self) -> Float[np.ndarray, " sample"]:
        """Torque over twist between 3 % and 100 % of rated torque, mean of both directions and the turn [N·m/rad]."""
        rated, low = self.torque[-1], LOST_MOTION * self.torque[-1]
        twist = self.width(1.0).mean(axis=1) - self.lost_motion
        return np.asarray(2.0 * (rated - low) / twist)


def loop_torques(reducer: Reducer, shares: Sequence[float]) -> Float[np.ndarray, " level"]:
    """Return the torques at shares of the rated one in both directions, ascending [N·m].

    T = ±share·T_rated, own derivation.
    """
    return np.asarray(reducer.load.rated_torque * np.array([*(-share for share in reversed(shares)), *shares]))


def hysteresis_loop(
    model: EquivalentModel, errors: Errors, carrier_angle: AtAngles, shares: Sequence[float] = READ
) -> HysteresisLoop:
    """Return torque against twist at shares of the rated torque in both directions and at the carrier angles [rad].

    θ(T) of the equilibria (5) at T = ±share·T_rated, twist in rad; without friction.

    Own derivation; lost motion at ±3 % of the rated torque as catalogues define it.
    """
    torque = loop_torques(model.reducer, shares)
    twist = [
        model.at_torque(level).equilibria(errors, level, carrier_angle).transmission_error for level in torque.tolist()
    ]
    return HysteresisLoop(torque=torque, twist=np.stack(twist, axis=1))


def both_directions(
    model: EquivalentModel, errors: Errors, torque: float, carrier_angle: AtAngles | None = None
) -> tuple[Curves, Curves]:
    """Return the transmission error while turning counter-clockwise and clockwise against a torque [rad].

    What reversing adds is the second minus the first. The sign of the torque does not matter, as it resists both ways.

    Own derivation: turning backwards against T is turning forwards under −T.
    """
    forward, backward = (
        model.at_torque(torque).equilibria(errors, resisting, carrier_angle).transmission_error
        for resisting in (-abs(torque), abs(torque))
    )
    return forward, backward


class _Bearings(NamedTuple):
    """The bearings of one interface."""

    interface: str
    parts: tuple[Part, ...]  # What yields in series
    stiffness: float  # Of the springs that stand for them [N/m]
    columns: Int[np.ndarray, " column"]  # Columns x, y of every bearing's place
    place_by_way: Float[np.ndarray, "angle bearing 2 2"]  # Displacement of the place that adds a way [-]

    def displacement(self, carried: Forces, at: int) -> Errors:
        """Return how far to displace the places so that springs yield as the bearings do under their forces [m].

        The forces are those at one carrier angle, given by its number.
        """
        force = carried.vectors(self.interface)[:, 0]
        size = np.maximum(np.hypot(force[..., 0], force[..., 1]), np.finfo(float).tiny)
        ways = np.sum([part.ways(size) for part in self.parts], axis=0)
        longer = force * (1.0 / self.stiffness - ways / size)[..., np.newaxis]
        return np.asarray(np.einsum("bxy,sby->sbx", self.place_by_way[at], longer).reshape(force.shape[0], -1))


def _bearings(model: EquivalentModel, carrier_angle: AtAngles) -> Iterator[_Bearings]:
    """Yield the interfaces with rolling bearings."""
    for group in bilateral_groups(Positions(model.reducer, carrier_angle, model.orders)):
        parts = tuple(part for part in model.reducer.parts if part.interface == group.stiffness_name)
        if not any(isinstance(part.yields, RollingBearing) for part in parts):
            continue
        at = [group.columns.index(column) for place in group.places for column in vector_columns(place)]
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
    model: EquivalentModel, errors: Errors, carrier_angle: AtAngles, shares: Sequence[float] = READ
) -> HysteresisLoop:
    """Return torque against twist as `tolalloc.reducers.equivalent.hysteresis.hysteresis_loop` does.

    A twist is not a number where it is not found.

    A spring is displaced by F/K − w(F) [m] along its force F, theory page equation (75), own derivation, repeated until
    the twist [rad] changes by less than 1e-8 of it; torques [N·m]. Without friction; it has no exact
    derivatives.

    Examples
    --------
    Without rolling bearings it is the loop of `hysteresis_loop`, up to signs of zero:

    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("rv20e_liu2020"))
    >>> errors, at = np.zeros((1, len(model.columns))), np.zeros(1)
    >>> own, secant = (loop(model, errors, at, (1.0,)).twist for loop in (own_load_loop, hysteresis_loop))
    >>> bool(np.allclose(own, secant, rtol=1e-9))
    True
    """
    torque = loop_torques(model.reducer, shares)
    twist = [_twist(model.at_torque(level), errors, level, carrier_angle) for level in torque.tolist()]
    return HysteresisLoop(torque=torque, twist=np.stack(twist, axis=1))


def _twist(springs: EquivalentModel, errors: Errors, torque: float, carrier_angle: AtAngles) -> Curves:
    """Return the transmission error [rad]; angle by angle, because at each of them the places are others."""
    bearings, tables = tuple(_bearings(springs, carrier_angle)), springs.tables_at(carrier_angle)
    found = np.full((errors.shape[0], carrier_angle.size), np.nan)
    for at in range(carrier_angle.size):
        here = CondensedAngles(*(field[at : at + 1] for field in tables))
        displaced, twist = errors.copy(), np.full(errors.shape[0], np.inf)
        for _ in range(_LOAD_STEPS):
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

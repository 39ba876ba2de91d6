"""Torque against twist with friction, the sun held: two branches, and what catalogues read off them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.mesh import normals
from tolalloc.reducers.equivalent.friction import (
    CRANK_BEARINGS,
    MESH,
    PINS,
    FrictionAtTorque,
    angles_of_pins,
    friction_torques,
    sliding_ways,
)
from tolalloc.reducers.equivalent.hysteresis import DRAWN, LOST_MOTION, HysteresisLoop, loop_torques
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.equivalent.play import Play, interpolated

_STEPS = 81
"""Torques at which a loop is drawn beside those at which it is solved: so many equally spaced, and so many about 0,
where little torque closes the backlash [-]."""


@dataclass(frozen=True, kw_only=True)
class FrictionLoop:
    """Twist of the carrier from minus to plus the rated torque and back, the sun held, mean over the angles."""

    torque: Float[np.ndarray, " step"]  # Torques on the carrier, ascending and symmetrical about 0 [N·m]
    rising: Float[np.ndarray, "sample step"]  # Twist while the torque rises [rad]
    falling: Float[np.ndarray, "sample step"]  # Twist while it falls [rad]
    rated: FrictionAtTorque  # Friction of a turning reducer against the rated torque
    no_load: FrictionAtTorque  # That without torque
    plain: HysteresisLoop  # The loop without friction

    def _at(self, branch: Float[np.ndarray, "sample step"], share: float) -> Float[np.ndarray, " sample"]:
        return branch[:, int(np.argmin(np.abs(self.torque - share * self.torque[-1])))]

    @property
    def lost_motion(self) -> Float[np.ndarray, " sample"]:
        """Way between the middles of the loop's width at ±3 % of rated torque [rad]."""
        both = 0.5 * (self.rising + self.falling)
        return np.asarray(self._at(both, LOST_MOTION) - self._at(both, -LOST_MOTION))

    @property
    def hysteresis_loss(self) -> Float[np.ndarray, " sample"]:
        """Width of the loop at no torque [rad]."""
        return np.asarray(self._at(self.falling, 0.0) - self._at(self.rising, 0.0))


def friction_loop(
    model: EquivalentModel, errors: Float[np.ndarray, "sample column"], carrier_angle: Float[np.ndarray, " angle"]
) -> FrictionLoop:
    """Return the loop with friction at the carrier angles [rad].

    Raises
    ------
    ValueError
        A reducer whose bearings or gears are not stated by their dimensions.
    """
    if unknown := model.reducer.friction_dimensions.unknown:
        raise ValueError(f"{model.reducer.name}: no dimensions of {', '.join(unknown)}")
    levels = loop_torques(model.reducer, DRAWN)
    solved = [Solved.of(model.at_torque(level).equilibria(errors, level, carrier_angle)) for level in levels.tolist()]
    turn = np.stack([each.equilibria.transmission_error for each in solved], axis=1)
    even = np.linspace(-1.0, 1.0, _STEPS)
    steps = np.unique(np.concatenate([levels, [0.0], levels[-1] * even, levels[-1] * even**5]))
    twist = _followed(levels, turn.mean(axis=2), solved, np.concatenate([steps[::-1], steps]))
    return FrictionLoop(
        torque=steps,
        rising=twist[:, steps.size :],
        falling=twist[:, steps.size - 1 :: -1],
        rated=FrictionAtTorque.of(solved[0]),
        no_load=FrictionAtTorque.of(solved[levels.size // 2 - 1]),
        plain=HysteresisLoop(torque=levels, twist=turn),
    )


def _followed(
    levels: Float[np.ndarray, " level"],
    twist: Float[np.ndarray, "sample level"],
    solved: list[Solved],
    path: Float[np.ndarray, " step"],
) -> Float[np.ndarray, "sample step"]:
    """Return the twist along a path of torque that starts where the torque has just risen.

    The carrier bearing holds back the whole twist, the pins what the discs move, and all that turns with the cranks
    what the meshes yield.
    """
    by_level = [friction_torques(each) for each in solved]
    turning = {name: np.stack([found[name].mean(axis=1) for found in by_level], axis=1) for name in by_level[0]}
    shares = twist_of_friction(solved)
    outside = Play.of(levels, turning["carrier_bearing"]).follow(np.broadcast_to(path, (twist.shape[0], path.size)))
    discs = Play.of(levels, shares.sliding).follow(outside)
    with_cranks = np.sum([turning[name] for name in (PINS, *CRANK_BEARINGS)], axis=0)
    cranks = Play.of(levels, with_cranks).follow(outside)
    return np.asarray(
        interpolated(outside, levels, twist - shares.discs - shares.cranks)
        + interpolated(discs, levels, shares.discs)
        + interpolated(cranks, levels, shares.cranks)
    )


@dataclass(frozen=True, kw_only=True)
class TwistOfFriction:
    """Parts of the twist that friction holds back, mean over the angles, from 0 at the lowest torque."""

    discs: Float[np.ndarray, "sample level"]  # From discs that move among the pins [rad]
    cranks: Float[np.ndarray, "sample level"]  # From cranks that turn because the meshes yield [rad]
    sliding: Float[np.ndarray, "sample level"]  # Friction torque of the discs' movement among the pins [N·m]


def twist_of_friction(solved: list[Solved]) -> TwistOfFriction:
    """Return the parts of the twist that go with sliding, theory page equation (73).

    Between two torques the forces that are added per added torque balance a torque of one. By virtual work they give
    the twist as the sum of force times way over all contacts, exactly, so that every kind of contact has its share.
    """
    coefficient = solved[0].equilibria.reducer.friction.pins
    discs, cranks, lower, upper = (list[Float[np.ndarray, " sample"]]() for _ in range(4))
    for before, after in pairwise(solved):
        added = after.equilibria.torque - before.equilibria.torque
        pressed, slid = _disc_ways(before, after)
        twist = ((after.forces.pins - before.forces.pins) * pressed).sum(axis=(2, 3)).mean(axis=1) / added
        mesh = (_mesh_force(after) - _mesh_force(before)) * (_mesh_way(after) - _mesh_way(before))
        discs.append(twist)
        cranks.append(mesh.sum(axis=2).mean(axis=1) / added)
        for ends, end in ((lower, before), (upper, after)):
            ends.append(coefficient * (end.forces.pins * np.abs(slid)).sum(axis=(2, 3)).mean(axis=1) / twist)
    # At a torque the mean of what the ways on both sides of it give with the forces at it.
    inner = [0.5 * (below + above) for below, above in zip(upper[:-1], lower[1:], strict=True)]
    sliding = np.stack([lower[0], *inner, upper[-1]], axis=1)
    return TwistOfFriction(discs=_summed(discs), cranks=_summed(cranks), sliding=sliding)


def _summed(changes: list[Float[np.ndarray, " sample"]]) -> Float[np.ndarray, "sample level"]:
    return np.cumsum(np.stack([np.zeros_like(changes[0]), *changes], axis=1), axis=1)


def _disc_ways(
    before: Solved, after: Solved
) -> tuple[Float[np.ndarray, "sample angle disc pin"], Float[np.ndarray, "sample angle disc pin"]]:
    """Return how far every disc moves towards every pin and along it between two equilibria [m].

    A disc that turns by r_d·θ about its centre slides by that times cos a − (R_p·√S − r_rp)/r_d.
    """
    own, reducer = after.equilibria, after.equilibria.reducer
    stage, discs = reducer.cycloid_stage, reducer.disc_count
    moved = (own.retained - before.equilibria.retained)[:, :, : 3 * discs]
    moved = moved.reshape(*moved.shape[:2], discs, 3)
    into = normals(stage.shortening, angles_of_pins(reducer, own.carrier_angle))
    turning = into.towards_crank - sliding_ways(reducer, own.carrier_angle) / stage.disc_pitch_radius
    by_disc = own.tables.contact_by_disc
    along = np.stack([by_disc[:, :, 1], -by_disc[:, :, 0], turning], axis=2)
    return np.einsum("sadc,adcp->sadp", moved, by_disc), np.einsum("sadc,adcp->sadp", moved, along)


def _mesh_force(solved: Solved) -> Float[np.ndarray, "sample angle mesh"]:
    """Return the force of every mesh along its line of action, with its sign [N]."""
    found = solved.forces
    own, bilateral = found.rows_of_stiffness[MESH], found.rows.shape[2]
    if own.start < bilateral:
        return np.asarray(found.rows[:, :, own])
    return np.asarray(found.elements[:, :, own.start - bilateral : own.stop - bilateral, 0])


def _mesh_way(solved: Solved) -> Float[np.ndarray, "sample angle mesh"]:
    """Return how far every mesh yields, its nominal clearance included [m]."""
    reducer, force = solved.equilibria.reducer, _mesh_force(solved)
    return np.asarray(force / reducer.stiffness.gear_mesh + np.sign(force) * reducer.clearances.gear_mesh)

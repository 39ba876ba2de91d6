"""Friction torque of every kind of contact at the output, by virtual work, and the loop of torque and twist with it.

The sun held, friction stands before springs: a play operator says what a spring feels of a torque that rises and falls.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.tooth_profile import normals, pole_distance
from tolalloc.reducers.equivalent.hysteresis import DRAWN, LOST_MOTION, HysteresisLoop, loop_torques
from tolalloc.reducers.equivalent.model import Curves, EquivalentModel, Errors
from tolalloc.reducers.equivalent.outputs import MESHES, AtPins, Forces, Solved, angles_of_pins
from tolalloc.reducers.equivalent.springs import AtAngles
from tolalloc.reducers.reducer.bearings import CRANK_BEARINGS, FrictionDimensions, loss_factor
from tolalloc.reducers.reducer.design import Mesh, Reducer
from tolalloc.reducers.reducer.idle_torque import IdleTorque

Levels = Float[np.ndarray, " level"]
"""Torques of the levels, ascending [N·m]."""
AtLevels = Float[np.ndarray, "sample level"]
AtSteps = Float[np.ndarray, "sample step"]
MESH, PINS = "gear_mesh", "pins"

_STEPS = 81
"""Torques at which a loop is drawn beside those at which it is solved: so many equally spaced, and so many about 0,
where little torque closes the backlash [-]."""


def _interpolated(at: AtSteps, levels: Levels | AtLevels, values: Levels | AtLevels) -> AtSteps:
    """Return the values of every sample between its ascending levels, straight between two and constant beyond."""
    samples = at.shape[0]
    every = (np.broadcast_to(given, (samples, given.shape[-1])) for given in (levels, values))
    return np.stack([np.interp(*row) for row in zip(at, *every, strict=True)])


@dataclass(frozen=True, kw_only=True)
class PlayOperator:
    """Friction before a spring: the torque outside and the one that the spring feels, theory page equation (72).

    The spring feels S where the torque is S + f(S) as it rises and S − f(S) as it falls; between the two nothing moves.
    Exact wherever the torque only rises or only falls between two steps.
    """

    inside: Levels  # Torques S that the spring feels, ascending [N·m]
    rising: Float[np.ndarray, "sample level"]  # Torque at which the spring gives way upwards at S [N·m]
    falling: Float[np.ndarray, "sample level"]  # Torque at which it gives way downwards [N·m]

    @classmethod
    def of(cls, inside: Levels, friction: AtLevels) -> PlayOperator:
        """Return the operator of a friction torque that belongs to the torques S [N·m].

        Where friction grows faster than the torque the spring is locked until the torque reaches what frees it, so the
        limits never fall.
        """
        return cls(
            inside=inside,
            rising=np.maximum.accumulate(inside + friction, axis=1),
            falling=np.minimum.accumulate((inside - friction)[:, ::-1], axis=1)[:, ::-1],
        )

    def follow(self, path: AtSteps) -> AtSteps:
        """Return what the spring feels at every step of a path, which starts where the torque has just risen [N·m]."""
        low = _interpolated(path, self.rising, self.inside)
        high = _interpolated(path, self.falling, self.inside)
        felt = np.empty(path.shape)
        state = low[:, 0]
        for step in range(path.shape[1]):
            state = np.maximum(low[:, step], np.minimum(high[:, step], state))
            felt[:, step] = state
        return felt


def sliding_ways(reducer: Reducer, carrier_angle: AtAngles) -> Float[np.ndarray, "angle disc pin"]:
    """Return how far every disc slides along every pin per radian of the output, R_p·√S − r_rp [m/rad].

    A disc turns against the housing about its pole, which lies on the contact's normal. A pin that turns in its groove
    instead of staying there slides in the groove by the same way under the same force.

    Theory page equation (69), own derivation: R_p·√S is the distance of pin and pole, S = 1 + K1² − 2K1·cos φ.
    """
    stage = reducer.cycloid_stage
    root = pole_distance(stage.shortening, angles_of_pins(reducer, carrier_angle))
    return np.asarray(stage.pin_circle_radius * root - stage.pin_radius)


def _bearing(reducer: Reducer, dimensions: FrictionDimensions, found: Forces, name: str) -> Curves:
    """Return the friction torque of the bearings of one kind: µ·(F + preload)·d_m/2 times their speed per output's.

    A crankshaft turns by −zc per output radian, discs and carrier by 1, so that its bearings turn by zp.
    """
    bearing, force = getattr(dimensions, name), found.of(name)
    speed = reducer.cycloid_stage.pin_count if name in CRANK_BEARINGS else 1
    load = force.sum(axis=2) + force.shape[2] * bearing.rows * bearing.idle_load
    return np.asarray(getattr(reducer.friction, name) * load * bearing.pitch_diameter / 2.0 * speed)


def friction_torques(solved: Solved) -> dict[str, Curves]:
    """Return the friction torque of every kind of contact that is known, theory page equations (70), (71) [N·m].

    It is that at the output: the coefficient times the sum of force times sliding way per radian of the output, the
    sun turning. Forces are those of the equilibria, which have no friction.

    T_f = Σ µ·F·way; Coulomb's friction, no seals and no grease (`IdleTorque`); mesh µ·H_v·F·r_b1·(i − 1), of a centre
    gear µ·H_v·F·r_b4·i besides, i the turns of the sun.

    Own derivation by virtual work; H_v Ohlendorf's, bearings µ·P·d/2 as SKF's.

    Examples
    --------
    >>> from tolalloc.reducers.equivalent.perfect import perfect_reducer
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = friction_torques(perfect_reducer(load_reducer("rv20e"), -167.0))
    >>> {name: round(float(torque.mean()), 1) for name, torque in found.items()}  # at the output [N·m]
    {'pins': 8.7, 'crank_disc_bearing': 4.0, 'crank_carrier_bearing': 3.0, 'carrier_bearing': 0.0, 'gear_mesh': 2.7}
    """
    reducer, found = solved.equilibria.reducer, solved.forces
    dimensions = reducer.friction_dimensions
    torques = {
        PINS: reducer.friction.pins
        * np.einsum("sadp,adp->sa", found.pins, sliding_ways(reducer, solved.equilibria.carrier_angle))
    }
    for name in (*CRANK_BEARINGS, "carrier_bearing"):
        if getattr(dimensions, name) is not None:
            torques[name] = _bearing(reducer, dimensions, found, name)
    if MESH not in dimensions.unknown and reducer.meshes:
        torques[MESH] = sum(_mesh(reducer, found, own, ratio) for own in reducer.meshes if (ratio := own.contact_ratio))
    return torques


def _mesh(reducer: Reducer, found: Forces, own: Mesh, contact_ratio: float) -> Curves:
    """Return the friction torque of gear meshes of one kind."""
    transmitted = found.of(own.interface).sum(axis=2) * own.lever * own.turns
    return np.asarray(reducer.friction.gear_mesh * loss_factor(*own.teeth, contact_ratio) * transmitted)


@dataclass(frozen=True, kw_only=True)
class FrictionAtTorque:
    """Friction of units under one torque, mean over the angles; theory page equation (70), contacts alone."""

    torque: float  # Torque on the carrier [N·m]
    by_contact: dict[str, Float[np.ndarray, " sample"]]  # Kind of contact → friction torque at the output [N·m]

    @classmethod
    def of(cls, solved: Solved) -> FrictionAtTorque:
        """Return the friction in equilibria."""
        means = {name: np.asarray(torque.mean(axis=1)) for name, torque in friction_torques(solved).items()}
        return cls(torque=solved.equilibria.torque, by_contact=means)

    @property
    def friction_torque(self) -> Float[np.ndarray, " sample"]:
        """Sum over all kinds of contact that are known [N·m]."""
        return np.asarray(sum(self.by_contact.values()))

    @property
    def efficiency(self) -> Float[np.ndarray, " sample"]:
        """η = T/(T + T_f) of the contacts, of a reducer that drives its load, theory page equation (70) [-]."""
        size = abs(self.torque)
        return np.asarray(size / (size + self.friction_torque))


@dataclass(frozen=True, kw_only=True)
class FrictionLoop:
    """Twist of the carrier from minus to plus the rated torque and back, the sun held, mean over the angles.

    Theory page equation (74) reads lost motion and hysteresis loss from it [rad].
    """

    torque: Float[np.ndarray, " step"]  # Torques on the carrier, ascending and symmetrical about 0 [N·m]
    rising: Float[np.ndarray, "sample step"]  # Twist while the torque rises [rad]
    falling: Float[np.ndarray, "sample step"]  # Twist while it falls [rad]
    rated: FrictionAtTorque  # Friction of a turning reducer against the rated torque
    no_load: FrictionAtTorque  # That without torque
    plain: HysteresisLoop  # The loop without friction

    def _at(self, branch: AtSteps, share: float) -> Float[np.ndarray, " sample"]:
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


def friction_loop(model: EquivalentModel, errors: Errors, carrier_angle: AtAngles) -> FrictionLoop:
    """Return the loop with friction at the carrier angles [rad].

    Theory page equations (72) to (74), own derivation: Coulomb's friction at forces of equilibria that have none, which
    errs in second order of the loss; bearings, shafts and carrier yield without friction.
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


def _followed(levels: Levels, twist: AtLevels, solved: list[Solved], path: Float[np.ndarray, " step"]) -> AtSteps:
    """Return the twist along a path of torque that starts where the torque has just risen.

    Carrier bearing and seal hold back the whole twist, the pins what the discs move, and all that turns with the cranks
    what the meshes yield.
    """
    idle = IdleTorque.of(solved[0].equilibria.reducer)
    by_level = [friction_torques(each) for each in solved]
    turning = {name: np.stack([found[name].mean(axis=1) for found in by_level], axis=1) for name in by_level[0]}
    shares = twist_of_friction(solved)
    outside = PlayOperator.of(levels, turning["carrier_bearing"] + idle.at_output).follow(
        np.broadcast_to(path, (twist.shape[0], path.size))
    )
    discs = PlayOperator.of(levels, shares.sliding).follow(outside)
    with_cranks = np.sum([turning[name] for name in (PINS, *CRANK_BEARINGS)], axis=0) + idle.at_cranks
    cranks = PlayOperator.of(levels, with_cranks).follow(outside)
    return np.asarray(
        _interpolated(outside, levels, twist - shares.discs - shares.cranks)
        + _interpolated(discs, levels, shares.discs)
        + _interpolated(cranks, levels, shares.cranks)
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

    Δθ = Σ (ΔF/ΔT)·Δway [rad], exact; sliding f = µ·ΣF·|Δs|/Δθ [N·m], own derivation.

    Examples
    --------
    >>> from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
    >>> from tolalloc.reducers.equivalent.perfect import exact_unit
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> model = EquivalentModel(load_reducer("rv20e"))
    >>> solved = [Solved.of(model.equilibria(exact_unit(model), torque, TURN_ANGLES[:1])) for torque in (16.7, 167.0)]
    >>> found = twist_of_friction(solved)
    >>> low, high = (own.equilibria.transmission_error[0, 0] for own in solved)
    >>> share = (found.discs[0, 1] + found.cranks[0, 1]) / (high - low)
    >>> bool(0 < share < 1)  # the rest is bearings, shafts and carrier
    True
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


def _summed(changes: list[Float[np.ndarray, " sample"]]) -> AtLevels:
    return np.cumsum(np.stack([np.zeros_like(changes[0]), *changes], axis=1), axis=1)


def _disc_ways(before: Solved, after: Solved) -> tuple[AtPins, AtPins]:
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
    """Return the force of every mesh along its line of action, with its sign, that of a centre gear last [N]."""
    found = solved.forces
    return np.concatenate([found.vectors(name)[..., 0] for name in MESHES if name in found.rows_of_stiffness], axis=2)


def _mesh_way(solved: Solved) -> Float[np.ndarray, "sample angle mesh"]:
    """Return how far every mesh yields, its nominal clearance included [m]."""
    reducer, force = solved.equilibria.reducer, _mesh_force(solved)
    names = [own.interface for own in reducer.meshes for _ in range(own.count)]
    stiffness = np.array([getattr(reducer.stiffness, name) for name in names])
    clearance = np.array([reducer.clearance_of(name) for name in names])
    return np.asarray(force / stiffness + np.sign(force) * clearance)

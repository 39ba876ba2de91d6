"""Friction torque of every kind of contact at the output, by virtual work, and the efficiency that it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.mesh import pin_angles
from tolalloc.reducers.equivalent.outputs import Forces, Solved
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.friction import FrictionDimensions, loss_factor

MESH, PINS = "gear_mesh", "pins"
CRANK_BEARINGS = ("crank_disc_bearing", "crank_carrier_bearing")


def angles_of_pins(reducer: Reducer, carrier_angle: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle disc pin"]:
    """Return the angle of every pin from the crank direction of every disc [rad]."""
    crank, apart = -reducer.cycloid_stage.disc_teeth * carrier_angle, 2.0 * np.pi / reducer.disc_count
    discs = range(reducer.disc_count)
    return np.stack([pin_angles(reducer.cycloid_stage, -(crank + apart * disc)) for disc in discs], axis=1)


def sliding_ways(reducer: Reducer, carrier_angle: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle disc pin"]:
    """Return how far every disc slides along every pin per radian of the output, R_p·√S − r_rp [m/rad].

    A disc turns against the housing about its pole, which lies on the contact's normal. A pin that turns in its groove
    instead of staying there slides in the groove by the same way under the same force.
    """
    stage, angle = reducer.cycloid_stage, angles_of_pins(reducer, carrier_angle)
    root = np.sqrt(1.0 + stage.shortening**2 - 2.0 * stage.shortening * np.cos(angle))
    return np.asarray(stage.pin_circle_radius * root - stage.pin_radius)


def _bearing(
    reducer: Reducer, dimensions: FrictionDimensions, found: Forces, name: str
) -> Float[np.ndarray, "sample angle"]:
    """Return the friction torque of the bearings of one kind: µ·(F + preload)·d_m/2 times their speed per output's.

    A crankshaft turns by −zc per output radian, discs and carrier by 1, so that its bearings turn by zp.
    """
    bearing, force = getattr(dimensions, name), found.of(name)
    speed = reducer.cycloid_stage.pin_count if name in CRANK_BEARINGS else 1
    load = force.sum(axis=2) + force.shape[2] * bearing.rows * bearing.idle_load
    return np.asarray(getattr(reducer.friction, name) * load * bearing.pitch_diameter / 2.0 * speed)


def friction_torques(solved: Solved) -> dict[str, Float[np.ndarray, "sample angle"]]:
    """Return the friction torque of every kind of contact that is known, theory page equation (70), (71) [N·m].

    It is that at the output: the coefficient times the sum of force times sliding way per radian of the output, the
    sun turning. Forces are those of the equilibria, which have no friction.
    """
    reducer, found = solved.equilibria.reducer, solved.forces
    dimensions, first = reducer.friction_dimensions, reducer.first_stage
    torques = {
        PINS: reducer.friction.pins
        * np.einsum("sadp,adp->sa", found.pins, sliding_ways(reducer, solved.equilibria.carrier_angle))
    }
    for name in (*CRANK_BEARINGS, "carrier_bearing"):
        if name not in dimensions.unknown:
            torques[name] = _bearing(reducer, dimensions, found, name)
    if MESH not in dimensions.unknown and dimensions.contact_ratio is not None:
        sun_base = reducer.planet_base_radius * first.sun_teeth / first.planet_teeth
        loss = loss_factor(first.sun_teeth, first.planet_teeth, dimensions.contact_ratio)
        # Seen from the carrier the sun turns by ratio − 1 per radian of the output.
        transmitted = found.of(MESH).sum(axis=2) * sun_base * (reducer.ratio - 1.0)
        torques[MESH] = reducer.friction.gear_mesh * loss * transmitted
    return torques


@dataclass(frozen=True, kw_only=True)
class FrictionAtTorque:
    """Friction of units under one torque, mean over the angles."""

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
        """η = T/(T + T_f) of a reducer that drives its load [-]."""
        size = abs(self.torque)
        return np.asarray(size / (size + self.friction_torque))

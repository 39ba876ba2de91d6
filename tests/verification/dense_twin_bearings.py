"""Rolling bearings of the dense twin, element by element: the springs that stand for them, and the bearings themselves.

Dimensions of bearings and compliances of bodies are the reducer's; forces are written here a second time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe

from studies.benchmarks.plain_rows import spring_groups
from tests.verification.dense_twin import DenseModel, Interface, Response, interface, play_response
from tolalloc.reducers.equivalent.springs import HARMONICS, SpringGroup
from tolalloc.reducers.reducer.bearings import BallBearing, RollerBearing, RollingBearing
from tolalloc.reducers.reducer.design import Clearances, Reducer


def hertz(bearing: BallBearing) -> float:
    """Load of a ball between both races over its approach to 3/2, with Brewe and Hamrock's integrals [N/m^1.5]."""
    ball, modulus, approach = bearing.ball_diameter, 206e9 / (1 - 0.3**2), 0.0
    small = ball * math.cos(bearing.contact_angle) / bearing.pitch_diameter
    for rolling in (-2 / ball * small / (1 + small), 2 / ball * small / (1 - small)):
        along, across = 2 / ball + rolling, 2 / ball - 1 / (bearing.osculation * ball)
        first, second = 1.5277 + 0.6023 * math.log(along / across), 1.0003 + 0.5968 * across / along
        axes = 1.0339 * (along / across) ** 0.636
        approach += (9 * (along + across) * first**3 / (2 * second * (math.pi * axes * modulus) ** 2)) ** (1 / 3)
    return approach**-1.5


class Rollers(NamedTuple):
    """The rolling elements of some bearings alike."""

    across: np.ndarray  # [bearing, roller, 2], how far a displacement of 1 presses a roller along its contact
    pressed: float  # how far the preload presses every roller, less what the clearance leaves [m]
    coefficient: float  # load over what a roller is pressed to the exponent
    exponent: float

    @classmethod
    def of(cls, bearing: RollingBearing, phase: np.ndarray) -> Rollers:
        """Return the rollers of bearings whose first ones stand at a phase [bearing, row] [rad]."""
        if isinstance(bearing, BallBearing):
            count, coefficient, exponent = bearing.balls, hertz(bearing), 1.5
        else:
            assert isinstance(bearing, RollerBearing)  # ISO/TS 16281 prints 35,948 N/mm^(10/9)
            count, exponent = bearing.rollers, 10 / 9
            coefficient = 35948.0 * (bearing.roller_length * 1e3) ** (8 / 9) * 1e3**exponent
        angle = (phase[:, :, np.newaxis] + 2 * np.pi * np.arange(count) / count).reshape(len(phase), -1)
        cosine, sine = math.cos(bearing.contact_angle), math.sin(bearing.contact_angle)
        preloaded = (bearing.preload / (count * coefficient * sine)) ** (1 / exponent) if bearing.preload else 0.0
        across = cosine * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return cls(across, preloaded - bearing.clearance / 2 * cosine, coefficient, exponent)

    def response(self, stiffness: np.ndarray, parameter: np.ndarray, displacement: np.ndarray) -> Response:
        """Load c·δⁿ and energy c·δ^(n+1)/(n+1) of every roller that is pressed by δ."""
        pressed = np.maximum(np.einsum("brx,bx->br", self.across, displacement) + self.pressed, 0.0)
        load = self.coefficient * pressed**self.exponent
        slope = self.exponent * load / np.maximum(pressed, 1e-200)
        energy = (load * pressed).sum(axis=1) / (self.exponent + 1)
        force = np.einsum("br,brx->bx", load, self.across)
        return energy, force, np.einsum("br,brx,bry->bxy", slope, self.across, self.across)

    def way(self, force: float) -> float:
        """Return how far one bearing moves along x under a force along x [m]."""

        def missing(way: float) -> float:
            return float(self.response(np.empty(0), np.empty(0), np.array([[way, 0.0]]))[1][0, 0]) - force

        return float(brentq(missing, 0.0, 1e-3, xtol=1e-18, rtol=1e-14))


def parts_of(reducer: Reducer, name: str) -> tuple[list[RollingBearing], float]:
    """Return the bearing of an interface, if any, and what the bodies in series with it yield [m/N]."""
    yields = [part.yields for part in reducer.parts if part.interface == name]
    assert all(part.stiffer == 1.0 for part in reducer.parts)
    return [each for each in yields if isinstance(each, RollingBearing)], sum(
        each for each in yields if isinstance(each, float)
    )


def forces_by_statics(reducer: Reducer, torque: float) -> dict[str, float]:
    """Return the forces of theory page equation (66); the mean over the crank direction is an elliptic integral."""
    cranks, discs, stage = reducer.crank_count, reducer.disc_count, reducer.cycloid_stage
    held = torque / cranks / reducer.crank_circle_radius
    bent, pins = held / discs, torque / cranks / discs / stage.eccentricity / stage.pin_count
    mean = 2 / np.pi * (bent + pins) * ellipe(4 * bent * pins / (bent + pins) ** 2)
    return {"crank_disc_bearing": mean, "crank_carrier_bearing": held, "carrier_bearing": 1e-3 * held}


def secant(bearing: RollingBearing, force: float) -> float:
    """Return the way beyond the play over the force, mean with a roller in its direction and with it between two."""
    count = Rollers.of(bearing, np.zeros((1, 1))).across.shape[1]
    ways = [Rollers.of(bearing, np.full((1, bearing.rows), phase)).way(force) for phase in (0.0, np.pi / count)]
    return (sum(ways) / 2 - play(bearing)) / force


def play(bearing: RollingBearing) -> float:
    """Return the way until a roller is pressed, mean with one in the way and with two beside it [m]."""
    rollers = Rollers.of(bearing, np.zeros((1, 1)))
    until = max(-rollers.pressed / math.cos(bearing.contact_angle), 0.0)
    return until * (1 + 1 / math.cos(math.pi / rollers.across.shape[1])) / 2


def with_secants(reducer: Reducer, torque: float) -> Reducer:
    """Return the reducer with the springs of theory page equations (66) and (67) at a torque on the carrier."""
    forces, own, gaps = forces_by_statics(reducer, max(abs(torque), 1e-3 * reducer.load.rated_torque)), {}, {}
    for name in {part.interface for part in reducer.parts}:
        bearings, bodies = parts_of(reducer, name)
        own[name] = 1 / (bodies + sum(secant(bearing, forces[name]) for bearing in bearings))
        if bearings:
            gaps[name] = play(bearings[0])
    return replace(
        reducer,
        parts=(),
        stiffness=replace(reducer.stiffness, **own),
        clearances=replace(reducer.clearances, **gaps),
    )


Laws = Callable[[RollingBearing, int], Callable[..., Response]]
"""From a bearing and how many of them there are, what they answer."""


def standing(generator: np.random.Generator) -> Laws:
    """Every row of elements stands anywhere in its ring."""

    def law(bearing: RollingBearing, count: int) -> Callable[..., Response]:
        return Rollers.of(bearing, generator.uniform(0, 2 * np.pi, (count, bearing.rows))).response

    return law


def turning(bearing: RollingBearing, count: int) -> Callable[..., Response]:
    """Under a force the way is the mean of one with a roller in its direction and one with the force between two."""
    one = Rollers.of(bearing, np.zeros((1, 1))).across.shape[1]
    both = [Rollers.of(bearing, np.full((count, bearing.rows), phase)) for phase in (0.0, np.pi / one)]

    def law(stiffness: np.ndarray, parameter: np.ndarray, displacement: np.ndarray) -> Response:
        reach = np.maximum(np.linalg.norm(displacement, axis=1), 1e-15)
        direction = displacement / reach[:, np.newaxis]
        ways = np.tile(reach, (2, 1))  # Newton's method, so that both forces are the same
        for _ in range(100):
            moved = ways[:, :, np.newaxis] * [1.0, 0.0]
            along = [each.response(stiffness, parameter, way) for each, way in zip(both, moved, strict=True)]
            force, slope = (np.array([each[order][:, 0] for each in along]) for order in (1, 2))
            slope = np.maximum(slope[:, :, 0], 1e-200)
            change = np.diff(force, axis=0)[0] / slope.sum(axis=0)
            if (np.abs(change) <= 1e-14 * reach + 1e-21).all():
                break
            ways[0] = np.clip(ways[0] + change, 0.0, 2 * reach)
            ways[1] = 2 * reach - ways[0]
        else:
            raise AssertionError("the two ways are not found")
        force, slope = force.mean(axis=0), 2 * slope[0] * slope[1] / slope.sum(axis=0)
        radial = direction[:, :, np.newaxis] * direction[:, np.newaxis]
        across = (force / reach)[:, None, None] * (np.eye(2) - radial)
        energy = (along[0][0] + along[1][0]) / 2
        return energy, force[:, np.newaxis] * direction, slope[:, None, None] * radial + across

    return law


def with_bearings(
    reducer: Reducer,
    errors: dict[str, float],
    torque: float,
    carrier_angle: float,
    laws: Laws,
    orders: tuple[int, ...] = HARMONICS,
) -> DenseModel:
    """Return the model with nonlinear rolling bearings.

    What lies in series with a bearing is a spring behind it, joined to it at two coordinates of their own.
    """
    springs = replace(with_secants(reducer, torque), clearances=Clearances(gear_mesh=reducer.clearances.gear_mesh))
    groups = spring_groups(springs, np.array([carrier_angle]), orders)
    first = groups[0].displacement.shape[2]
    size = first + sum(len(group.stiffness[0]) for group in groups if joined(reducer, group))
    found, load = list[Interface](), np.zeros(size)
    load[first - 1] = torque
    for group in groups:
        plain = interface(springs, errors, carrier_angle, group)
        rows = np.pad(plain.displacement, ((0, 0), (0, 0), (0, size - plain.displacement.shape[2])))
        bearings, bodies = parts_of(reducer, group.stiffness_name)
        if not bearings:
            found.append(plain._replace(displacement=rows))
            continue
        count = len(rows) // 2
        shaped = Interface(
            name=group.name,
            displacement=rows.reshape(count, 2, size),
            undisturbed=plain.undisturbed.reshape(count, 2),
            stiffness=plain.stiffness[::2],
            law=laws(bearings[0], count),
            parameter=np.zeros(count),
        )
        if joined(reducer, group):
            joint = np.eye(size)[first : first + 2 * count].reshape(count, 2, size)
            first += 2 * count
            behind = shaped._replace(
                name=f"behind {group.name}",
                displacement=shaped.displacement - joint,
                stiffness=np.full(count, 1 / bodies),
                law=play_response,
            )
            found.append(behind)
            shaped = shaped._replace(displacement=joint, undisturbed=np.zeros((count, 2)))
        found.append(shaped)
    return DenseModel(tuple(found), load)


def joined(reducer: Reducer, group: SpringGroup) -> bool:
    """Return whether something lies in series with the bearings of a group."""
    bearings, bodies = parts_of(reducer, group.stiffness_name)
    return bool(bearings) and bodies > 0

"""The equations of motion without condensation, compiled code or time steps, from the dense twin at moving angles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp

from tests.verification.dense_twin import DenseModel, dense_model, least_energy
from tolalloc.reducers.equivalent.springs import HARMONICS, Coordinates
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.wings.motion.motion import Inertia, SpeedProfile


def part_paths(reducer: Reducer, carrier_angle: float) -> np.ndarray:
    """Where the nominal motion takes every coordinate's part: centres and angles."""
    at, stage = Coordinates(reducer.crank_count, reducer.disc_count), reducer.cycloid_stage
    path = np.zeros(at.count)
    crank_angle = -stage.disc_teeth * carrier_angle
    for crank in range(reducer.crank_count):
        centre = reducer.crank_circle_radius * np.exp(1j * (carrier_angle + 2 * np.pi * crank / reducer.crank_count))
        path[at.planet(crank) : at.planet(crank) + 3] = centre.real, centre.imag, crank_angle
    for disc in range(reducer.disc_count):
        centre = stage.eccentricity * np.exp(1j * (crank_angle + 2 * np.pi * disc / reducer.disc_count))
        path[at.disc(disc) : at.disc(disc) + 3] = centre.real, centre.imag, carrier_angle
    path[at.carrier + 2] = carrier_angle
    return path


def path_derivatives(reducer: Reducer, carrier_angle: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative of the paths by the carrier angle, by differences of a fourth-order formula."""
    h = 2e-3 / reducer.cycloid_stage.disc_teeth
    two_back, back, here, on, two_on = (part_paths(reducer, carrier_angle + k * h) for k in (-2, -1, 0, 1, 2))
    first = (two_back - 8 * back + 8 * on - two_on) / (12 * h)
    return first, (-two_back + 16 * back - 30 * here + 16 * on - two_on) / (12 * h * h)


@dataclass(frozen=True)
class MovingTwin:
    """One unit in motion; damping per mass and per stiffness of every interface without play."""

    reducer: Reducer
    errors: dict[str, float]
    inertia: Inertia
    carrier_speed: SpeedProfile
    torque: SpeedProfile
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    angle: float = 0.0
    orders: tuple[int, ...] = HARMONICS

    @cached_property
    def mass(self) -> np.ndarray:
        return self.inertia.diagonal(Coordinates(self.reducer.crank_count, self.reducer.disc_count))

    def carrier_angle(self, time: float) -> float:
        return self.angle + float(self.carrier_speed.integral(np.array([time]))[0])

    def springs(self, time: float, torque: float | None = None) -> DenseModel:
        load = float(self.torque.at(np.array([time]))[0]) if torque is None else torque
        return dense_model(self.reducer, self.errors, load, self.carrier_angle(time), self.orders)

    def nominal_acceleration(self, time: float) -> np.ndarray:
        first, second = path_derivatives(self.reducer, self.carrier_angle(time))
        at = np.array([time])
        return first * self.carrier_speed.slope(at) + second * self.carrier_speed.at(at) ** 2

    def damping(self, springs: DenseModel) -> np.ndarray:
        matrix = self.mass_damping * np.diag(self.mass)
        for part in springs.interfaces:
            field = part.name.replace("–", "_").replace(" ", "_")
            if part.name != "pin contact" and getattr(self.reducer.clearances, field, 0.0) == 0.0:
                rows = part.displacement
                matrix += self.stiffness_damping * np.einsum("e,eri,erj->ij", part.stiffness, rows, rows)
        return matrix

    def start(self) -> np.ndarray:
        return least_energy(self.springs(0.0))

    def unbalance(self, time: float, q: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        springs = self.springs(time)
        inertial = self.mass * (acceleration + self.nominal_acceleration(time))
        return inertial + self.damping(springs) @ velocity + springs.gradient(q)

    def integrated(self, times: np.ndarray, nodes: int = 8) -> np.ndarray:
        """Displacements and velocities at the times, [time, 2, coordinate], by Radau's method.

        Rows are smooth functions of time; between Chebyshev nodes of a short interval a polynomial stands for them.
        """
        end = times[-1]
        points = end / 2 * (1 - np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes))
        springs = [self.springs(point, 0.0) for point in points]
        accelerations = np.stack([self.nominal_acceleration(point) for point in points])
        weight = (-1.0) ** np.arange(nodes) * np.sin(np.pi * (np.arange(nodes) + 0.5) / nodes)

        def at(time: float) -> tuple[DenseModel, np.ndarray, np.ndarray]:
            apart = weight / (time - points + 1e-30)
            share = apart / apart.sum()
            parts = tuple(
                same[0]._replace(
                    displacement=np.tensordot(share, np.stack([part.displacement for part in same]), 1),
                    undisturbed=np.tensordot(share, np.stack([part.undisturbed for part in same]), 1),
                    stiffness=np.tensordot(share, np.stack([part.stiffness for part in same]), 1),
                )
                for same in zip(*(own.interfaces for own in springs), strict=True)
            )
            load = springs[0].load.copy()
            load[-1] = self.torque.at(np.array([time]))[0]
            model = DenseModel(parts, load)
            return model, self.damping(model), share @ accelerations

        unit = 1e-6  # so that coordinates are of the order of one
        size = self.mass.size

        def rate(time: float, state: np.ndarray) -> np.ndarray:
            q, velocity = unit * state[:size], unit * state[size:]
            model, damping, nominal = at(time)
            acceleration = -(model.gradient(q) + damping @ velocity) / self.mass - nominal
            return np.concatenate([velocity, acceleration]) / unit

        def jacobian(time: float, state: np.ndarray) -> np.ndarray:
            model, damping, _ = at(time)
            inverse = 1 / self.mass[:, np.newaxis]
            right = np.concatenate([-inverse * model.hessian(unit * state[:size]), -inverse * damping], axis=1)
            return np.concatenate([np.eye(size, 2 * size, size), right])

        begin = np.concatenate([self.start(), np.zeros(size)]) / unit
        scale = np.concatenate([np.full(size, 1e-9), np.full(size, 1e-5)])
        found = solve_ivp(rate, (0.0, end), begin, method="Radau", t_eval=times, rtol=1e-9, atol=scale, jac=jacobian)
        return unit * found.y.T.reshape(times.size, 2, size)

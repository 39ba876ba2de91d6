"""The equivalent model without condensation and without compiled code: all coordinates, one angle, SciPy.

Only the spring rows are the package's (`test_rows_against_geometry` proves them); what makes them nonlinear stands here
a second time, from the theory page. A vanishing gradient proves the minimum of the convex energy, however it was found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize
from scipy.special import lambertw

from studies.benchmarks.plain_rows import spring_groups
from tolalloc.reducers.cycloid.loaded_contact import equivalent_length
from tolalloc.reducers.equivalent.springs import HARMONICS, Coordinates, SpringGroup
from tolalloc.reducers.reducer.design import Reducer

Response = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Energy [element], force [element, row] and its derivative [element, row, row] of an interface."""


def play_response(stiffness: np.ndarray, clearance: np.ndarray, compression: np.ndarray) -> Response:
    """Energy ½k(|δ| − c)₊²; without clearance a spring that pushes and pulls."""
    reach = np.maximum(np.linalg.norm(compression, axis=1), 1e-200)
    taut, direction = np.maximum(reach - clearance, 0.0), compression / reach[:, np.newaxis]
    along = direction[:, :, np.newaxis] * direction[:, np.newaxis]
    across = np.eye(compression.shape[1]) - along
    slope = stiffness[:, None, None] * ((taut > 0)[:, None, None] * along + (taut / reach)[:, None, None] * across)
    return stiffness * taut**2 / 2, (stiffness * taut)[:, np.newaxis] * direction, slope


def tilted_response(stiffness: np.ndarray, half_depth: np.ndarray, compression: np.ndarray) -> Response:
    """Force K/(4h)·[(s+h)₊² − (s−h)₊²]: the tilted tooth lies deeper by h at one end and less deep at the other."""
    middle = compression[:, 0]
    at_edge, over_all = np.abs(middle) < half_depth, middle >= half_depth
    whole, deep = np.where(over_all, middle, 0.0), np.where(at_edge, middle + half_depth, 0.0)
    width = np.where(at_edge, half_depth, 1.0)  # where only a part of the width touches
    energy = stiffness * np.where(over_all, whole**2 / 2 + half_depth**2 / 6, deep**3 / (12 * width))
    force, slope = stiffness * (whole + deep**2 / (4 * width)), stiffness * (over_all + deep / (2 * width))
    return energy, force[:, np.newaxis], slope[:, np.newaxis, np.newaxis]


def logarithmic_response(stiffness: np.ndarray, length: np.ndarray, compression: np.ndarray) -> Response:
    """δ = F/c·ln(cλ/F) with c = 2·stiffness: with w = ln(cλ/F) it reads w·exp(−w) = δ/λ, w > 1."""
    scale, middle = 2 * stiffness, compression[:, 0]
    straight = 2 * length * np.exp(-2.0)  # where w = 2; from there the tangent goes on
    beyond, touching = np.maximum(middle - straight, 0.0), middle > 0
    w = -lambertw(-np.clip(middle, 1e-200, straight) / length, -1).real
    force = scale * length * np.exp(-w)
    energy = force**2 / scale * (w / 2 - 0.25) + force * beyond + scale * beyond**2 / 2  # ∫F dδ
    force, slope = touching * (force + scale * beyond), touching * scale / (w - 1)
    return touching * energy, force[:, np.newaxis], slope[:, np.newaxis, np.newaxis]


def pin_law(
    reducer: Reducer, errors: dict[str, float], carrier_angle: float, normal: np.ndarray
) -> tuple[Callable[..., Response], np.ndarray]:
    """Return the law of the pins and its parameter; the normals x + iy [disc, pin] point into the discs."""
    stage, discs = reducer.cycloid_stage, np.arange(reducer.disc_count)[:, np.newaxis]
    if reducer.stiffness.pin_contact_law == "logarithmic":
        crank_direction = 2 * np.pi * discs / len(discs) - stage.disc_teeth * carrier_angle
        pin_angle = 2 * np.pi * np.arange(stage.pin_count) / stage.pin_count - crank_direction
        bending = np.exp(2 * reducer.stiffness.pin_contact / reducer.stiffness.pin_bending)
        length = equivalent_length(stage, pin_angle) * bending
        return logarithmic_response, length.ravel()
    x, y = ([[errors.get(f"disc{disc + 1}.tilt.{axis}", 0.0)] for disc in discs.ravel()] for axis in "xy")
    tilt = (np.array(x) + 1j * np.array(y)) * np.exp(1j * carrier_angle)  # the disc turns with the carrier
    return tilted_response, stage.face_width / 2 * np.abs((tilt * normal.conj()).imag).ravel()


class Interface(NamedTuple):
    """One spring group of one unit at one angle, its rows by element."""

    name: str
    displacement: np.ndarray  # [element, row, coordinate]
    undisturbed: np.ndarray  # [element, row]
    stiffness: np.ndarray  # [element]
    law: Callable[..., Response]
    parameter: np.ndarray  # [element]

    def at(self, q: np.ndarray) -> Response:
        return self.law(self.stiffness, self.parameter, self.displacement @ q + self.undisturbed)


def interface(reducer: Reducer, errors: dict[str, float], carrier_angle: float, group: SpringGroup) -> Interface:
    rows, (count, size) = group.displacement[0], group.displacement[0].shape
    undisturbed = group.error[0] @ np.array([errors.get(name, 0.0) for name in group.columns])
    elements, law, parameter = count, play_response, np.zeros(count)
    if group.contact == "play":
        elements = len(group.clearance_columns)
        deviation = np.array([errors.get(name, 0.0) for name in group.clearance_columns])
        parameter = np.maximum(group.clearance + deviation, 0.0)
    elif group.contact == "unilateral":
        at = Coordinates(reducer.crank_count, reducer.disc_count)
        x, y = (-rows[:, at.disc(0) + axis : at.carrier : 3].sum(axis=1) for axis in (0, 1))  # other discs' are zero
        law, parameter = pin_law(reducer, errors, carrier_angle, (x + 1j * y).reshape(reducer.disc_count, -1))
    shape, stiffness = (elements, count // elements), group.stiffness[0, :: count // elements]
    return Interface(group.name, rows.reshape(*shape, size), undisturbed.reshape(shape), stiffness, law, parameter)


class DenseModel(NamedTuple):
    """One unit at one carrier angle: energy, gradient, Hessian and forces in all coordinates."""

    interfaces: tuple[Interface, ...]
    load: np.ndarray

    def energy(self, q: np.ndarray) -> float:
        return float(sum(part.at(q)[0].sum() for part in self.interfaces) - self.load @ q)

    def gradient(self, q: np.ndarray) -> np.ndarray:
        return sum(np.einsum("er,eri->i", part.at(q)[1], part.displacement) for part in self.interfaces) - self.load

    def hessian(self, q: np.ndarray) -> np.ndarray:
        parts = ((part.displacement, part.at(q)[2]) for part in self.interfaces)
        return sum(np.tensordot(row, slope @ row, axes=((0, 1), (0, 1))) for row, slope in parts)

    def forces(self, q: np.ndarray) -> dict[str, np.ndarray]:
        return {part.name: part.at(q)[1] for part in self.interfaces}

    def imbalance(self, q: np.ndarray) -> float:
        """Largest component of the gradient over the largest force; moments count as at levers of 1 m."""
        return float(np.abs(self.gradient(q)).max() / max(np.abs(force).max() for force in self.forces(q).values()))


class DenseEquilibrium(NamedTuple):
    """Where the energy is least; forces [element, row] by interface."""

    rotation: float
    coordinates: np.ndarray
    energy: float
    forces: dict[str, np.ndarray]
    imbalance: float


def dense_model(
    reducer: Reducer, errors: dict[str, float], torque: float, carrier_angle: float, orders: tuple[int, ...] = HARMONICS
) -> DenseModel:
    """Return the model of one unit; errors that are not named are zero."""
    groups = spring_groups(reducer, np.array([carrier_angle]), orders)
    load = np.zeros(groups[0].displacement.shape[2])
    load[-1] = torque
    return DenseModel(tuple(interface(reducer, errors, carrier_angle, group) for group in groups), load)


def least_energy(model: DenseModel) -> np.ndarray:
    """Return the coordinates: a trust region finds the neighbourhood, Newton's method ends where rounding is all."""
    stiffness = ((part.stiffness[:, None, None] * part.displacement**2).sum(axis=(0, 1)) for part in model.interfaces)
    unit = sum(stiffness) ** -0.5  # strains all springs of one coordinate by half a joule

    def gradient(x: np.ndarray) -> np.ndarray:
        return unit * model.gradient(unit * x)

    def hessian(x: np.ndarray) -> np.ndarray:
        return np.outer(unit, unit) * model.hessian(unit * x)

    scaled = {"fun": lambda x: model.energy(unit * x), "x0": 0 * unit, "jac": gradient, "hess": hessian}
    x = minimize(**scaled, method="trust-exact", options={"gtol": 1e-8, "maxiter": 200, "max_trust_radius": 1e6}).x
    sizes, path = [np.abs(gradient(x)).max()], [x]
    while len(path) < 500 and (sizes[-1] > 1e-11 or min(sizes[-4:]) < 0.5 * min(sizes[:-4], default=np.inf)):
        slope = gradient(x)
        # Parts that float in their clearances have no stiffness; what is added vanishes with the gradient.
        step, length = np.linalg.solve(hessian(x) + np.clip(sizes[-1], 1e-15, 1e-3) * np.eye(x.size), -slope), 1.0
        if step @ gradient(x + step) > -0.1 * (step @ slope) > 0:
            length = brentq(lambda at, x=x, step=step: step @ gradient(x + at * step), 0.0, 1.0, rtol=1e-3)
        x = x + length * step
        path.append(x)
        sizes.append(np.abs(gradient(x)).max())
    return unit * path[int(np.argmin(sizes))]


def dense_equilibrium(
    reducer: Reducer, errors: dict[str, float], torque: float, carrier_angle: float, orders: tuple[int, ...] = HARMONICS
) -> DenseEquilibrium:
    """Return the equilibrium of one unit at one angle; errors that are not named are zero."""
    model = dense_model(reducer, errors, torque, carrier_angle, orders)
    q = least_energy(model)
    return DenseEquilibrium(float(q[-1]), q, model.energy(q), model.forces(q), model.imbalance(q))

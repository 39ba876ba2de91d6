"""The equivalent model without condensation and without compiled code: all coordinates, one angle, SciPy."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

from tolalloc.equivalent.condensation import spring_groups
from tolalloc.reducer.design import Reducer


def dense_rotation(reducer: Reducer, errors: dict[str, float], torque: float, carrier_angle: float) -> float:
    """Return the carrier rotation [rad] at one angle by minimising the energy in all coordinates."""
    groups = spring_groups(reducer, np.array([carrier_angle]))
    a = np.concatenate([group.displacement[0] for group in groups])
    undisturbed = np.concatenate(
        [group.error[0] @ np.array([errors[name] for name in group.columns]) for group in groups]
    )
    stiffness = np.concatenate([group.stiffness[0] for group in groups])
    pushes_only = np.concatenate([np.full(group.stiffness.shape[1], group.contact == "unilateral") for group in groups])
    # Unknowns in µm and at levers of 30 mm, energy in units that keep the Hessian near one.
    lever = np.where(np.arange(a.shape[1]) >= 0, 1e-6, 0.0)
    rotations = np.flatnonzero(np.abs(a).max(axis=0) < 0.2)
    lever[rotations] /= 0.03
    a, stiffness, force = a * lever, stiffness / 1e10, np.zeros(a.shape[1])
    force[-1] = torque * lever[-1] / 1e10
    scale = 1e12

    def active(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        compression = a @ q + undisturbed
        return compression, np.where(pushes_only & (compression <= 0), 0.0, stiffness)

    def energy(q: np.ndarray) -> float:
        compression, k = active(q)
        return float(0.5 * k @ compression**2 - force @ q) * scale

    def gradient(q: np.ndarray) -> np.ndarray:
        compression, k = active(q)
        return (a.T @ (k * compression) - force) * scale

    def hessian(q: np.ndarray) -> np.ndarray:
        return (a.T * active(q)[1]) @ a * scale

    q = minimize(energy, np.zeros(a.shape[1]), jac=gradient, hess=hessian, method="trust-exact", tol=1e-9).x
    for _ in range(20):  # the contact set is right; Newton's method on it is exact
        q = q - np.linalg.solve(hessian(q), gradient(q))
    return float(q[-1] * lever[-1])

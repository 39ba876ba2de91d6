"""Constants of the implicit time integrators."""

from __future__ import annotations

from dataclasses import dataclass

from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class Integrator:
    """Constants of a one-step integrator of second order, in the form of Arnold and Brüls (2007).

    Parameters
    ----------
    alpha_m, alpha_f
        Weights of the old step's accelerations, algorithmic and true [-].
    beta, gamma
        Newmark's weights of the new acceleration in displacement and in velocity [-].

    Notes
    -----
    The equations of motion hold exactly at every step:
    (1 − αm)·a' + αm·a = (1 − αf)·q̈' + αf·q̈, q' = q + h·q̇ + h²((½ − β)·a + β·a'), q̇' = q̇ + h((1 − γ)·a + γ·a').

    References
    ----------
    Arnold, M. and Brüls, O. (2007), Multibody System Dynamics 18, 185–202.
    """

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    def rates(self, step: float) -> tuple[float, float, float]:
        """Return what a displacement beyond the predicted one adds to a, q̇ and q̈ [1/s², 1/s, 1/s²]."""
        algorithmic = 1 / (self.beta * step**2)
        return algorithmic, self.gamma * step * algorithmic, (1 - self.alpha_m) / (1 - self.alpha_f) * algorithmic


def newmark() -> Integrator:
    """Return Newmark's method of the average acceleration, which takes no energy away."""
    return Integrator(alpha_m=0.0, alpha_f=0.0, beta=0.25, gamma=0.5)


def generalised_alpha(spectral_radius: float) -> Integrator:
    """Return the generalised-α method; a step leaves the spectral radius of an oscillation far too fast for it [-].

    Raises
    ------
    InputError
        A spectral radius outside 0 … 1.

    References
    ----------
    Chung, J. and Hulbert, G. M. (1993), Journal of Applied Mechanics 60, 371–375.
    """
    if not 0.0 <= spectral_radius <= 1.0:
        raise InputError.at("integrator", "spectral_radius", spectral_radius, "0 to 1")
    alpha_m, alpha_f = (2 * spectral_radius - 1) / (spectral_radius + 1), spectral_radius / (spectral_radius + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return Integrator(alpha_m=alpha_m, alpha_f=alpha_f, beta=(gamma + 0.5) ** 2 / 4, gamma=gamma)

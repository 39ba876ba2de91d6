"""How stiff one pin against one tooth is: what every contact law takes, along the whole tooth."""

from __future__ import annotations

from math import exp

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.cycloid.mesh import Angles, path_curvature
from tolalloc.reducers.reducer.design import CycloidStage
from tolalloc.reducers.reducer.stiffness import Stiffness

APPROACH = 2.0 / 3.0
"""Constant of the approach F/c·(ln(cL/F) + 2/3) of pin and tooth: Roark's and Li Lixing's, who write it
2/3 + ln(16·r·ρ/(2a)²) with Hertz's half width a [-]."""


def contact_stiffness(
    stage: CycloidStage, stiffness: Stiffness, pin_angle: Angles
) -> tuple[Float[np.ndarray, "*angles"], Float[np.ndarray, "*angles"]]:
    """Return what `pin_force` takes of pins against the teeth that they meet.

    First of the linear laws the stiffness, of the logarithmic one its scale C; bending in series [N/m]. Then ln(λ/1 m)
    of the logarithmic law [-].
    """
    contact, law = np.full_like(pin_angle, stiffness.pin_contact), stiffness.pin_contact_law
    if law == "table2":
        contact = pin_contact_table2(stage, stiffness.pin_contact, pin_angle)
    log_length = np.log(equivalent_length(stage, pin_angle))
    if law == "logarithmic":
        # A spring in series adds F/k to F/c·ln(cλ/F), which a longer λ does as well.
        log_length = log_length + 2.0 * stiffness.pin_contact / stiffness.pin_bending
    else:
        contact = contact / (1.0 + contact / stiffness.pin_bending)
    return contact, log_length


def pin_contact_table2(stage: CycloidStage, convex_stiffness: float, pin_angle: Angles) -> Float[np.ndarray, "*angles"]:
    """Return K_djk along the tooth: C(ρ−r)/(ρ+r) on the concave part, C on the convex part [N/m].

    With the curvature κ of the pin centre's path it is C/(1 + 2rκ). The printed formula with its signed curvature is
    singular or negative on the convex part for pin radii above about 2.5 mm on an RV-20E, so only the concave part
    follows the print.

    References
    ----------
    liu2020, Table 2 (K_djk).
    """
    return np.asarray(convex_stiffness / (1 + 2 * stage.pin_radius * np.maximum(path_curvature(stage, pin_angle), 0.0)))


def equivalent_length(stage: CycloidStage, pin_angle: Angles) -> Float[np.ndarray, "*angles"]:
    """Return λ = L·exp(2/3) of the approach F/c·ln(cλ/F), theory page equation (30) [m].

    L is the radius of curvature of the path of the pin's centre on the disc: the flank's radius plus r_rp where the
    flank is convex and minus r_rp where it is concave; with Hertz's half width the approach depends on the radii by L
    alone. Near the inflection L grows without bound and the approach only with its logarithm; Rp as the largest length
    is an assumption.
    """
    bend = np.abs(path_curvature(stage, pin_angle))
    return np.asarray(exp(APPROACH) / np.maximum(bend, 1 / stage.pin_circle_radius))


def peak_pressure(
    stage: CycloidStage, contact_modulus: float, pin_angle: Angles, force: Float[np.ndarray, "*angles"]
) -> Float[np.ndarray, "*angles"]:
    """Return Hertz's peak pressure √(F·E*/(πb·R)), R from the pin and the tooth's own curvature where it touches [Pa].

    E* is that of pin and disc, the angle φ that of the pins from the crank direction [rad], the force theirs [N].
    """
    path, pin = path_curvature(stage, pin_angle), stage.pin_radius
    # 1/R = 1/r + 1/ρ with ρ = −1/κ − r of the tooth, convex positive.
    sum_of_curvatures = 1 / pin - path / (1 + pin * path)
    return np.asarray(np.sqrt(force * contact_modulus * sum_of_curvatures / (np.pi * stage.face_width)))

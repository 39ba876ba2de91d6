"""Rows of liu2020's Table 2 as printed, where the model takes another: evidence, not in use."""

from __future__ import annotations

from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.reducer.design import CycloidStage


def mesh_as_printed(contact_ratio: float, sun_virtual_teeth: float, planet_virtual_teeth: float) -> float:
    """Return K_sp as printed, with 0.1551 and per face width: not a stiffness but one per width [N/(mm·µm)]."""
    return (0.75 * contact_ratio + 0.25) / (0.04723 + 0.1551 / sun_virtual_teeth + 0.25791 / planet_virtual_teeth)


def pin_contact_as_printed(
    stage: CycloidStage, elastic_modulus: float, poisson_ratio: float, pin_angle: Float[np.ndarray, "*angles"]
) -> Float[np.ndarray, "*angles"]:
    """Return K_djk as printed, πbE·Rp·S^1.5/(4(1−µ²)(Rp·S^1.5 + 2r_rp·T)), T = K1(1+zp)cos φ − (1+zp·K1²) [N/m].

    Sound where T > 0, on the concave part of the tooth. On the convex part, T < 0, it exceeds that of a flat flank,
    and it is singular or negative where the pin is larger than half the radius of the path of its centre; the model
    then takes `tolalloc.reducers.cycloid.loaded_contact.pin_contact_table2`.
    """
    shortening, pins, cosine = stage.shortening, stage.pin_count, np.cos(pin_angle)
    path = stage.pin_circle_radius * (1 + shortening**2 - 2 * shortening * cosine) ** 1.5
    bend = shortening * (1 + pins) * cosine - (1 + pins * shortening**2)
    flat = pi * stage.face_width * elastic_modulus / (4 * (1 - poisson_ratio**2))
    return np.asarray(flat * path / (path + 2 * stage.pin_radius * bend))

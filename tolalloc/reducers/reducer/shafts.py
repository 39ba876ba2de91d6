"""Crankshafts, discs and carrier as elastic bodies: what each adds to the way of a bearing, strength of materials."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.reading.files import times
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.reducer.stiffness import Material


def _shear_modulus(material: Material) -> float:
    return material.elastic_modulus / (2.0 * (1.0 + material.poisson_ratio))


def shaft_flexibility(
    places: Float[np.ndarray, " place"], span: float, diameter: float, material: Material
) -> Float[np.ndarray, "place place"]:
    """Return how far a solid shaft on two supports moves at every place per force at every place [m/N].

    Places are measured from one support [m]. Euler's bending, and Timoshenko's shear with the factor of a circle,
    6(1+µ)/(7+6µ).

    Examples
    --------
    In the middle of a slender shaft it is l³/(48EJ):

    >>> steel, length, thick = Material(elastic_modulus=206e9, poisson_ratio=0.3), 1.0, 0.01
    >>> found = shaft_flexibility(np.array([0.5]), length, thick, steel)[0, 0]
    >>> f"{found * 48 * 206e9 * pi * thick**4 / 64:.3f}"
    '1.000'
    """
    near, far = np.minimum.outer(places, places), np.maximum.outer(places, places)
    behind = span - far
    bending = near * behind * (span**2 - near**2 - behind**2) / (6.0 * span)
    inertia, area = pi * diameter**4 / 64.0, pi * diameter**2 / 4.0
    factor = 6.0 * (1.0 + material.poisson_ratio) / (7.0 + 6.0 * material.poisson_ratio)
    shear = near * behind / span
    return np.asarray(
        bending / (material.elastic_modulus * inertia) + shear / (factor * _shear_modulus(material) * area)
    )


Millimetres = Annotated[float, Field(gt=0, le=2000), times(MILLIMETRE)]


@dataclass(frozen=True, kw_only=True)
class Crankshaft:
    """A crankshaft between its bearings in the carrier, journals in the middle; table ``[stiffness.crankshaft]``."""

    diameter: Annotated[Millimetres, Field(alias="diameter_mm")]  # That bends, eccentricities left out [m]
    span: Annotated[Millimetres, Field(alias="span_mm")]  # Distance between the middles of its bearings [m]
    # From the planet gear to the middle of the journals: what is twisted [m]
    gear_distance: Annotated[Millimetres, Field(alias="gear_distance_mm")]

    def flexibilities(self, discs: int, spacing: float, material: Material) -> tuple[float, float]:
        """Return what bending adds at each journal alone, and what all journals share [m/N].

        With f11 of a journal under its own force and f12 under another's, journal 1 moves by (f11 − f12)F1 +
        f12(F1 + F2): a spring of its own in series with the journal's bearing, and one in series with those in the
        carrier. Exact for two journals; of three, the means.
        """
        places = self.span / 2.0 + spacing * (np.arange(discs) - (discs - 1) / 2.0)
        if places[0] <= 0.0:
            allowed = f"above {spacing * (discs - 1) / MILLIMETRE:g}, where its outer journals stand"
            raise ValueError(f"crankshaft.span_mm is {self.span / MILLIMETRE:g}; allowed is {allowed}")
        flexibility = shaft_flexibility(places, self.span, self.diameter, material)
        own = float(np.diag(flexibility).mean())
        shared = float(flexibility[~np.eye(discs, dtype=bool)].mean()) if discs > 1 else own
        return own - shared, shared

    def twist(self, material: Material) -> float:
        """Return the angle by which the gear turns against the journals per torque, l/(GJ) [rad/(N·m)]."""
        return self.gear_distance / (_shear_modulus(material) * pi * self.diameter**4 / 32.0)


@dataclass(frozen=True, kw_only=True)
class Pillars:
    """The pillars that join both flanges of a carrier, built in at both ends; table ``[stiffness.pillars]``."""

    count: Annotated[int, Field(ge=2, le=12)]
    radius: Annotated[Millimetres, Field(alias="radius_mm")]  # Radius of the circle that they stand on [m]
    thickness: Annotated[Millimetres, Field(alias="thickness_mm")]  # Across the radius, the way they bend [m]
    width: Annotated[Millimetres, Field(alias="width_mm")]  # Along the radius [m]
    length: Annotated[Millimetres, Field(alias="length_mm")]  # Between the flanges [m]

    def twist(self, material: Material) -> float:
        """Return the angle between the flanges per torque through the pillars [rad/(N·m)]."""
        inertia, area = self.width * self.thickness**3 / 12.0, self.width * self.thickness
        bending = self.length**3 / (12.0 * material.elastic_modulus * inertia)
        shear = self.length / (5.0 / 6.0 * _shear_modulus(material) * area)
        return (bending + shear) / (self.count * self.radius**2)


def bore_flexibility(bore_radius: float, outer_radius: float, width: float, material: Material) -> float:
    """Return how far a bore moves in its disc per force in the plane [m/N].

    Kelvin's force in a plane sheet: (1+µ)(3−µ)/(4πEb)·ln(R/r), from the bore's edge r to the disc's R.
    """
    poisson = material.poisson_ratio
    per_logarithm = (1.0 + poisson) * (3.0 - poisson) / (4.0 * pi * material.elastic_modulus * width)
    return per_logarithm * log(outer_radius / bore_radius)

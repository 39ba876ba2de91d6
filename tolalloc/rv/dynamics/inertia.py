"""Masses and moments of inertia of the moving parts."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.rv.equivalent.kinematics import Coordinates
from tolalloc.rv.reducer.design import Reducer

ASSUMPTIONS = (
    "sun gear and planet gears: solid cylinders of their pitch radius, as wide as a disc; a crankshaft adds nothing to "
    "its planet gear",
    "disc: solid cylinder of the radius Rp − r_rp and its own width; bores are not taken out",
    "carrier: two solid flanges of the radius Rp − r_rp, each as wide as a disc",
    "all parts of steel of one density; the load's inertia turns with the carrier",
)
"""What `inertia_of` supposes, because no source prints a mass."""


@dataclass(frozen=True, kw_only=True)
class Inertia:
    """Masses and moments of inertia of one part of each kind.

    Parameters
    ----------
    sun, planet, disc, carrier
        Masses; the planet's with its crankshaft [kg].
    planet_moment, disc_moment, carrier_moment
        Moments of inertia about their own axes; the carrier's with all that the output turns [kg·m²].

    Raises
    ------
    InputError
        A value that is not positive and finite.
    """

    sun: float
    planet: float
    disc: float
    carrier: float
    planet_moment: float
    disc_moment: float
    carrier_moment: float

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 < value < np.inf:
                raise InputError.at("inertia", name, value, "a positive number")

    def diagonal(self, coordinates: Coordinates) -> Float[np.ndarray, " coordinate"]:
        """Return the mass or moment of inertia of every coordinate [kg, kg·m²]."""
        planet, disc = [self.planet, self.planet, self.planet_moment], [self.disc, self.disc, self.disc_moment]
        carrier = [self.carrier, self.carrier, self.carrier_moment]
        parts = [self.sun, self.sun, *planet * coordinates.crank_count, *disc * coordinates.disc_count, *carrier]
        return np.array(parts)


def inertia_of(reducer: Reducer, density: float = 7850.0, output_inertia: float = 0.0) -> Inertia:
    """Return the inertia of a reducer's parts under `ASSUMPTIONS`.

    Parameters
    ----------
    reducer
        Nominal design.
    density
        Density of all parts [kg/m³].
    output_inertia
        Moment of inertia that the carrier turns besides its own [kg·m²].

    Raises
    ------
    InputError
        A density that is not positive, or a negative output inertia.
    """
    if not 0.0 <= output_inertia < np.inf:
        raise InputError.at("inertia", "output_inertia", output_inertia, "0 or a positive number")
    stage, gears = reducer.cycloid_stage, reducer.first_stage

    def cylinder(radius: float, width: float) -> tuple[float, float]:
        mass = density * pi * radius**2 * width
        return mass, mass * radius**2 / 2

    body = stage.pin_circle_radius - stage.pin_radius
    sun, _ = cylinder(gears.module * gears.sun_teeth / 2, stage.face_width)
    planet, planet_moment = cylinder(gears.module * gears.planet_teeth / 2, stage.face_width)
    disc, disc_moment = cylinder(body, stage.face_width)
    carrier, carrier_moment = cylinder(body, 2 * stage.face_width)
    return Inertia(
        sun=sun,
        planet=planet,
        disc=disc,
        carrier=carrier,
        planet_moment=planet_moment,
        disc_moment=disc_moment,
        carrier_moment=carrier_moment + output_inertia,
    )

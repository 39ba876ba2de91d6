"""Stiffness of every interface: given values, or the empirical formulas of liu2020, Table 2."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, sin

import numpy as np
from jaxtyping import Float

TAPER_ANGLE = radians(80.0)
"""Contact angle of the taper roller bearings that liu2020 puts into K_b [rad]."""


@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """Stiffness of the interfaces [N/m].

    Parameters
    ----------
    sun_support
        K_s, support of the sun gear shaft [N/m].
    gear_mesh
        K_sp, one sun–planet mesh along its line of action [N/m].
    crank_disc_bearing
        K_pd, one bearing between a crank journal and a disc bore [N/m].
    crank_carrier_bearing
        K_b, one bearing between a crankshaft and the carrier [N/m].
    carrier_bearing
        K_ca, the carrier in the housing [N/m].
    pin_contact
        C, one pin against one disc tooth [N/m].
    pin_contact_law
        ``constant``: C at every pin; ``table2``: liu2020's K_djk on the concave part, C on the convex part;
        ``logarithmic``: Hertzian line contact, softer under small forces, C of the flat flank as its scale.
    """

    sun_support: float
    gear_mesh: float
    crank_disc_bearing: float
    crank_carrier_bearing: float
    carrier_bearing: float
    pin_contact: float
    pin_contact_law: str = "constant"


@dataclass(frozen=True, kw_only=True)
class IdentifiedStiffness:
    """Stiffnesses found from measured units, with their standard uncertainty.

    Parameters
    ----------
    source
        Where the values come from.
    values, standard_uncertainty
        Field of `Stiffness` → value and standard uncertainty [N/m].
    notes
        What a reader must know before trusting the values.
    """

    source: str
    values: dict[str, float]
    standard_uncertainty: dict[str, float]
    notes: tuple[str, ...] = ()


def shaft_support(diameter: float, length: float, elastic_modulus: float) -> float:
    """Return K_s = 3π d⁴E/(64 l³), a simply supported shaft loaded at mid-span [N/m].

    Parameters
    ----------
    diameter, length
        Shaft diameter and span [m].
    elastic_modulus
        Young's modulus [Pa].

    References
    ----------
    liu2020, Table 2.
    """
    return 3.0 * pi * diameter**4 * elastic_modulus / (64.0 * length**3)


def roller_bearing(
    loaded_length: float, elastic_modulus: float, poisson_ratio: float, contact_angle: float = radians(90.0)
) -> float:
    """Return K_pd = π(l·n)E/(8(1−µ²)), or K_b with the taper's contact angle of 80° [N/m].

    Parameters
    ----------
    loaded_length
        Roller length times number of rollers, l·n [m].
    elastic_modulus
        Young's modulus [Pa].
    poisson_ratio
        Poisson's ratio µ [-].
    contact_angle
        Angle whose sine divides the stiffness [rad].

    References
    ----------
    liu2020, Table 2.
    """
    return pi * loaded_length * elastic_modulus / (8.0 * (1.0 - poisson_ratio**2) * sin(contact_angle))


def gear_mesh(contact_ratio: float, sun_virtual_teeth: float, planet_virtual_teeth: float, face_width: float) -> float:
    """Return K_sp of one mesh: the single-pair stiffness of ISO 6336-1 times the face width [N/m].

    Notes
    -----
    liu2020 prints 0.1551 for the standard's 0.15551 and leaves the face width out; the value per
    width is in N/(mm·µm), so one millimetre of width gives 1e6 times as much in N/m.

    Parameters
    ----------
    contact_ratio
        Transverse contact ratio ε_α [-].
    sun_virtual_teeth, planet_virtual_teeth
        Virtual numbers of teeth [-].
    face_width
        Common face width [m].

    References
    ----------
    liu2020, Table 2; ISO 6336-1.
    """
    flexibility = 0.04723 + 0.15551 / sun_virtual_teeth + 0.25791 / planet_virtual_teeth
    return (0.75 * contact_ratio + 0.25) / flexibility * (face_width * 1e3) * 1e6


def line_contact(face_width: float, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return C = πbE/(4(1−µ²)), the stiffness of a pin on a flat or convex flank [N/m].

    Parameters
    ----------
    face_width
        Loaded width b [m].
    elastic_modulus
        Young's modulus [Pa].
    poisson_ratio
        Poisson's ratio µ [-].

    References
    ----------
    liu2020, Table 2 (K_djk without its curvature factor).
    """
    return pi * face_width * elastic_modulus / (4.0 * (1.0 - poisson_ratio**2))


def pin_contact_table2(
    convex_stiffness: float,
    shortening: float,
    pin_count: int,
    pin_circle_radius: float,
    pin_radius: float,
    pin_angle: Float[np.ndarray, "..."],
) -> Float[np.ndarray, "..."]:
    """Return K_djk along the tooth: C(ρ−r)/(ρ+r) on the concave part, C on the convex part [N/m].

    Notes
    -----
    The printed formula with its signed curvature term is singular or negative on the convex part for
    pin radii above about 2.5 mm on an RV-20E, so only the concave part (T > 0) follows the print.

    Parameters
    ----------
    convex_stiffness
        C of `line_contact` [N/m].
    shortening
        K1 [-].
    pin_count
        zp [-].
    pin_circle_radius, pin_radius
        Rp and r_rp [m].
    pin_angle
        Angle φ′ of the pin from the crank direction [rad].

    References
    ----------
    liu2020, Table 2 (K_djk).
    """
    cosine = np.cos(pin_angle)
    curvature_term = shortening * (1 + pin_count) * cosine - (1 + pin_count * shortening**2)
    length = pin_circle_radius * (1 + shortening**2 - 2 * shortening * cosine) ** 1.5
    concave = convex_stiffness * length / (length + 2 * pin_radius * np.maximum(curvature_term, 0.0))
    return np.where(curvature_term > 0, concave, convex_stiffness)


def equivalent_length(
    shortening: float,
    pin_count: int,
    pin_circle_radius: float,
    pin_angle: Float[np.ndarray, "..."],
) -> Float[np.ndarray, "..."]:
    """Return L, the radius of curvature of the path of the pin's centre on the disc, at most Rp [m].

    Notes
    -----
    It is the flank's radius plus r_rp where the flank is convex and minus r_rp where it is concave; with Hertz's half
    width the approach of pin and flank depends on the radii by L alone. Near the inflection L grows without bound and
    the approach only with its logarithm; Rp as the largest length is an assumption.

    Parameters
    ----------
    shortening
        K1 [-].
    pin_count
        zp [-].
    pin_circle_radius
        Rp [m].
    pin_angle
        Angle φ′ of the pin from the crank direction [rad].
    """
    cosine = np.cos(pin_angle)
    curvature_term = np.abs(shortening * (1 + pin_count) * cosine - (1 + pin_count * shortening**2))
    length = pin_circle_radius * (1 + shortening**2 - 2 * shortening * cosine) ** 1.5
    return np.asarray(pin_circle_radius * length / np.maximum(length, pin_circle_radius * curvature_term))

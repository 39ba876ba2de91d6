"""Stiffness of every interface: given values, or the empirical formulas of liu2020, Table 2."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, radians, sin

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
    pin_bending
        One pin between its supports, in series with its contact; infinite where it rests in a half groove [N/m].
    """

    sun_support: float
    gear_mesh: float
    crank_disc_bearing: float
    crank_carrier_bearing: float
    carrier_bearing: float
    pin_contact: float
    pin_contact_law: str = "constant"
    pin_bending: float = inf


@dataclass(frozen=True, kw_only=True)
class Material:
    """Elastic constants.

    Parameters
    ----------
    elastic_modulus
        Young's modulus E [Pa].
    poisson_ratio
        Poisson's ratio µ [-].
    """

    elastic_modulus: float
    poisson_ratio: float


def contact_modulus(first: Material, second: Material) -> float:
    """Return E* of two bodies in contact, 1/E* = (1 − µ1²)/E1 + (1 − µ2²)/E2 [Pa]."""
    return 1.0 / sum((1.0 - body.poisson_ratio**2) / body.elastic_modulus for body in (first, second))


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


def line_contact(face_width: float, contact_modulus: float) -> float:
    """Return C = πbE*/2, the stiffness of a pin on a flat or convex flank [N/m].

    Notes
    -----
    liu2020 prints πbE/(4(1−µ²)), which it is for pin and disc of one material.

    Parameters
    ----------
    face_width
        Loaded width b [m].
    contact_modulus
        E* of pin and disc [Pa].

    References
    ----------
    liu2020, Table 2 (K_djk without its curvature factor).
    """
    return pi * face_width * contact_modulus / 2.0


def pin_bending(diameter: float, span: float, elastic_modulus: float) -> float:
    """Return 64/31·48EJ/l³, a solid pin on two supports, its load spread over half the span [N/m].

    Parameters
    ----------
    diameter, span
        Pin diameter and distance l of its supports [m].
    elastic_modulus
        Young's modulus [Pa].

    References
    ----------
    Li Lixing's method, as xi2015 uses it; the factor 31/64 is not printed there [A].
    """
    return 64.0 / 31.0 * 48.0 * elastic_modulus * (pi * diameter**4 / 64.0) / span**3

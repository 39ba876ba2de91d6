"""Table 2 of liu2020 row by row: the printed form under an honest name, and the sound reading where they differ.

The pins' row, K_djk, has its scale C in `rv.reducer.stiffness.line_contact` and its sound reading along the tooth
in `tolalloc.reducers.cycloid.contact_stiffness.pin_contact_table2`. The ledger of all rows is
docs/reference/table-2.md.
Arguments are in SI units: lengths m, forces N, Young's moduli Pa, angles rad; Poisson's ratios µ are 0 up to 0.5.
"""

from __future__ import annotations

from math import pi, radians, sin, sqrt

from tolalloc.reading.units import GIGAPASCAL

TAPER_ANGLE = radians(80.0)
"""Contact angle of the taper roller bearings that liu2020 puts into K_b [rad]."""

GEAR_STEEL = 206.0 * GIGAPASCAL
"""Young's modulus that the numbers in ISO 6336-1's formula belong to [Pa]."""

LARGEST_CONTACT = 0.1
"""Radius of a ball's contact over the ball's radius up to which Hertz's half space stands for the ball [-]."""


def shaft_support(diameter: float, length: float, elastic_modulus: float) -> float:
    """Return K_s = 3π d⁴E/(64 l³) = 3EJ/l³, a shaft clamped at one end and loaded at the other [N/m].

    A shaft on two supports loaded at mid-span would be 48EJ/l³, sixteen times as much. Valid for bending alone: shear
    adds about 0.54(d/l)² of the deflection, 6 % at l = 3d; a reducer file with l below d is refused. The clamp is
    rigid.
    """
    return 3.0 * pi * diameter**4 * elastic_modulus / (64.0 * length**3)


def roller_bearing(
    loaded_length: float, elastic_modulus: float, poisson_ratio: float, contact_angle: float = radians(90.0)
) -> float:
    """Return K_pd = π(l·n)E/(8(1−µ²)), or K_b with the taper's contact angle of 80° [N/m].

    Two line contacts πlE/(4(1−µ²)) in series, one at either ring, times n rollers that all stand in the direction of
    the load. Of n rollers around a bearing, n/2 act so if all are preloaded and n/4 if there is neither preload nor
    play: l·n is the length that acts, not the length that is there. Same steel for rollers and rings. Being linear in
    the force it is stiffer than Hertz's line contact, whose logarithm it leaves out.
    """
    return pi * loaded_length * elastic_modulus / (8.0 * (1.0 - poisson_ratio**2) * sin(contact_angle))


def gear_mesh(
    contact_ratio: float,
    sun_virtual_teeth: float,
    planet_virtual_teeth: float,
    face_width: float,
    elastic_modulus: float,
) -> float:
    """Return K_sp of one mesh: the stiffness of ISO 6336-1 per face width, times the width and E/206 GPa [N/m].

    liu2020 prints 0.1551 for the standard's 0.15551 and leaves the face width out; the value per
    width is in N/(mm·µm), so one millimetre of width gives 1e6 times as much in N/m. The mean over a mesh of gears
    without profile shift under 100 N/mm or more; the standard's factor 0.8 between theory and measurement is left out
    as in the print, and lighter loads are softer still. A reducer file may give contact ratios of 1 to 2.5 and
    virtual teeth from 5.
    """
    flexibility = 0.04723 + 0.15551 / sun_virtual_teeth + 0.25791 / planet_virtual_teeth
    per_width = (0.75 * contact_ratio + 0.25) / flexibility * 1e9
    return per_width * face_width * elastic_modulus / GEAR_STEEL


def ball_coefficient_as_printed(radius: float, balls: int, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return K_ca as printed, E·n·√r_g/(3(1−µ²)): a coefficient c of F = c·δ^1.5, not a stiffness [N/m^1.5].

    Hertz's ball of radius R on a flat of its own steel has F = 2E√R/(3(1−µ²))·δ^1.5. Two such contacts in series, one
    at either race, share δ, so c falls by 2^1.5 to E√R/(3√2(1−µ²)). The print halves as if the law were linear; it is
    n balls between two flat races exactly where r_g is half the ball's radius **[D]**. liu2020 takes the number as
    N/m, which it would be at a compression of 4/9 m.
    """
    return elastic_modulus * balls * sqrt(radius) / (3.0 * (1.0 - poisson_ratio**2))


def ball_bearing(ball_radius: float, balls: int, preload: float, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return the sound K_ca = dF/dδ = 3/2·c^(2/3)·F^(1/3) of F = c·δ^1.5 under a preload F [N/m].

    c is `ball_coefficient_as_printed` with half the ball's radius **[D]**. Small changes around the preload. **[A]**:
    all n balls stand in the direction of the displacement, as in the print, and F is what they carry together; a ring
    of n balls at contact angle α has n/2·cos²α of them. **[A]**: flat races; grooves of 0.515 to 0.53 ball diameters
    make the contact 2.1 to 1.8 times as stiff. Valid up to `largest_preload`, beyond which a reducer file is refused.
    """
    coefficient = ball_coefficient_as_printed(ball_radius / 2.0, balls, elastic_modulus, poisson_ratio)
    return float(1.5 * coefficient ** (2.0 / 3.0) * preload ** (1.0 / 3.0))


def largest_preload(ball_radius: float, balls: int, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return the force at which the contact of a ball with a flat race is a tenth as wide as the ball [N].

    Hertz's contact radius a = (3QR/(4E*))^(1/3) with E* = E/(2(1−µ²)). In steel a fifth of it makes 4.2 GPa, ISO 76's
    static limit for ball bearings.
    """
    contact_modulus = elastic_modulus / (2.0 * (1.0 - poisson_ratio**2))
    return balls * 4.0 / 3.0 * contact_modulus * ball_radius**2 * LARGEST_CONTACT**3

"""Stiffness of every interface: values, how well they are known, what pins are made of, and elastic bodies.

Rows of liu2020's Table 2 stand here for shaft, gears, bearings and the scale C of the pins, the printed form under an
honest name and the sound reading where they differ; the pins' sound reading along the tooth is
`tolalloc.reducers.cycloid.loaded_contact.pin_contact_table2`. The ledger of all rows is docs/reference/table-2.md.
Arguments are in SI units: lengths m, forces N, Young's moduli Pa, angles rad; Poisson's ratios µ are 0 up to 0.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf, log, pi, radians, sin, sqrt
from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.exceptions import InputError
from tolalloc.reading.files import times
from tolalloc.reading.units import GIGAPASCAL, MILLIMETRE

ROUNDING = 1e-9
"""What a correlation may miss of symmetry, of 1 on its diagonal and of no negative eigenvalue [-]."""
TAPER_ANGLE = radians(80.0)
"""Contact angle of the taper roller bearings that liu2020 puts into K_b [rad]."""
GEAR_STEEL = 206.0 * GIGAPASCAL
"""Young's modulus that the numbers in ISO 6336-1's formula belong to [Pa]."""
LARGEST_CONTACT = 0.1
"""Radius of a ball's contact over the ball's radius up to which Hertz's half space stands for the ball [-]."""
Millimetres = Annotated[float, Field(gt=0, le=2000), times(MILLIMETRE)]


@dataclass(frozen=True, kw_only=True)
class Stiffness:
    """Stiffness of the interfaces [N/m]."""

    carrier_bearing: float  # K_ca, the carrier in the housing [N/m]
    pin_contact: float  # C, one pin against one disc tooth [N/m]
    # Of an RV reducer, 0 in a single stage
    sun_support: float = 0.0  # K_s, support of the sun gear shaft [N/m]
    gear_mesh: float = 0.0  # K_sp, one sun–planet mesh along its line of action [N/m]
    crank_disc_bearing: float = 0.0  # K_pd, one crank journal in a disc bore [N/m]
    crank_carrier_bearing: float = 0.0  # K_b, one crankshaft in the carrier [N/m]
    centre_mesh: float = 0.0  # Input pinion with a centre gear, where there is one [N/m]
    # Of a single stage, 0 in an RV reducer
    shaft_support: float = 0.0  # The input shaft in its bearings [N/m]
    eccentric_bearing: float = 0.0  # One eccentric of the shaft in the bore of its disc [N/m]
    output_pin: float = 0.0  # One output pin, with what it bends, against the wall of its hole [N/m]
    # ``constant``: C at every pin; ``table2``: liu2020's K_djk on the concave part, C on the convex part;
    # ``logarithmic``: Hertzian line contact, softer under small forces, C of the flat flank as its scale
    pin_contact_law: str = "constant"
    # One pin between its supports, in series with its contact; infinite where it rests in a half groove [N/m]
    pin_bending: float = inf
    # The ring of pins against what holds it, angles as arcs at the pin circle; infinite where it does not give [N/m]
    ring_along: float = inf
    ring_across: float = inf
    ring_turn: float = inf
    ring_tilt_along: float = inf
    ring_tilt_across: float = inf


@dataclass(frozen=True, kw_only=True)
class Material:
    """Elastic constants; table ``[material]``, and ``[pin_material]`` where the pins are of another one."""

    # Young's modulus E and Poisson's ratio µ [Pa, -]
    elastic_modulus: Annotated[float, Field(alias="elastic_modulus_gpa", ge=10, le=1000), times(GIGAPASCAL)]
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]


def contact_modulus(first: Material, second: Material) -> float:
    """Return E* of two bodies in contact, 1/E* = (1 − µ1²)/E1 + (1 − µ2²)/E2 [Pa].

    References
    ----------
    Hertz's contact of two elastic half spaces.

    Examples
    --------
    >>> steel = Material(elastic_modulus=206e9, poisson_ratio=0.3)
    >>> round(contact_modulus(steel, steel) / 1e9, 2)  # E/(2(1 − µ²)) of one material [GPa]
    113.19
    """
    return 1.0 / sum((1.0 - body.poisson_ratio**2) / body.elastic_modulus for body in (first, second))


@dataclass(frozen=True, kw_only=True, eq=False)
class IdentifiedStiffness:
    """Stiffnesses found from measured units, with their standard uncertainty."""

    source: str  # Where the values come from
    # Field of `Stiffness` → value and standard uncertainty [N/m]
    values: dict[str, float]
    standard_uncertainty: dict[str, float]
    # Correlation of the values in their order; none of them is correlated unless given [-]
    correlation: Float[np.ndarray, "stiffness stiffness"] = field(default_factory=lambda: np.empty((0, 0)))
    notes: tuple[str, ...] = ()  # What a reader must know before trusting the values

    def __post_init__(self) -> None:
        given = self.correlation if self.correlation.size else np.eye(len(self.values))
        object.__setattr__(self, "correlation", checked_correlation(given, tuple(self.values), self.source))

    def __eq__(self, other: object) -> bool:
        """Return whether everything is the same, the order of the stiffnesses included."""
        return isinstance(other, IdentifiedStiffness) and self.content == other.content

    @property
    def content(self) -> tuple[object, ...]:
        """Everything as numbers and names that compare and print in full."""
        values, uncertainty = list(self.values.items()), list(self.standard_uncertainty.items())
        return self.source, values, uncertainty, self.correlation.tolist(), self.notes

    @property
    def covariance(self) -> Float[np.ndarray, "stiffness stiffness"]:
        """Covariance of the relative changes, which to first order is that of ln K, in the order of ``values`` [-]."""
        relative = np.array([self.standard_uncertainty[name] / value for name, value in self.values.items()])
        return np.asarray(self.correlation * np.outer(relative, relative))


def checked_correlation(
    rows: Sequence[Sequence[float]] | Float[np.ndarray, "row column"], names: tuple[str, ...], place: str | Path
) -> Float[np.ndarray, "stiffness stiffness"]:
    """Return the rows as a correlation of the named stiffnesses."""
    size, lengths = len(names), [len(row) for row in rows]
    if lengths != [size] * size:
        allowed = f"{size} rows of {size}, in the order {', '.join(names)}"
        raise InputError.at(place, "correlation, numbers per row,", lengths, allowed)
    matrix = np.array(rows, dtype=float).reshape(size, size)
    for (row, column), value in np.ndenumerate(matrix):
        entry = f"correlation of {names[row]} with {names[column]}"
        if not abs(value) <= 1.0 + ROUNDING:
            raise InputError.at(place, entry, float(value), "-1 to 1")
        if row == column and abs(value - 1.0) > ROUNDING:
            raise InputError.at(place, entry, float(value), "1, that of a stiffness with itself")
        if abs(value - matrix[column, row]) > ROUNDING:
            raise InputError.at(place, entry, float(value), f"{matrix[column, row]:g}, as in the mirrored place")
    smallest = float(np.linalg.eigvalsh(matrix)[0]) if size else 0.0
    if smallest < -ROUNDING:
        allowed = "0 or more, else no such values exist"
        raise InputError.at(place, "smallest eigenvalue of correlation", smallest, allowed)
    return matrix


def line_contact(face_width: float, contact_modulus: float) -> float:
    """Return C = πbE*/2, the stiffness of a pin on a flat or convex flank [N/m].

    liu2020 prints πbE/(4(1−µ²)), which it is for pin and disc of one material.

    References
    ----------
    liu2020, Table 2 (K_djk without its curvature factor).

    Examples
    --------
    >>> round(line_contact(0.010, 113.19e9) / 1e9, 3)  # steel on steel over 10 mm [1e9 N/m]
    1.778
    """
    return pi * face_width * contact_modulus / 2.0


def pin_bending(diameter: float, span: float, elastic_modulus: float) -> float:
    """Return 64/31·48EJ/l³, a solid pin on two supports, its load spread over half the span [N/m].

    References
    ----------
    Li Lixing's method, as xi2015 uses it; the factor 31/64 is not printed there [A].

    f = F·l³/(48EJ)·31/64, J = πd⁴/64; slender, no shear.

    Examples
    --------
    >>> round(pin_bending(0.006, 0.031, 206e9) / 1e6, 1)  # a pin of 6 mm over a span of 31 mm [1e6 N/m]
    43.6
    """
    return 64.0 / 31.0 * 48.0 * elastic_modulus * (pi * diameter**4 / 64.0) / span**3


def shaft_support(diameter: float, length: float, elastic_modulus: float) -> float:
    """Return K_s = 3π d⁴E/(64 l³) = 3EJ/l³, a shaft clamped at one end and loaded at the other [N/m].

    A shaft on two supports loaded at mid-span would be 48EJ/l³, sixteen times as much. Valid for bending alone: shear
    adds about 0.54(d/l)² of the deflection, 6 % at l = 3d; a reducer file with l below d is refused. The clamp is
    rigid.

    References
    ----------
    liu2020, Table 2 (K_s).

    Examples
    --------
    >>> round(shaft_support(0.015, 0.1, 206e9) / 1e6, 3)  # Ø 15 mm, 100 mm long [1e6 N/m]
    1.536
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

    References
    ----------
    liu2020, Table 2 (K_pd and K_b).

    Examples
    --------
    >>> round(roller_bearing(0.1226, 206e9, 0.3) / 1e10, 3)  # l·n of 122.6 mm gives liu2020's K_pd [1e10 N/m]
    1.09
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

    References
    ----------
    ISO 6336-1; liu2020, Table 2 (K_sp).

    K_sp = (0.75ε + 0.25)/(0.04723 + 0.15551/z1 + 0.25791/z2)·b·E/206 GPa, in N/(mm·µm) per width.

    Examples
    --------
    >>> round(gear_mesh(1.6, 16.0, 32.0, 0.010, 206e9) / 1e6, 1)  # 16 and 32 teeth, 10 mm wide [1e6 N/m]
    223.0
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

    References
    ----------
    liu2020, Table 2 (K_ca); Hertz for the contact of a ball with a plane.

    Examples
    --------
    >>> round(ball_coefficient_as_printed(0.003, 30, 206e9, 0.3) / 1e11, 3)  # 30 balls, r_g = 3 mm [1e11 N/m^1.5]
    1.24
    """
    return elastic_modulus * balls * sqrt(radius) / (3.0 * (1.0 - poisson_ratio**2))


def ball_bearing(ball_radius: float, balls: int, preload: float, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return the sound K_ca = dF/dδ = 3/2·c^(2/3)·F^(1/3) of F = c·δ^1.5 under a preload F [N/m].

    c is `ball_coefficient_as_printed` with half the ball's radius **[D]**. Small changes around the preload. **[A]**:
    all n balls stand in the direction of the displacement, as in the print, and F is what they carry together; a ring
    of n balls at contact angle α has n/2·cos²α of them. **[A]**: flat races; grooves of 0.515 to 0.53 ball diameters
    make the contact 2.1 to 1.8 times as stiff. Valid up to `largest_preload`, beyond which a reducer file is refused.

    Examples
    --------
    >>> round(ball_bearing(0.003, 30, 5000.0, 206e9, 0.3) / 1e8, 2)  # 30 balls of radius 3 mm at 5 kN [1e8 N/m]
    5.06
    """
    coefficient = ball_coefficient_as_printed(ball_radius / 2.0, balls, elastic_modulus, poisson_ratio)
    return float(1.5 * coefficient ** (2.0 / 3.0) * preload ** (1.0 / 3.0))


def largest_preload(ball_radius: float, balls: int, elastic_modulus: float, poisson_ratio: float) -> float:
    """Return the force at which the contact of a ball with a flat race is a tenth as wide as the ball [N].

    Hertz's contact radius a = (3QR/(4E*))^(1/3) with E* = E/(2(1−µ²)). In steel a fifth of it makes 4.2 GPa, ISO 76's
    static limit for ball bearings.

    F = n·(4/3)·E*·R²·0.1³.

    References
    ----------
    Hertz for a; the limit of a tenth is an own choice, compared with ISO 76.

    Examples
    --------
    >>> round(largest_preload(0.003, 30, 206e9, 0.3))  # 30 balls of radius 3 mm [N]
    40747
    """
    contact_modulus = elastic_modulus / (2.0 * (1.0 - poisson_ratio**2))
    return balls * 4.0 / 3.0 * contact_modulus * ball_radius**2 * LARGEST_CONTACT**3


def shear_modulus(material: Material) -> float:
    """Return G = E/(2(1 + µ)) [Pa]."""
    return material.elastic_modulus / (2.0 * (1.0 + material.poisson_ratio))


def shaft_flexibility(
    places: Float[np.ndarray, " place"], span: float, diameter: float, material: Material
) -> Float[np.ndarray, "place place"]:
    """Return how far a solid shaft on two supports moves at every place per force at every place [m/N].

    Places are measured from one support [m]. Euler's bending, and Timoshenko's shear with the factor of a circle,
    6(1+µ)/(7+6µ).

    f(a, b) = a·b'·(l² − a² − b'²)/(6·l·E·J) + a·b'/(l·κ·G·A), b' = l − b ≥ 0 the way behind the farther place.

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
        bending / (material.elastic_modulus * inertia) + shear / (factor * shear_modulus(material) * area)
    )


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
        f12(F1 + F2), theory page equation (67): a spring of its own in series with the journal's bearing, and one in
        series with those in the carrier. Exact for two journals; of three, the means. Spacing [m].
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
        return self.gear_distance / (shear_modulus(material) * pi * self.diameter**4 / 32.0)


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
        shear = self.length / (5.0 / 6.0 * shear_modulus(material) * area)
        return (bending + shear) / (self.count * self.radius**2)


def bore_flexibility(bore_radius: float, outer_radius: float, width: float, material: Material) -> float:
    """Return how far a bore moves in its disc per force in the plane [m/N].

    Kelvin's force in a plane sheet: (1+µ)(3−µ)/(4πEb)·ln(R/r), from the bore's edge r to the disc's R.

    References
    ----------
    Kelvin's point force in a sheet (plane stress); the bounds r and R are an own choice, for r well below R.

    f = (1 + µ)(3 − µ)/(4πEb)·ln(R/r).

    Examples
    --------
    >>> f"{bore_flexibility(0.015, 0.052, 0.010, Material(elastic_modulus=206e9, poisson_ratio=0.3)):.2e}"  # [m/N]
    '1.69e-10'
    """
    poisson = material.poisson_ratio
    per_logarithm = (1.0 + poisson) * (3.0 - poisson) / (4.0 * pi * material.elastic_modulus * width)
    return per_logarithm * log(outer_radius / bore_radius)

"""Rolling bearings: radial force of a displaced ring as a sum over its rolling elements, ISO/TS 16281.

With them stand the parts that yield in an interface, and what friction follows from: a coefficient per kind of contact,
and the dimensions of bearings.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import asin, cos, log, pi, sin, sqrt, tan
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float
from pydantic import Field

from tolalloc.exceptions import InputError
from tolalloc.reading.files import times
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.stiffness import Material

Displacement = float | Float[np.ndarray, " displacement"]
"""How far one ring is moved across the other [m]."""
_LINE = 35948.0
"""c_L of a steel roller of 1 mm effective length between both races, ISO/TS 16281 [N/mm^(10/9)]."""

_ROLLERS, _BALLS = 207.9 * 0.83, 39.9 * 0.95
"""Constants of f_c by Lundberg and Palmgren with the reductions that ISO 281 tabulates f_c with [N, mm]."""

_LARGEST = 1e-3
"""Displacement within which every force of a bearing is looked for [m]."""

_KNOTS = 20_000
"""Displacements at which forces are tabulated [-]."""

_STEEL = Material(elastic_modulus=206e9, poisson_ratio=0.3)

Elements = Annotated[int, Field(ge=3, le=200)]
Millimetres = Annotated[float, Field(gt=0, le=500), times(MILLIMETRE)]
Coefficient = Annotated[float, Field(ge=0, le=0.5)]
SLIDING_FRICTION = 0.05
"""Coefficient of a disc that slides on pins in their half grooves, oil between them; an assumption [-]."""
WEAR = 2e-10
"""Volume that either of two lubricated hardened steel surfaces loses over force times sliding way; an assumption, as
mild wear differs by powers of ten [mm³/(N·m)]."""
LARGEST_CONTACT_RATIO = 2.0
"""Contact ratio up to which the friction of a gear mesh is known here [-]."""
CRANK_BEARINGS = ("crank_disc_bearing", "crank_carrier_bearing")
CONTACTS = {
    name: name.replace("_", " ").replace("crank ", "crank–")
    for name in ("pins", *CRANK_BEARINGS, "carrier_bearing", "gear_mesh")
}
"""Kind of contact → its name."""


@dataclass(frozen=True, kw_only=True)
class RollingBearing(ABC):
    """A steel bearing whose rings stay parallel.

    The element at ψ from the displacement δ_r is pressed by (δ_r·cos ψ − s/2)·cos α + δ_a·sin α [m] and carries c times
    that to the exponent [N], theory page equation (65).
    """

    element: ClassVar[str]  # What an element is called
    exponent: ClassVar[float]  # Of the compression of an element [-]
    life_exponent: ClassVar[float]  # p of load rating over load in the basic life, theory page equation (93) [-]

    pitch_diameter: Annotated[Millimetres, Field(alias="pitch_diameter_mm")]  # Of the circle of the elements [m]
    # Internal clearance s, by how much one ring moves across the other, negative for interference, which preloads all
    # elements; contact angle α against the radial plane [m, rad]
    clearance: Annotated[float, Field(alias="clearance_um", ge=-100, le=1000), times(MICROMETRE)] = 0.0
    contact_angle: Annotated[float, Field(alias="contact_angle_deg", ge=0, lt=90), times(DEGREE)] = 0.0
    preload: Annotated[float, Field(alias="preload_n", ge=0, le=1e6)] = 0.0  # Axial force that presses the rings [N]
    rows: Annotated[int, Field(ge=1, le=4)] = 1  # Bearings or rows that share the force alike [-]

    def __post_init__(self) -> None:
        """Raise for elements that overlap or are smaller than their clearance, and for preload of the other kind."""
        fitting = int(pi / asin(min(self.diameter / self.pitch_diameter, 1.0)))
        if self.elements > fitting:
            raise ValueError(f"{self.element}s is {self.elements}; allowed is 3 to {fitting}, else they overlap")
        if self.clearance >= self.diameter:
            allowed = f"below {self.element}_diameter_mm = {self.diameter / MILLIMETRE:g}"
            raise ValueError(f"clearance_um is {self.clearance / MICROMETRE:g}; allowed is {allowed}")
        if self.clearance < 0.0 and self.contact_angle:
            given = f"clearance_um is {self.clearance / MICROMETRE:g}; allowed is 0 or more"
            raise ValueError(f"{given} with a contact_angle_deg, where preload_n presses the elements")
        if self.preload and not self.contact_angle:
            raise ValueError(f"preload_n is {self.preload:g}; allowed is 0 without a contact_angle_deg")

    @property
    def elements(self) -> int:
        """Number Z of elements in a row [-]."""
        return int(getattr(self, f"{self.element}s"))

    @property
    def diameter(self) -> float:
        """Diameter of an element [m]."""
        return float(getattr(self, f"{self.element}_diameter"))

    @property
    @abstractmethod
    def coefficient(self) -> float:
        """Load of an element over its compression to the `exponent` [N/m^exponent]."""

    @property
    @abstractmethod
    def load_rating(self) -> float:
        """Basic dynamic radial load rating C of all rows by ISO 281, theory page equation (92) [N]."""

    @property
    def _slenderness(self) -> float:
        """Element over pitch circle γ = D·cos α/d_m [-]."""
        return self.diameter * cos(self.contact_angle) / self.pitch_diameter

    def life(self, load: float | Float[np.ndarray, "*loads"]) -> Float[np.ndarray, "*loads"]:
        """Return the basic rating life L10 under a load [N] in turns of ring on ring, theory page equation (93) [-]."""
        return np.asarray(1e6 * (self.load_rating / load) ** self.life_exponent)

    @cached_property
    def axial(self) -> float:
        """Axial approach δ_a of the rings under the preload, Z·c·(δ_a·sin α)^n·sin α [m]."""
        if not self.preload:
            return 0.0
        sine = sin(self.contact_angle)
        return float((self.preload / (self.elements * self.coefficient * sine)) ** (1.0 / self.exponent) / sine)

    @property
    def idle_load(self) -> float:
        """What rubs in a row without a force on the rings: the preload, or all elements under interference [N]."""
        return self.preload if self.clearance >= 0.0 else float(self.element_loads(0.0).sum())

    @property
    def _directions(self) -> tuple[float, float]:
        """Directions of an element from the displacement that a turning bearing meets: in it, and two beside it."""
        return 0.0, pi / self.elements

    @property
    def play(self) -> float:
        """How far a ring moves from the middle before an element in its way carries; 0 under preload [m].

        The mean of both directions: between two elements it moves a little farther.
        """
        return sum(self._until_contact(direction) for direction in self._directions) / 2.0

    def _until_contact(self, direction: float) -> float:
        return max(self.clearance / 2.0 - self.axial * tan(self.contact_angle), 0.0) / cos(direction)

    def element_loads(
        self, displacement: Displacement, direction: float = 0.0
    ) -> Float[np.ndarray, "*displacement element"]:
        """Return the load of every element along its contact, one standing at a direction from the displacement [N]."""
        cosine = np.cos(direction + 2.0 * pi * np.arange(self.elements) / self.elements)
        radial = (np.multiply.outer(displacement, cosine) - self.clearance / 2.0) * cos(self.contact_angle)
        pressed = radial + self.axial * sin(self.contact_angle)
        return np.asarray(self.coefficient * np.maximum(pressed, 0.0) ** self.exponent)

    def radial_force(self, displacement: Displacement, direction: float = 0.0) -> Float[np.ndarray, "*displacement"]:
        """Return the force along a displacement [m] from the middle of the play, theory page equation (65) [N]."""
        cosine = np.cos(direction + 2.0 * pi * np.arange(self.elements) / self.elements)
        return np.asarray(self.rows * cos(self.contact_angle) * self.element_loads(displacement, direction) @ cosine)

    def radial_displacement(self, force: float, direction: float = 0.0) -> float:
        """Return the displacement under a radial force [N] [m]."""
        from scipy.optimize import brentq

        if not 0.0 < force < self.radial_force(_LARGEST, direction):
            raise InputError.at("rolling bearing", "radial force [N]", force, "above 0, and what a millimetre gives")
        return float(
            brentq(lambda moved: self.radial_force(moved, direction) - force, 0.0, _LARGEST, xtol=1e-18, rtol=1e-14)
        )

    def compliance(self, force: float) -> float:
        """Return displacement beyond the play over force [N]: 1/K of theory page equation (66), a secant [m/N].

        The mean of the displacements with an element in the direction of the force and with the force between two: a
        turning bearing meets both. It holds at this force, a tenth of which has 79 % of the stiffness with rollers.
        """
        moved = [self.radial_displacement(force, direction) for direction in self._directions]
        return (sum(moved) / 2.0 - self.play) / force

    def ways(self, force: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return the displacement beyond the play under every force, `compliance` times force [m].

        Read off a table, within a ten millionth. Forces are raised to 1/n, because without clearance and preload the
        displacement goes with that.
        """
        raised = force ** (1.0 / self.exponent)
        return np.asarray(sum(np.interp(raised, *curve) for curve in self._curves) / 2.0 - self.play)

    @cached_property
    def _curves(self) -> tuple[tuple[Float[np.ndarray, " knot"], Float[np.ndarray, " knot"]], ...]:
        """Force to 1/n and displacement in both directions [N^(1/n), m]."""
        beyond = np.concatenate([[0.0], np.geomspace(_LARGEST * 1e-9, _LARGEST, _KNOTS)])
        found = []
        for direction in self._directions:
            moved = self._until_contact(direction) + beyond
            found.append((self.radial_force(moved, direction).clip(0.0) ** (1.0 / self.exponent), moved))
        return tuple(found)


@dataclass(frozen=True, kw_only=True)
class RollerBearing(RollingBearing):
    """Cylindrical, needle or tapered rollers: line contact, c_L = 35,948·L^(8/9) N/mm^(10/9), exponent 10/9."""

    element: ClassVar[str] = "roller"
    exponent: ClassVar[float] = 10.0 / 9.0
    life_exponent: ClassVar[float] = 10.0 / 3.0

    rollers: Elements
    roller_diameter: Annotated[Millimetres, Field(alias="roller_diameter_mm")]  # [m]
    roller_length: Annotated[Millimetres, Field(alias="roller_length_mm")]  # Effective length L_we [m]

    @property
    def coefficient(self) -> float:
        """c_L of a roller between both races [N/m^(10/9)]."""
        return float(_LINE * (self.roller_length / MILLIMETRE) ** (8.0 / 9.0) / MILLIMETRE**self.exponent)

    @property
    def load_rating(self) -> float:
        """b_m·f_c·(i·L·cos α)^(7/9)·Z^(3/4)·D^(29/27) with b_m = 1.1, theory page equation (92) [N]."""
        small = self._slenderness
        races = (1.04 * ((1.0 - small) / (1.0 + small)) ** (143.0 / 108.0)) ** 4.5
        geometry = small ** (2.0 / 9.0) * (1.0 - small) ** (29.0 / 27.0) / (1.0 + small) ** 0.25
        factor = _ROLLERS * geometry * (1.0 + races) ** (-2.0 / 9.0)
        carried = (self.rows * self.roller_length / MILLIMETRE * cos(self.contact_angle)) ** (7.0 / 9.0)
        return float(1.1 * factor * carried * self.rollers**0.75 * (self.roller_diameter / MILLIMETRE) ** (29.0 / 27.0))


@dataclass(frozen=True, kw_only=True)
class BallBearing(RollingBearing):
    """Balls in grooves: Hertz's point contact, exponent 3/2, both races together."""

    element: ClassVar[str] = "ball"
    exponent: ClassVar[float] = 1.5
    life_exponent: ClassVar[float] = 3.0

    balls: Elements
    ball_diameter: Annotated[Millimetres, Field(alias="ball_diameter_mm")]  # [m]
    osculation: Annotated[float, Field(gt=0.5, le=1)] = 0.52  # Radius of a groove over the ball's diameter [-]

    @property
    def coefficient(self) -> float:
        """c_P of a ball between both races [N/m^1.5]."""
        small = self._slenderness
        races = (self._race(-small / (1.0 + small)), self._race(small / (1.0 - small)))
        return float(sum(race ** (-2.0 / 3.0) for race in races) ** -1.5)

    @property
    def load_rating(self) -> float:
        """b_m·f_c·(i·cos α)^0.7·Z^(2/3)·D^1.8 with b_m = 1.3, balls up to 25.4 mm, theory page equation (92) [N]."""
        small, groove = self._slenderness, 2.0 * self.osculation
        races = (1.04 * ((1.0 - small) / (1.0 + small)) ** 1.72) ** (10.0 / 3.0)
        geometry = small**0.3 * (1.0 - small) ** 1.39 / (1.0 + small) ** (1.0 / 3.0)
        factor = _BALLS * geometry * (groove / (groove - 1.0)) ** 0.41 * (1.0 + races) ** -0.3
        carried = (self.rows * cos(self.contact_angle)) ** 0.7 * self.balls ** (2.0 / 3.0)
        return float(1.3 * factor * carried * (self.ball_diameter / MILLIMETRE) ** 1.8)

    def _race(self, rolling: float) -> float:
        """Return the coefficient at one race [N/m^1.5].

        Rolling is the race's curvature along its way times the ball's radius. Elliptic integrals by Brewe and Hamrock
        (1977), as Harris gives them, within 3 %.
        """
        radius = self.ball_diameter / 2.0
        along, across = (1.0 + rolling) / radius, (1.0 - 0.5 / self.osculation) / radius
        ratio, total = along / across, along + across
        slenderness = 1.0339 * ratio**0.636
        second, first = 1.0003 + 0.5968 / ratio, 1.5277 + 0.6023 * log(ratio)
        modulus = _STEEL.elastic_modulus / (1.0 - _STEEL.poisson_ratio**2)
        return float(pi * slenderness * modulus) * sqrt(2.0 * second / (9.0 * total * first**3))


@dataclass(frozen=True)
class Part:
    """A part that yields in an interface: a rolling bearing, or a body with a constant compliance."""

    interface: str  # Field of `tolalloc.reducers.reducer.stiffness.Stiffness` that it belongs to
    name: str  # What it is, such as ``carrier twist``
    yields: RollingBearing | float  # The bearing, or what the body yields [m/N]
    stiffer: float = 1.0  # Stiffness over what the dimensions give, where it was identified [-]

    def compliance(self, force: float) -> float:
        """Return the way over the force [m/N]."""
        own = _bearing(self.yields, force) if isinstance(self.yields, RollingBearing) else self.yields
        return own / self.stiffer

    def ways(self, force: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return the way beyond the play under every force [m]."""
        own = self.yields.ways(force) if isinstance(self.yields, RollingBearing) else self.yields * force
        return np.asarray(own / self.stiffer)


@lru_cache(maxsize=256)
def _bearing(bearing: RollingBearing, force: float) -> float:
    """Return what a bearing yields; loops of torque ask the same few forces again and again."""
    return bearing.compliance(force)


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Coefficients of friction; table ``[friction]`` of a reducer file, all assumed unless a file states them.

    Those of bearings are SKF's for M = µ·P·d/2, ordinary lubrication included, of needle rollers, tapered rollers and
    angular-contact balls; d is taken as the pitch diameter, because files state no bore: a fifth more friction.
    """

    # A disc on a pin, or the pin in its groove: whichever slides [-]
    pins: Coefficient = SLIDING_FRICTION
    crank_disc_bearing: Coefficient = 0.0025
    crank_carrier_bearing: Coefficient = 0.0018
    carrier_bearing: Coefficient = 0.0020
    gear_mesh: Coefficient = 0.06  # µ_z, mean over the path of contact [-]
    # Volume that a disc or a pin loses over force times way where they slide, Archard's k [mm³/(N·m)]
    wear_mm3_per_nm: Annotated[float, Field(ge=0, le=1e-4)] = WEAR
    # What seals and grease take at the output whatever the load, where measured; else by a rule, `IdleTorque` [N·m]
    seals: Annotated[float | None, Field(alias="seals_nm", ge=0, le=1e4)] = None
    grease: Annotated[float | None, Field(alias="grease_nm", ge=0, le=1e4)] = None

    @property
    def wear(self) -> float:
        """Archard's k [m³/(N·m)]."""
        return self.wear_mm3_per_nm * MILLIMETRE**3

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficient of every kind of contact [-]."""
        return {name: getattr(self, name) for name in CONTACTS}


@dataclass(frozen=True, kw_only=True)
class FrictionDimensions:
    """Dimensions from which friction follows; none where a file states a stiffness instead."""

    contacts: ClassVar[tuple[str, ...]] = tuple(CONTACTS)  # Kinds of contact that have a coefficient of friction
    has_idle: ClassVar[bool] = True  # Whether seals and grease count where the reducer turns under load

    crank_disc_bearing: RollingBearing | None = None  # One journal's
    crank_carrier_bearing: RollingBearing | None = None  # Both of one crankshaft as rows of one
    carrier_bearing: RollingBearing | None = None
    contact_ratio: float | None = None  # Of a sun–planet mesh [-]

    @property
    def unknown(self) -> tuple[str, ...]:
        """Kinds of contact whose friction does not follow from what the file states."""
        meshes = (value for name, value in vars(self).items() if "contact_ratio" in name)
        bearings = tuple(name for name, value in vars(self).items() if value is None and "contact_ratio" not in name)
        known = all(ratio is not None and ratio <= LARGEST_CONTACT_RATIO for ratio in meshes)
        return bearings if known else (*bearings, "gear_mesh")


def loss_factor(first_teeth: int, second_teeth: int, contact_ratio: float) -> float:
    """Return H_v, friction work over transmitted work and coefficient of spur gears, theory page equation (71) [-].

    Ohlendorf's π(1/z1 + 1/z2)(1 − ε + ε1² + ε2²), 1 ≤ ε ≤ 2, with the path of contact alike before and behind the pitch
    point, ε1 = ε2 = ε/2: that of gears whose profile shift balances the sliding.

    Examples
    --------
    >>> f"{loss_factor(10, 26, 1.5):.3f}"
    '0.272'
    """
    return pi * (1 / first_teeth + 1 / second_teeth) * (1 - contact_ratio + contact_ratio**2 / 2)


def friction_assumptions(friction: Friction, dimensions: FrictionDimensions) -> tuple[str, ...]:
    """Return what the numbers on friction take for granted, and what they leave out."""
    coefficients = ", ".join(f"{CONTACTS[name]} {friction.coefficients[name]:g}" for name in dimensions.contacts)
    unknown = ", ".join(CONTACTS.get(name, name.replace("_", " ")) for name in dimensions.unknown)
    left_out = f"friction of {unknown}: not known, because the file states a stiffness and no dimensions"
    return (
        f"coefficients of friction: {coefficients}; the same at every speed and temperature",
        "friction: Coulomb's, at the forces without friction; no churning of gears and discs, no flanges of rollers",
        *([left_out] if unknown else []),
    )

"""The nominal design of a reducer: what the drawing would say if nothing had an error.

Its interfaces are springs in series: every part adds to the way of a bearing, at the load that it carries.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import cos, lcm, sqrt
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field

from tolalloc.exceptions import InputError
from tolalloc.reading.files import times
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.bearings import Friction, FrictionDimensions, Part
from tolalloc.reducers.reducer.form import PartForm
from tolalloc.reducers.reducer.housing import Housing
from tolalloc.reducers.reducer.stiffness import Material, Stiffness, contact_modulus, line_contact, pin_bending

Teeth = Annotated[int, Field(ge=5, le=1000)]
THERMAL_EXPANSION = 11.5e-6
"""Coefficient α of discs and ring, a usual value of bearing and case-hardened steel; an assumption [1/K]."""
SHIFT_SIGNS = {"plus": 1.0, "minus": -1.0}
"""Convention → sign of its shift here: ``plus`` grinds at Rp + Δr_p (liu2020, song2019), ``minus`` at Rp − Δr_p
(li2018, xi2015). All of them grind with a pin of r_rp + Δr_rp."""
MODIFICATION_CONVENTION = (
    "the discs are ground with a pin of radius r_rp + Δr_rp on a pin circle of radius R_p + Δr_p; a positive "
    "equidistant amount and a negative shift remove material"
)
"""What the signs of these two amounts mean on a drawing."""
ROTATION_CONVENTION = (
    "a positive rotation turns every flank by δ about the axis of the disc towards the middle of its tooth and removes "
    "material on the flanks alone; δ·r_d is its arc at the radius r_d = {radius:g} mm"
)
"""What the sign of the third one means there, the radius in millimetres."""
_PHASES = 2.0 * np.pi * np.arange(64) / 64
_SMALLEST = 1e-3
"""Share of the rated torque whose forces a secant stiffness is taken at for smaller ones [-]."""


@dataclass(frozen=True, kw_only=True)
class FirstStage:
    """Sun gear and planet gears, an involute pair; table ``[first_stage]`` of a reducer file."""

    # Numbers of teeth Z1 and Z2 [-]
    sun_teeth: Teeth
    planet_teeth: Teeth
    # Module m and pressure angle α [m, rad]
    module: Annotated[float, Field(alias="module_mm", ge=0.1, le=20), times(MILLIMETRE)]
    pressure_angle: Annotated[float, Field(alias="pressure_angle_deg", ge=5, le=45), times(DEGREE)]


@dataclass(frozen=True, kw_only=True)
class CycloidStage:
    """Cycloid discs against the ring of pins; table ``[cycloid_stage]``."""

    pin_count: Teeth  # Number zp [-]
    disc_teeth: Teeth  # Number zc = zp − 1 [-]
    # Radius Rp of the circle of pin centres, and r_rp of a pin [m]
    pin_circle_radius: Annotated[float, Field(alias="pin_circle_radius_mm", ge=5, le=1000), times(MILLIMETRE)]
    pin_radius: Annotated[float, Field(alias="pin_radius_mm", ge=0.1, le=50), times(MILLIMETRE)]
    # Crank eccentricity e [m]
    eccentricity: Annotated[float, Field(alias="eccentricity_mm", ge=0.05, le=10), times(MILLIMETRE)]
    # Loaded width b of a disc, and distance between the middle planes of neighbouring discs, in a file b unless given
    # [m]
    face_width: Annotated[float, Field(alias="face_width_mm", ge=0.5, le=200), times(MILLIMETRE)]
    disc_spacing: Annotated[float, Field(alias="disc_spacing_mm", ge=0, le=500), times(MILLIMETRE)] = 0.0
    # Relief c of the teeth at either end of the width, c·(2z/b)² at z from the middle [m]
    crowning: Annotated[float, Field(alias="crowning_um", ge=0, le=100), times(MICROMETRE)] = field(
        default=0.0, repr=False
    )

    @property
    def shortening(self) -> float:
        """Ratio K1 = e·zp/Rp [-]."""
        return self.eccentricity * self.pin_count / self.pin_circle_radius

    @property
    def disc_pitch_radius(self) -> float:
        """Lever r_d = e·zc of the pin forces about the disc centre [m]."""
        return self.eccentricity * self.disc_teeth

    @property
    def flank_ratio(self) -> float:
        """Q = √(1 − K1²), part of a shift that is felt on the flank where cos φ = K1 [-]."""
        return sqrt(1 - self.shortening**2)

    @property
    def smallest_convex_radius(self) -> float:
        """Smallest convex radius of the pin centre's path on the disc [m]; a larger pin undercuts the teeth.

        It stands where the derivative of the curvature, theory page equation (33), vanishes, or else at the tip.
        """
        pins, shortening = self.pin_count, self.shortening
        cosine = max((2 - pins + shortening**2 * (2 * pins - 1)) / (shortening * (1 + pins)), -1.0)
        bend = 1 + pins * shortening**2 - shortening * (1 + pins) * cosine
        return self.pin_circle_radius * sqrt(1 + shortening**2 - 2 * shortening * cosine) ** 3 / bend


def thermal_shift(stage: CycloidStage, warmer: float) -> float:
    """Return the shift that discs warmer than the ring by ΔT [K] have beside that of their grinding, α·R_p·ΔT [m].

    Disc and ring are each of one temperature, α is `THERMAL_EXPANSION`. Of the growth of a disc as a whole,
    α·ΔT·(R_p·cos φ − r_rp − e·cos γ) along a normal, the first term alone is taken: the others are below a tenth of it.

    Own derivation; α is an assumption.
    """
    return THERMAL_EXPANSION * stage.pin_circle_radius * warmer


@dataclass(frozen=True, kw_only=True)
class Modification:
    """Modification of the disc's teeth, theory page equation (34); positive Δr_rp and δ remove material."""

    equidistant: float  # Δr_rp: the grinding pin radius is r_rp + Δr_rp [m]
    shift: float  # Δr_p: the pin circle radius at grinding is Rp + Δr_p [m]
    rotation: float = 0.0  # δ: each flank is turned towards its tooth's middle by δ about the disc's centre [rad]

    @classmethod
    def from_convention(cls, convention: str, equidistant: float, shift: float, rotation: float = 0.0) -> Modification:
        """Return the modification that a source with the convention ``plus`` or ``minus`` prints [m, m, rad]."""
        return cls(equidistant=equidistant, shift=SHIFT_SIGNS[convention] * shift, rotation=rotation)

    def flank_clearance(self, stage: CycloidStage) -> float:
        """Return the nominal gap on the flank where cos φ = K1: Δr_rp − Δr_p·√(1−K1²) + δ·r_d [m].

        It is the smallest gap unless shift or rotation are positive.
        """
        return self.equidistant - self.shift * stage.flank_ratio + self.rotation_clearance(stage)

    def rotation_clearance(self, stage: CycloidStage) -> float:
        """Return the part of the flank clearance that turned flanks leave, δ·r_d [m]."""
        return self.rotation * stage.disc_pitch_radius

    def clearances(self, stage: CycloidStage) -> tuple[float, float, float]:
        """Return rotation, flank and radial clearance, from which `from_clearances` finds the amounts [m]."""
        return self.rotation_clearance(stage), self.flank_clearance(stage), self.radial_clearance

    @property
    def deviations(self) -> dict[str, float]:
        """The amounts as error columns of the model, the equidistant first and the rotation last [m, m, rad]."""
        return {f"modification.{name}": amount for name, amount in vars(self).items()}

    @property
    def radial_clearance(self) -> float:
        """The nominal gap at tooth tip and root, Δr_rp − Δr_p [m]."""
        return self.equidistant - self.shift

    @classmethod
    def from_clearances(cls, flank: float, radial: float, stage: CycloidStage, rotation: float = 0.0) -> Modification:
        """Return the amounts that leave a flank and a radial clearance, of which turned flanks leave some [m].

        F = Δr_rp − q·Δr_p + δ·r_d is the whole clearance of the flank, J = Δr_rp − Δr_p that at tip and root, which
        turned flanks do not change, and R = δ·r_d the rotation clearance, a part of F. So each may be chosen without
        the others: Δr_p = (F − R − J)/(1 − q), Δr_rp = J + Δr_p, δ = R/r_d; theory page equation (35) at φ0 and tip,
        own derivation, first order in the amounts.
        """
        shift = (flank - rotation - radial) / (1 - stage.flank_ratio)
        return cls(equidistant=radial + shift, shift=shift, rotation=rotation / stage.disc_pitch_radius)


@dataclass(frozen=True, kw_only=True)
class NominalClearances:
    """Nominal clearances of the bilateral interfaces of a family, named as in `Stiffness`; table ``[clearances]``."""


@dataclass(frozen=True, kw_only=True)
class Clearances(NominalClearances):
    """Nominal clearance, half the play, of the bilateral interfaces, 0 where there is none; table ``[clearances]``."""

    # Half the normal backlash of a sun–planet mesh [m]
    gear_mesh: Annotated[float, Field(alias="gear_mesh_um", ge=0, le=200), times(MICROMETRE)] = 0.0
    # Radial clearance of a bearing, half its diametral one [m]
    crank_disc_bearing: Annotated[float, Field(alias="crank_disc_bearing_um", ge=0, le=200), times(MICROMETRE)] = 0.0
    crank_carrier_bearing: Annotated[
        float, Field(alias="crank_carrier_bearing_um", ge=0, le=200), times(MICROMETRE)
    ] = 0.0
    carrier_bearing: Annotated[float, Field(alias="carrier_bearing_um", ge=0, le=200), times(MICROMETRE)] = 0.0


@dataclass(frozen=True, kw_only=True)
class Load:
    """Torques on the carrier [N·m]; negative resists the positive direction of rotation. Table ``[load]``."""

    test_torque: Annotated[float, Field(alias="test_torque_nm", ge=-1e5, le=1e5)]
    rated_torque: Annotated[float, Field(alias="rated_torque_nm", gt=0, le=1e5)]
    # What the output turns besides the reducer [kg·m²], and the largest speed of the input [rpm]; for its resonance
    inertia: Annotated[float | None, Field(alias="inertia_kgm2", gt=0, le=1e6)] = None
    input_speed: Annotated[float | None, Field(alias="input_speed_rpm", gt=0, le=1e5)] = None


@dataclass(frozen=True, kw_only=True)
class Catalogue:
    """What a maker's catalogue states of the size, to hold the model against; table ``[catalogue]``."""

    torsional_rigidity: Annotated[
        float, Field(alias="torsional_rigidity_nm_per_arcmin", ge=0.1, le=1e5), times(1 / ARCMINUTE)
    ]  # Torque over twist between 3 % and 100 % of the rated torque [N·m/rad]
    # Largest twist between both directions of 3 % of the rated torque, and largest error over a turn [rad]
    lost_motion: Annotated[float, Field(alias="lost_motion_arcmin", ge=0.05, le=10), times(ARCMINUTE)]
    transmission_error: Annotated[float, Field(alias="transmission_error_arcsec", ge=5, le=600), times(ARCSECOND)]
    # Largest torque that turns it without load, at the output, if the catalogue states one [N·m]
    no_load_torque: Annotated[float | None, Field(alias="no_load_torque_nm", gt=0, le=1e4)] = None


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """Gear meshes of one kind before the cycloid stage."""

    interface: str  # Field of `Stiffness`
    count: int  # Number of meshes [-]
    teeth: tuple[int, int]  # Numbers of teeth of the pair [-]
    contact_ratio: float | None  # Unless the file states a stiffness instead [-]
    lever: float  # Base radius of the gear that is driven or drives the planets [m]
    turns: float  # Its turns against what carries the pair, per turn of the output [-]


@dataclass(frozen=True, kw_only=True)
class Reducer:
    """Nominal design, materials, stiffness and load of one reducer; ``assumptions`` says what no source prints.

    It is that of an RV reducer; those of other families, `tolalloc.reducers.families`, say what is otherwise in them.
    """

    family: ClassVar[str] = "RV"  # Name of the family
    driven_by: ClassVar[str] = "cranks"  # What drives the carrier
    input_count: ClassVar[int] = 2  # Coordinates of sun or shaft; 3 where its rotation is not given [-]
    unmoved: ClassVar[str] = ""  # What of it no equation of motion in time has
    has_half_turn: ClassVar[bool] = True  # Whether half a turn may carry it into itself, as it does no pinion
    is_dimensioned: ClassVar[bool] = False  # Whether dimensions say its preload, even where it has no `parts`
    lacking: ClassVar[str] = ""  # What a reducer of another family lacks, in words

    name: str
    source: str
    crank_count: int
    disc_count: int
    cycloid_stage: CycloidStage
    disc_material: Material
    pin_material: Material
    stiffness: Stiffness
    modification: Modification
    load: Load
    clearances: NominalClearances = field(default_factory=Clearances)
    # Parts that yield in series, of the interfaces whose stiffness follows from dimensions
    parts: tuple[Part, ...] = ()
    housing: Housing = field(default_factory=Housing)
    friction: Friction = field(default_factory=Friction)
    friction_dimensions: FrictionDimensions = field(default_factory=FrictionDimensions)
    catalogue: Catalogue | None = None
    first_stage: FirstStage | None = None  # Sun and planets
    assumptions: tuple[str, ...] = field(default=())
    # Free profile of the flanks, form of measured discs and pins; none unless stated
    form: PartForm | None = field(default=None, repr=False)

    @classmethod
    def of(cls, reducer: Reducer) -> Self:
        """Return a reducer of this family or one made from it.

        Raises
        ------
        InputError
            It is of another one.
        """
        if not isinstance(reducer, cls):
            raise InputError(f"reducer {reducer.name}: {cls.lacking}")
        return reducer

    @property
    def gears(self) -> FirstStage:
        """Sun and planets."""
        if self.first_stage is None:
            raise InputError(
                f"reducer {self.name}: a {self.family} has neither sun nor planets; this needs an RV reducer."
            )
        return self.first_stage

    def clearance_of(self, interface: str) -> float:
        """Return the nominal clearance of an interface, named as in `Stiffness`, 0 where there is none [m]."""
        return float(getattr(self.clearances, interface, 0.0))

    @property
    def drive_count(self) -> int:
        """Number of cranks, or of what else drives the carrier [-]."""
        return self.crank_count

    @property
    def carrier_radius(self) -> float:
        """Radius at which the carrier is driven [m]."""
        return self.crank_circle_radius

    @property
    def crank_circle_radius(self) -> float:
        """Radius a_sp of the circle of crank axes, m(Z1+Z2)/2 [m]."""
        return self.gears.module * (self.gears.sun_teeth + self.gears.planet_teeth) / 2

    @property
    def planet_base_radius(self) -> float:
        """Base radius r_b2 of the planet gear, m·Z2·cos(α)/2 [m]."""
        return self.gears.module * self.gears.planet_teeth * cos(self.gears.pressure_angle) / 2

    @property
    def sun_base_radius(self) -> float:
        """Base radius r_b1 of the sun gear, r_b2·Z1/Z2 [m]."""
        return self.planet_base_radius * self.gears.sun_teeth / self.gears.planet_teeth

    @property
    def contact_modulus(self) -> float:
        """E* of pins and discs [Pa]."""
        return contact_modulus(self.disc_material, self.pin_material)

    def with_face_width(self, width: float) -> Reducer:
        """Return the reducer with discs of another loaded width [m]; the pin contact becomes that of Table 2."""
        return replace(
            self,
            cycloid_stage=replace(self.cycloid_stage, face_width=width),
            stiffness=replace(self.stiffness, pin_contact=line_contact(width, self.contact_modulus)),
        )

    def with_pin_span(self, span: float) -> Reducer:
        """Return the reducer with pins that bend between two supports at a distance [m]."""
        diameter, modulus = 2 * self.cycloid_stage.pin_radius, self.pin_material.elastic_modulus
        return replace(self, stiffness=replace(self.stiffness, pin_bending=pin_bending(diameter, span, modulus)))

    def with_warmer_discs(self, warmer: float) -> Reducer:
        """Return the reducer whose discs are warmer than the ring by so much [K], by the shift of `thermal_shift`."""
        if not warmer:
            return self
        shift = self.modification.shift + thermal_shift(self.cycloid_stage, warmer)
        return replace(self, modification=replace(self.modification, shift=shift))

    def torque_on_carrier(self, asked: float | None, place: str) -> float:
        """Return the torque to use, the test torque unless one is asked for; negative resists the rotation [N·m].

        Commands and files take torques with this sign only, nomenclature page.
        """
        torque, largest = self.load.test_torque if asked is None else asked, 10 * self.load.rated_torque
        if not (is_number(torque) and 0 < abs(torque) <= largest):
            raise InputError.of_argument(place, "torque", torque, f"-{largest:g} to {largest:g} N·m, but not 0")
        return torque

    @property
    def ratio(self) -> float:
        """Turns of the motor's shaft per turn of the carrier, the pin housing fixed, theory page equation (4) [-]."""
        return self.sun_ratio

    @property
    def sun_ratio(self) -> float:
        """Turns of the sun per turn of the carrier, housing fixed, 1 + (Z2/Z1)·zp, theory page equation (4) [-]."""
        return 1.0 + self.gears.planet_teeth / self.gears.sun_teeth * self.cycloid_stage.pin_count

    @property
    def sun_turns(self) -> Fraction:
        """Turns of the sun beyond those of the carrier, per turn of it, exactly [-]."""
        return Fraction(self.gears.planet_teeth * self.cycloid_stage.pin_count, self.gears.sun_teeth)

    @property
    def closing_turns(self) -> int:
        """Turns of the carrier after which every part is where it was [-]."""
        return self.sun_turns.denominator

    @property
    def input_orders(self) -> tuple[float, ...]:
        """Waves per output turn that errors of sun and meshes make [-]."""
        meshes = self.sun_ratio - 1.0
        return (meshes, self.crank_count * meshes)

    @property
    def open_orders(self) -> tuple[float, ...]:
        """Those of `input_orders` that one output turn cuts [-]."""
        return tuple(own for own in self.input_orders if abs(own - round(own)) > 1e-9)

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """Gear meshes before the cycloid stage: sun and planets, where the sun turns by i − 1 seen from the carrier."""
        own = Mesh(
            interface="gear_mesh",
            count=self.crank_count,
            teeth=(self.gears.sun_teeth, self.gears.planet_teeth),
            contact_ratio=self.friction_dimensions.contact_ratio,
            lever=self.sun_base_radius,
            turns=self.sun_ratio - 1.0,
        )
        return (own,)

    @property
    def like_features(self) -> dict[str, int]:
        """Kind of feature of which each has a deviation of its own → their number [-]."""
        return {"": 1, "pin": self.cycloid_stage.pin_count, "tooth": self.cycloid_stage.disc_teeth}

    @property
    def contact_orders(self) -> tuple[int, int]:
        """Waves per output turn that exact parts make: pins with teeth, pins with what drives the carrier [-].

        lcm(n, zp)·zc and lcm(n, n_drive)·zp with n discs, which all meet a pin at once where n divides the number.
        """
        stage, discs = self.cycloid_stage, self.disc_count
        return lcm(discs, stage.pin_count) * stage.disc_teeth, lcm(discs, self.drive_count) * stage.pin_count

    def resolves(self, order: float, angles: int) -> bool:
        """Return whether equally spaced angles of a turn hold a wave onto which none of exact contacts folds."""
        made = (number * own for own in self.contact_orders for number in range(1, 5))
        folded = {abs(own - angles * round(own / angles)) for own in made if own > angles / 2}
        return order < angles / 2 and order not in folded


def interface_forces(reducer: Reducer, torque: float) -> dict[str, float]:
    """Return the mean force in each interface [N] under a torque on the carrier [N·m] by statics alone.

    Without part errors: each crank holds its part of the torque against the carrier and a share of that against every
    disc, beside its share of the disc's pin forces, T/(e·zp) across the crank direction, which turn against it. The
    first stage carries the torque over the ratio; the carrier bearing holds none.

    Crank–carrier T/(n_c·a_sp); crank–disc the mean over φ of |T/(n_c·n_d·a_sp) + e^(iφ)·T/(n_c·n_d·e·zp)|; mesh
    T/(i·n_c·r_b1), that of a centre gear T/(i·r_b4), i that of the sun; T [N·m], 3 to 4 % above the solved mean.

    Theory page equation (66), own derivation: statics of exact parts.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = interface_forces(load_reducer("rv20e_liu2020"), 167.0)
    >>> round(found["crank_carrier_bearing"]), round(found["gear_mesh"])  # two cranks at 27 mm [N]
    (3093, 113)
    """
    size, stage = abs(torque), reducer.cycloid_stage
    crank = size / (reducer.crank_count * reducer.crank_circle_radius)
    tangential = crank / reducer.disc_count
    pins = size / (reducer.disc_count * reducer.crank_count * stage.eccentricity * stage.pin_count)
    return {
        "crank_carrier_bearing": crank,
        "crank_disc_bearing": float(np.abs(tangential + pins * np.exp(1j * _PHASES)).mean()),
        **{own.interface: size / (reducer.sun_ratio * own.count * own.lever) for own in reducer.meshes},
        "sun_support": 0.0,
        "carrier_bearing": 0.0,
    }


def compliances(reducer: Reducer, torque: float) -> dict[str, dict[str, float]]:
    """Return what every part yields by interface [m/N], at the forces of a torque on the carrier [N·m].

    Theory page equation (67), own derivation: secants w(F)/F at the forces of `interface_forces`; below 0.1 % of the
    rated torque those at 0.1 %.

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> found = compliances(load_reducer("rv20e"), 167.0)["crank_carrier_bearing"]
    >>> {part: f"{value:.1e}" for part, value in found.items() if "bear" in part}  # [m/N]
    {'crank–carrier bearings': '1.5e-09'}
    """
    if not reducer.parts:
        return {}
    least = _SMALLEST * reducer.load.rated_torque
    forces = interface_forces(reducer, max(abs(torque), least))
    unloaded = forces["crank_carrier_bearing"] * _SMALLEST
    found: dict[str, dict[str, float]] = {}
    for part in reducer.parts:
        force = forces[part.interface] or unloaded
        found.setdefault(part.interface, {})[part.name] = part.compliance(force)
    return found


def at_torque(reducer: Reducer, torque: float) -> Reducer:
    """Return the reducer with the secant stiffness of its parts at the forces of a torque on the carrier [N·m].

    Theory page equation (67), own derivation: parts in series, 1/K = Σ 1/K_part [m/N].

    Examples
    --------
    >>> from tolalloc.reducers.reducer.files import load_reducer
    >>> design = load_reducer("rv20e")
    >>> found = [at_torque(design, share * 167.0).stiffness.crank_disc_bearing for share in (0.1, 1.0)]
    >>> [round(value / 1e6) for value in found]  # a bearing is softer under a tenth of the force [1e6 N/m]
    [203, 238]
    """
    if not reducer.parts:
        return reducer
    own: dict[str, Any] = {
        interface: 1.0 / sum(parts.values()) for interface, parts in compliances(reducer, torque).items()
    }
    return replace(reducer, stiffness=replace(reducer.stiffness, **own))

"""What may stand in the file of a reducer: what the files of all families state, and the file of an RV reducer."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf, pi
from typing import Annotated, Any, ClassVar, Literal, get_type_hints

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from tolalloc.reading.files import Record, times
from tolalloc.reading.units import ARCMINUTE, MICROMETRE, MICRORADIAN, MILLIMETRE
from tolalloc.reducers.reducer.bearings import (
    BallBearing,
    Friction,
    FrictionDimensions,
    Part,
    RollerBearing,
    RollingBearing,
)
from tolalloc.reducers.reducer.design import (
    Catalogue,
    Clearances,
    CycloidStage,
    FirstStage,
    Load,
    Modification,
    Reducer,
    at_torque,
)
from tolalloc.reducers.reducer.housing import Housing
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reducers.reducer.stiffness import (
    TAPER_ANGLE,
    Crankshaft,
    Material,
    Pillars,
    Stiffness,
    ball_bearing,
    bore_flexibility,
    contact_modulus,
    gear_mesh,
    largest_preload,
    line_contact,
    pin_bending,
    roller_bearing,
    shaft_support,
)

NewtonPerMetre = Annotated[float, Field(ge=1e4, le=1e13)]
_SMALLEST_TWIST, _LARGEST_TWIST = 0.3, 30.0
"""Twist under rated torque that a catalogue's rigidity may mean; RV reducers have 2.9 to 4 [arcmin]."""
Micrometres = Annotated[float, Field(ge=-200, le=200), times(MICROMETRE)]
CROWNING = (
    "the crowning of the teeth affects line load and pressure alone, by slices as stiff as the contact law at the "
    "force of the pin; forces, twist and transmission error are those of the section in the middle over the whole width"
)
"""What is assumed of crowned teeth."""
BOLTED = (
    "the ring is as compliant as its bolts and the cones that they clamp, by a rule of thumb, alike all around; the "
    "bodies behind the flange are left out"
)
"""What is assumed of a ring whose bolts are stated."""


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """Dimensions from which Table 2 of liu2020 gives the support of the sun."""

    diameter: Annotated[float, Field(alias="diameter_mm", gt=0, le=500), times(MILLIMETRE)]  # [m]
    length: Annotated[float, Field(alias="length_mm", gt=0, le=2000), times(MILLIMETRE)]  # [m]

    def __post_init__(self) -> None:
        if self.length < self.diameter:
            raise ValueError(
                f"length_mm is {self.length / MILLIMETRE:g}; allowed is diameter_mm = {self.diameter / MILLIMETRE:g} "
                "or more, because the formula bends the shaft and knows no shear"
            )


@dataclass(frozen=True, kw_only=True)
class Rollers:
    """Roller length times number of rollers, from which Table 2 of liu2020 gives a bearing's stiffness."""

    loaded_length: Annotated[float, Field(alias="loaded_length_mm", gt=0, le=10000), times(MILLIMETRE)]  # [m]


@dataclass(frozen=True, kw_only=True)
class SpurPair:
    """Data of a pair of spur gears from which Table 2 of liu2020, that is ISO 6336-1, gives the mesh stiffness."""

    contact_ratio: Annotated[float, Field(ge=1, le=2.5)]
    face_width: Annotated[float, Field(alias="face_width_mm", gt=0, le=500), times(MILLIMETRE)]  # [m]


@dataclass(frozen=True, kw_only=True)
class GearPair(SpurPair):
    """Data of the gear pair from which Table 2 of liu2020, that is ISO 6336-1, gives the mesh stiffness.

    Virtual teeth that are not given are those of the first stage, as spur gears have them; helical gears have more.
    """

    sun_virtual_teeth: Annotated[float, Field(ge=5)] | None = None
    planet_virtual_teeth: Annotated[float, Field(ge=5)] | None = None

    def of(self, stage: FirstStage) -> GearPair:
        """Return the data with the virtual teeth of every gear, no fewer than it has."""
        found = {}
        for gear, teeth in (("sun", stage.sun_teeth), ("planet", stage.planet_teeth)):
            name = f"{gear}_virtual_teeth"
            found[name] = float(teeth) if getattr(self, name) is None else getattr(self, name)
            if found[name] < teeth:
                raise ValueError(
                    f"stiffness.gear_mesh.{name} is {found[name]:g}; allowed is {gear}_teeth = {teeth} or more, and "
                    "nothing for spur gears"
                )
        return replace(self, **found)


@dataclass(frozen=True, kw_only=True)
class Balls:
    """Data of the carrier's angular-contact bearing from which Hertz's contact gives its stiffness."""

    ball_radius: Annotated[float, Field(alias="ball_radius_mm", ge=0.1, le=50), times(MILLIMETRE)]  # [m]
    balls: Annotated[int, Field(ge=1, le=1000)]
    preload: Annotated[float, Field(alias="preload_n", gt=0, le=1e7)]  # [N]


def _preloaded(ball_radius: float, balls: int, preload: float, **elastic: float) -> float:
    """Return the stiffness of a ball bearing unless the preload is beyond what the balls carry as Hertz says."""
    largest = largest_preload(ball_radius, balls, **elastic)
    if preload > largest:
        raise ValueError(
            f"stiffness.carrier_bearing.preload_n is {preload:g}; allowed is up to {largest:.4g}, where the contacts "
            "are a tenth as wide as the balls"
        )
    return ball_bearing(ball_radius, balls, preload, **elastic)


FORMULAS: Mapping[str, Callable[..., float]] = {
    "sun_support": lambda elastic_modulus, poisson_ratio, **own: shaft_support(**own, elastic_modulus=elastic_modulus),  # noqa: ARG005
    "gear_mesh": lambda elastic_modulus, poisson_ratio, **own: gear_mesh(**own, elastic_modulus=elastic_modulus),  # noqa: ARG005
    "crank_disc_bearing": roller_bearing,
    "crank_carrier_bearing": lambda **own: roller_bearing(**own, contact_angle=TAPER_ANGLE),
    "carrier_bearing": _preloaded,
}
"""Stiffness → its formula, of the dimensions in the file and the elastic constants of the discs."""


def _stated_as(given: object) -> str:
    """Return how a bearing's stiffness is stated, so that messages are about what was meant."""
    if not isinstance(given, Mapping):
        return "number"
    return "table 2" if {"loaded_length_mm", "ball_radius_mm"} & given.keys() else "bearing"


RollerStiffness = Annotated[
    Annotated[NewtonPerMetre, Tag("number")]
    | Annotated[Rollers, Tag("table 2")]
    | Annotated[RollerBearing, Tag("bearing")],
    Discriminator(_stated_as),
]
BallStiffness = Annotated[
    Annotated[NewtonPerMetre, Tag("number")]
    | Annotated[Balls, Tag("table 2")]
    | Annotated[BallBearing, Tag("bearing")],
    Discriminator(_stated_as),
]


class StiffnessRecord(Record):
    """Table ``[stiffness]``: N/m, or the dimensions for the formula; without ``pin_contact`` it is πbE*/2.

    ``pin_span_mm`` is the distance of two supports between which the pins bend; without it they rest in half grooves.
    """

    sun_support: NewtonPerMetre | Shaft
    gear_mesh: NewtonPerMetre | GearPair
    crank_disc_bearing: RollerStiffness
    crank_carrier_bearing: RollerStiffness
    carrier_bearing: BallStiffness
    crankshaft: Crankshaft | None = None
    pillars: Pillars | None = None
    pin_contact: NewtonPerMetre | None = None
    pin_contact_law: Literal["constant", "table2", "logarithmic"] = "constant"
    pin_span_mm: Annotated[float, Field(ge=1, le=500)] | None = None

    def stiffness(self, disc: Material, pin: Material, gears: FirstStage, stage: CycloidStage) -> Stiffness:
        """Return all stiffnesses, given or by formula [N/m]."""
        bearings: dict[str, Any] = {}
        for name, formula in FORMULAS.items():
            own = getattr(self, name)
            if isinstance(own, GearPair):
                own = own.of(gears)
            if isinstance(own, RollingBearing):
                bearings[name] = inf  # its parts say it, at the load that they carry
            else:
                bearings[name] = own if isinstance(own, float) else formula(**vars(own), **vars(disc))
        return Stiffness(
            **bearings,
            pin_contact=self.pin_contact or line_contact(stage.face_width, contact_modulus(disc, pin)),
            pin_contact_law=self.pin_contact_law,
            pin_bending=bending_of_pins(self.pin_span_mm, stage, pin),
        )

    @property
    def friction_dimensions(self) -> FrictionDimensions:
        """Bearings and gears that are given by their dimensions, both bearings of a crankshaft as one."""
        inner, outer, main = self.crank_disc_bearing, self.crank_carrier_bearing, self.carrier_bearing
        return FrictionDimensions(
            crank_disc_bearing=inner if isinstance(inner, RollerBearing) else None,
            crank_carrier_bearing=replace(outer, rows=2 * outer.rows) if isinstance(outer, RollerBearing) else None,
            carrier_bearing=main if isinstance(main, BallBearing) else None,
            contact_ratio=self.gear_mesh.contact_ratio if isinstance(self.gear_mesh, GearPair) else None,
        )

    def parts(self, reducer: Reducer) -> tuple[Part, ...]:
        """Return the parts of the interfaces that yield in series, a given stiffness as one of them."""
        disc, stage, found = reducer.disc_material, reducer.cycloid_stage, list[Part]()
        if isinstance(self.crank_disc_bearing, RollerBearing):
            bearing = self.crank_disc_bearing
            edge = (bearing.pitch_diameter + bearing.diameter) / 2.0
            ring = bore_flexibility(edge, stage.pin_circle_radius, stage.face_width, disc)
            found += [
                Part("crank_disc_bearing", "crank–disc bearing", bearing),
                Part("crank_disc_bearing", "disc", ring),
            ]
        if (both := self.friction_dimensions.crank_carrier_bearing) is not None:
            found.append(Part("crank_carrier_bearing", "crank–carrier bearings", both))
        if isinstance(self.carrier_bearing, BallBearing):
            found.append(Part("carrier_bearing", "carrier bearing", self.carrier_bearing))
        if self.crankshaft:
            own, shared = self.crankshaft.flexibilities(reducer.disc_count, stage.disc_spacing, disc)
            found += [
                Part("crank_disc_bearing", "crank bending, a journal alone", own),
                Part("crank_carrier_bearing", "crank bending, all journals", shared),
                Part("gear_mesh", "crank torsion", reducer.planet_base_radius**2 * self.crankshaft.twist(disc)),
            ]
        if self.pillars:
            # Half the torque goes through the pillars, and a crank lies half on either flange.
            each = reducer.crank_count * reducer.crank_circle_radius**2 / 4.0
            found.append(Part("crank_carrier_bearing", "carrier twist", each * self.pillars.twist(disc)))
        named = {part.interface for part in found}
        given = [name for name in named if not isinstance(getattr(self, name), RollingBearing)]
        found += [Part(name, name.replace("_", " "), 1.0 / getattr(reducer.stiffness, name)) for name in sorted(given)]
        return tuple(found)


def bending_of_pins(span_mm: float | None, stage: CycloidStage, pin: Material) -> float:
    """Return the stiffness of the pins between their supports, infinite without a span [N/m]."""
    if span_mm is None:
        return inf
    return pin_bending(2 * stage.pin_radius, span_mm * MILLIMETRE, pin.elastic_modulus)


def _with_spacing(table: Any) -> Any:
    """Return table ``[cycloid_stage]`` with discs that stand side by side unless it says otherwise."""
    if not isinstance(table, dict) or "face_width_mm" not in table:
        return table
    return {"disc_spacing_mm": table["face_width_mm"], **table}


def _is_a_cycloid(stage: CycloidStage) -> CycloidStage:
    if stage.disc_teeth != stage.pin_count - 1:
        raise ValueError(f"disc_teeth must be pin_count − 1 = {stage.pin_count - 1} (one-tooth difference)")
    if not stage.shortening < 1:
        raise ValueError(f"K1 = eccentricity·pin_count/pin_circle_radius must be below 1 and is {stage.shortening:.3g}")
    half_pitch, convex = stage.pin_circle_radius * pi / stage.pin_count, stage.smallest_convex_radius
    for largest, what in ((half_pitch, "neighbouring pins overlap"), (convex, "pins undercut the teeth")):
        if stage.pin_radius >= largest:
            raise ValueError(f"pin_radius_mm must be below {largest / MILLIMETRE:.3g}, where {what}")
    return stage


class ModificationRecord(Record):
    """Table ``[modification]``; the convention says whether the shift was written Rp + Δr_p or Rp − Δr_p.

    ``profile`` names a CSV file beside it, a free form that is added to the amounts.
    """

    equidistant_um: Micrometres
    shift_um: Micrometres
    rotation_urad: Annotated[float, Field(ge=-5000, le=5000), times(MICRORADIAN)] = 0.0
    convention: Literal["plus", "minus"] = "plus"
    profile: str = ""


class AnyReducerRecord(Record):
    """What the files of all families state."""

    table: ClassVar[str]  # By which a file is known to be of the family
    design: ClassVar[type[Reducer]]  # Of the family

    name: str
    source: str
    disc_count: Annotated[int, Field(ge=1, le=3)]
    cycloid_stage: Annotated[CycloidStage, BeforeValidator(_with_spacing), AfterValidator(_is_a_cycloid)]
    material: Material
    pin_material: Material | None = None
    modification: ModificationRecord
    load: Load
    housing: Housing = Housing()
    friction: Friction = Friction()
    catalogue: Catalogue | None = None
    assumptions: tuple[str, ...] = ()

    @classmethod
    def stiffness_fields(cls) -> Iterable[str]:
        """Return what its table ``[stiffness]`` may hold."""
        table: type[Record] = get_type_hints(cls)["stiffness"]
        return table.model_fields

    @abstractmethod
    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""

    def stated(self) -> dict[str, Any]:
        """Return the fields of the reducer that all families have."""
        given = self.modification
        amounts = given.equidistant_um, given.shift_um, given.rotation_urad
        same = ("name", "source", "disc_count", "cycloid_stage", "load", "friction", "catalogue")
        return {name: getattr(self, name) for name in same} | {
            "disc_material": self.material,
            "pin_material": self.pin_material or self.material,
            "modification": Modification.from_convention(given.convention, *amounts),
            "housing": self.housing,
            "assumptions": (
                *self.assumptions,
                *([CROWNING] if self.cycloid_stage.crowning else []),
                *([BOLTED] if self.housing.bolts else []),
            ),
        }

    def on_ring(self, stiffness: Stiffness) -> Stiffness:
        """Return the stiffnesses with those that hold the ring of pins."""
        springs: dict[str, Any] = self.housing.springs(self.material, self.cycloid_stage.pin_circle_radius)
        return replace(stiffness, **springs)

    def require_catalogue(self, reducer: Reducer) -> None:
        """Raise where a catalogue states a rigidity that no reducer has, or no room for seals and grease."""
        if self.catalogue is None:
            return
        rated, stated = self.load.rated_torque, self.catalogue.torsional_rigidity * ARCMINUTE
        least, most = rated / _LARGEST_TWIST, rated / _SMALLEST_TWIST
        if not least <= stated <= most:
            raise ValueError(
                f"catalogue.torsional_rigidity_nm_per_arcmin is {stated:g}; allowed is {least:.3g} to {most:.3g}, "
                f"a twist of {_SMALLEST_TWIST:g} to {_LARGEST_TWIST:g} arcmin under the rated {rated:g} N·m"
            )
        # Seals, grease and preload alone must leave something of what turns the reducer without load.
        taken, allowed = IdleTorque.of(reducer).together, self.catalogue.no_load_torque
        if allowed is not None and allowed <= taken:
            raise ValueError(
                f"catalogue.no_load_torque_nm is {allowed:g}; allowed is more than {taken:.3g}, which seals, grease "
                "and preloaded rollers take; friction.seals_nm and friction.grease_nm state what they are known to take"
            )


class ReducerRecord(AnyReducerRecord):
    """A whole file of an RV reducer."""

    table = "first_stage"
    design: ClassVar[type[Reducer]] = Reducer

    crank_count: Annotated[int, Field(ge=2, le=6)]
    first_stage: FirstStage
    stiffness: StiffnessRecord
    clearances: Clearances = Clearances()

    @model_validator(mode="after")
    def _holds_together(self) -> ReducerRecord:
        self.require_catalogue(self.reducer())
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        reducer = self.design(
            crank_count=self.crank_count,
            first_stage=self.first_stage,
            stiffness=self._stiffness(),
            friction_dimensions=self.stiffness.friction_dimensions,
            **self.stated(),
        )
        reducer = replace(reducer, parts=self.stiffness.parts(reducer), clearances=self._clearances())
        return at_torque(reducer, reducer.load.rated_torque)

    def _stiffness(self) -> Stiffness:
        disc = self.material
        found = self.stiffness.stiffness(disc, self.pin_material or disc, self.first_stage, self.cycloid_stage)
        return self.on_ring(found)

    def _clearances(self) -> Clearances:
        """Return the clearances, those of bearings that are given by their dimensions included."""
        own: dict[str, float] = {}
        for name in vars(self.clearances):
            bearing = getattr(self.stiffness, name)
            if isinstance(bearing, RollingBearing) and bearing.play:
                if getattr(self.clearances, name):
                    raise ValueError(f"clearances.{name}_um is given twice: the bearing in [stiffness] has one too")
                own[name] = bearing.play
        return replace(self.clearances, **own)

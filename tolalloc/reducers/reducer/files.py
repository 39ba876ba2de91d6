"""Reducers and identified stiffnesses as TOML files, presets by name and the user's own: what may be written there."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf, pi, sin
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import read_text
from tolalloc.reading.files import Record, as_toml, read_toml, shipped_or_path, times, validated, write_new
from tolalloc.reading.units import ARCMINUTE, MICROMETRE, MICRORADIAN, MILLIMETRE
from tolalloc.reducers.reducer.bearings import (
    BallBearing,
    Friction,
    FrictionDimensions,
    Part,
    RollerBearing,
    RollingBearing,
    SingleStageFriction,
)
from tolalloc.reducers.reducer.design import (
    Catalogue,
    CentreGear,
    CentreGearClearances,
    Clearances,
    CycloidStage,
    FirstStage,
    Load,
    Modification,
    OutputPins,
    Reducer,
    SingleStageClearances,
    at_torque,
)
from tolalloc.reducers.reducer.form import PartForm, load_designed
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reducers.reducer.stiffness import (
    TAPER_ANGLE,
    Crankshaft,
    IdentifiedStiffness,
    Material,
    Pillars,
    Stiffness,
    ball_bearing,
    bore_flexibility,
    checked_correlation,
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
PRESETS = Path(__file__).parent / "presets"
Micrometres = Annotated[float, Field(ge=-200, le=200), times(MICROMETRE)]
CROWNING = (
    "the crowning of the teeth is felt by line load and pressure alone, by slices as stiff as the contact law at the "
    "force of the pin; forces, twist and transmission error are those of the section in the middle over the whole width"
)
"""What is assumed of crowned teeth."""
_LARGEST_GAP = 0.5 * MILLIMETRE
"""Gap between an output pin and its hole that is believed; more is another pin or hole [m]."""
_MODIFICATION = re.compile(r"^\[modification\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)


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
            pin_bending=_pin_bending(self.pin_span_mm, stage, pin),
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


class CentreGearStiffnessRecord(StiffnessRecord):
    """Table ``[stiffness]`` with a centre gear; a pinion without ``pinion_support`` stands on a rigid shaft."""

    centre_mesh: NewtonPerMetre | SpurPair
    pinion_support: NewtonPerMetre | Shaft | None = None

    def mesh(self, gear: CentreGear, elastic_modulus: float) -> float:
        """Return the stiffness of pinion and centre gear, given or by formula [N/m]."""
        if isinstance(self.centre_mesh, float):
            return self.centre_mesh
        teeth = (float(gear.pinion_teeth), float(gear.teeth))
        return gear_mesh(self.centre_mesh.contact_ratio, *teeth, self.centre_mesh.face_width, elastic_modulus)

    @property
    def friction_dimensions(self) -> FrictionDimensions:
        """Bearings and gears that are given by their dimensions, the mesh of the centre gear too."""
        known = self.centre_mesh.contact_ratio if isinstance(self.centre_mesh, SpurPair) else None
        return replace(super().friction_dimensions, centre_contact_ratio=known)

    def parts(self, reducer: Reducer) -> tuple[Part, ...]:
        """Return the parts that yield in series, the pinion's shaft along the line of action as one of them."""
        found, shaft = super().parts(reducer), self.pinion_support
        if shaft is None:
            return found
        if not isinstance(shaft, float):
            shaft = shaft_support(**vars(shaft), elastic_modulus=reducer.disc_material.elastic_modulus)
        mesh = Part("centre_mesh", "centre mesh", 1.0 / reducer.stiffness.centre_mesh)
        return (*found, mesh, Part("centre_mesh", "pinion shaft", 1.0 / shaft))


class SingleStageStiffnessRecord(Record):
    """Table ``[stiffness]`` of a single stage: N/m; without ``pin_contact`` it is πbE*/2, and so is ``output_pin``."""

    shaft_support: NewtonPerMetre
    eccentric_bearing: NewtonPerMetre
    carrier_bearing: NewtonPerMetre
    output_pin: NewtonPerMetre | None = None
    pin_contact: NewtonPerMetre | None = None
    pin_contact_law: Literal["constant", "table2", "logarithmic"] = "constant"
    pin_span_mm: Annotated[float, Field(ge=1, le=500)] | None = None

    def stiffness(self, disc: Material, pin: Material, stage: CycloidStage) -> Stiffness:
        """Return all stiffnesses, given or by formula [N/m]."""
        contact = line_contact(stage.face_width, contact_modulus(disc, pin))
        return Stiffness(
            shaft_support=self.shaft_support,
            eccentric_bearing=self.eccentric_bearing,
            carrier_bearing=self.carrier_bearing,
            output_pin=self.output_pin or contact,
            pin_contact=self.pin_contact or contact,
            pin_contact_law=self.pin_contact_law,
            pin_bending=_pin_bending(self.pin_span_mm, stage, pin),
        )


def _pin_bending(span_mm: float | None, stage: CycloidStage, pin: Material) -> float:
    """Return the stiffness of the pins between their supports, infinite without a span [N/m]."""
    if span_mm is None:
        return inf
    return pin_bending(2 * stage.pin_radius, span_mm * MILLIMETRE, pin.elastic_modulus)


class IdentifiedValue(Record):
    """One stiffness and its standard uncertainty."""

    value: NewtonPerMetre
    standard_uncertainty: Annotated[float, Field(ge=0)]

    @model_validator(mode="after")
    def _is_known(self) -> IdentifiedValue:
        # It is read as that of ln K; bounds with a factor of a hundred between them leave 1.3 of the value.
        if self.standard_uncertainty > 2 * self.value:
            raise ValueError(
                f"standard_uncertainty is {self.standard_uncertainty:g} N/m; allowed is twice the value, "
                f"{2 * self.value:g} N/m, or less"
            )
        return self


class IdentifiedStiffnessRecord(Record):
    """A file of identified stiffnesses; ``correlation`` is in the order in which they are listed."""

    source: str
    stiffness: dict[str, IdentifiedValue]
    correlation: tuple[tuple[float, ...], ...] | None = None
    notes: tuple[str, ...] = ()


IDENTIFIABLE = tuple(
    field
    for field in dict.fromkeys((*CentreGearStiffnessRecord.model_fields, *SingleStageStiffnessRecord.model_fields))
    if field not in ("pin_contact_law", "pin_span_mm", "crankshaft", "pillars", "pinion_support")
)
"""Fields of `tolalloc.reducers.reducer.stiffness.Stiffness` that a file of identified stiffnesses may hold."""


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


class _AnyReducerRecord(Record):
    """What the files of all families state."""

    name: str
    source: str
    disc_count: Annotated[int, Field(ge=1, le=3)]
    cycloid_stage: Annotated[CycloidStage, BeforeValidator(_with_spacing), AfterValidator(_is_a_cycloid)]
    material: Material
    pin_material: Material | None = None
    modification: ModificationRecord
    load: Load
    friction: Friction = Friction()
    catalogue: Catalogue | None = None
    assumptions: tuple[str, ...] = ()

    def _stated(self) -> dict[str, Any]:
        """Return the fields of the reducer that all families have."""
        given = self.modification
        amounts = given.equidistant_um, given.shift_um, given.rotation_urad
        same = ("name", "source", "disc_count", "cycloid_stage", "load", "friction", "catalogue")
        return {name: getattr(self, name) for name in same} | {
            "disc_material": self.material,
            "pin_material": self.pin_material or self.material,
            "modification": Modification.from_convention(given.convention, *amounts),
            "assumptions": (*self.assumptions, *([CROWNING] if self.cycloid_stage.crowning else [])),
        }

    def _require_catalogue(self, reducer: Reducer) -> None:
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


class SingleStageRecord(_AnyReducerRecord):
    """A whole file of a single-stage drive, which has a table ``[output_pins]``."""

    output_pins: OutputPins
    stiffness: SingleStageStiffnessRecord
    clearances: SingleStageClearances = SingleStageClearances()

    @model_validator(mode="after")
    def _holds_together(self) -> SingleStageRecord:
        pins, eccentricity = self.output_pins, self.cycloid_stage.eccentricity
        smallest = pins.pin_radius + eccentricity
        if not smallest <= pins.hole_radius <= smallest + _LARGEST_GAP:
            raise ValueError(
                f"output_pins.hole_radius_mm is {pins.hole_radius / MILLIMETRE:g}; allowed is pin_radius_mm plus "
                f"eccentricity_mm, {smallest / MILLIMETRE:.6g}, to {_LARGEST_GAP / MILLIMETRE:g} mm more"
            )
        root = self.cycloid_stage.pin_circle_radius - eccentricity - self.cycloid_stage.pin_radius
        room = min(root - pins.circle_radius, pins.circle_radius * sin(pi / pins.count))
        if pins.hole_radius >= room:
            raise ValueError(
                f"output_pins.hole_radius_mm is {pins.hole_radius / MILLIMETRE:g}; allowed is below "
                f"{room / MILLIMETRE:.4g}, where holes meet each other or the teeth"
            )
        self._require_catalogue(self.reducer())
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        stated = self._stated()
        return Reducer(
            crank_count=0,
            output_pins=self.output_pins,
            stiffness=self.stiffness.stiffness(stated["disc_material"], stated["pin_material"], self.cycloid_stage),
            friction_dimensions=SingleStageFriction(),
            clearances=self.clearances,
            **stated,
        )


class ReducerRecord(_AnyReducerRecord):
    """A whole file of an RV reducer."""

    crank_count: Annotated[int, Field(ge=2, le=6)]
    first_stage: FirstStage
    stiffness: StiffnessRecord
    clearances: Clearances = Clearances()

    @model_validator(mode="after")
    def _holds_together(self) -> ReducerRecord:
        self._require_catalogue(self.reducer())
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        reducer = Reducer(
            crank_count=self.crank_count,
            first_stage=self.first_stage,
            stiffness=self._stiffness(),
            friction_dimensions=self.stiffness.friction_dimensions,
            **self._stated(),
        )
        reducer = replace(reducer, parts=self.stiffness.parts(reducer), clearances=self._clearances())
        return at_torque(reducer, reducer.load.rated_torque)

    def _stiffness(self) -> Stiffness:
        disc = self.material
        return self.stiffness.stiffness(disc, self.pin_material or disc, self.first_stage, self.cycloid_stage)

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


class CentreGearRecord(ReducerRecord):
    """A whole file of an RV reducer with centre gear and hollow shaft, which has a table ``[centre_gear]``."""

    centre_gear: CentreGear
    stiffness: CentreGearStiffnessRecord
    clearances: CentreGearClearances = CentreGearClearances()

    def _stated(self) -> dict[str, Any]:
        return {**super()._stated(), "centre_gear": self.centre_gear}

    def _stiffness(self) -> Stiffness:
        own = self.stiffness.mesh(self.centre_gear, self.material.elastic_modulus)
        return replace(super()._stiffness(), centre_mesh=own)


def load_reducer(name: str | Path) -> Reducer:
    """Return a reducer by preset name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    content = read_toml(path)
    record = validated(_record_of(content), content, path)
    reducer = record.reducer()
    if not record.modification.profile:
        return reducer
    profile = path.parent / record.modification.profile
    said = f"the flanks stand out of the profile of the amounts as {profile.name} states"
    return replace(reducer, form=PartForm(designed=load_designed(profile)), assumptions=(*reducer.assumptions, said))


def _record_of(content: Mapping[str, Any]) -> type[SingleStageRecord] | type[ReducerRecord]:
    """Return what a file must hold: that of a single stage where it has output pins, or that with a centre gear."""
    if "output_pins" in content:
        return SingleStageRecord
    return CentreGearRecord if "centre_gear" in content else ReducerRecord


def write_modified(name: str | Path, modification: Modification, path: Path) -> None:
    """Write a reducer's file again with another modification, everything else of it as it was.

    Raises
    ------
    InputError, UnknownNameError
        The new file is there already or cannot be made, or the old one has no table ``[modification]``.
    """
    source = shipped_or_path(name, PRESETS, ".reducer.toml", "reducer")
    profile = read_toml(source).get("modification", {}).get("profile", "")
    free = f"profile = {as_toml(str((source.parent / profile).resolve()))}\n" if profile else ""
    turned = f"rotation_urad = {as_toml(modification.rotation / MICRORADIAN)}\n" if modification.rotation else ""
    table = (
        "[modification] # pin radius + equidistant, pin circle radius + shift, at grinding\n"
        f"equidistant_um = {as_toml(modification.equidistant / MICROMETRE)}\n"
        f"shift_um = {as_toml(modification.shift / MICROMETRE)}\n"
        f"{turned}{free}"
        'convention = "plus"\n\n'
    )
    text, found = _MODIFICATION.subn(table, read_text(source, "a text file in TOML"))
    if found != 1:
        raise InputError(f"{source}: no table [modification] of its own; without it nothing can be put in its place.")
    content = tomllib.loads(text)
    validated(_record_of(content), content, path)
    write_new(path, text)


def load_identified_stiffness(name: str | Path) -> IdentifiedStiffness:
    """Return identified stiffnesses by shipped name or from the user's TOML file.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    """
    path = shipped_or_path(name, PRESETS, ".stiffness.toml", "stiffness")
    return _identified(read_toml(path), path)


def _identified(data: dict[str, Any], path: Path) -> IdentifiedStiffness:
    """Return the identified stiffnesses of a file's content."""
    record = validated(IdentifiedStiffnessRecord, data, path)
    for field in record.stiffness:
        if field not in IDENTIFIABLE:
            raise InputError.at(path, "stiffness", field, "one of " + ", ".join(IDENTIFIABLE))
    rows = np.eye(len(record.stiffness)) if record.correlation is None else record.correlation
    return IdentifiedStiffness(
        source=record.source,
        values={field: item.value for field, item in record.stiffness.items()},
        standard_uncertainty={field: item.standard_uncertainty for field, item in record.stiffness.items()},
        correlation=checked_correlation(rows, tuple(record.stiffness), path),
        notes=record.notes,
    )


def write_identified_stiffness(identified: IdentifiedStiffness, path: Path) -> None:
    """Write a file that `load_identified_stiffness` reads back equal.

    Raises
    ------
    InputError
        The file is there already or cannot be made, or a value could not be read back.
    """
    lines = [f"source = {as_toml(identified.source)}", "notes = ["]
    lines += [f"  {as_toml(note)}," for note in identified.notes]
    lines += ["]", "correlation = ["]
    lines += [f"  {row}," for row in identified.correlation.tolist()]
    lines += ["]"]
    for field, value in identified.values.items():
        uncertainty = identified.standard_uncertainty[field]
        lines += ["", f"[stiffness.{field}]", f"value = {as_toml(value)}"]
        lines += [f"standard_uncertainty = {as_toml(uncertainty)}"]
    text = "\n".join(lines) + "\n"
    _identified(tomllib.loads(text), path)
    write_new(path, text)


def with_stiffness(reducer: Reducer, identified: IdentifiedStiffness) -> Reducer:
    """Return the reducer with the identified stiffnesses in place of its own."""
    values: dict[str, Any] = dict(identified.values)
    others = tuple(part for part in reducer.parts if part.interface not in values)
    return replace(reducer, stiffness=replace(reducer.stiffness, **values), parts=others)

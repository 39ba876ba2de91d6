"""The nominal single-stage drive, and what its file states."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi, sin
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from tolalloc.reading.files import Record, times
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.bearings import FrictionDimensions
from tolalloc.reducers.reducer.design import CycloidStage, Mesh, NominalClearances, Reducer
from tolalloc.reducers.reducer.records import AnyReducerRecord, NewtonPerMetre, bending_of_pins
from tolalloc.reducers.reducer.stiffness import Material, Stiffness, contact_modulus, line_contact

_LARGEST_GAP = 0.5 * MILLIMETRE
"""Gap between an output pin and its hole that is believed; more is another pin or hole [m]."""


@dataclass(frozen=True, kw_only=True)
class OutputPins:
    """Pins or rollers of the output in holes of the discs; table ``[output_pins]`` of a reducer file."""

    count: Annotated[int, Field(ge=3, le=40)]  # Number n [-]
    # Radius a of the circle that they stand on, r_o of a pin with its roller, R_h of a hole [m]
    circle_radius: Annotated[float, Field(alias="circle_radius_mm", ge=2, le=900), times(MILLIMETRE)]
    pin_radius: Annotated[float, Field(alias="pin_radius_mm", ge=0.1, le=100), times(MILLIMETRE)]
    hole_radius: Annotated[float, Field(alias="hole_radius_mm", ge=0.1, le=200), times(MILLIMETRE)]

    def gap(self, eccentricity: float) -> float:
        """Return the nominal gap that a pin has towards the wall that it drives, R_h − r_o − e [m]."""
        return self.hole_radius - self.pin_radius - eccentricity


@dataclass(frozen=True, kw_only=True)
class SingleStageClearances(NominalClearances):
    """Nominal radial clearances of the bearings of a single stage, half the diametral ones; table ``[clearances]``."""

    eccentric_bearing: Annotated[float, Field(alias="eccentric_bearing_um", ge=0, le=200), times(MICROMETRE)] = 0.0
    carrier_bearing: Annotated[float, Field(alias="carrier_bearing_um", ge=0, le=200), times(MICROMETRE)] = 0.0


@dataclass(frozen=True, kw_only=True)
class SingleStageFriction(FrictionDimensions):
    """Those of a single stage, whose file states no bearing by its dimensions: pins and teeth alone are known."""

    has_idle: ClassVar[bool] = False
    contacts: ClassVar[tuple[str, ...]] = ("pins",)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Kinds of contact whose friction does not follow from what the file states."""
        return ("eccentric_bearing", "output_pin", "carrier_bearing")


@dataclass(frozen=True, kw_only=True)
class SingleStageReducer(Reducer):
    """A single-stage drive: an eccentric shaft, discs, and output pins in their holes."""

    family: ClassVar[str] = "single stage"
    driven_by: ClassVar[str] = "output pins"
    is_dimensioned: ClassVar[bool] = True
    lacking: ClassVar[str] = "an RV reducer has no output pins; this needs a single stage."
    output_pins: OutputPins
    crank_count: int = 0
    clearances: NominalClearances = field(default_factory=SingleStageClearances)

    @property
    def drive_count(self) -> int:
        """Number of output pins [-]."""
        return self.output_pins.count

    @property
    def carrier_radius(self) -> float:
        """Radius of the circle of output pins [m]."""
        return self.output_pins.circle_radius

    @property
    def sun_ratio(self) -> float:
        """Turns of the shaft per turn of the carrier, −zc: it turns against its output [-]."""
        return -float(self.cycloid_stage.disc_teeth)

    @property
    def closing_turns(self) -> int:
        """One turn of the carrier [-]."""
        return 1

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """None: there are no gears."""
        return ()

    @property
    def like_features(self) -> dict[str, int]:
        """Number of features that each have a deviation of their own, of output pins and their holes too [-]."""
        return super().like_features | {"output pin": self.output_pins.count}


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
            pin_bending=bending_of_pins(self.pin_span_mm, stage, pin),
        )


class SingleStageRecord(AnyReducerRecord):
    """A whole file of a single-stage drive, which has a table ``[output_pins]``."""

    table = "output_pins"
    design: ClassVar[type[Reducer]] = SingleStageReducer

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
        self.require_catalogue(self.reducer())
        return self

    def reducer(self) -> Reducer:
        """Return the reducer in SI units."""
        stated = self.stated() | {"output_pins": self.output_pins}
        return self.design(
            stiffness=self.on_ring(
                self.stiffness.stiffness(stated["disc_material"], stated["pin_material"], self.cycloid_stage)
            ),
            friction_dimensions=SingleStageFriction(),
            clearances=self.clearances,
            **stated,
        )

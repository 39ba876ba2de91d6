"""The nominal RV reducer with centre gear and hollow shaft, and what its file states."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import cos, lcm
from typing import Annotated, Any, ClassVar

from pydantic import Field

from tolalloc.reading.files import times
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.reducer.bearings import FrictionDimensions, Part
from tolalloc.reducers.reducer.design import Clearances, Mesh, Reducer, Teeth
from tolalloc.reducers.reducer.records import NewtonPerMetre, ReducerRecord, Shaft, SpurPair, StiffnessRecord
from tolalloc.reducers.reducer.stiffness import Stiffness, gear_mesh, shaft_support


@dataclass(frozen=True, kw_only=True)
class CentreGear:
    """Input pinion and outer toothing of the gear on a hollow shaft that carries the sun; table ``[centre_gear]``."""

    # Numbers of teeth Z3 and Z4 [-]
    pinion_teeth: Teeth
    teeth: Teeth
    # Module and pressure angle of the pair, spur gears [m, rad]
    module: Annotated[float, Field(alias="module_mm", ge=0.1, le=20), times(MILLIMETRE)]
    pressure_angle: Annotated[float, Field(alias="pressure_angle_deg", ge=5, le=45), times(DEGREE)]

    @property
    def base_radius(self) -> float:
        """Base radius r_b4 of the outer toothing, m·Z4·cos(α)/2 [m]."""
        return self.module * self.teeth * cos(self.pressure_angle) / 2


@dataclass(frozen=True, kw_only=True)
class CentreGearClearances(Clearances):
    """Those of an RV reducer with a centre gear; table ``[clearances]``."""

    # Half the normal backlash of input pinion and centre gear [m]
    centre_mesh: Annotated[float, Field(alias="centre_mesh_um", ge=0, le=200), times(MICROMETRE)] = 0.0


@dataclass(frozen=True, kw_only=True)
class CentreGearFriction(FrictionDimensions):
    """Dimensions from which friction follows, those of the centre gear's mesh too."""

    centre_contact_ratio: float | None = None  # Of input pinion and centre gear [-]


@dataclass(frozen=True, kw_only=True)
class CentreGearReducer(Reducer):
    """An RV reducer whose sun is the second toothing of a centre gear, which a pinion of the motor drives."""

    family: ClassVar[str] = "RV centre gear"
    input_count: ClassVar[int] = 3
    unmoved: ClassVar[str] = "a centre gear"
    has_half_turn: ClassVar[bool] = False
    lacking: ClassVar[str] = "there is no centre gear; this needs a table [centre_gear]."
    centre_gear: CentreGear
    friction_dimensions: CentreGearFriction = field(default_factory=CentreGearFriction)

    @property
    def ratio(self) -> float:
        """Turns of the motor per turn of the carrier, −Z4/Z3 times the sun's, theory page equation (100) [-]."""
        return -self.sun_ratio * self.centre_gear.teeth / self.centre_gear.pinion_teeth

    @property
    def closing_turns(self) -> int:
        """Turns of the carrier after which sun and pinion are where they were [-]."""
        motor = (1 + self.sun_turns) * Fraction(self.centre_gear.teeth, self.centre_gear.pinion_teeth)
        return lcm(self.sun_turns.denominator, motor.denominator)

    @property
    def input_orders(self) -> tuple[float, ...]:
        """Waves per output turn that errors of the gears make, those of centre gear and pinion in the housing [-]."""
        return (*super().input_orders, self.sun_ratio, abs(self.ratio))

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """Those of sun and planets, and that of pinion and centre gear."""
        gear = self.centre_gear
        own = Mesh(
            interface="centre_mesh",
            count=1,
            teeth=(gear.pinion_teeth, gear.teeth),
            contact_ratio=self.friction_dimensions.centre_contact_ratio,
            lever=gear.base_radius,
            turns=self.sun_ratio,
        )
        return (*super().meshes, own)


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
    def friction_dimensions(self) -> CentreGearFriction:
        """Bearings and gears that are given by their dimensions, the mesh of the centre gear too."""
        known = self.centre_mesh.contact_ratio if isinstance(self.centre_mesh, SpurPair) else None
        return CentreGearFriction(**vars(super().friction_dimensions), centre_contact_ratio=known)

    def parts(self, reducer: Reducer) -> tuple[Part, ...]:
        """Return the parts that yield in series, the pinion's shaft along the line of action as one of them."""
        found, shaft = super().parts(reducer), self.pinion_support
        if shaft is None:
            return found
        if not isinstance(shaft, float):
            shaft = shaft_support(**vars(shaft), elastic_modulus=reducer.disc_material.elastic_modulus)
        mesh = Part("centre_mesh", "centre mesh", 1.0 / reducer.stiffness.centre_mesh)
        return (*found, mesh, Part("centre_mesh", "pinion shaft", 1.0 / shaft))


class CentreGearRecord(ReducerRecord):
    """A whole file of an RV reducer with centre gear and hollow shaft, which has a table ``[centre_gear]``."""

    table = "centre_gear"
    design: ClassVar[type[Reducer]] = CentreGearReducer

    centre_gear: CentreGear
    stiffness: CentreGearStiffnessRecord
    clearances: CentreGearClearances = CentreGearClearances()

    def stated(self) -> dict[str, Any]:
        """Return the fields of the reducer that all families have, and the centre gear."""
        return {**super().stated(), "centre_gear": self.centre_gear}

    def _stiffness(self) -> Stiffness:
        own = self.stiffness.mesh(self.centre_gear, self.material.elastic_modulus)
        return replace(super()._stiffness(), centre_mesh=own)

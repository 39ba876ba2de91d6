"""The stiffness in a reducer file and in a file of identified stiffnesses: what may be written there."""

from __future__ import annotations

from math import inf
from typing import Annotated, Literal

from pydantic import Field, model_validator

from tolalloc.files import Record
from tolalloc.rv.reducer.design import CycloidStage
from tolalloc.rv.reducer.stiffness import Material, Stiffness, contact_modulus, line_contact, pin_bending
from tolalloc.rv.reducer.table2 import (
    TAPER_ANGLE,
    ball_bearing,
    gear_mesh,
    largest_preload,
    roller_bearing,
    shaft_support,
)
from tolalloc.units import MILLIMETRE

NewtonPerMetre = Annotated[float, Field(ge=1e4, le=1e13)]


class ShaftRecord(Record):
    """Dimensions from which Table 2 of liu2020 gives the support of the sun."""

    diameter_mm: Annotated[float, Field(gt=0, le=500)]
    length_mm: Annotated[float, Field(gt=0, le=2000)]

    @model_validator(mode="after")
    def _bends(self) -> ShaftRecord:
        if self.length_mm < self.diameter_mm:
            raise ValueError(
                f"length_mm is {self.length_mm:g}; allowed is diameter_mm = {self.diameter_mm:g} or more, because the "
                "formula bends the shaft and knows no shear"
            )
        return self


class BearingRecord(Record):
    """Roller length times number of rollers, from which Table 2 of liu2020 gives a bearing's stiffness."""

    loaded_length_mm: Annotated[float, Field(gt=0, le=10000)]


class MeshRecord(Record):
    """Data of the gear pair from which Table 2 of liu2020, that is ISO 6336-1, gives the mesh stiffness."""

    contact_ratio: Annotated[float, Field(ge=1, le=2.5)]
    sun_virtual_teeth: Annotated[float, Field(ge=5)]
    planet_virtual_teeth: Annotated[float, Field(ge=5)]
    face_width_mm: Annotated[float, Field(gt=0, le=500)]


class BallRecord(Record):
    """Data of the carrier's angular-contact bearing from which Hertz's contact gives its stiffness."""

    ball_radius_mm: Annotated[float, Field(ge=0.1, le=50)]
    balls: Annotated[int, Field(ge=1, le=1000)]
    preload_n: Annotated[float, Field(gt=0, le=1e7)]

    def stiffness(self, material: Material) -> float:
        """Return the stiffness under the preload [N/m].

        Raises
        ------
        ValueError
            The preload is beyond what the balls carry as Hertz says.
        """
        radius, elastic = self.ball_radius_mm * MILLIMETRE, (material.elastic_modulus, material.poisson_ratio)
        largest = largest_preload(radius, self.balls, *elastic)
        if self.preload_n > largest:
            raise ValueError(
                f"stiffness.carrier_bearing.preload_n is {self.preload_n:g}; allowed is up to {largest:.4g}, where the "
                "contacts are a tenth as wide as the balls"
            )
        return ball_bearing(radius, self.balls, self.preload_n, *elastic)


class StiffnessRecord(Record):
    """Table ``[stiffness]``: N/m, or the dimensions for the formula; without ``pin_contact`` it is πbE*/2.

    ``pin_span_mm`` is the distance of two supports between which the pins bend; without it they rest in half grooves.
    """

    sun_support: NewtonPerMetre | ShaftRecord
    gear_mesh: NewtonPerMetre | MeshRecord
    crank_disc_bearing: NewtonPerMetre | BearingRecord
    crank_carrier_bearing: NewtonPerMetre | BearingRecord
    carrier_bearing: NewtonPerMetre | BallRecord
    pin_contact: NewtonPerMetre | None = None
    pin_contact_law: Literal["constant", "table2", "logarithmic"] = "constant"
    pin_span_mm: Annotated[float, Field(ge=1, le=500)] | None = None

    def stiffness(self, disc: Material, pin: Material, stage: CycloidStage) -> Stiffness:
        """Return all stiffnesses, given or by formula [N/m]."""
        modulus, poisson = disc.elastic_modulus, disc.poisson_ratio
        sun, mesh, carrier = self.sun_support, self.gear_mesh, self.carrier_bearing
        journal, crank = self.crank_disc_bearing, self.crank_carrier_bearing
        if isinstance(sun, ShaftRecord):
            sun = shaft_support(sun.diameter_mm * MILLIMETRE, sun.length_mm * MILLIMETRE, modulus)
        if isinstance(mesh, MeshRecord):
            teeth, width = (mesh.sun_virtual_teeth, mesh.planet_virtual_teeth), mesh.face_width_mm * MILLIMETRE
            mesh = gear_mesh(mesh.contact_ratio, *teeth, width, modulus)
        if isinstance(journal, BearingRecord):
            journal = roller_bearing(journal.loaded_length_mm * MILLIMETRE, modulus, poisson)
        if isinstance(crank, BearingRecord):
            crank = roller_bearing(crank.loaded_length_mm * MILLIMETRE, modulus, poisson, TAPER_ANGLE)
        if isinstance(carrier, BallRecord):
            carrier = carrier.stiffness(disc)
        return Stiffness(
            sun_support=sun,
            gear_mesh=mesh,
            crank_disc_bearing=journal,
            crank_carrier_bearing=crank,
            carrier_bearing=carrier,
            pin_contact=self.pin_contact or line_contact(stage.face_width, contact_modulus(disc, pin)),
            pin_contact_law=self.pin_contact_law,
            pin_bending=inf
            if self.pin_span_mm is None
            else pin_bending(2 * stage.pin_radius, self.pin_span_mm * MILLIMETRE, pin.elastic_modulus),
        )


class IdentifiedValue(Record):
    """One stiffness and its standard uncertainty."""

    value: NewtonPerMetre
    standard_uncertainty: Annotated[float, Field(ge=0)]


class IdentifiedStiffnessRecord(Record):
    """A file of identified stiffnesses; ``correlation`` is in the order in which they are listed."""

    source: str
    stiffness: dict[str, IdentifiedValue]
    correlation: tuple[tuple[float, ...], ...] | None = None
    notes: tuple[str, ...] = ()


IDENTIFIABLE = tuple(field for field in StiffnessRecord.model_fields if field not in ("pin_contact_law", "pin_span_mm"))
"""Fields of `tolalloc.rv.reducer.stiffness.Stiffness` that a file of identified stiffnesses may hold."""

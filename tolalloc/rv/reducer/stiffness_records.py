"""The stiffness in a reducer file and in a file of identified stiffnesses: what may be written there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Annotated, Any, Literal

from pydantic import Field

from tolalloc.files import Record, times
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
class GearPair:
    """Data of the gear pair from which Table 2 of liu2020, that is ISO 6336-1, gives the mesh stiffness."""

    contact_ratio: Annotated[float, Field(ge=1, le=2.5)]
    sun_virtual_teeth: Annotated[float, Field(ge=5)]
    planet_virtual_teeth: Annotated[float, Field(ge=5)]
    face_width: Annotated[float, Field(alias="face_width_mm", gt=0, le=500), times(MILLIMETRE)]  # [m]


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


class StiffnessRecord(Record):
    """Table ``[stiffness]``: N/m, or the dimensions for the formula; without ``pin_contact`` it is πbE*/2.

    ``pin_span_mm`` is the distance of two supports between which the pins bend; without it they rest in half grooves.
    """

    sun_support: NewtonPerMetre | Shaft
    gear_mesh: NewtonPerMetre | GearPair
    crank_disc_bearing: NewtonPerMetre | Rollers
    crank_carrier_bearing: NewtonPerMetre | Rollers
    carrier_bearing: NewtonPerMetre | Balls
    pin_contact: NewtonPerMetre | None = None
    pin_contact_law: Literal["constant", "table2", "logarithmic"] = "constant"
    pin_span_mm: Annotated[float, Field(ge=1, le=500)] | None = None

    def stiffness(self, disc: Material, pin: Material, stage: CycloidStage) -> Stiffness:
        """Return all stiffnesses, given or by formula [N/m]."""
        bearings: dict[str, Any] = {}
        for name, formula in FORMULAS.items():
            own = getattr(self, name)
            bearings[name] = own if isinstance(own, float) else formula(**vars(own), **vars(disc))
        return Stiffness(
            **bearings,
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

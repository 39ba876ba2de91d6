"""What one family of reducers is: spring groups, sources, its picture, and what a new folder starts from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

from tolalloc.reducers.equivalent.interfaces import Interface
from tolalloc.reducers.equivalent.sources import ErrorSource, ErrorSources
from tolalloc.reducers.equivalent.springs import AtAngles, Positions, SpringGroup
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.records import AnyReducerRecord


@dataclass(frozen=True, kw_only=True)
class Place:
    """A feature of a part that the picture shows and that sources of the drawing limit."""

    id: str  # Name of the feature, the beginning of its sources' names where they share one
    label: str  # What a reader calls it
    part: str  # Part that carries it
    sources: tuple[str, ...] = ()  # Names of the drawing's sources that sit there


HOUSING_PLACES = (
    Place(id="housing.pins", label="places of the pins in the housing", part="housing"),
    Place(id="housing.grooves", label="grooves of the pins", part="housing"),
    Place(id="pins", label="pins", part="pins"),
)
"""Of the housing with its pins, which all families have."""


@dataclass(frozen=True, kw_only=True)
class NewRows:
    """What a new folder starts from: presets, allowed counts, and the table whose zones are scaled."""

    presets: tuple[str, ...]  # Presets whose dimensions follow one rule, smallest first
    cranks: tuple[int, ...]  # Counts that a folder can be made for, none where the family has no cranks [-]
    discs: tuple[int, ...]
    table: str  # Tolerance table that is scaled, and that states the clearances of its modification
    diameter: float  # Of the pin circle to which the table belongs [mm]
    lost_motion: float  # Limit that its first study asks for [arcmin]
    priced: tuple[str, str, str]  # Patterns of sources that the sample of process costs prices
    schema: str  # Kind of its reducer files
    title: str  # What they are called
    stiffer: str  # Stiffness whose true value the simulated bench differs in, a field of `Stiffness`


def first_tooth(teeth: int, others: int, direction: float) -> float:
    """Return where the first tooth of a gear stands that meshes with another, such as the sun, from a direction [rad].

    The gear has the number of others, the one in the middle, whose first tooth stands at 0, that of teeth.
    """
    ahead = direction * teeth / (2 * pi) % 1.0
    return direction + pi + (ahead - 0.5) * 2 * pi / others


@dataclass(frozen=True, kw_only=True)
class ReducerFamily:
    """One family of reducers."""

    name: str
    interfaces: tuple[Interface, ...]  # All spring groups but the contact of pins and teeth
    contact_sources: tuple[ErrorSource, ...]  # What that contact declares
    record: type[AnyReducerRecord]  # What its files hold
    limited: tuple[Interface, ...]  # Whose largest force under the rated torque a requirement may limit
    rate: float  # Answers of limited outputs that two cores give [1/s]
    places: Callable[[Reducer], Iterable[Place]]  # In the picture, from the inside of the housing to the input
    identified: tuple[str, ...]  # Stiffnesses that measured units tell unless others are asked for, of `Stiffness`
    axes: Callable[[Reducer], dict[str, str]]  # Place of an axis in the picture → source whose vector moves it there
    # Radii and counts for the picture [mm, -], and what of them is an assumption of the drawing
    outlines: Callable[[Reducer], tuple[dict[str, Any], tuple[str, ...]]]
    new: NewRows
    # Gears before the sun in the picture: part → what it turns by, and where its first tooth starts [rad]
    turning: Callable[[Reducer], Mapping[str, tuple[Callable[[Positions], AtAngles], float]]] = lambda _: {}

    @property
    def word(self) -> str:
        """Its name as a command takes it."""
        return self.name.lower().replace(" ", "-")

    @cached_property
    def sources(self) -> ErrorSources:
        """All kinds of sources: of the interfaces, then of pins and teeth."""
        declared = (kind for interface in self.interfaces for kind in interface.sources)
        return ErrorSources((*declared, *self.contact_sources))

    def groups(self, at: Positions) -> list[SpringGroup]:
        """Return all spring groups but the contact of pins and teeth."""
        return [interface.rows(at) for interface in self.interfaces]

"""Error sources: what stands on the drawing, and the columns of the model that it moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.uncertainty.zones import (
    Distribution,
    Feature,
    Spectrum,
    at_limit,
    standard_deviation_per_zone,
    standard_values,
)
from tolalloc.units import MICROMETRE, MILLIMETRE

ANGULAR = ("tilt", "phase", "rotation")
"""Last part of the name of a source whose columns are angles."""


def neglected_columns(patterns: Sequence[str], columns: Sequence[str]) -> frozenset[str]:
    """Return the columns that are taken as zero: those of a source that a pattern such as ``*.tilt`` names.

    A pattern may name nothing that this reducer has; a misspelt one leaves its column without a value, and that is
    refused.
    """
    return frozenset(
        name
        for name in columns
        for pattern in patterns
        if fnmatchcase(name, pattern) or fnmatchcase(name, f"{pattern}.*")
    )


@dataclass(frozen=True, kw_only=True)
class Source:
    """One tolerance on a drawing: one source of error, one or more columns of the model.

    Parameters
    ----------
    name
        Identifier; a column is this name, or this name and a component.
    part
        Part that carries the feature.
    feature
        Kind of callout.
    zone
        Width, diameter, total pitch deviation or indicator reading of the zone [m].
    minimum, maximum
        Smallest and largest zone that may be asked for [m].
    cost
        Cost of the feature at its zone; it falls as 1/zone [cost units].
    middle
        Middle of the zone as a deviation from the nominal size, for sizes only [m].
    nominal
        Nominal size, for the drawing only [m].
    distribution
        Shape of the deviation inside the zone.
    cp
        Process capability; at 1, 99.73 % of parts lie in the zone [-].
    shift
        Mean shift over half the zone, for sizes only [-].
    spectrum
        Order → relative amplitude of pitch and run-out deviations [-].
    each
        Number of like features (pins, teeth) that each deviate on their own inside this zone [-].
    over
        For an angle, the length over which the zone limits the deviation; 0 for everything else [m].
    group
        Sources of one group keep the ratios of their zones, for example both discs of one drawing.
    locked
        Whether allocation must leave the zone as it is.
    grade
        Tolerance grade as written on the drawing, carried through.
    note
        Where the numbers come from.
    """

    name: str
    part: str
    feature: Feature
    zone: float
    minimum: float
    maximum: float
    cost: float
    middle: float = 0.0
    nominal: float = 0.0
    distribution: Distribution = Distribution.NORMAL
    cp: float = 1.0
    shift: float = 0.0
    spectrum: Spectrum = ()
    each: int = 1
    over: float = 0.0
    group: str = ""
    locked: bool = False
    grade: str = ""
    note: str = ""

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the model's columns that this source moves."""
        names = [f"{self.name}.{number + 1}" for number in range(self.each)] if self.each > 1 else [self.name]
        if self.feature is Feature.SIZE:
            return tuple(names)
        if self.feature is Feature.POSITION:
            return tuple(f"{name}.{axis}" for name in names for axis in ("x", "y"))
        return tuple(f"{self.name}.{wave}{order}" for order, _ in self.spectrum for wave in ("cos", "sin"))

    @property
    def lever(self) -> float:
        """What divides a length inside the zone to give the column: 1, or the length that an angle is taken over."""
        return self.over or 1.0

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns per unit of zone for independent uniform numbers in (0, 1)."""
        own = uniform.reshape(uniform.shape[0] * self.each, -1)
        values = standard_values(self.feature, self.distribution, self.cp, self.shift, self.spectrum, own)
        return np.asarray(values.reshape(uniform.shape) / self.lever)

    def at_limit(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return columns per unit of zone that fill the zone exactly, for independent uniform numbers in (0, 1)."""
        own = uniform.reshape(uniform.shape[0] * self.each, -1)
        return np.asarray(at_limit(self.feature, self.spectrum, own).reshape(uniform.shape) / self.lever)

    @property
    def mapping(self) -> str:
        """Sentence that says how the zone became a distribution."""
        zone = self.zone / MICROMETRE
        reading = f"{zone:.3g} µm, {self.feature.zone_meaning}"
        if self.over:
            reading += f" over a length of {self.over / MILLIMETRE:g} mm"
        if self.each > 1:
            reading += f", each of {self.each} on its own"
        if self.distribution is Distribution.UNIFORM:
            return f"{reading}: uniform magnitude up to the zone, any phase"
        deviation = standard_deviation_per_zone(self.feature, self.cp, self.spectrum) * zone
        shift = f", mean shifted by {self.shift * zone / 2:.3g} µm" if self.shift else ""
        if self.spectrum:
            waves = ", ".join(f"{deviation * amplitude:.3g} (order {order})" for order, amplitude in self.spectrum)
            return f"{reading}: normal cosine and sine waves, σ = {waves} µm at Cp {self.cp:g}"
        axes = " on each axis" if self.feature is Feature.POSITION else ""
        return f"{reading}: normal, σ = {deviation:.3g} µm{axes} at Cp {self.cp:g}{shift}"

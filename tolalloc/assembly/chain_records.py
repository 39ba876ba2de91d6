"""What may be written in a chain file: parts, steps, efforts, noise, and what tolerances cost."""

from __future__ import annotations

from numbers import Real
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tolalloc.assembly.chain import Part
from tolalloc.assembly.plan import LARGEST_PRECISION
from tolalloc.assembly.steps import AssemblyStep, Choice, Efforts, Positive
from tolalloc.files import Record
from tolalloc.units import DEGREE, MILLIMETRE

SMALLEST, LARGEST = 0.1, 3600.0
"""Smallest and largest tolerance and limit that is believed, and largest error; smaller ones are degrees [arcsec]."""
QUIETEST = 0.01
"""Smallest noise that is believed, unless there is none [arcsec]."""


def _three(values: object) -> object:
    numbers = isinstance(values, list) and all(isinstance(one, Real) and not isinstance(one, bool) for one in values)
    if not isinstance(values, list) or not numbers or len(values) != 3:
        raise ValueError("allowed are three numbers, for x, y and z")
    return values


def _believed(value: float) -> float:
    if 0 < value < SMALLEST:
        raise ValueError(f"is that in degrees? allowed are arcseconds from {SMALLEST:g} to {LARGEST:g}")
    if not 0 < value <= LARGEST:
        raise ValueError(f"allowed are arcseconds from {SMALLEST:g} to {LARGEST:g}")
    return value


def _each_believed(values: tuple[float, float, float]) -> tuple[float, float, float]:
    for axis, value in zip("xyz", values, strict=True):
        try:
            _believed(value or SMALLEST)  # 0 is a part without that error
        except ValueError as error:
            raise ValueError(f"about {axis}: {error}") from None
    return values


def _noise(value: float) -> float:
    if value and not QUIETEST <= value <= LARGEST:
        question = "is that in degrees? " if 0 < value < QUIETEST else ""
        raise ValueError(f"{question}allowed are 0 and arcseconds from {QUIETEST:g} to {LARGEST:g}")
    return value


def _name(text: str) -> str:
    if not text or text != text.strip() or " - " in text:
        raise ValueError("allowed is a name without spaces at its ends and without ' - ', which parts two names")
    return text


Name = Annotated[str, AfterValidator(_name)]
Angle = Annotated[float, AfterValidator(_believed)]
Degrees = Annotated[float, Field(ge=-360, le=360)]
Millimetres = Annotated[float, Field(ge=-10000, le=10000)]
Weight = Annotated[float, Field(ge=0, le=1e9)]
Noise = Annotated[float, AfterValidator(_noise)]
Three = BeforeValidator(_three)


class CostRecord(Record):
    """Cost of a part's three tolerances t: fixed + factor/t, or fixed + factor·exp(−t/scale)."""

    form: Literal["reciprocal", "exponential"]
    factor: Annotated[tuple[Positive, Positive, Positive], Three]
    fixed: Annotated[tuple[Weight, Weight, Weight], Three] = (0.0, 0.0, 0.0)
    scale_arcsec: Annotated[tuple[Angle, Angle, Angle], Three] | None = None

    @model_validator(mode="after")
    def _has_its_scale(self) -> CostRecord:
        if (self.form == "exponential") != (self.scale_arcsec is not None):
            raise ValueError(
                f"form is {self.form!r}; allowed is a scale_arcsec with the exponential form and none with the other"
            )
        return self


class PartRecord(Record):
    """One table ``[[part]]``."""

    name: Name
    on: Name
    turned_deg: Annotated[tuple[Degrees, Degrees, Degrees], Three] = (0.0, 0.0, 0.0)
    position_mm: Annotated[tuple[Millimetres, Millimetres, Millimetres], Three] = (0.0, 0.0, 0.0)
    tolerance_arcsec: Annotated[tuple[float, float, float], Three, AfterValidator(_each_believed)]
    weight: Weight = 1.0
    tilts: tuple[str, ...] = ()
    rotates: tuple[str, ...] = ()
    tilt_limit_arcsec: Angle | None = None
    rotation_limit_arcsec: Angle | None = None
    cost: CostRecord | None = None

    def part(self) -> Part:
        """Return the part in SI units."""
        x, y, z = (float(value) for value in DEGREE * np.array(self.turned_deg))
        across, up, along = (float(value) for value in MILLIMETRE * np.array(self.position_mm))
        return Part(
            name=self.name,
            on=self.on,
            turned=(x, y, z),
            position=(across, up, along),
            tilts=self.tilts,
            rotates=self.rotates,
        )


class AssemblyStepRecord(Record):
    """One table ``[[step]]``."""

    mount: Name
    adjust: tuple[Name, ...]
    effort: dict[str, Positive] = Field(default_factory=dict)
    measure: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _efforts_are_of_what_is_turned(self) -> AssemblyStepRecord:
        for name in self.effort:
            if name not in self.adjust:
                raise ValueError(f"effort names {name}; allowed are parts that the step adjusts")
        return self

    def step(self) -> AssemblyStep:
        """Return the step."""
        return AssemblyStep(mount=self.mount, adjust=self.adjust, effort=self.effort, measure=self.measure)


class NoiseRecord(Record):
    """Table ``[noise]``, standard deviations."""

    measurement_arcsec: Noise = 0.0
    adjustment_arcsec: Noise = 0.0


class TolerancesRecord(Record):
    """Table ``[tolerances]``."""

    smallest_arcsec: Angle
    largest_arcsec: Angle
    effort_price: Weight = 0.0

    @model_validator(mode="after")
    def _smaller_one_first(self) -> TolerancesRecord:
        if not self.smallest_arcsec < self.largest_arcsec:
            raise ValueError(
                f"smallest_arcsec is {self.smallest_arcsec:g}; allowed is below largest_arcsec = "
                f"{self.largest_arcsec:g}"
            )
        return self


class ChainRecord(Record):
    """A chain file; parts and steps are checked one by one, so that a sentence can name or number them."""

    name: str
    source: str
    assumptions: tuple[str, ...] = ()
    datum: Name
    reducer: str = ""
    precision: Annotated[float, Field(ge=0, le=LARGEST_PRECISION)]
    adjust: Choice | None = None
    measure: Literal["current", "mounted"] | None = None
    effort: Efforts | None = None
    noise: NoiseRecord = NoiseRecord()
    part: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    step: tuple[dict[str, Any], ...] = ()
    tolerances: TolerancesRecord | None = None

    @model_validator(mode="after")
    def _steps_are_said_once(self) -> ChainRecord:
        for field in ("adjust", "measure", "effort"):
            if self.step and getattr(self, field) is not None:
                raise ValueError(f"{field} stands beside [[step]]; allowed is one of both, as every step says its own")
        return self

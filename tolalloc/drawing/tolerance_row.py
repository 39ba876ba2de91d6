"""One row of a tolerance table: what makes sense together, and the source that it becomes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from tolalloc.drawing.distributions import Distribution
from tolalloc.drawing.measured_parts import MeasuredParts
from tolalloc.drawing.measured_parts_file import load_measured_parts
from tolalloc.drawing.sources import ANGULAR, Source
from tolalloc.drawing.tolerance_cells import parsed_batches, parsed_spectrum, require_shape
from tolalloc.drawing.zones import Feature
from tolalloc.files import Record
from tolalloc.units import MICROMETRE, MILLIMETRE

LARGEST_ZONE = 2000.0
"""Largest zone that is believed [µm]; a metre typed for a millimetre is far above it, and a model may ask for less."""

_DECIMALS = 12
"""Decimals of a zone in its unit, more than any drawing has and fewer than a difference keeps [-]."""

UNITS = {"µm": 1.0, "um": 1.0, "mm": 1000.0}


class ToleranceRow(Record):
    """One row; the fields are the column headers without their unit."""

    id: Annotated[str, Field(min_length=1)]
    part: Annotated[str, Field(min_length=1)]
    feature: Feature
    nominal: float = 0.0
    plus: float
    minus: float
    unit: Annotated[str, Field(pattern="^(µm|um|mm)$")]
    distribution: Distribution = Distribution.NORMAL
    Cp: Annotated[float, Field(ge=0.1, le=10)] = 1.0
    shift: Annotated[float, Field(ge=-1, le=1)] = 0.0
    shape: float | None = None
    batches: str = ""
    measured: str = ""
    measured_zone: Annotated[float | None, Field(gt=0, le=LARGEST_ZONE)] = None
    sorted: bool = False
    process: str = ""
    group: str = ""
    locked: bool = False
    min: Annotated[float, Field(ge=0)]
    max: Annotated[float, Field(ge=0)]
    cost: Annotated[float, Field(ge=0, le=1e9)]
    grade: str = ""
    spectrum: str = ""
    each: Annotated[int, Field(ge=1, le=1000)] = 1
    over: Annotated[float | None, Field(gt=0, le=1000)] = None
    note: str = ""

    @property
    def zone(self) -> float:
        """Full width; a difference of two decimal numbers is no decimal number [unit]."""
        return round(self.plus - self.minus, _DECIMALS)

    @model_validator(mode="after")
    def _zone_makes_sense(self) -> ToleranceRow:
        zone, factor = self.zone, UNITS[self.unit]
        if not 0 <= zone * factor <= LARGEST_ZONE:
            raise ValueError(f"the zone plus − minus is {zone * factor:g} µm and must be 0 to {LARGEST_ZONE:g} µm")
        if self.feature is not Feature.SIZE and (self.minus != 0 or self.shift != 0):
            raise ValueError(f"minus and shift must be 0 for feature {self.feature.value}, whose zone is plus")
        if zone > 0 and not self.locked and not 0 < self.min <= zone <= self.max <= LARGEST_ZONE / factor:
            raise ValueError(
                f"the zone must lie between min and max, above 0 and up to {LARGEST_ZONE:g} µm: "
                f"min {self.min:g}, zone {zone:g}, max {self.max:g} {self.unit}"
            )
        if zone > 0 and not self.locked and self.cost == 0:
            raise ValueError("the cost must be above 0 for a zone that allocation may change; or lock it")
        angular = self.id.rsplit(".", 1)[-1] in ANGULAR
        if angular != (self.over is not None):
            raise ValueError(
                f"{self.id} {'is an angle and needs' if angular else 'is a length and has no'} over, the length in mm "
                "over which the zone limits it"
            )
        needs_spectrum = self.feature in (Feature.PITCH, Feature.RUNOUT)
        if needs_spectrum != bool(self.spectrum):
            raise ValueError(
                f"feature {self.feature.value} {'needs' if needs_spectrum else 'has no'} spectrum such as '1:9.2 2:4.3'"
            )
        if needs_spectrum and self.each > 1:
            raise ValueError("each must be 1 for a feature with a spectrum; single teeth are sources of feature size")
        return self

    @model_validator(mode="after")
    def _distribution_makes_sense(self) -> ToleranceRow:
        kind, batches = self.distribution, parsed_batches(self.batches)
        require_shape(kind, self.shape)
        if (kind is Distribution.MIXTURE) != bool(batches):
            raise ValueError("distribution mixture and batches such as '0.7:-0.3:0.8 0.3:0.5:0.6' go together")
        if (kind is Distribution.EMPIRICAL) != bool(self.measured) or (self.measured_zone and not self.measured):
            raise ValueError("distribution empirical, measured (the file of the parts) and measured_zone go together")
        if kind is Distribution.MIXTURE and self.Cp != 1:
            raise ValueError(f"the batches of a mixture state their spreads, so Cp must be 1: {self.Cp:g}")
        if kind is Distribution.EMPIRICAL and (self.Cp != 1 or self.shift != 0 or self.plus == self.minus):
            raise ValueError("measured parts show spread and mean, so Cp must be 1, shift 0 and the zone above 0")
        if self.feature is Feature.SIZE:
            return self
        if any(batch.shift for batch in batches):
            raise ValueError(f"the shift of a batch must be 0 for feature {self.feature.value}, which has no direction")
        if self.feature is not Feature.POSITION:
            self._require_sensible_waves()
        return self

    def _require_sensible_waves(self) -> None:
        """Raise unless the distribution says something about waves over a turn."""
        spectrum, teeth = parsed_spectrum(self.spectrum)
        if self.distribution is Distribution.EMPIRICAL:
            raise ValueError(f"distribution empirical is for sizes and positions, not for {self.feature.value}")
        if teeth and self.distribution is not Distribution.NORMAL:
            raise ValueError(f"a random part of the spectrum is normal: distribution {self.distribution.value}")
        if len(spectrum) > 1 and (self.sorted or self.batches):
            raise ValueError(
                f"{'sorted' if self.sorted else 'mixture'} concerns all orders of a part at once, and each order "
                f"deviates on its own here; it needs a spectrum of one order: {len(spectrum)} orders"
            )

    def source(self, folder: Path) -> Source:
        """Return the source in SI units.

        Parameters
        ----------
        folder
            Folder of the table, where the file of measured parts is looked for.
        """
        factor = UNITS[self.unit] * MICROMETRE
        spectrum, teeth = parsed_spectrum(self.spectrum)
        return Source(
            name=self.id,
            part=self.part,
            feature=self.feature,
            zone=self.zone * factor,
            middle=(self.plus + self.minus) / 2 * factor if self.feature is Feature.SIZE else 0.0,
            nominal=self.nominal * MILLIMETRE,
            minimum=self.min * factor,
            maximum=self.max * factor,
            cost=self.cost,
            distribution=self.distribution,
            cp=self.Cp,
            shift=self.shift,
            shape=self.shape or 0.0,
            batches=parsed_batches(self.batches),
            measured=self._measured_parts(folder),
            sorted=self.sorted,
            process=self.process,
            spectrum=spectrum,
            teeth=teeth,
            written_spectrum=self.spectrum,
            each=self.each,
            over=(self.over or 0.0) * MILLIMETRE,
            group=self.group or self.id,
            locked=self.locked,
            grade=self.grade,
            note=self.note,
        )

    def _measured_parts(self, folder: Path) -> MeasuredParts | None:
        if not self.measured:
            return None
        factor = UNITS[self.unit] * MICROMETRE
        return load_measured_parts(
            (folder / self.measured).resolve(),
            self.feature,
            (self.measured_zone or self.zone) * factor,
            (self.plus + self.minus) / 2 * factor if self.feature is Feature.SIZE else 0.0,
        )

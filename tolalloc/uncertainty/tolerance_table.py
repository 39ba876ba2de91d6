"""Tolerance tables: one row per source, read from CSV or Excel and written back in the same layout."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import Field, model_validator

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.files import Record, shipped_or_path, validated
from tolalloc.uncertainty.sources import ANGULAR, Source
from tolalloc.uncertainty.unit_file import DATA
from tolalloc.uncertainty.zones import Distribution, Feature, Spectrum
from tolalloc.units import MICROMETRE, MILLIMETRE

LARGEST_ZONE = 200.0
"""Largest zone that is believed [µm]; a metre typed for a millimetre is far above it."""

UNITS = {"µm": 1.0, "um": 1.0, "mm": 1000.0}
HEADERS = {
    "id": "id",
    "part": "part",
    "feature": "feature",
    "nominal": "nominal [mm]",
    "plus": "plus [unit]",
    "minus": "minus [unit]",
    "unit": "unit",
    "distribution": "distribution",
    "Cp": "Cp [-]",
    "shift": "shift [half zone]",
    "group": "group",
    "locked": "locked",
    "min": "min [unit]",
    "max": "max [unit]",
    "cost": "cost [cost units]",
    "grade": "grade",
    "spectrum": "spectrum [order:amplitude]",
    "each": "each [-]",
    "over": "over [mm]",
    "note": "note",
}
REQUIRED = ("id", "part", "feature", "plus", "minus", "unit", "min", "max", "cost")


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
    group: str = ""
    locked: bool = False
    min: Annotated[float, Field(ge=0)]
    max: Annotated[float, Field(ge=0)]
    cost: Annotated[float, Field(ge=0, le=1e9)]
    grade: str = ""
    spectrum: str = ""
    each: Annotated[int, Field(ge=1, le=1000)] = 1
    over: Annotated[float, Field(gt=0, le=1000)] | None = None
    note: str = ""

    @model_validator(mode="after")
    def _zone_makes_sense(self) -> ToleranceRow:
        zone, factor = self.plus - self.minus, UNITS[self.unit]
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
        if needs_spectrum != bool(self.parsed_spectrum):
            raise ValueError(
                f"feature {self.feature.value} {'needs' if needs_spectrum else 'has no'} spectrum such as '1:9.2 2:4.3'"
            )
        if needs_spectrum and self.each > 1:
            raise ValueError("each must be 1 for a feature with a spectrum; single teeth are sources of feature size")
        return self

    @property
    def parsed_spectrum(self) -> Spectrum:
        """The spectrum as numbers."""
        pairs = [re.fullmatch(r"(\d+):(\d+\.?\d*)", item) for item in self.spectrum.split()]
        if any(pair is None for pair in pairs):
            raise ValueError("the spectrum must read like '1:9.2 2:4.3 4:1.0' (order:amplitude)")
        return tuple((int(pair[1]), float(pair[2])) for pair in pairs if pair)

    def source(self) -> Source:
        """Return the source in SI units."""
        factor = UNITS[self.unit] * MICROMETRE
        return Source(
            name=self.id,
            part=self.part,
            feature=self.feature,
            zone=(self.plus - self.minus) * factor,
            middle=(self.plus + self.minus) / 2 * factor if self.feature is Feature.SIZE else 0.0,
            nominal=self.nominal * MILLIMETRE,
            minimum=self.min * factor,
            maximum=self.max * factor,
            cost=self.cost,
            distribution=self.distribution,
            cp=self.Cp,
            shift=self.shift,
            spectrum=self.parsed_spectrum,
            each=self.each,
            over=(self.over or 0.0) * MILLIMETRE,
            group=self.group or self.id,
            locked=self.locked,
            grade=self.grade,
            note=self.note,
        )


def load_tolerance_table(name: str | Path) -> tuple[Source, ...]:
    """Return the sources of a tolerance table by shipped name or from the user's CSV or XLSX file.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".tolerances.csv", "tolerance table")
    frame = _read(path)
    if frame.empty:
        raise InputError(f"{path}: the table has no rows; one row per source is needed.")
    sources = []
    for number, row in enumerate(frame.to_dict("records"), start=2):
        identity = str(row.get("id", "")).strip()
        place = f"{path}, row {number} ({identity or 'no id'})"
        cells = {str(key): _cell(str(key), value, place) for key, value in row.items() if str(value).strip() != ""}
        sources.append(validated(ToleranceRow, cells, place).source())
        if identity in {source.name for source in sources[:-1]}:
            raise InputError(f"{place}: id is {identity!r} for the second time; each source has one row.")
    return tuple(sources)


def _read(path: Path) -> pd.DataFrame:
    """Return the table as text with bare headers, or say what is wrong with the file as a whole."""
    try:
        if path.suffix.lower() in (".xlsx", ".xlsm"):
            frame = pd.read_excel(path, dtype=str, keep_default_na=False)
        else:
            frame = pd.read_csv(path, dtype=str, keep_default_na=False, encoding="utf-8-sig", index_col=False)
    except (
        pd.errors.ParserError,
        pd.errors.EmptyDataError,
        UnicodeDecodeError,
        zipfile.BadZipFile,
        ValueError,
    ) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path}: not a complete table in CSV (UTF-8) or XLSX; is the file truncated? ({reason})."
        ) from None
    frame.columns = [str(header).split(" [")[0].strip() for header in frame.columns]
    for header in frame.columns:
        if header not in HEADERS:
            raise UnknownNameError.among(path, "column", header, HEADERS)
    for header in REQUIRED:
        if header not in frame.columns:
            raise InputError(f"{path}: the column {header!r} is missing; needed are {', '.join(REQUIRED)}.")
    return frame.fillna("")


def _cell(header: str, text: str, place: str) -> object:
    """Return a cell as the type that its column asks for."""
    value = str(text).strip()
    annotation = ToleranceRow.model_fields[header].annotation
    if header == "each":
        if not value.isdecimal():
            raise InputError.at(place, header, value, "a whole number, 1 or more")
        return int(value)
    if annotation is bool:
        answers = {"yes": True, "no": False, "true": True, "false": False}
        if value.lower() not in answers:
            raise InputError.at(place, header, value, "yes or no")
        return answers[value.lower()]
    if annotation is float or header == "over":
        try:
            return float(value)
        except ValueError:
            raise InputError.at(place, header, value, "a number with a decimal point") from None
    if header in ("feature", "distribution"):
        kinds: type[Feature] | type[Distribution] = Feature if header == "feature" else Distribution
        if value not in list(kinds):
            raise InputError.at(place, header, value, "one of " + ", ".join(kinds))
        return kinds(value)
    return value


def table_frame(sources: Sequence[Source]) -> pd.DataFrame:
    """Return the sources as a tolerance table in the layout that `load_tolerance_table` reads."""
    rows = []
    for source in sources:
        zone, middle = source.zone / MICROMETRE, source.middle / MICROMETRE
        is_size = source.feature is Feature.SIZE
        rows.append(
            {
                "id": source.name,
                "part": source.part,
                "feature": source.feature.value,
                "nominal": source.nominal / MILLIMETRE,
                "plus": round(middle + zone / 2 if is_size else zone, 4),
                "minus": round(middle - zone / 2 if is_size else 0.0, 4),
                "unit": "µm",
                "distribution": source.distribution.value,
                "Cp": source.cp,
                "shift": source.shift,
                "group": source.group,
                "locked": "yes" if source.locked else "no",
                "min": round(source.minimum / MICROMETRE, 4),
                "max": round(source.maximum / MICROMETRE, 4),
                "cost": round(source.cost, 6),
                "grade": source.grade,
                "spectrum": " ".join(f"{order}:{amplitude:g}" for order, amplitude in source.spectrum),
                "each": source.each,
                "over": source.over / MILLIMETRE if source.over else "",
                "note": source.note,
            }
        )
    return pd.DataFrame(rows).rename(columns=HEADERS)


def with_zones(sources: Sequence[Source], zones: Sequence[float]) -> tuple[Source, ...]:
    """Return the sources at other zones [m], costs moved along."""
    return tuple(
        source if zone == source.zone else replace(source, zone=zone, cost=source.cost * source.zone / zone, grade="")
        for source, zone in zip(sources, zones, strict=True)
    )

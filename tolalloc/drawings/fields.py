"""The fields of a tolerance table: the one list that says how each is named, checked, read, written and explained."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tolalloc.drawings.distributions import Distribution, batches_text, parsed_batches, parsed_shapes, require_shapes
from tolalloc.drawings.measured_parts import (
    LARGEST_DEVIATION,
    MadeTo,
    MeasuredParts,
    load_measured_parts,
    named_file,
)
from tolalloc.drawings.provenance import STATUSES, parsed_provenance
from tolalloc.drawings.sources import INCHES, LENGTHS, PERCENT, Source, is_angular, like_places
from tolalloc.drawings.zones import Feature, parsed_spectrum, parsed_systematic, spectrum_text, systematic_text
from tolalloc.reading.files import Record
from tolalloc.reading.units import COST_UNITS, MICROMETRE, usual_signs

LARGEST_ZONE = LARGEST_DEVIATION
"""Largest zone that is believed [µm]; a model may ask for less, as a reducer does."""

LARGEST_WAVE = 2000.0
"""Largest amplitude of a wave that all parts share, of pitch or run-out, that is believed [µm]."""

SMALLEST_ZONE = 1e-6
"""Smallest zone that is believed unless it is 0; below, a zone is lost beside its nominal size [µm]."""

SMALLEST_COST = 1e-9
"""Smallest cost that is believed unless there is none [cost units]."""

_LIMITS = 0.05
"""Share of the nominal size within which the middle of plus and minus is that size, and they are its limits [-]."""

_FARTHEST = 20.0
"""Distance of the middle of a zone from the nominal size, over the zone, up to which it is believed: the loosest fits
of ISO 286 reach about 10 [-]."""

_DECIMALS = 12
"""Decimals of a zone in its unit, more than any drawing has and fewer than a difference keeps [-]."""

_WRITTEN_DECIMALS = {"µm": 5, "mm": 8, INCHES: 10, PERCENT: 10}
"""Decimals that a written table has in each unit: half a zone of four decimals of a micrometre, or finer [-]."""

UNITS = {"µm": 1.0, "um": 1.0, "mm": 1000.0, "in": 25400.0, "inch": 25400.0}
"""Unit of a length → micrometres."""

ALLOWED_UNITS = "µm, um, mm, in, inch or %"

_CALLED = {"um": "µm", "inch": INCHES}
"""Other spelling of a unit → the one that is written."""

Cell = str | int | float | MeasuredParts | None
"""What a source writes: a flag as yes or no, a file as seen from the table, nothing as an empty cell."""


@dataclass(frozen=True)
class TableColumn:
    """What a tolerance table knows of a field beside its type, its limits and its default."""

    # What stands there, as the page of columns explains it, and what the header says behind the name
    meaning: str
    unit: str = ""
    # Field of the source that is this cell, as the column is called unless given; none where `write` alone is
    attribute: str = ""
    write: Callable[[Source], Cell] | None = None  # Returns the cell of a source, where it is not its attribute


def _alternatives(words: Iterable[str]) -> str:
    """Return words of which one is chosen, as a sentence lists them."""
    *others, last = words
    return f"{', '.join(others)} or {last}"


def _plus(source: Source) -> float:
    """Return the upper limit of a size, or the zone of everything else [unit of the row]."""
    zone = _written(source, source.zone)
    if source.feature is not Feature.SIZE:
        return zone
    return round(source.middle / source.unit_length + zone / 2, _WRITTEN_DECIMALS[source.unit])


def _known_unit(text: str) -> str:
    """Return the unit of a row."""
    unit = usual_unit(text)
    if unit not in UNITS and unit != PERCENT:
        raise ValueError(f"allowed is {ALLOWED_UNITS}")
    return unit


def usual_unit(text: str) -> str:
    """Return the unit of a row in its one spelling."""
    unit = usual_signs(text.strip())
    return _CALLED.get(unit, unit)


def _length_written(source: Source, length: float) -> float:
    """Return a nominal size or a length as a table writes it [mm, or in]."""
    unit = LENGTHS[source.length_name]
    return length / unit if unit == LENGTHS["mm"] else round(length / unit, _WRITTEN_DECIMALS[INCHES])


def shapes_text(stated: object) -> object:
    """Return shapes as a cell states them, one number or several, as text."""
    if isinstance(stated, int | float) and not isinstance(stated, bool):
        return repr(stated)
    if isinstance(stated, list | tuple):
        return " ".join(map(repr, stated))
    return "" if stated is None else stated


def shapes_cell(shapes: tuple[float, ...]) -> Cell:
    """Return shapes as a table writes them: one as the number that it is."""
    return shapes[0] if len(shapes) == 1 else " ".join(map(repr, shapes)) or None


def _known_shapes(text: str) -> str:
    """Return the shapes of a row, as they were stated."""
    parsed_shapes(text)
    return text


def _known_provenance(text: str) -> str:
    """Return the provenance of a row, as it was stated."""
    parsed_provenance(text)
    return text


def _no_comment(text: str) -> str:
    """Return a first cell that no reader of the table takes for a comment."""
    if text.startswith("#"):
        raise ValueError("allowed is a name that does not begin with #, which makes the row a comment")
    return text


def _written(source: Source, length: float) -> float:
    """Return a length as a table writes it [unit of the row]."""
    return round(length / source.unit_length, _WRITTEN_DECIMALS[source.unit])


class ToleranceRow(Record):
    """One row; the fields are the column headers without their unit."""

    id: Annotated[
        str,
        Field(min_length=1),
        AfterValidator(_no_comment),
        TableColumn(
            "name of the source, `check` offers the nearest one if it is not known; or your own where `source` says "
            "which one is meant",
            write=lambda source: source.own_id or source.name,
        ),
    ]
    part: Annotated[str, TableColumn("part that carries it; the id unless given")] = ""
    feature: Annotated[
        Feature,
        TableColumn(
            "`size` (± zone), `position` (Ø zone of an axis), `pitch` (total cumulative deviation) or `runout` (full "
            "indicator reading); size unless given",
        ),
    ] = Feature.SIZE
    nominal: Annotated[
        float,
        TableColumn("nominal size, for grades, for you and for an own model; in inches where the unit is in", "mm"),
    ] = 0.0
    plus: Annotated[float, TableColumn("upper limit; the zone is plus − minus", "unit", write=_plus)]
    minus: Annotated[
        float,
        TableColumn(
            "lower limit; 0 for all but sizes",
            "unit",
            write=lambda source: round(_plus(source) - _written(source, source.zone), _WRITTEN_DECIMALS[source.unit]),
        ),
    ]
    unit: Annotated[
        str,
        AfterValidator(_known_unit),
        TableColumn("µm, mm, in or % (of the nominal size), for plus, minus, min and max"),
    ]
    distribution: Annotated[
        Distribution,
        TableColumn(f"{_alternatives(f'`{kind}`' for kind in Distribution)}; normal unless given"),
    ] = Distribution.NORMAL
    Cp: Annotated[float, Field(ge=0.1, le=10), TableColumn("capability; 1 unless given", "-", "cp")] = 1.0
    shift: Annotated[
        float, Field(ge=-1, le=1), TableColumn("mean shift over half the zone, sizes only", "half zone")
    ] = 0.0
    shape: Annotated[
        str,
        BeforeValidator(shapes_text),
        AfterValidator(_known_shapes),
        TableColumn(
            "of lognormal and Weibull; of a trapezoid its plateau over its width; of beta both, as `2 5`",
            "-",
            write=lambda source: shapes_cell(source.shapes),
        ),
    ] = ""
    batches: Annotated[
        str,
        TableColumn(
            "of a mixture, as weight:shift:spread: `0.7:-0.3:0.8 0.3:0.5:0.6`, shift in half zones",
            "weight:shift:spread",
            write=lambda source: batches_text(source.batches),
        ),
    ] = ""
    measured: Annotated[
        str,
        TableColumn(
            "file of at least 20 measured parts beside the table; distribution `empirical`. A CSV (`deviation [µm]` or "
            "`mean [µm],sigma [µm],parts`; of a position `x [µm],y [µm]` or `radius [µm]`), or a Q-DAS file, with one "
            "of its characteristics behind a colon: `parts.dfq:Diameter`",
            write=lambda source: source.measured,
        ),
    ] = ""
    measured_zone: Annotated[
        float | None,
        Field(ge=SMALLEST_ZONE, le=LARGEST_ZONE),
        TableColumn(
            "the zone that the measured parts were made to; today's unless given",
            "unit",
            write=lambda source: source.measured.zone / source.unit_length if source.measured else None,
        ),
    ] = None
    sorted: Annotated[
        bool,
        TableColumn("yes: parts outside the zone are sorted out before assembly (a truncated distribution)"),
    ] = False
    process: Annotated[
        str,
        TableColumn(
            "how the feature is made today: row of a process capability library (`ta.drawing(processes=)`), which then "
            "gives Cp, shift, distribution, shape and sorting unless the row states them, and of the process cost "
            "table; with Cp stated, the library need not know it",
        ),
    ] = ""
    group: Annotated[
        str,
        TableColumn(
            "rows of one group keep the ratios of their zones: both discs of one drawing. Unless given, rows of one "
            "feature on identical parts of a reducer form a group if zone, limits and price are the same; any other "
            "row stands alone",
        ),
    ] = ""
    locked: Annotated[
        bool, TableColumn("yes: allocation leaves the zone as it is; min, max and cost may then be empty, costing 0")
    ] = False
    min: Annotated[float, Field(ge=0), TableColumn("smallest zone that may be asked for", "unit", "minimum")]
    max: Annotated[float, Field(ge=0), TableColumn("largest zone that may be asked for", "unit", "maximum")]
    cost: Annotated[
        float,
        Field(ge=0, le=1e9),
        TableColumn(
            "cost of the feature at its zone; it falls as 1/zone unless a process cost table says otherwise",
            COST_UNITS,
            "cost",
            write=lambda source: round(source.cost, 12),
        ),
    ]
    grade: Annotated[str, TableColumn("carried through")] = ""
    step: Annotated[
        float,
        Field(ge=0, le=LARGEST_ZONE),
        TableColumn(
            "step of the numbers that the drawing states, to which an allocated zone is rounded down: the zone, or for "
            "a size its deviations; unless given, for a reducer 0.01 µm below 1 µm, 0.1 below 10, 0.5 below 100, "
            "then 1, and for an own model three figures",
            "unit",
            write=lambda source: _written(source, source.step) or None,
        ),
    ] = 0.0
    spectrum: Annotated[
        str,
        TableColumn(
            "for pitch and run-out: order:relative amplitude, as `1:9.2 2:4.3 4:1`; `random:1.0/40` adds 40 "
            "independent teeth",
            "order:amplitude",
            "written_spectrum",
            write=lambda source: source.written_spectrum or spectrum_text(source.spectrum),
        ),
    ] = ""
    systematic: Annotated[
        str,
        TableColumn(
            "for pitch and run-out: waves that all parts share beside the random ones, as `2:5.0@30`: order of the "
            "spectrum, amplitude in the unit of the row, direction of a crest",
            "order:amplitude@°",
            write=lambda source: systematic_text(source.systematic, source.unit_length),
        ),
    ] = ""
    each: Annotated[
        int,
        Field(ge=1, le=1000),
        TableColumn(
            "number of like features that each deviate on their own: of `each_pin.…`, `disc{j}.each_tooth.…`, and of "
            "holes and output pins of a single stage; the cost is that of them together",
            "-",
        ),
    ] = 1
    over: Annotated[
        float | None,
        Field(ge=0.001, le=1000),
        TableColumn(
            "for tilt, phase and rotation: the length over which the zone limits the deviation, in inches where the "
            "unit is in; a tilt leans by half the zone to either side, which is what a parallelism states",
            "mm",
            write=lambda source: _length_written(source, source.over) or None,
        ),
    ] = None
    drawing: Annotated[
        str,
        TableColumn(
            "number and revision of the drawing that states the zone; shown beside the id in tables of reports"
        ),
    ] = ""
    label: Annotated[str, TableColumn("your own word for it, as the drawing has it; shown beside the id as well")] = ""
    source: Annotated[
        str,
        TableColumn(
            "the source that is meant where the id is your own, which is then shown beside it and may stand for it in "
            "process costs, correlations and `whatif`",
            write=lambda source: source.name if source.own_id else "",
        ),
    ] = ""
    places: Annotated[
        int,
        Field(ge=0, le=1000),
        TableColumn(
            "like places that the row stands for, `6` or `6x`, which may also stand before its name: `source` is then "
            "a pattern such as `crank*.journal*.eccentricity`, or the name without its numbers; zone and cost are "
            "those of each",
            "-",
            write=lambda source: source.places or None,
        ),
    ] = 0
    uncertainty: Annotated[
        float,
        Field(ge=0, le=LARGEST_ZONE),
        TableColumn(
            "expanded uncertainty (k = 2) of its gauge; a zone below ten times as much is named in the report, "
            "and the inspection plan keeps it off both limits",
            "unit",
            "uncertainty",
            write=lambda source: _written(source, source.uncertainty) or None,
        ),
    ] = 0.0
    provenance: Annotated[
        str,
        AfterValidator(_known_provenance),
        TableColumn(
            f"how its numbers are known: {_alternatives(f'`{word}`' for word in STATUSES)}, for zone, range and cost "
            "or each as in `zone:measured cost:assumed`; unless given, what the note says before a colon",
        ),
    ] = ""
    note: Annotated[str, TableColumn("carried through; `assumed: …` states how the numbers are known")] = ""

    @property
    def name(self) -> str:
        """Name of the source that the row is about, or what it calls several."""
        return like_places(self.source or self.id)[1]

    @property
    def _places(self) -> int:
        """Like places that the row stands for, by what its name or, for a pattern, its id says too; 0 if nothing."""
        return self.places or like_places(self.source or self.id)[0] or ("*" in self.source and like_places(self.id)[0])

    @property
    def length_unit(self) -> str:
        """Unit of the nominal size and of over."""
        return INCHES if self.unit == INCHES else "mm"

    @property
    def micrometres(self) -> float:
        """Micrometres of one unit of the row [µm]."""
        return abs(self.nominal) * 10.0 if self.unit == PERCENT else UNITS[self.unit]

    @property
    def zone(self) -> float:
        """Full width; a difference of two decimal numbers is no decimal number [unit]."""
        return round(self.plus - self.minus, _DECIMALS)

    @model_validator(mode="after")
    def _makes_sense(self) -> ToleranceRow:
        self._require_unit()
        self._require_zone()
        self._require_distribution()
        self._require_systematic_waves()
        return self

    def _require_unit(self) -> None:
        if self.unit == PERCENT and not self.nominal:
            raise ValueError("unit is %, which is of the nominal size; allowed is a nominal size other than 0")
        if self.places and (named := like_places(self.source or self.id)[0]) not in (0, self.places):
            raise ValueError(f"places is {self.places}, and the name of its source says {named}; allowed is one number")

    def _require_zone(self) -> None:
        zone, factor = self.zone, self.micrometres
        if not 0 <= zone * factor <= LARGEST_ZONE:
            raise ValueError(f"the zone plus − minus is {zone * factor:.9g} µm and must be 0 to {LARGEST_ZONE:.0f} µm")
        self._require_deviations()
        if self.plus == self.minus and not self.locked and (self.min > 0 or self.cost > 0):
            sign = f"; if ± {self.plus:g} is meant, minus is −{self.plus:g}" if self.plus > 0 else ""
            raise ValueError(
                "the zone is 0 but the row is not locked; allowed is 0 with locked = yes, which neglects the source, "
                f"or a zone above 0 up to {LARGEST_ZONE:.0f} µm{sign}"
            )
        if self.feature is not Feature.SIZE and (self.minus != 0 or self.shift != 0):
            raise ValueError(f"minus and shift must be 0 for feature {self.feature.value}, whose zone is plus")
        if zone > 0 and not self.locked and not 0 < self.min <= zone <= self.max <= LARGEST_ZONE / factor:
            raise ValueError(
                f"the zone must lie between min and max, above 0 and up to {LARGEST_ZONE:.0f} µm: "
                f"min {self.min:g}, zone {zone:g}, max {self.max:g}, all in the {self.unit} of the row"
            )
        if self.plus != self.minus and zone * factor < SMALLEST_ZONE:
            raise ValueError(
                f"the zone plus − minus is {zone * factor:g} µm and must be 0, or {SMALLEST_ZONE:g} µm or more"
            )
        if zone > 0 and not self.locked and self.cost < SMALLEST_COST:
            raise ValueError(
                f"the cost must be {SMALLEST_COST:g} or more for a zone that allocation may change; or lock it"
            )
        angular = is_angular(self.name)
        if angular != (self.over is not None):
            raise ValueError(
                f"{self.name} {'is an angle and needs' if angular else 'is a length and has no'} over, the length "
                "in mm over which the zone limits it; names of angles end in .tilt, .rotation or .phase"
            )
        needs_spectrum = self.feature in (Feature.PITCH, Feature.RUNOUT)
        if needs_spectrum != bool(self.spectrum):
            raise ValueError(
                f"feature {self.feature.value} {'needs' if needs_spectrum else 'has no'} spectrum such as '1:9.2 2:4.3'"
            )
        if needs_spectrum and self.each > 1:
            raise ValueError("each must be 1 for a feature with a spectrum; single teeth are sources of feature size")

    def _require_deviations(self) -> None:
        """Raise if plus and minus are limits of size, or far from any deviation of a zone of this width."""
        if self.feature is not Feature.SIZE:
            return
        inside = UNITS[self.length_unit] / self.micrometres if self.nominal else 0.0
        nominal, middle = self.nominal * inside, (self.plus + self.minus) / 2
        near = abs(middle - nominal) <= max(self.zone, _LIMITS * abs(nominal))
        if nominal and near and abs(middle) > self.zone:
            plus, minus = round(self.plus - nominal, _DECIMALS), round(self.minus - nominal, _DECIMALS)
            raise ValueError(
                f"plus {self.plus:g} and minus {self.minus:g} are limits of a size of {self.nominal:g} "
                f"{self.length_unit}; allowed are "
                f"deviations from it, here plus {plus:g} and minus {minus:g} {self.unit}"
            )
        if self.zone > 0 and abs(middle) > _FARTHEST * self.zone:
            raise ValueError(
                f"plus {self.plus:g} and minus {self.minus:g} lie {middle:g} {self.unit} from the nominal size, "
                f"{abs(middle) / self.zone:.0f} times their zone; allowed are deviations, up to {_FARTHEST:g} times it"
            )

    def _require_distribution(self) -> None:
        kind, batches = self.distribution, parsed_batches(self.batches)
        require_shapes(kind, parsed_shapes(self.shape))
        if kind is Distribution.RAYLEIGH and self.feature is not Feature.SIZE:
            raise ValueError(
                f"distribution rayleigh is for radial sizes; for feature {self.feature.value} allowed is normal, whose "
                "vectors have such a length"
            )
        if (kind is Distribution.MIXTURE) != bool(batches):
            raise ValueError("distribution mixture and batches such as '0.7:-0.3:0.8 0.3:0.5:0.6' go together")
        if (kind is Distribution.EMPIRICAL) != bool(self.measured) or (self.measured_zone and not self.measured):
            raise ValueError("distribution empirical, measured (the file of the parts) and measured_zone go together")
        if kind is Distribution.MIXTURE and self.Cp != 1:
            raise ValueError(f"the batches of a mixture state their spreads, so Cp must be 1: {self.Cp:g}")
        if kind is Distribution.EMPIRICAL and (self.Cp != 1 or self.shift != 0 or self.plus == self.minus):
            raise ValueError("measured parts show spread and mean, so Cp must be 1, shift 0 and the zone above 0")
        if self.feature is Feature.SIZE:
            return
        if any(batch.shift for batch in batches):
            raise ValueError(f"the shift of a batch must be 0 for feature {self.feature.value}, which has no direction")
        if self.feature is not Feature.POSITION:
            self._require_sensible_waves()

    def _require_systematic_waves(self) -> None:
        orders = {order for order, _ in parsed_spectrum(self.spectrum)[0]}
        for order, amplitude, _ in parsed_systematic(self.systematic):
            if order not in orders:
                allowed = ", ".join(map(str, sorted(orders))) or "none, as the row has no spectrum"
                raise ValueError(f"systematic has order {order}; allowed are the orders of its spectrum: {allowed}")
            if amplitude * self.micrometres > LARGEST_WAVE:
                allowed = f"0 to {LARGEST_WAVE / 1e3:g} mm"
                raise ValueError(f"systematic has an amplitude of {amplitude:g} {self.unit}; allowed is {allowed}")

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

    def as_source(self, folder: Path) -> Source:
        """Return the source in SI units; its file of measured parts is looked for in the folder."""
        factor, length = self.micrometres * MICROMETRE, LENGTHS[self.length_unit]
        middle = (self.plus + self.minus) / 2 * factor if self.feature is Feature.SIZE else 0.0
        spectrum, teeth = parsed_spectrum(self.spectrum)
        shapes = parsed_shapes(self.shape)
        in_si = {"unit": factor, "mm": length}
        stated: dict[str, Any] = {
            own.attribute or name: getattr(self, name) * in_si[own.unit] if own.unit in in_si else getattr(self, name)
            for name, own in COLUMNS.items()
            if own.attribute or not own.write
        }
        return Source(
            **stated | {"part": self.part or self.name},
            name=self.name,
            own_id=self.id if self.name != self.id else "",
            places=self._places,
            zone=self.zone * factor,
            middle=middle,
            step=self.step * factor,
            shape=shapes[0] if len(shapes) == 1 else shapes or 0.0,
            batches=parsed_batches(self.batches),
            measured=self._measured_parts(folder, middle),
            spectrum=spectrum,
            systematic=tuple((order, size * factor, at) for order, size, at in parsed_systematic(self.systematic)),
            teeth=teeth,
            over=(self.over or 0.0) * length,
        )

    def _measured_parts(self, folder: Path, middle: float) -> MeasuredParts | None:
        if not self.measured:
            return None
        zone = (self.measured_zone or self.zone) * (self.micrometres * MICROMETRE)
        nominal = self.nominal * LENGTHS[self.length_unit]
        is_tilt = self.name.endswith(".tilt")
        made_to = MadeTo(feature=self.feature, zone=zone, middle=middle, nominal=nominal, is_tilt=is_tilt)
        file, characteristic = named_file(self.measured)
        return load_measured_parts((folder / file).resolve(), made_to, characteristic)


COLUMNS = {
    name: next(item for item in field.metadata if isinstance(item, TableColumn))
    for name, field in ToleranceRow.model_fields.items()
}
"""Field → what a table knows of it."""


def cell_of(source: Source, name: str) -> Cell:
    """Return what a source writes into the column of a field."""
    own = COLUMNS[name]
    if own.write:
        return own.write(source)
    value: Any = getattr(source, own.attribute or name)
    in_table = {"unit": _written, "mm": _length_written}.get(own.unit)
    return in_table(source, value) if in_table else value


def headers_in(
    cost_unit: str, sources: Sequence[Source] = (), called: Mapping[str, str] = MappingProxyType({})
) -> dict[str, str]:
    """Return field → header of its column, in a table whose costs are in cost units or a currency.

    Nominal sizes are in inches where all sources are, and state no unit where some are; like places, uncertainties and
    statuses have a column where one source states them. What the user's table calls a field comes first.
    """
    lengths = {own.length_name for own in sources} or {"mm"}
    said = {COST_UNITS: cost_unit, "mm": lengths.pop() if len(lengths) == 1 else ""}
    heads = {name: head for head, name in reversed(tuple(called.items()))}  # the first of several
    left_out = {name for name in _WHERE_STATED if sources and not any(getattr(own, name) for own in sources)}
    units = {name: said.get(own.unit, own.unit) for name, own in COLUMNS.items() if name not in left_out}
    return {
        name: f"{heads.get(name, name)} [{unit}]" if unit else heads.get(name, name) for name, unit in units.items()
    }


_WHERE_STATED = ("places", "uncertainty", "provenance")
"""Columns that a table has where one of its sources states something there."""

HEADERS = headers_in(COST_UNITS)

"""Tolerance tables: reading and writing them, the process libraries they name, and what in them is hardly meant."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from tolalloc.drawings.distributions import Distribution, parsed_shapes, require_shapes
from tolalloc.drawings.fields import (
    ALLOWED_UNITS,
    COLUMNS,
    UNITS,
    Cell,
    ToleranceRow,
    cell_of,
    headers_in,
    shapes_text,
    usual_unit,
)
from tolalloc.drawings.heads import Heads, split_header
from tolalloc.drawings.ladder import RADII, fit_deviations, is_fit, tolerance_factor
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.sources import INCHES, LENGTHS, PERCENT, Source, by_row, known_as
from tolalloc.drawings.table_file import (
    DATA,
    number_at,
    read_rows,
    read_table_file,
    require_columns,
    require_units,
    typed_cells,
    usual_word,
)
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import Faults, InputError, UnknownNameError
from tolalloc.reading.file_content import is_file
from tolalloc.reading.files import Record, as_toml, no_formula, read_toml, shipped_or_path, validated
from tolalloc.reading.units import COST_UNITS, MICROMETRE, MILLIMETRE, number_in

if TYPE_CHECKING:
    import pandas as pd

_UNITS = {"Cp": "-", "shift": "half zone", "shape": "-"}
"""Field → unit that its header may state."""
_NO_TEXT, _NO_NAME = r"[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff]", r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]"
"""What no cell may hold, since no file with it is read, and what no name may, since it is written on one line."""

CLOSED_FORMS = tuple(kind for kind in Distribution if kind not in (Distribution.MIXTURE, Distribution.EMPIRICAL))
_FINEST, _COARSEST = 0.2, 640.0
"""Zone over the standard tolerance factor i of ISO 286-1 outside which it is doubted: IT01 is 0.4 of it and more, and
IT15 is 640 [-]."""
_WIDE = 0.12
"""Zone over the nominal size from which on it is doubted [-]."""
_SMALLEST_SIZE = 0.1 * MILLIMETRE
"""Nominal size below which it is doubted, where one is stated [m]."""
_OF_FREE = ("min", "max", "cost")
"""Columns that a row whose zone is locked may leave empty."""
_FINEST_ZONE = 0.1 * MICROMETRE
"""Zone of a feature without a nominal size below which it is doubted [m]."""
_WIDEST_ZONE = 2.0 * MILLIMETRE
"""Zone of a feature without a nominal size above which it is doubted: a metre may be meant as a millimetre [m]."""
_LARGEST_SIZE = 3150.0 * MILLIMETRE
"""Largest nominal size of ISO 286-1 [m]."""
_OFF = 3.0
"""Distance of the middle of a zone from the nominal size, over the zone, from which on it is doubted: ISO 286 has such
fits, but hardly in a precision part [-]."""
_RANGE = 100.0
"""Factor between a zone and its smallest or largest one from which on their units are doubted [-]."""
_COST, _FEWEST = 50.0, 3
"""Factor between a cost and the middle one of a table of so many rows from which on it is doubted [-]."""
_CAPABILITY = (0.4, 4.0)
"""Cp outside which a process is doubted [-]."""
_STEEP = 0.01
"""Zone over the length that an angle is taken over, from which on the length is doubted [rad]."""
_FLAT = 5e-6
"""The same below which the length is doubted, 1″ [rad]; assumption."""
_SHIPPED = "generic"
"""Process capability library of a table that names none."""
SMALLEST_KEPT = 0.01
"""Smallest share that sorting may leave of all parts [-]."""
_NEAR = 0.75
"""Likeness of a head to the name of a column from which on it is a slip rather than a column of the user's own [-]."""
_FIRST_WORD = re.compile(r"\s*(\w+)\s*[(/,:*]")
"""First word of a head that goes on in brackets or behind a stroke."""
_NUMBERS = tuple(
    name for name, own in COLUMNS.items() if own.unit and name not in ("batches", "spectrum", "systematic")
)
"""Columns of numbers, of which a head such as ``Cp (short)`` is one in other words."""
_BOTH = re.compile(r"(?:±|\+/-|\+-)\s*")
"""What stands before a number that is both deviations."""
_MEASURED = 10.0
"""Largest deviation of a measured part over the largest zone that a model believes [-]."""


class ProcessCapability(Record):
    """One row: a process and a feature; the fields are the column headers without their unit."""

    process: Annotated[str, Field(min_length=1)]
    feature: Feature
    Cp: Annotated[float, Field(ge=0.1, le=10)]
    shift: Annotated[float, Field(ge=-1, le=1)] = 0.0
    distribution: Distribution = Distribution.NORMAL
    shape: Annotated[str, BeforeValidator(shapes_text)] = ""
    sorted: bool = False
    note: Annotated[str, Field(min_length=1)]

    @model_validator(mode="after")
    def _distribution_makes_sense(self) -> ProcessCapability:
        if self.distribution not in CLOSED_FORMS:
            raise ValueError(
                f"distribution {self.distribution.value} belongs to single sources; allowed is one of "
                + ", ".join(CLOSED_FORMS)
            )
        if self.feature is not Feature.SIZE and self.shift != 0:
            raise ValueError(f"shift must be 0 for feature {self.feature.value}: {self.shift:g}")
        require_shapes(self.distribution, parsed_shapes(self.shape))
        return self

    @property
    def cells(self) -> dict[str, object]:
        """What a row of a tolerance table takes from it."""
        return self.model_dump(include={"Cp", "shift", "distribution", "shape", "sorted"})


ProcessCapabilities = Mapping[tuple[str, Feature], ProcessCapability]


def load_process_capabilities(name: str | Path) -> ProcessCapabilities:
    """Return a process capability library by shipped name or from the user's CSV file.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".processes.csv", "process capability library")
    found: dict[tuple[str, Feature], ProcessCapability] = {}
    for place, capability in read_rows(path, ProcessCapability, "process", _UNITS):
        key = capability.process, capability.feature
        if key in found:
            raise InputError(
                f"{place}: process is {key[0]!r} for feature {key[1].value} for the second time; each has one row."
            )
        found[key] = capability
    return found


def with_process(cells: Mapping[str, object], capabilities: ProcessCapabilities, place: str) -> dict[str, object]:
    """Return the cells of a row of a tolerance table, completed by the capability of the process that it names.

    A process may be known to a process cost table alone: its row states Cp, so nothing has to be looked up.
    """
    process, feature = cells.get("process"), cells.get("feature", Feature.SIZE)
    if process is None:
        return dict(cells)
    capability = capabilities.get((str(process), Feature(str(feature))))
    if capability is None:
        if "Cp" in cells:
            return dict(cells)
        known = [name for name, kind in capabilities if kind == feature]
        raise UnknownNameError.among(place, f"process (with an empty Cp) for feature {feature}", str(process), known)
    taken = capability.cells
    if cells.get("distribution", capability.distribution) is not capability.distribution:
        del taken["shape"]  # it belongs to the library's distribution
    return {**taken, **cells}


def doubts(sources: Sequence[Source], table: str) -> tuple[str, ...]:
    """Return what is allowed in a table but hardly meant, a sentence a row."""
    costs = np.array([source.cost for source in sources if source.zone > 0 and source.cost > 0])
    middle = float(np.median(costs)) if costs.size >= _FEWEST else 0.0
    return tuple(
        f"{table}, {source.own_id or source.name}: {'; '.join(reasons)}. Is it meant?"
        for source in sources
        if (reasons := _reasons(source, middle))
    )


def _reasons(source: Source, middle_cost: float) -> list[str]:
    """Return what is doubted of a row."""
    if source.zone == 0.0:
        off = abs(source.middle) > 0
        return [f"its zone is 0 and {_length(source.middle)} off the nominal size"] if off else []
    of_parts = [source.measured.doubt] if source.measured and source.measured.doubt else []
    return [*_of_size(source), *_of_zone(source), *_of_process(source, middle_cost), *of_parts]


def _of_size(source: Source) -> Iterator[str]:
    """Yield what is doubted of the nominal size and of where the zone lies beside it."""
    zone, nominal = source.zone, source.nominal
    if nominal < 0:
        yield f"the nominal size is {_length(nominal)}, below 0"
    if 0 < nominal < _SMALLEST_SIZE:
        yield f"the nominal size is {_length(nominal)}"
    if abs(nominal) > _LARGEST_SIZE:
        yield f"the nominal size is {_length(nominal)}, beyond those of ISO 286"
    if source.feature is Feature.SIZE and not source.over and 0 < nominal * _WIDE < zone:
        yield f"the zone of {_length(zone)} is {zone / nominal:.0%} of the nominal size of {_length(nominal)}"
    if abs(source.middle) > _OFF * zone:
        yield f"the middle of its zone of {_length(zone)} is {_length(source.middle)} off the nominal size"
    elif source.feature is Feature.SIZE and abs(source.middle) > 0.5 * zone * (1 + 1e-9):
        yield (
            f"both deviations have one sign, so the nominal size lies outside its zone, whose middle is "
            f"{_length(source.middle)} off"
        )


def _of_zone(source: Source) -> Iterator[str]:
    """Yield what is doubted of the size of the zone and of its range."""
    zone = source.zone
    if zone < _FINEST_ZONE:
        yield f"the zone of {_length(zone)} is finer than any process holds"
    elif not source.nominal and zone > _WIDEST_ZONE:
        yield f"the zone of {_length(zone)} is wide, and no nominal size is stated beside it"
    elif source.nominal > 0 and source.feature is Feature.SIZE and not source.over:
        factor = zone / tolerance_factor(source.nominal)
        if not _FINEST <= factor <= _COARSEST:
            than = "finer than IT01" if factor < _FINEST else "coarser than IT15"
            yield f"the zone of {_length(zone)} is {than} at a nominal size of {_length(source.nominal)}"
    if not source.is_resolved:
        yield f"the zone of {_length(zone)} is {zone / source.uncertainty:.2g} times the uncertainty of its gauge"
    if source.over and not _FLAT <= zone / source.over <= _STEEP:
        yield f"a zone of {_length(zone)} over {_length(source.over)} is an angle of {zone / source.over:.2g} rad"
    if not source.locked and source.maximum > _RANGE * zone:
        yield f"max of {_length(source.maximum)} is {source.maximum / zone:.3g} times the zone"
    if not source.locked and 0 < source.minimum < zone / _RANGE:
        yield f"min of {_length(source.minimum)} is 1/{zone / source.minimum:.3g} of the zone"


def _of_process(source: Source, middle_cost: float) -> Iterator[str]:
    """Yield what is doubted of capability and cost."""
    if not _CAPABILITY[0] <= source.cp <= _CAPABILITY[1]:
        yield f"Cp is {source.cp:g}"
    if middle_cost and source.cost and not middle_cost / _COST <= source.cost <= middle_cost * _COST:
        yield f"its cost of {source.cost:g} is far from {middle_cost:g}, the middle one of the table"


def _length(length: float) -> str:
    """Return a length in the unit that a drawing would have."""
    if abs(length) >= MILLIMETRE / 2:
        return f"{length / MILLIMETRE:.4g} mm"
    return f"{length / MICROMETRE:.4g} µm"


class HeadsFile(Record):
    """What an office calls the columns of its table, as a TOML file beside it says it."""

    columns: Mapping[str, str]  # Head as it is written, without its unit → name of the column that it is


def heads_of(path: Path, columns: Mapping[str, str] = MappingProxyType({})) -> Heads:
    """Return how the heads of a tolerance table are read, some of them called as an office does.

    What is given comes before what the file `heads_file` beside the table says.

    Raises
    ------
    InputError, UnknownNameError
        A head stands for what is no column, or two heads for one; or the file is no such file.
    """
    beside, places = heads_file(path), dict.fromkeys(columns, "drawing, columns")
    if stated := heads_beside(path):
        columns, places = {**stated, **columns}, {**dict.fromkeys(stated, f"{beside}, columns"), **places}
    for head, name in columns.items():
        if name not in ToleranceRow.model_fields:
            raise UnknownNameError.among(places[head], f"column for {head!r},", name, ToleranceRow.model_fields)
    return Heads(needed=("id",), known=tuple(ToleranceRow.model_fields), called=dict(columns))


def heads_file(table: Path) -> Path:
    """Return the file beside a tolerance table that says what its heads mean, whether it is there or not."""
    return table.with_suffix(".toml")


def heads_beside(table: Path) -> Mapping[str, str]:
    """Return what the file beside a tolerance table says, nothing where there is none or it is of another kind."""
    path = heads_file(table)
    content = read_toml(path) if is_file(path) else {}
    if not get_close_matches("columns", content):
        return {}
    return validated(HeadsFile, content, path).columns


def heads_text(called: Mapping[str, str]) -> str:
    """Return the text of such a file."""
    lines = (f"{as_toml(head)} = {as_toml(name)}\n" for head, name in called.items())
    return "".join(["# What the heads of the table beside this file mean.\n[columns]\n", *lines])


def own_heads(path: Path, names: Sequence[str]) -> tuple[str, ...]:
    """Return the heads of the user's own columns; those nearly the name of a column are an InputError."""
    spelt = {name.lower(): name for name in ToleranceRow.model_fields}
    own = [name for name in names if name and name not in ToleranceRow.model_fields]
    near = {name: get_close_matches(name.lower(), spelt, n=1, cutoff=_NEAR) for name in own}
    for name in own:
        first = _FIRST_WORD.match(name)
        if first and spelt.get(first[1].lower()) in _NUMBERS:
            near[name] = [first[1].lower()]
    if slips := [f"{name!r} ({spelt[found[0]]}?)" for name, found in near.items() if found]:
        raise InputError(
            f"{path}: no such column: {', '.join(slips)}; rename each, or say what it is in "
            f"{heads_file(path).name} beside it or by ta.drawing(columns=)."
        )
    return tuple(own)


def load_tolerance_table(
    name: str | Path,
    capabilities: str | Path = _SHIPPED,
    sheet: str = "",
    columns: Mapping[str, str] = MappingProxyType({}),
) -> tuple[Source, ...]:
    """Return the sources of a tolerance table and its processes, each by shipped name or from the user's file.

    Of a workbook the named sheet is read, the first unless named. Columns of the user's own are kept (`own_heads`); an
    office's heads stand for names of columns. One cell "± 0.05" or "h6" is both deviations of a row.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".tolerances.csv", "tolerance table")
    (_, first), *others = read_table_file(path, heads_of(path, columns), sheet=sheet)
    stated = [split_header(header) for header in first]
    own = own_heads(path, [name for name, _ in stated])
    headers = tuple(name for name, _ in stated)
    unit = "" if "unit" in headers else _unit_of_heads(stated)
    plus = headers.index("plus") if "plus" in headers else 0
    both = others and "minus" not in headers and all(_says_both(cells[plus]) for _, cells in others)
    kept, more = [name for name in headers if name not in own], {"unit": unit} if unit else {}
    require_columns(path, (*kept, *["minus"] * bool(both), *more), ToleranceRow)
    if len(set(own)) < len(own):
        twice = next(name for name in own if own.count(name) > 1)
        raise InputError(f"{path}: the column {twice!r} is there twice; each has one.")
    if not others:
        raise InputError(f"{path}: the table has no rows; one row per source is needed.")
    rows = [(number, dict(zip(headers, cells, strict=True)) | more) for number, cells in others]
    _require_units(path, [(name, unit) for name, unit in stated if name not in own], rows)
    known = []
    for number, row in rows:
        place = f"{path}, row {number} ({row['id'] or 'no id'})"
        bare = _without_units({name: row[name] for name in (*kept, *more)}, place)
        known.append((number, _both_ways(bare, place)))
    sources = sources_of_rows(known, capabilities, str(path), path.parent)
    full = dict(zip(headers, first, strict=True))
    return tuple(
        replace(source, own_cells=tuple((full[name], row[name]) for name in own))
        for source, (_, row) in zip(sources, rows, strict=True)
    )


def _says_both(plus: str) -> bool:
    """Return whether a cell says both deviations: behind ±, or as a fit."""
    return _BOTH.match(plus) is not None or is_fit(plus)


def _both_ways(row: dict[str, str], place: str) -> dict[str, str]:
    """Return a row with both deviations of one cell that says both, where it states no other."""
    plus = row.get("plus", "")
    if not _says_both(plus) or row.get("minus"):
        return row
    if sign := _BOTH.match(plus):
        size = plus[sign.end() :].replace(",", ".")
        return {**row, "plus": size, "minus": f"-{size}"}
    nominal, feature = row.get("nominal", ""), usual_word(row.get("feature", "")) or Feature.SIZE
    name = row.get("source") or row["id"]
    if feature != Feature.SIZE or name.rsplit(".", 1)[-1] in RADII or not nominal:
        allowed = "plus and minus, since a fit is that of a diameter or width with its nominal size"
        raise InputError.at(place, "plus", plus, allowed)
    unit, inch = usual_unit(row.get("unit", "")), usual_unit(row.get("unit", "")) == INCHES
    width = number_at(place, "nominal", nominal) * LENGTHS[INCHES if inch else "mm"]
    try:
        deviations = fit_deviations(plus, width)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None
    length = abs(width) / 100.0 if unit == PERCENT else UNITS.get(unit, 1.0) * MICROMETRE
    upper, lower = (f"{round(one / length, 12):.12g}" for one in deviations)
    return {**row, "plus": upper, "minus": lower}


def _unit_of_heads(stated: Sequence[tuple[str, str]]) -> str:
    """Return the one unit of all zones where every head of them states it, for a table without a column of units."""
    units = {usual_unit(unit) for name, unit in stated if name in COLUMNS and COLUMNS[name].unit == "unit"}
    return units.pop() if len(units) == 1 and units <= {*UNITS, PERCENT} else ""


def _without_units(row: dict[str, str], place: str) -> dict[str, str]:
    """Return a row whose numbers stand without the units behind them, which must be those of their columns."""
    found, unit = dict(row), usual_unit(row["unit"])
    for name, cell in row.items():
        own = {"unit": unit, "mm": INCHES if unit == INCHES else "mm"}.get(COLUMNS[name].unit, "")
        if own and cell:
            try:
                found[name] = number_in(cell, own)
            except ValueError as error:
                raise InputError.at(place, name, cell, str(error)) from None
    return found


def _require_units(path: Path, stated: Sequence[tuple[str, str]], rows: Sequence[tuple[int, dict[str, str]]]) -> None:
    """Raise unless headers state the units of `COLUMNS`; that of zones may also be the one unit of all rows.

    A nominal size may be in inches where all rows are, and in mm where none is.
    """
    units = {name: column.unit for name, column in COLUMNS.items()}
    for column, unit in stated:
        own = usual_unit(unit)
        is_length = units[column] == "mm" and own in ("mm", INCHES)
        if not is_length and (units[column] != "unit" or unit in ("", "unit")):
            continue
        if own not in UNITS and own != PERCENT:
            allowed = f"unit, where the column unit says it row by row; or {ALLOWED_UNITS}, the same as in all rows"
            raise InputError.at(path, f"the unit of column {column}", unit, allowed)
        for number, row in rows:
            said = usual_unit(row["unit"])
            other = (said == INCHES) != (own == INCHES) if is_length else said != own
            if other and (said in UNITS or said == PERCENT):
                allowed = f"{unit} as in the header {column} [{unit}]; numbers are not converted"
                raise InputError.at(f"{path}, row {number} ({row['id'] or 'no id'})", "unit", row["unit"], allowed)
        units[column] = unit
    require_units(path, stated, units)


def sources_of_rows(
    rows: Sequence[tuple[int, Mapping[str, object]]], capabilities: str | Path, place: str, folder: Path
) -> tuple[Source, ...]:
    """Return the sources of numbered rows, whose cells are text or already of the type of their field.

    The place is what messages name; files of measured parts are looked for in the folder.
    """
    # The shipped library is read where a row names a process of it.
    is_asked = capabilities != _SHIPPED or any(row.get("process") for _, row in rows)
    processes = load_process_capabilities(capabilities) if is_asked else {}
    sources: dict[str, Source] = {}
    faults = Faults()
    for number, row in rows:
        identity = str(row.get("id", "")).strip()
        where = f"{place}, row {number} ({identity or 'no id'})"
        with faults.kept():
            _require_plain(row, f"{place}, row {number}")
            _require_filled(row, where)
            cells = with_process(_with_range(typed_cells(ToleranceRow, row, where)), processes, where)
            source = validated(ToleranceRow, cells, where).as_source(folder)
            if source.name in sources:
                field = "source" if source.own_id else "id"
                raise InputError(f"{where}: {field} is {source.name!r} for the second time; each source has one row.")
            if {identity, source.name} & {*known_as(sources.values())}:
                raise InputError(f"{where}: id is {identity!r} for the second time; each row has one of its own.")
            if source.sorted and source.zone_mapping.inside < SMALLEST_KEPT:
                left = f"no, as it would leave less than {SMALLEST_KEPT:.0%} of all parts"
                raise InputError.at(where, "sorted", "yes", left)
            sources[source.name] = source
    faults.require_none()
    return tuple(sources.values())


def _require_plain(row: Mapping[str, object], where: str) -> None:
    """Raise if a cell holds what no table can be read back with, or a name what breaks its line."""
    for field, cell in row.items():
        if re.search(_NO_NAME if field in ("id", "source", "group") else _NO_TEXT, str(cell)):
            raise InputError.at(where, field, cell, "text without control characters, a name on one line")


def _require_filled(row: Mapping[str, object], where: str) -> None:
    """Raise if several cells are empty that a source needs, as in the row of a sum."""
    given = _OF_FREE if row.get("locked") not in ("", None) else ()
    needed = [name for name, field in ToleranceRow.model_fields.items() if field.is_required() and name not in given]
    missing = [name for name in needed if row.get(name) in ("", None)]
    if len(missing) > 1:
        raise InputError(
            f"{where}: {', '.join(missing)} are missing; a row that is no source, such as a sum, begins with # or goes."
        )


def _with_range(cells: dict[str, object]) -> dict[str, object]:
    """Return the cells of a row; a locked one without range and price may become what it is, and costs nothing."""
    plus, minus = cells.get("plus"), cells.get("minus")
    if cells.get("locked") is not True or not (isinstance(plus, int | float) and isinstance(minus, int | float)):
        return cells
    width = abs(plus - minus)
    return dict(zip(_OF_FREE, (width, width, 0.0), strict=True)) | cells


def table_rows(sources: Sequence[Source], folder: Path | None = None) -> list[list[str | int | float]]:
    """Return the cells of the sources in the order of `COLUMNS`, the user's own behind them.

    Files of measured parts are named from the folder of the table, or so that they are found from everywhere.
    """
    own = own_heads_of(sources)
    names = headers_in(COST_UNITS, sources)
    return [
        [
            *(_written(cell_of(source, name), folder) for name in names),
            *(dict(source.own_cells).get(head, "") for head in own),
        ]
        for source, _ in by_row(sources)
    ]


def own_heads_of(sources: Sequence[Source]) -> tuple[str, ...]:
    """Return the heads of the user's own columns, in their order."""
    return tuple(dict.fromkeys(head for source in sources for head, _ in source.own_cells))


def _written(cell: Cell, folder: Path | None) -> str | int | float:
    """Return a cell as a table shows it."""
    if isinstance(cell, MeasuredParts):
        file = (Path(os.path.relpath(cell.path, folder.resolve())) if folder else cell.path).as_posix()
        return f"{file}:{cell.characteristic}" if cell.characteristic else file
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if cell is None:
        return ""
    return str(cell) if isinstance(cell, str) else cell


def table_frame(
    sources: Sequence[Source],
    folder: Path | None = None,
    cost_unit: str = COST_UNITS,
    called: Mapping[str, str] = MappingProxyType({}),
) -> pd.DataFrame:
    """Return the sources as a tolerance table in the layout that `load_tolerance_table` reads, heads as an office's."""
    import pandas as pd

    heads = [*headers_in(cost_unit, sources, called).values(), *own_heads_of(sources)]
    return pd.DataFrame(table_rows(sources, folder), columns=heads)


def table_text(
    sources: Sequence[Source],
    folder: Path | None = None,
    currency: str = "",
    called: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the sources as the CSV file that `load_tolerance_table` reads, costs in a currency if they are in one."""
    text = StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    heads = headers_in(currency or COST_UNITS, sources, called).values()
    writer.writerow(map(no_formula, [*heads, *own_heads_of(sources)]))
    writer.writerows(map(no_formula, row) for row in table_rows(sources, folder))
    return text.getvalue()


def require_small_zones(sources: Sequence[Source], largest: float, place: str | Path) -> None:
    """Raise unless all zones, those that may be asked for and measured parts are as small as a model believes [m]."""
    limit, farthest = largest / MICROMETRE, _MEASURED * largest / MICROMETRE
    for source in sources:
        who = f"{place} ({source.name})"
        if source.measured and (own := max(map(abs, source.measured.values)) / MICROMETRE) > farthest:
            file = source.measured.path.name
            raise InputError(f"{who}: {file} has a deviation of {own:g} µm; allowed is {farthest:g} µm.")
        zone, smallest, most = (length / MICROMETRE for length in (source.zone, source.minimum, source.maximum))
        if zone > limit:
            raise InputError(f"{who}: the zone plus − minus is {zone:g} µm and must be 0 to {limit:g} µm.")
        if zone > 0 and not source.locked and most > limit:
            raise InputError(
                f"{who}: the zone must lie between min and max, above 0 and up to {limit:g} µm: "
                f"min {smallest:g}, zone {zone:g}, max {most:g} µm."
            )


def with_zones(
    sources: Sequence[Source], zones: Sequence[float], costs: Mapping[str, float] | None = None
) -> tuple[Source, ...]:
    """Return the sources at other zones [m], each at the cost given for its name or else as 1/zone [cost units]."""
    known = costs or {}
    return tuple(
        source
        if zone == source.zone and source.name not in known
        else replace(
            source,
            zone=zone,
            cost=known[source.name] if source.name in known else source.cost * source.zone / zone,
            grade=source.grade if zone == source.zone else "",
        )
        for source, zone in zip(sources, zones, strict=True)
    )

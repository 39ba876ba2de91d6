"""A drawing as a whole: the sources of its table, how they depend on each other, and what their zones cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from tolalloc.drawings.correlation import Correlation, load_correlations
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.fields import COLUMNS, ToleranceRow
from tolalloc.drawings.heads import split_header
from tolalloc.drawings.population import STATED, Population, populated, require_population
from tolalloc.drawings.returned_table import TableFile
from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import (
    DATA,
    hidden_cells,
    is_workbook,
    read_table_file,
    require_columns,
    setting_line,
    stated_currency,
    stated_settings,
)
from tolalloc.drawings.tolerance_table import (
    doubts,
    heads_beside,
    heads_file,
    heads_of,
    heads_text,
    load_tolerance_table,
    own_heads,
    sources_of_rows,
    table_frame,
    table_text,
)
from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import is_file, other_encoding
from tolalloc.reading.files import found_from_here, shipped_or_path, write_new
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import COST_UNITS, MICROMETRE, currency_in

if TYPE_CHECKING:
    import pandas as pd

_LARGEST_RATIO = 100.0
"""Largest zone over the uncertainty of its gauge that may be asked for as the smallest [-]."""

Costs = str | Path | Mapping[str, Any]
"""Process cost table by shipped name or path, or source → ways to make it; empty: what the table says, as 1/zone."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Drawing:
    """What is known of the parts before anything is computed.

    Parameters
    ----------
    name
        Tolerance table as it was named, for reports.
    errors
        The sources of the table with their correlations.
    costs
        Ways to make the features and what each costs, which `tolalloc.allocation.cost` reads.
    notes
        What a reader of its table must know, such as which rows were hidden.
    currency
        What its costs are in, such as EUR, which reports then say; empty where they are cost units.
    settings
        Settings of the model that belong to it, such as the clearances of a tooth modification: a study of the drawing
        takes them instead of its model's own [units of their names].
    population
        For which parts a drawing promises its yield: those that the table states, row by row, unless given; ``uniform``
        for parts spread evenly over their zones; ``none`` for parts anywhere in them, which only the worst unit tells;
        or one Cp for all, about the middle of each zone [-].
    gauge_ratio
        Smallest zone that may be asked for, over the uncertainty of its gauge, where the table states one; 10 by the
        rule of many shops, 0 to leave it to the table. A zone of the table below that is opened to it [-].
    """

    name: str
    errors: ErrorModel
    costs: Costs = ""
    notes: tuple[str, ...] = ()
    currency: str = ""
    settings: Mapping[str, float] = field(default_factory=dict)
    population: Population = STATED
    gauge_ratio: float = 0.0

    def __post_init__(self) -> None:
        require_population(self.population, self.name)
        if not (is_number(self.gauge_ratio) and 0 <= self.gauge_ratio <= _LARGEST_RATIO):
            raise InputError.at(self.name, "gauge_ratio", self.gauge_ratio, f"0 to {_LARGEST_RATIO:g}")

    @classmethod
    def of_rows(
        cls,
        rows: Iterable[Mapping[str, object]],
        *,
        place: str = "drawing",
        processes: str | Path = "generic",
        correlations: str | Path | Correlation = "",
        costs: Costs = "",
        currency: str = "",
        population: Population = STATED,
        gauge_ratio: float = 0.0,
    ) -> Drawing:
        """Return the drawing of rows written in Python, with the same checks as those of a file.

        Parameters
        ----------
        rows
            Field of `tolalloc.drawings.fields.ToleranceRow` → value; needed are id, plus, minus, unit, min, max, cost.
        place
            What messages and reports call the rows.
        processes, correlations, costs
            As in `load_drawing`; correlations may also be given as they are.
        currency
            What costs are in, three letters as in EUR or a sign; cost units if empty.
        population, gauge_ratio
            As of a `Drawing`.

        Raises
        ------
        InputError, UnknownNameError
            The row, field and value that are not allowed.

        Examples
        --------
        A hub of 55.29 ± 0.1 mm is one source with one column, in metres:

        >>> zone = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 3.0}
        >>> hub = Drawing.of_rows([{"id": "hub", "nominal": 55.29, **zone}])
        >>> hub.errors.columns, hub.sources[0].zone
        (('hub',), 0.0002)
        """
        listed = list(rows) if isinstance(rows, Iterable) and not isinstance(rows, str | Mapping) else [rows]
        for row in listed:
            if not (isinstance(row, Mapping) and "id" in row):
                raise InputError.at(place, "rows", row, 'a list of rows such as {"id": "hub", "plus": 0.1, …}')
        numbered = [(number, dict(row)) for number, row in enumerate(listed, start=1)]
        for number, row in numbered:
            require_columns(f"{place}, row {number} ({row['id']})", tuple(row), ToleranceRow)
        sources = sources_of_rows(numbered, processes, place, Path.cwd())
        if not isinstance(correlations, Correlation):
            correlations = load_correlations(correlations, sources) if correlations else Correlation()
        if currency and currency_in(currency) != currency:
            raise InputError.at(place, "currency", currency, "three letters such as EUR, or €, $, £ or ¥")
        errors = ErrorModel(sources, correlation=correlations, table=place)
        return cls(
            name=place,
            errors=errors,
            costs=_placed(costs),
            currency=currency,
            notes=doubts(sources, place),
            population=population,
            gauge_ratio=gauge_ratio,
        )

    def __repr__(self) -> str:
        return f"<drawing {self.name}: {len(self.sources)} sources>"

    @property
    def sources(self) -> tuple[Source, ...]:
        """The rows of the tolerance table."""
        return self.errors.sources

    @property
    def correlation(self) -> Correlation:
        """The correlations between the sources."""
        return self.errors.correlation

    def with_table(self, table: str | Path) -> Drawing:
        """Return the drawing at the zones of another tolerance table, with the same correlations and process costs.

        Its settings stay as well, but those that the table states.
        """
        read = load_drawing(found_from_here(table))
        changed = self.with_sources(read.sources, str(table))
        errors, settings = replace(changed.errors, called=read.errors.called), {**self.settings, **read.settings}
        currency = read.currency or self.currency
        return replace(changed, errors=errors, notes=read.notes, currency=currency, settings=settings)

    def with_sources(self, changed: Iterable[Source], name: str = "") -> Drawing:
        """Return the drawing with some of its sources changed, with the same correlations and process costs."""
        others = {source.name: source for source in changed}
        rows = {source.row for source in others.values()}  # whose places are among them
        known = {source.name: source for source in self.sources if source.name not in rows}
        sources = tuple((known | others).values())
        errors = replace(self.errors, sources=sources, table=name or self.name)
        return replace(self, name=name or self.name, errors=errors)

    @property
    def as_asked(self) -> ErrorModel:
        """The sources as a study takes them: in the population of the drawing, no zone too fine for its gauge.

        Raises
        ------
        InputError
            A zone whose largest is too fine for its gauge, or whose cost no rule tells where it is opened.
        """
        found = populated(self.errors, self.population)
        if not self.gauge_ratio:
            return found
        return replace(found, sources=tuple(self._gauged(own) for own in found.sources))

    def _has_prices(self, source: Source) -> bool:
        """Return whether process costs may say what a source costs at another zone."""
        return (
            bool({source.name, source.own_id} & {*self.costs}) if isinstance(self.costs, Mapping) else bool(self.costs)
        )

    @property
    def opened(self) -> str:
        """Which zones were too fine for their gauges and were opened, a sentence; nothing where none was."""
        rows = zip(self.errors.sources, self.as_asked.sources, strict=True)
        told = [
            f"{own.own_id or own.name} {own.said(own.zone)} → {new.said(new.zone)}"
            for own, new in rows
            if new.zone != own.zone
        ]
        if not told:
            return ""
        rows_opened = ", ".join(told)
        return f"Opened to {self.gauge_ratio:g} times the uncertainty of their gauges, before all else: {rows_opened}."

    def _gauged(self, source: Source) -> Source:
        """Return a source whose smallest zone its gauge resolves, its cost as 1/zone where its zone is opened."""
        least = self.gauge_ratio * source.uncertainty
        if source.locked or least <= source.minimum:
            return source
        told = f"{source.uncertainty / MICROMETRE:g} µm of its gauge, and {self.gauge_ratio:g} times as much is asked"
        if least > source.maximum:
            allowed = f"{least / MICROMETRE:g} µm or more, for {told}"
            raise InputError.at(f"{self.name} ({source.name})", "max", f"{source.maximum / MICROMETRE:g} µm", allowed)
        if least > source.zone and self._has_prices(source):
            allowed = f"{least / MICROMETRE:g} µm or more with process costs, for {told}"
            raise InputError.at(f"{self.name} ({source.name})", "zone", f"{source.zone / MICROMETRE:g} µm", allowed)
        zone = max(source.zone, least)
        return replace(source, minimum=least, zone=zone, cost=source.cost * source.zone / zone)

    def to_frame(self) -> pd.DataFrame:
        """Return the tolerance table, units in the headers."""
        return table_frame(self.sources, cost_unit=self.currency or COST_UNITS, called=self.errors.called)

    def to_csv(self, path: str | Path) -> Path:
        """Write the tolerance table, which `load_drawing` reads again, into a new file, and return its path.

        Heads of an office's are written again, and what they mean into a TOML file beside the table; its settings stand
        below its rows. Process costs (``costs=``) and correlations are not in it.

        Raises
        ------
        InputError
            The file is there already or cannot be made.
        """
        written, called = Path(path), self.errors.called
        settings = "".join(f"{setting_line(name, value)}\n" for name, value in self.settings.items())
        write_new(written, table_text(self.sources, written.parent, self.currency, called) + settings)
        if called:
            write_new(heads_file(written), heads_text(called))
        return written

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the name and the table."""
        table = self.to_frame().to_html(index=False, border=0, classes="data", float_format="{:.6g}".format)
        return f"<p><b>{escape(self.name)}: {len(self.sources)} sources</b></p>\n{table}"


def load_drawing(
    table: str | Path,
    processes: str | Path = "generic",
    correlations: str | Path = "",
    costs: Costs = "",
    folder: Path | None = None,
    sheet: str = "",
    columns: Mapping[str, str] = MappingProxyType({}),
    population: Population = STATED,
    gauge_ratio: float = 0.0,
) -> Drawing:
    """Return a drawing from its files, each by shipped name or path.

    Parameters
    ----------
    table
        Tolerance table, CSV or XLSX.
    processes
        Process capability library that rows of the table may name.
    correlations
        Correlations between sources; none if empty.
    costs
        Ways to make the features and what each costs, as a file or source → processes; if empty, every feature costs
        what the table says at its zone, falling as 1/zone.
    folder
        Folder that relative paths start from, such as that of a study; the current one unless given.
    sheet
        Sheet of a workbook that holds the tolerance table; the first unless given.
    columns
        Head of a table as an office writes it, without its unit → name of the column that it is, such as
        ``{"Zeichn.-Nr.": "drawing"}``; a TOML file beside the table, of the same stem, may say it as well, under
        ``[columns]``. Other heads that are no column's are kept with their cells.
    population, gauge_ratio
        As of a `Drawing`.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.

    Examples
    --------
    >>> drawing = load_drawing("rv20e_drawing")
    >>> len(drawing.sources), f"{1e6 * drawing.sources[0].zone:.1f} µm", drawing.settings["flank clearance [µm]"]
    (50, '4.0 µm', 3.5)
    """
    sources = load_tolerance_table(beside(folder, table), beside(folder, processes), sheet, columns)
    correlation = load_correlations(beside(folder, correlations), sources) if correlations else Correlation()
    path = found_from_here(beside(folder, table))
    notes, currency = _read_beside(path, sheet, columns)
    called = dict(heads_of(path, columns).called)
    file = TableFile(path=path.resolve(), sheet=sheet, columns=columns) if path.suffix else None
    return Drawing(
        name=str(table),
        errors=ErrorModel(sources, correlation=correlation, table=str(table), called=called, file=file),
        costs=_placed(costs if isinstance(costs, Mapping) else beside(folder, costs)),
        notes=(*notes, *doubts(sources, path.name)),
        currency=currency,
        settings=stated_settings(shipped_or_path(beside(folder, table), DATA, ".tolerances.csv", "tolerance table")),
        population=population,
        gauge_ratio=gauge_ratio,
    )


def _read_beside(table: Path, sheet: str, columns: Mapping[str, str]) -> tuple[tuple[str, ...], str]:
    """Return what a reader of a tolerance table must know, and the currency of its costs."""
    if not table.suffix:
        return (), ""  # a shipped one
    header, names = read_table_file(table, heads := heads_of(table, columns), sheet=sheet)[0]
    stated, units = [split_header(name) for name in names], {name: own.unit for name, own in COLUMNS.items()}
    own = own_heads(table, [name for name, _ in stated])
    titles = f"{table.name}: the header is in row {header}; the rows above it were left out"
    kept = f"{table.name}: kept unchanged and written again: {', '.join(own)}"
    found = [titles] * (header > 1) + [kept] * bool(own)
    if is_workbook(table):
        found += hidden_cells(table, sheet)
    elif encoding := other_encoding(table):
        found.append(f"{table.name}: read as {encoding}, since it is not UTF-8")
    if heads_beside(table):
        meant = ", ".join(f"{head} is {name}" for head, name in heads.called.items())
        found.append(f"{table.name}: heads as {heads_file(table).name} says: {meant}")
    return tuple(found), stated_currency(table, stated, units)


def beside(folder: Path | None, name: str | Path) -> str | Path:
    """Return where a file is that a study names; a shipped name stays as it is."""
    if not isinstance(name, str | Path):
        raise InputError.at("drawing", "a file", name, "a shipped name or a path")
    path = Path(name)
    return folder / path if folder and name and (path.suffix or is_file(folder / path)) else name


def _placed(costs: Costs) -> Costs:
    """Return costs with their path as it is meant now; they are read later, when no script is being read any more."""
    if isinstance(costs, Mapping) or not costs:
        return costs
    return found_from_here(costs) if Path(costs).suffix or is_file(found_from_here(costs)) else costs

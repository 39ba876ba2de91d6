"""What to write on the drawing: its tables by source and by dimension, their pictures, and the files that go on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from warnings import warn

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.allocation.result import AllocationResult
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.drawings.sources import RESOLVED, Source, by_row, length_unit, zone_in, zone_unit
from tolalloc.drawings.table_file import setting_line
from tolalloc.drawings.tolerance_table import heads_file, heads_text, table_frame
from tolalloc.exceptions import InputError
from tolalloc.reading.file_content import is_file
from tolalloc.reading.units import COST_UNITS, MICROMETRE, unit_of
from tolalloc.reports.columns import Column, Table, own_words, span
from tolalloc.reports.drawing_sheet import write_sheet
from tolalloc.reports.excel import Book
from tolalloc.reports.feature_frame import writing_unit
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.allocation_assembly import assembly_notes
from tolalloc.reports.tellers.allocation_inspection import add_plan, plan_lines, write_plan
from tolalloc.reports.tellers.allocation_population import assumed_sentences, population_note
from tolalloc.reports.tellers.allocation_sentences import amounts_convention, drawn_amounts
from tolalloc.reports.tellers.allocation_sheet import drawing_sheet
from tolalloc.reports.tellers.allocation_workbook import add_calculator
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity, short, with_unit
from tolalloc.reports.writer import write_csv

_say = Sentences("allocation")

_STEP = 0.1
"""Share of a zone by which the figure of effects opens it [-]."""

_NOTHING_LEFT = 0.01
"""What is left of a limit over an effect on it, up to which nothing is said to be left [-]."""
_NOTICED = 10.0
"""Tightening from which a shop is asked whether it holds a zone [%]."""

_EFFECTS = 4
"""Dimensions whose effect is drawn, the largest first [-]."""

_Source = tuple[Source, Source]
"""A source before and after."""
_Row = tuple[Source, Sequence[_Source]]
"""What a table calls sources, and these, alike, before and after."""
_Dimension = tuple[str, Sequence[_Source]]
"""The name of a dimension and its members."""


def sources_table(result: AllocationResult) -> Table[_Row]:
    """Return the drawing in short: zone, grade, process, share of the variance and cost of every row of the table."""
    shares, changes, unit = _shares(result), result.process_changes, unit_of(result.leading)
    by_deviation, by_zone = (_by_source(result, own) for own in (result.chosen.by_deviation, result.chosen.by_zone))
    zone, (length, _) = zone_unit(result.space.errors.sources), length_unit(result.space.errors.sources)
    made_before, made = _processes(result)

    def each(known: Mapping[str, float], row: _Row, otherwise: float = np.nan) -> list[float]:
        return [known.get(own.name, otherwise) for own, _ in row[1]]

    columns: list[Column[_Row]] = [
        Column("source", lambda row: row[0].name),
        *own_words(lambda row: row[:1]),
        Column("places [-]", lambda row: str(len(row[1])), nothing="1"),
        Column("callout", lambda row: row[0].feature.value),
        Column(f"zone before [{zone}]", lambda row: zone_in(row[1][0][0], zone)),
        Column(f"zone [{zone}]", lambda row: zone_in(row[0], zone)),
        Column("change [%]", lambda row: _change(row[1][0])),
        Column("grade", lambda row: row[0].grade),
        Column("process before", lambda row: made_before[row[1][0][0].name]),
        Column("process", lambda row: made[row[1][0][0].name]),
        Column("share of variance [%]", lambda row: sum(each(shares, row))),
    ]
    if by_deviation:
        columns.append(Column(f"Sens [{unit}/{length}]", lambda row: _span(each(by_deviation, row))))
    if by_zone:
        columns.append(Column(f"kept value per zone [{unit}/{length}]", lambda row: sum(each(by_zone, row))))
    columns.append(Column("cost before [{cost}]", lambda row: sum(old.cost for old, _ in row[1])))
    columns.append(Column("cost [{cost}]", lambda row: sum(new.cost for _, new in row[1])))
    if any(changes.values()):
        columns.append(Column("of it for a new process [{cost}]", lambda row: sum(each(changes, row, 0.0))))
    columns.append(Column("locked", lambda row: "yes" if row[0].locked else "no"))
    before, drawn = {own.name: own for own in result.space.errors.sources}, by_row(result.drawn_sources)
    rows = [(row, [(before[own.name], own) for own in members]) for row, members in drawn if row.zone != 0.0]
    return Table(name="drawing", columns=columns, rows=rows)


def _span(values: Sequence[float]) -> float | str:
    """Return a cell of one value or from the smallest of several to the largest."""
    return values[0] if len(values) == 1 else span(min(values), max(values))


def dimensions_table(result: AllocationResult) -> Table[_Dimension]:
    """Return the drawing line by line: a dimension, or members of one that share a value where it has several."""
    parts, zone = _parts(result), zone_unit(result.space.errors.sources)
    (before, after), portrait = _processes(result), portrait_of(result.model)

    def process_before(row: _Dimension) -> str:
        name = row[1][0][0].name
        return before[name] if before[name] != after[name] else ""

    def limit_of(row: _Dimension) -> str:
        output = result.asked_by.get(row[1][0][0].dimension, "")
        return portrait.display_name(output) if output else ""

    columns: list[Column[_Dimension]] = [
        Column("dimension", lambda row: row[0], terminal=1),
        *own_words(_after, lambda row: row[0]),
        Column("places [-]", lambda row: len(row[1])),
        Column(f"write [{writing_unit(result.drawn_sources)}]", lambda row: portrait.frames(_after(row)), terminal=2),
        Column(f"zone before [{zone}]", lambda row: _zones((old for old, _ in row[1]), zone)),
        Column(f"zone [{zone}]", lambda row: _zones((new for _, new in row[1]), zone)),
        Column("change [%]", lambda row: _change(row[1][0])),
        Column("grade", lambda row: row[1][0][1].grade, nothing="", terminal=5),
        Column("process before", process_before, nothing=""),
        Column("process", lambda row: after[row[1][0][0].name], nothing="as today", terminal=6),
        Column("index as drawn [%]", lambda row: parts.get(row[1][0][0].dimension, np.nan), terminal=3),
        Column("limit that holds it", limit_of, nothing=""),
        Column("cost before [{cost}]", lambda row: np.sum([old.cost for old, _ in row[1]])),
        Column("cost [{cost}]", lambda row: np.sum([new.cost for _, new in row[1]]), terminal=4),
        Column("locked", lambda row: "yes" if row[1][0][0].locked else "no", nothing="no"),
    ]
    known = {own.name: own for own in result.space.errors.sources}
    rows = [(result.line_name(own), [(known[member.name], member) for member in own[1]]) for own in result.lines]
    return Table(name="dimensions", columns=columns, rows=rows)


def _after(row: _Dimension) -> list[Source]:
    """Return the members of a dimension as drawn."""
    return [own for _, own in row[1]]


def _change(row: _Source) -> float:
    """Return the change of a zone, 0 where rounding alone differs [%]."""
    return round((row[1].zone / row[0].zone - 1) * 100, 2) + 0.0


def _processes(result: AllocationResult) -> Iterator[dict[str, str]]:
    """Yield source → the process that makes it, before and now."""
    stated = {own.name: own.process for own in result.space.errors.sources}
    for space, design in ((result.space, result.free.baseline), (result.drawn, result.chosen)):
        yield stated | {name: made.name for name, made in space.made_by(design.design).items()}


def _zones(members: Iterable[Source], unit: str) -> float | str:
    """Return the zone of all members, or the smallest and the largest of them [unit]."""
    return _span([zone_in(own, unit) for own in members])


def _parts(result: AllocationResult) -> dict[str, float]:
    """Return the total index of every dimension, correlated ones under each of their names [%]."""
    if (found := result.shares) is None:
        return {}
    return {
        name: float(total) * 100.0
        for joined, total in zip(found.sources, found.total, strict=True)
        for name in joined.split(" + ")
    }


def _by_source(result: AllocationResult, derivatives: Float[np.ndarray, " source"] | None) -> dict[str, float]:
    """Return derivatives of the chosen design by the name of the source, none where there are none.

    Per unit of length that a report shows zones in [output per µm, or in].
    """
    if derivatives is None:
        return {}
    names = [source.name for source in result.drawn.errors.active]
    _, length = length_unit(result.space.errors.sources)
    return dict(zip(names, (derivatives * length).tolist(), strict=True))


def _shares(result: AllocationResult) -> dict[str, float]:
    """Return the part of every source in the sum of the total indices, that of a dimension in equal parts [%]."""
    if (found := result.shares) is None:
        return {}
    said = dict[str, float]()
    for joined, share in zip(found.sources, found.total / found.total.sum() * 100, strict=True):
        members = [own for name in joined.split(" + ") for own in result.dimensions.get(name, ())]
        said |= {own.name: float(share) / len(members) for own in members}
    return said


def tolerances_frame(result: AllocationResult, cost_unit: str = COST_UNITS) -> pd.DataFrame:
    """Return the tolerance table in the layout of the input, with share of the variance and change added."""
    frame = table_frame(result.drawn_sources, cost_unit=cost_unit, called=result.space.errors.called)
    known = sources_table(result).frame(cost_unit).set_index("source")
    rows, costs = by_row(result.drawn_sources), {own.name: own.cost for own in result.space.errors.sources}
    known = known.reindex([row.name for row, _ in rows])
    for header in ("share of variance [%]", "change [%]"):
        frame[header] = known[header].to_numpy()
    frame[f"cost before [{cost_unit}]"] = [costs[own[0].name] if row.zone else np.nan for row, own in rows]
    return frame


def effects(result: AllocationResult, width: float | None = None) -> dict[str, float]:
    """Return what opening each dimension does to what is kept of the leading output, largest effect first.

    By a tenth, or each zone by a width [m]. Nothing where the model of the drawing knows no derivatives by zones [unit
    of the leading output].
    """
    if result.chosen.by_zone is None:
        return {}
    names = [source.name for source in result.drawn.errors.active]
    slope = dict(zip(names, result.chosen.by_zone.tolist(), strict=True))
    found = {
        name: sum((width or _STEP * source.zone) * slope.get(source.name, 0.0) for source in members)
        for name, members in result.dimensions.items()
    }
    return dict(sorted(found.items(), key=lambda own: -abs(own[1])))


def effects_figure(result: AllocationResult) -> tuple[Figure, ...]:
    """Return the largest of these effects, a tenth beside a micrometre; nothing where there are none."""
    largest, each = dict(list(effects(result).items())[:_EFFECTS]), effects(result, MICROMETRE)
    if not largest:
        return ()
    guarantee, names = result.requirements[0].guarantee, list(largest)
    share = f"{100 * guarantee.target:.4g} % " if isinstance(guarantee, AtYield) else ""
    bars = (
        Series.bars(f"by {_STEP * 100:.0f} %", names, largest.values()),
        Series.bars("by 1 µm", names, [each[name] for name in names]),
    )
    axis = f"change of {share}{short(result.leading)} [{unit_of(result.leading)}]"
    return (Figure("effects", _say("figure_effects"), axis, series=bars, vertical=((0.0, ""),)),)


def risks(result: AllocationResult) -> Iterator[str]:
    """Yield what can go wrong with the drawing: in the shop, with its first driver, and beyond what was computed."""
    driver, effect = next(iter(effects(result).items()), ("", 0.0))
    name, members = min(dimensions_table(result).rows, key=lambda row: _change(row[1][0]))
    before, after = members[0]
    if (change := _change(members[0])) < -_NOTICED:
        unit = zone_unit(result.space.errors.sources)
        zones = {"before": zone_in(before, unit), "after": zone_in(after, unit), "unit": unit}
        yield _say("risk_tightest", name=name, change=-change / 100, **zones)
    yield from _too_fine(result)
    yield from _at_ends(result)
    if result.met and effect > 0:
        left = max(-result.chosen.checks[0].tightest.excess, 0.0)
        moved = {"effect": effect} | ({"left": left} if left > _NOTHING_LEFT * effect else {})
        said = {key: with_unit(f"{value:.2g}", result.leading) for key, value in moved.items()}
        key = "risk_driver" if "left" in said else "risk_driver_spent"
        yield _say(key, name=driver, step=_STEP, output=short(result.leading), **said)
    yield from portrait_of(result.model.at(result.chosen.settings)).risks
    yield from assumed_sentences(result)
    yield _say("risk_not_included", what=portrait_of(result.model).not_included)


def _too_fine(result: AllocationResult) -> Iterator[str]:
    """Yield which zones their gauges do not resolve, all in one sentence."""
    coarsest = [(own, max(own[1], key=lambda member: member.uncertainty)) for own in result.lines]
    lines = [
        _say(
            "risk_gauge_line",
            name=result.line_name(line),
            zone=own.zone / MICROMETRE,
            gauge=own.uncertainty / MICROMETRE,
        )
        for line, own in coarsest
        if not own.is_resolved
    ]
    if lines:
        yield _say("risk_gauge", times=RESOLVED, lines=", ".join(lines))


def _at_ends(result: AllocationResult) -> Iterator[str]:
    """Yield which settings lie at an end of what was allowed."""
    for setting, value in zip(result.space.settings, result.chosen.settings.tolist(), strict=True):
        for end, word in ((setting.lower, "smallest"), (setting.upper, "largest")):
            if setting.lower < setting.upper and abs(value - end) < setting.step / 2:
                name = quantity(setting.name).capitalize()
                yield _say("risk_bound", name=name, end=word, value=with_unit(f"{value:.3g}", setting.name))


def zones_figure(rows: Sequence[_Row]) -> Figure:
    """Return the zones before and after."""
    names = [row.name for row, _ in rows]
    unit = zone_unit(row for row, _ in rows)
    before, after = ([zone_in(own, unit) for own in side] for side in zip(*(own[0] for _, own in rows), strict=True))
    bars = Series.bars("before", names, before), Series.bars("after", names, after)
    return Figure("zones", _say("figure_zones"), f"zone [{unit}]", series=bars)


def write_drawing(result: AllocationResult, header: Header, folder: Path) -> None:
    """Write the drawing as files.

    ``allocation.csv`` is read back, ``drawing.xlsx`` goes on calculating and has the inspection plan, ``frames.dxf``
    enters a drawing program and ``inspection.dfd`` a measuring room's.
    """
    cost_unit, called = header.cost_unit, result.space.errors.called
    notes = (
        *drawn_amounts(result),
        *amounts_convention(result),
        *assembly_notes(result),
        *population_note(result),
    )
    write_csv(table_frame(result.drawn_sources, folder, cost_unit, called), folder / "allocation.csv")
    if called:
        heads_file(folder / "allocation.csv").write_text(heads_text(called), encoding="utf-8")
    with (folder / "allocation.csv").open("a", encoding="utf-8") as file:
        file.write("".join(f"{line}\n" for line in _table_comments(result, header, notes)))
    book = Book()
    add_calculator(book, result, header, notes)
    plan = plan_lines(result, _parts(result))
    for name, frame in {**_settings_sheet(result), "tolerances": tolerances_frame(result, cost_unit)}.items():
        book.table(name, frame)
    add_plan(book, plan)
    (folder / "drawing.xlsx").write_bytes(book.content())
    write_sheet(drawing_sheet(result, header, plan, date.today()), folder / "frames.dxf")
    write_plan(plan, header.name, folder / "inspection.dfd")
    _return_table(result, folder)


def _return_table(result: AllocationResult, folder: Path) -> None:
    """Write a user's own table with the new zones; one that cannot say them, or is gone, stops no report."""
    own = result.space.errors.file
    try:
        if own and is_file(own.path) and own.is_own:
            own.written(result.space.errors.sources, result.drawn_sources, folder)
    except (InputError, OSError) as fault:
        warn(f"The table is not returned beside the report: {fault}", stacklevel=2)


def _table_comments(result: AllocationResult, header: Header, notes: Sequence[str]) -> list[str]:
    """Return what a table says below its rows: of which study it is, what it costs, and the settings that belong to it.

    Without commas and semicolons, so that no program that reads the rows parts them into cells.
    """
    paid = sum(result.process_changes.values())
    once = _say("table_once", paid=paid) if paid else ""
    said = [
        _say("table_study", name=result.name, digest=header.digest[:12] or "not known", cost=result.cost, once=once)
    ]
    if header.title_block:
        fields = (f"{label} {text}" for label, text in header.title_block.items())
        said.append(_say("table_block", fields="; ".join(fields)))
    said += notes
    values = zip(result.space.shared.names, result.chosen.settings.tolist(), strict=True)
    lines = [f"# {sentence}".replace(",", " and").replace(";", " -") for sentence in said]
    return [*lines, *(setting_line(name, value) for name, value in values)]


def _settings_sheet(result: AllocationResult) -> dict[str, pd.DataFrame]:
    """Return a sheet of the settings that belong to the drawing and of what is made for them; none without any."""
    if not result.amounts:
        return {}
    rows: list[dict[str, object]] = [
        {
            "what": quantity(own.name),
            "value [unit]": own.value,
            "before [unit]": own.before,
            "unit": unit_of(own.name),
            "tolerance ± [µm]": own.tolerance and own.tolerance / MICROMETRE,
        }
        for own in result.amounts
    ]
    rows += [{"what": sentence} for sentence in amounts_convention(result)]
    return {portrait_of(result.model).settings_word: pd.DataFrame(rows)}

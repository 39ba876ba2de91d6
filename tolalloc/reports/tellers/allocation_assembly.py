"""What an allocation says of parts that are chosen at assembly: costs, classes, sizes, and what is left over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from tolalloc.allocation.result import AllocationResult, AssemblyChoice
from tolalloc.drawings.compensators import Compensator, Indexing, Shim
from tolalloc.drawings.sorting import Sorting
from tolalloc.drawings.sources import Source
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number

_say = Sentences("allocation")


_NONE = float("nan")


@dataclass(frozen=True, kw_only=True)
class _Bin:
    """One class or sector of a sorted source, or one size; what it does not have is not a number."""

    source: str
    what: str
    number: int
    low: float = _NONE  # Where it begins, as a deviation from the nominal size; nothing where it is open [µm]
    high: float = _NONE
    begin: float = _NONE  # Of a sector, where it begins, counted from the x axis [°]
    end: float = _NONE
    middle: float = _NONE  # Of a size, how far it is from the nominal one [µm]
    turned: float = _NONE  # Of an angular position, how far the part is turned [°]


def assembly_cost_sentences(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return what zones and assembly cost together, beside the cheapest drawing of parts as they come."""
    assembled = result.assembled
    if assembled is None:
        return ()
    best, alone = assembled.best, assembled.nothing_chosen
    others = [own for own in assembled.choices if own is not best and own.met]
    against = ""
    if best.compensators and alone:
        key = "assembly_alone" if alone.met else "assembly_alone_missed"
        against = _say(key, cost=alone.cost)
    elif others:
        against = _say("assembly_next", label=others[0].label, cost=min(own.cost for own in others))
    key = "assembly_cost" if best.compensators else "assembly_none"
    gaps = {"zones": best.zones_cost, "assembly": best.assembly_cost, "cost": best.cost}
    return (_say(key, label=best.label, cost_unit=cost_unit, against=against, **gaps),)


def assembly_sentences(result: AllocationResult) -> tuple[str, ...]:
    """Return what becomes of the drawing where nothing is chosen, and of parts that find no mate."""
    assembled = result.assembled
    if assembled is None or not assembled.best.compensators:
        return ()
    before, after = assembled.as_they_come.joint, result.chosen.joint
    said = [
        _say(
            "assembly_random",
            simulated=portrait_of(result.model).simulated,
            share=before.estimate,
            low=100 * before.low,
            high=before.high,
            after=after.estimate,
        )
    ]
    for own in assembled.best.compensators:
        if isinstance(own, Sorting):
            left = own.leftover_of({name: _source(result, name) for name in own.named})
            said.append(_say("assembly_left", share=left, parts=own.parts, mates=own.mates, batch=own.batch))
    return tuple(said)


def assembly_notes(result: AllocationResult) -> tuple[str, ...]:
    """Return what the drawing must say of classes and sizes, without which its zones do not hold."""
    return tuple(_note(result, own) for own in _acting(result))


def assembly_section(result: AllocationResult, cost_unit: str) -> tuple[Section, ...]:
    """Return the section on parts chosen at assembly; nothing where nothing was to be chosen."""
    if result.assembled is None:
        return ()
    compared = choices_table(result)
    tables = [(compared.name, compared.frame(cost_unit))]
    if bins := bins_table(result):
        tables.append((bins.name, bins.frame(cost_unit)))
    return (
        Section(
            heading=_say("heading_assembly"),
            paragraphs=(*assembly_sentences(result), *assembly_notes(result), *_methods(result)),
            figures=choices_figure(result, cost_unit),
            tables=tuple(tables),
            unfolded=True,
        ),
    )


def _methods(result: AllocationResult) -> tuple[str, ...]:
    """Return where classes end and what is assumed of measuring."""
    widths = {own.width is None for own in _acting(result) if isinstance(own, Sorting)}
    keys = [key for key, equal in (("method_equal", True), ("method_width", False)) if equal in widths]
    return tuple(map(_say, [*keys, "assembly_method"]))


def choices_table(result: AllocationResult) -> Table[AssemblyChoice]:
    """Return what every way to choose parts costs."""
    columns: list[Column[AssemblyChoice]] = [
        Column(header="parts at assembly", value=lambda row: row.label),
        Column(header="met", value=lambda row: "yes" if row.met else "no"),
        Column(header="cost of zones [{cost}]", value=lambda row: row.zones_cost),
        Column(header="cost of assembly [{cost}]", value=lambda row: row.assembly_cost),
        Column(header="cost in all [{cost}]", value=lambda row: row.cost),
        Column(
            header="lower bound of zones [{cost}]",
            value=lambda row: float("nan") if row.bound is None else row.bound,
        ),
        Column(header="all limits at once [%]", value=lambda row: 100 * row.joint.estimate),
        Column(header="left over [%]", value=lambda row: 100 * row.left_over),
    ]
    choices = result.assembled.choices if result.assembled else ()
    return Table(name="parts at assembly", columns=columns, rows=list(choices))


def bins_table(result: AllocationResult) -> Table[_Bin] | None:
    """Return where classes begin and end, and the sizes; nothing where parts are taken as they come."""
    rows = [own for acting in _acting(result) for own in _bins(result, acting)]
    if not rows:
        return None
    columns: list[Column[_Bin]] = [
        Column(header="source", value=lambda row: row.source),
        Column(header="what", value=lambda row: row.what),
        Column(header="number [-]", value=lambda row: row.number),
    ]
    kinds = {row.what for row in rows}
    if "class" in kinds:
        columns.append(Column(header="from [µm]", value=lambda row: row.low, nothing="open"))
        columns.append(Column(header="to [µm]", value=lambda row: row.high, nothing="open"))
    if "sector" in kinds:
        columns.append(Column(header="from [°]", value=lambda row: row.begin, nothing=""))
        columns.append(Column(header="to [°]", value=lambda row: row.end, nothing=""))
    if "size" in kinds:
        columns.append(Column(header="off nominal [µm]", value=lambda row: row.middle, nothing=""))
    if "position" in kinds:
        columns.append(Column(header="turned by [°]", value=lambda row: row.turned, nothing=""))
    return Table(name="classes and sizes", columns=columns, rows=rows)


def choices_figure(result: AllocationResult, cost_unit: str) -> tuple[Figure, ...]:
    """Return the cost of zones and of assembly over the choices; nothing of a single one."""
    choices = [own for own in (result.assembled.choices if result.assembled else ()) if own.met]
    if len(choices) < 2:
        return ()
    names = [own.label for own in choices]
    return (
        Figure(
            name="assembly",
            title=_say("figure_assembly"),
            x_label=f"cost [{cost_unit}]",
            series=(
                Series(label="zones and assembly", kind="bars", x=names, y=[own.cost for own in choices]),
                Series(label="zones alone", kind="bars", x=names, y=[own.zones_cost for own in choices]),
            ),
        ),
    )


def assembly_summary(result: AllocationResult) -> dict[str, Any]:
    """Return the same for a program; nothing where nothing was to be chosen."""
    assembled = result.assembled
    if assembled is None:
        return {}
    return {
        "parts at assembly": assembled.best.label,
        "cost of assembly [cost units]": assembled.best.assembly_cost,
        "cost in all [cost units]": assembled.best.cost,
        "yield with parts as they come [-]": assembled.as_they_come.joint.estimate,
        "choices of parts": choices_table(result).records(),
    }


def _acting(result: AllocationResult) -> tuple[Compensator, ...]:
    return result.assembled.best.compensators if result.assembled else ()


def _source(result: AllocationResult, name: str) -> Source:
    """Return a source as drawn."""
    return next(own for own in result.drawn_sources if own.name == name)


def _bins(result: AllocationResult, acting: Compensator) -> list[_Bin]:
    """Return the classes and sectors of both sources of a sorting, or the sizes of a shim."""
    if isinstance(acting, Shim):
        return [
            _Bin(source=part, what="size", number=at + 1, middle=acting.step * steps)
            for part in acting.chosen
            for at, steps in enumerate(range(-acting.reach, acting.reach + 1))
        ]
    if isinstance(acting, Indexing):
        return [
            _Bin(source=part, what="position", number=at + 1, turned=360.0 * at / acting.count)
            for part in acting.chosen
            for at in range(acting.count)
        ]
    found = list[_Bin]()
    if not isinstance(acting, Sorting):
        return found
    for name in acting.named:
        limits = acting.limits(_source(result, name)) / MICROMETRE
        lengths = pairwise([_NONE, *limits.tolist(), _NONE] if limits.size else [])
        found += [_Bin(source=name, what="class", number=at, low=a, high=b) for at, (a, b) in enumerate(lengths, 1)]
        angles = pairwise(acting.sectors(name).tolist())
        found += [_Bin(source=name, what="sector", number=at, begin=a, end=b) for at, (a, b) in enumerate(angles, 1)]
    return found


def _note(result: AllocationResult, acting: Compensator) -> str:
    """Return what the drawing says of a sorting or of sizes."""
    if isinstance(acting, Sorting):
        return _sorting_note(result, acting)
    if not isinstance(acting, Shim | Indexing):
        return ""
    gaps, parts = " and ".join(_gap(part, others) for part, others in acting.of_each), " and ".join(acting.chosen)
    if isinstance(acting, Indexing):
        return _say("note_indexing", part=parts, positions=acting.count, width=360.0 / acting.count, gaps=gaps)
    key = "note_shim_each" if any(_source(result, part).each > 1 for part in acting.chosen) else "note_shim"
    return _say(key, part=parts, sizes=acting.count, step=acting.step, gaps=gaps)


def _sorting_note(result: AllocationResult, acting: Sorting) -> str:
    """Return what the drawing says of a sorting: of classes, of sectors, or of both."""
    gaps = {"parts": acting.parts, "mates": acting.mates, "classes": acting.count}
    said = []
    if 1 in acting.measured:
        key = "note_directions_opposite" if acting.opposite else "note_directions"
        said.append(_say(key, width=360.0 / acting.count, **gaps))
    if acting.by == "direction":
        return said[0]
    ends = [
        "/".join(number(end, ".2f") for end in acting.limits(_source(result, name)) / MICROMETRE)
        for name in acting.named
    ]
    key = "note_opposite" if acting.opposite else "note_sorting"
    what = _say("of_vector" if 0 in acting.measured else "of_deviation")
    return " ".join([*said, _say(key, parts_ends=ends[0], mates_ends=ends[1], what=what, **gaps)])


def _gap(part: str, others: Sequence[tuple[str, float]]) -> str:
    """Return the gap of a part as a formula without commas, such as ``washer − 2·hole``."""
    said = [part]
    for name, weight in others:
        times = "" if abs(weight) == 1.0 else f"{abs(weight):g}·"
        said.append(f"{'−' if weight < 0 else '+'} {times}{name}")
    return " ".join(said)

"""What an allocation says of parts that are chosen at assembly: costs, classes, sizes, and what is left over."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from math import nan
from typing import Any

import pandas as pd

from tolalloc.allocation.result import AllocationResult, AssemblyChoice
from tolalloc.drawings.compensators import Compensator, Indexing, Shim
from tolalloc.drawings.sorting import Sorting
from tolalloc.drawings.sources import Source
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.check import interval_gaps
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number

_say = Sentences("allocation")


_BINS = (
    *("source", "what", "number [-]", "from [µm]", "to [µm]", "from [°]", "to [°]"),
    *("off nominal [µm]", "turned by [°]"),
)
"""Columns of classes, sectors, sizes and positions: where one begins and ends, as a deviation from the nominal size or
counted from the x axis; how far a size is from the nominal one; how far a part is turned."""


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


def assembly_sentences(result: AllocationResult) -> Iterator[str]:
    """Yield what becomes of the drawing where nothing is chosen, and of parts that find no mate."""
    assembled = result.assembled
    if assembled is None or not assembled.best.compensators:
        return
    gaps = {"simulated": portrait_of(result.model).simulated, "after": result.chosen.joint.estimate}
    yield _say("assembly_random", **interval_gaps(assembled.as_they_come.joint), **gaps)
    for own in assembled.best.compensators:
        if isinstance(own, Sorting):
            left = own.leftover_of({name: _source(result, name) for name in own.named})
            yield _say("assembly_left", share=left, parts=own.parts, mates=own.mates, batch=own.batch)


def assembly_notes(result: AllocationResult) -> tuple[str, ...]:
    """Return what the drawing must say of classes and sizes, without which its zones do not hold."""
    return tuple(_note(result, own) for own in _acting(result))


def assembly_sections(result: AllocationResult, cost_unit: str) -> Iterator[Section]:
    """Yield the section on parts chosen at assembly; nothing where nothing was to be chosen."""
    if result.assembled is None:
        return
    compared, bins = choices_table(result), bins_table(result)
    further = () if bins is None else (("classes and sizes", bins),)
    yield Section(
        heading=_say("heading_assembly"),
        paragraphs=(*assembly_sentences(result), *assembly_notes(result), *_methods(result)),
        figures=choices_figure(result, cost_unit),
        tables=((compared.name, compared.frame(cost_unit)), *further),
        unfolded=True,
    )


def _methods(result: AllocationResult) -> tuple[str, ...]:
    """Return where classes end and what is assumed of measuring."""
    widths = {own.width is None for own in _acting(result) if isinstance(own, Sorting)}
    keys = [key for key, equal in (("method_equal", True), ("method_width", False)) if equal in widths]
    return tuple(map(_say, [*keys, "assembly_method"]))


def choices_table(result: AllocationResult) -> Table[AssemblyChoice]:
    """Return what every way to choose parts costs."""
    columns: list[Column[AssemblyChoice]] = [
        Column("parts at assembly", lambda row: row.label),
        Column("met", lambda row: "yes" if row.met else "no"),
        Column("cost of zones [{cost}]", lambda row: row.zones_cost),
        Column("cost of assembly [{cost}]", lambda row: row.assembly_cost),
        Column("cost in all [{cost}]", lambda row: row.cost),
        Column("lower bound of zones [{cost}]", lambda row: float("nan") if row.bound is None else row.bound),
        Column("all limits at once [%]", lambda row: 100 * row.joint.estimate),
        Column("left over [%]", lambda row: 100 * row.left_over),
    ]
    choices = result.assembled.choices if result.assembled else ()
    return Table(name="parts at assembly", columns=columns, rows=list(choices))


def bins_table(result: AllocationResult) -> pd.DataFrame | None:
    """Return where classes begin and end, and the sizes; nothing where parts are taken as they come."""
    frame = pd.DataFrame([own for acting in _acting(result) for own in _bins(result, acting)])
    return None if frame.empty else frame[[name for name in _BINS if name in frame]]


def choices_figure(result: AllocationResult, cost_unit: str) -> tuple[Figure, ...]:
    """Return the cost of zones and of assembly over the choices; nothing of a single one."""
    choices = [own for own in (result.assembled.choices if result.assembled else ()) if own.met]
    if len(choices) < 2:
        return ()
    names = [own.label for own in choices]
    bars = (
        Series.bars("zones and assembly", names, [own.cost for own in choices]),
        Series.bars("zones alone", names, [own.zones_cost for own in choices]),
    )
    return (Figure("assembly", _say("figure_assembly"), f"cost [{cost_unit}]", series=bars),)


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


def _bins(result: AllocationResult, acting: Compensator) -> Iterator[dict[str, object]]:
    """Yield the classes and sectors of both sources of a sorting, or the sizes of a shim; no end where one is open."""
    if isinstance(acting, Shim):
        for part, at in product(acting.chosen, range(2 * acting.reach + 1)):
            yield _bin(part, "size", at + 1) | {"off nominal [µm]": acting.step * (at - acting.reach)}
    if isinstance(acting, Indexing):
        for part, at in product(acting.chosen, range(acting.count)):
            yield _bin(part, "position", at + 1) | {"turned by [°]": 360.0 * at / acting.count}
    if not isinstance(acting, Sorting):
        return
    for name in acting.named:
        limits = (acting.limits(_source(result, name)) / MICROMETRE).tolist()
        for at, (low, high) in enumerate(pairwise([nan, *limits, nan] if limits else []), 1):
            yield _bin(name, "class", at) | {"from [µm]": low, "to [µm]": high}
        for at, (begin, end) in enumerate(pairwise(acting.sectors(name).tolist()), 1):
            yield _bin(name, "sector", at) | {"from [°]": begin, "to [°]": end}


def _bin(source: str, what: str, number: int) -> dict[str, object]:
    return {"source": source, "what": what, "number [-]": number}


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
    limits = (acting.limits(_source(result, name)) / MICROMETRE for name in acting.named)
    ends = ["/".join(number(end, ".2f") for end in own) for own in limits]
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

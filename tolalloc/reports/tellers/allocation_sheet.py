"""What stands on the sheet for a drawing program: frames, inspection data, amounts, datums and title block."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import Any

from tolalloc.allocation.result import AllocationResult
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.drawing_sheet import DrawingSheet, SheetFrame, SheetTable
from tolalloc.reports.feature_frame import INSPECTED
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import Portrait, portrait_of
from tolalloc.reports.tellers.allocation_assembly import assembly_notes
from tolalloc.reports.tellers.allocation_inspection import PlanLine
from tolalloc.reports.tellers.allocation_population import population_note
from tolalloc.reports.tellers.allocation_sentences import amounts_convention, drawn_amounts, examined, verdict
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number, quantity

_say = Sentences("allocation")

_AXIS = "A"
"""Datum that every frame names, about which pitch and run-out of teeth are measured too."""


def drawing_sheet(result: AllocationResult, header: Header, plan: Sequence[PlanLine], today: date) -> DrawingSheet:
    """Return the sheet of a drawing on a day, every line with its number in the inspection plan."""
    framed, inspected = _lines(result, plan)
    model = portrait_of(result.model)
    return DrawingSheet(
        frames=tuple(map(_framed, framed)),
        tables=(*_inspection(inspected), *_amounts(result, plan), *_datums(model, [*framed, *inspected])),
        sketches=model.sign_sketches if result.amounts else (),
        notes=(
            *drawn_amounts(result),
            *amounts_convention(result),
            *assembly_notes(result),
            *population_note(result),
            verdict(result)[-1],
        ),
        title_block=_title_block(result, header, today),
    )


def _lines(result: AllocationResult, plan: Sequence[PlanLine]) -> tuple[list[PlanLine], list[PlanLine]]:
    """Return the lines with a frame or deviations, and those that are inspection data of gear parts.

    Tolerances of the amounts stand beside the amounts.
    """
    beside = set(result.model.drawn_amounts.sources)
    lines = [own for own in plan if own.first.name not in beside]
    inspected = [own for own in lines if own.frame.characteristic in INSPECTED]
    return [own for own in lines if own not in inspected], inspected


def _framed(line: PlanLine) -> SheetFrame:
    """Return a frame beside the name of its dimension, which says where the zone holds."""
    name = f"{line.name}, {line.frame.place}" if line.frame.place else line.name
    return SheetFrame(number=line.number, name=name, frame=line.frame, demand=line.demand)


def _table(key: str, rows: Sequence[tuple[str, ...]], widths: tuple[float, ...]) -> SheetTable:
    """Return a table whose title and header stand in one sentence, parted by bars."""
    title, *header = _say(key).split("|")
    return SheetTable(title=title, header=tuple(header), rows=tuple(rows), widths=widths)


def _inspection(lines: Sequence[PlanLine]) -> tuple[SheetTable, ...]:
    """Return pitch and run-out of the gear parts, and what their single teeth may deviate."""
    rows = [
        (
            str(own.number),
            own.name,
            " ".join(filter(None, (own.frame.symbol, own.frame.characteristic))),
            own.frame.zone,
            _AXIS if own.frame.symbol else "",
            own.demand,
        )
        for own in lines
    ]
    return (_table("table_inspection", rows, (10.0, 58.0, 40.0, 24.0, 14.0, 34.0)),) if rows else ()


def _amounts(result: AllocationResult, plan: Sequence[PlanLine]) -> tuple[SheetTable, ...]:
    """Return what is made with the zones: amounts with their own tolerance, and the clearances that they leave."""
    effects, drawn = portrait_of(result.model).effects(result.chosen.settings), result.model.drawn_amounts
    numbers = {member.name: str(own.number) for own in plan for member in own.members}
    number_of = {name: numbers.get(source, "") for name, source in zip(drawn.names, drawn.sources, strict=False)}
    rows = [
        (
            number_of.get(own.name, ""),
            quantity(own.name),
            number(own.value, ".2f"),
            number(own.tolerance / MICROMETRE, ".3g") if own.tolerance else "",
            unit_of(own.name),
            effects.get(own.name, ""),
        )
        for own in result.amounts
    ]
    return (_table("table_amounts", rows, (10.0, 40.0, 18.0, 32.0, 12.0, 68.0)),) if rows else ()


def _datums(model: Portrait[Any], lines: Sequence[PlanLine]) -> tuple[SheetTable, ...]:
    """Return the datum of every kind of part that something refers to; the feature that carries it is left free."""
    parts: dict[str, list[str]] = {}
    for line in lines:
        for own in line.members:
            frame = model.frame(own)
            if frame.datums or frame.characteristic in INSPECTED:
                alike = parts.setdefault(own.part.rstrip("0123456789"), [])
                alike += [] if own.part in alike else [own.part]
    rows = [(", ".join(own), _AXIS, _say("table_datum_axis"), "") for own in parts.values()]
    return (_table("table_datums", rows, (50.0, 14.0, 70.0, 46.0)),) if rows else ()


def _title_block(result: AllocationResult, header: Header, today: date) -> tuple[tuple[str, str], ...]:
    """Return label and value of every field; what is not known stays empty, to be filled in by hand."""
    stated, fault = header.title_block, examined(result).fault
    status = _say("sheet_status_met" if result.met else "sheet_status_missed")
    if result.met and fault:
        status = _say("sheet_status_fault")
    return (
        (portrait_of(result.model).kind, header.model),
        ("study", header.name),
        ("study hash", header.digest[:12] or "not known"),
        *((label, stated.get(label, "")) for label in ("drawing number", "revision", "author")),
        ("date", today.isoformat()),
        ("material", stated.get("material", "")),
        ("units", _say("sheet_units")),
        ("limits", f"{status}{_say('sheet_status_quick') if header.quick else ''}"),
        ("checked", ""),
        ("released", ""),
    )

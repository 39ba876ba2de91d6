"""What stands on the sheet for a drawing program: frames, inspection data, amounts, datums and title block."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import Any

from tolalloc.allocation.result import AllocationResult
from tolalloc.drawings.sources import Source
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.drawing_sheet import DrawingSheet, SheetTable
from tolalloc.reports.feature_frame import INSPECTED, FeatureFrame
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import Portrait, portrait_of
from tolalloc.reports.tellers.allocation_assembly import assembly_notes
from tolalloc.reports.tellers.allocation_sentences import amounts_convention, drawn_amounts, examined, verdict
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number, quantity

_say = Sentences("allocation")

_AXIS = "A"
"""Datum that every frame names, about which pitch and run-out of teeth are measured too."""
_Line = tuple[str, tuple[Source, ...]]


def drawing_sheet(result: AllocationResult, header: Header, today: date) -> DrawingSheet:
    """Return the sheet of a drawing on a day."""
    framed, inspected = _lines(result)
    model = portrait_of(result.model)
    return DrawingSheet(
        frames=tuple(_framed(result.line_name(own), model.frame(own[1][0])) for own in framed),
        tables=(*_inspection(result, inspected), *_amounts(result), *_datums(model, [*framed, *inspected])),
        sketches=model.sign_sketches if result.amounts else (),
        notes=(
            *drawn_amounts(result),
            *amounts_convention(result),
            *assembly_notes(result),
            verdict(result)[-1],
        ),
        title_block=_title_block(result, header, today),
    )


def _lines(result: AllocationResult) -> tuple[list[_Line], list[_Line]]:
    """Return the lines with a frame or deviations, and those that are inspection data of gear parts.

    Tolerances of the amounts stand beside the amounts.
    """
    beside, model = set(result.model.drawn_amounts.sources), portrait_of(result.model)
    lines = [own for own in result.lines if own[1][0].name not in beside]
    inspected = [own for own in lines if model.frame(own[1][0]).characteristic in INSPECTED]
    return [own for own in lines if own not in inspected], inspected


def _framed(name: str, frame: FeatureFrame) -> tuple[str, FeatureFrame]:
    """Return a frame beside the name of its dimension, which says where the zone holds."""
    return (f"{name}, {frame.place}" if frame.place else name), frame


def _table(key: str, rows: Sequence[tuple[str, ...]], widths: tuple[float, ...]) -> SheetTable:
    """Return a table whose title and header stand in one sentence, parted by bars."""
    title, *header = _say(key).split("|")
    return SheetTable(title=title, header=tuple(header), rows=tuple(rows), widths=widths)


def _inspection(result: AllocationResult, lines: list[_Line]) -> tuple[SheetTable, ...]:
    """Return pitch and run-out of the gear parts, and what their single teeth may deviate."""
    rows, model = [], portrait_of(result.model)
    for own in lines:
        frame = model.frame(own[1][0])
        about = _AXIS if frame.symbol else ""
        rows.append((result.line_name(own), frame.symbol, frame.characteristic, frame.zone, about))
    return (_table("table_inspection", rows, (68.0, 16.0, 44.0, 32.0, 20.0)),) if rows else ()


def _amounts(result: AllocationResult) -> tuple[SheetTable, ...]:
    """Return what is made with the zones: amounts with their own tolerance, and the clearances that they leave."""
    effects = portrait_of(result.model).effects(result.chosen.settings)
    rows = [
        (
            quantity(own.name),
            number(own.value, ".2f"),
            number(own.tolerance / MICROMETRE, ".3g") if own.tolerance else "",
            unit_of(own.name),
            effects.get(own.name, ""),
        )
        for own in result.amounts
    ]
    return (_table("table_amounts", rows, (40.0, 18.0, 32.0, 12.0, 78.0)),) if rows else ()


def _datums(model: Portrait[Any], lines: list[_Line]) -> tuple[SheetTable, ...]:
    """Return the datum of every kind of part that something refers to; the feature that carries it is left free."""
    parts: dict[str, list[str]] = {}
    for _, members in lines:
        for own in members:
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

"""A sheet for a drawing program: frames, tables, notes, sign pictures and title block, on layers of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, degrees
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from tolalloc.reports.drawing_files import centre, new_drawing
from tolalloc.reports.feature_frame import HEIGHT, FeatureFrame, boxes, drawn_symbol
from tolalloc.reports.portrait import SignSketch

if TYPE_CHECKING:
    from ezdxf.layouts.layout import Modelspace

LAYERS = {"FRAMES": 7, "BALLOONS": 5, "POPULATION": 5, "TEXT": 7, "TABLE": 7, "TITLE_BLOCK": 7, "SIGN_PICTURE": 3}
"""Layer → colour of the AutoCAD Colour Index; a layer may be frozen without the others."""
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}
"""Sheets of ISO 216 across [mm]; the smallest one that holds everything is taken."""

_STYLE = "SHEET"
_SCALE = 7.0 / HEIGHT
"""Height of a frame on paper is 7 mm, for letters of 3.5 mm [mm/px]."""
_TALL = HEIGHT * _SCALE
_SMALL, _TEXT, _BIG = 1.8, 2.5, 3.5
"""Heights of letters, ISO 3098 [mm]."""
_BROAD = 0.72
"""Width of a letter over its height, on the safe side [-]."""
_LINE = 1.55
"""Distance of lines of text over the height of letters [-]."""
_MARGIN, _GAP = 10.0, 6.0
"""Border of the sheet, and free space between parts of it [mm]."""
_WIDTH = 180.0
"""Width of tables and title block, that of ISO 7200 [mm]."""
_CELL, _ACROSS = 9.0, 3
"""Height of a field of the title block [mm], and fields beside each other [-]."""
_NAMES = 34
"""Letters of a name before it is wrapped [-]."""
_SKETCH = 30.0
"""Height of a sign picture [mm]."""
_BALLOON = 9.0
"""Room of a balloon before the name of its line [mm]."""


@dataclass(frozen=True, kw_only=True)
class SheetTable:
    """A table of the sheet."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[float, ...]  # Of the columns, 180 mm together [mm]

    @property
    def cells(self) -> list[list[list[str]]]:
        """Rows of cells of lines, the header first."""
        return [
            [wrap(text, _letters(width - 2.0, _TEXT)) or [""] for text, width in zip(row, self.widths, strict=True)]
            for row in (self.header, *self.rows)
        ]

    @property
    def heights(self) -> list[float]:
        """Heights of the rows, the header first [mm]."""
        return [max(map(len, row)) * _TEXT * _LINE + 1.0 for row in self.cells]

    @property
    def height(self) -> float:
        """Height with its title [mm]."""
        return _BIG * _LINE + 1.0 + sum(self.heights)


@dataclass(frozen=True, kw_only=True)
class SheetFrame:
    """A frame with its balloon."""

    number: int  # In the inspection plan
    name: str  # Of the dimension
    frame: FeatureFrame  # What to write
    demand: str = ""  # What it demands of the population of its parts

    @property
    def lines(self) -> list[str]:
        """Lines of text beside it."""
        return [*wrap(self.name, _NAMES), *wrap(self.demand, _NAMES)]


@dataclass(frozen=True, kw_only=True)
class DrawingSheet:
    """All that stands on the sheet."""

    frames: tuple[SheetFrame, ...]
    tables: tuple[SheetTable, ...] = ()
    sketches: tuple[SignSketch, ...] = ()
    notes: tuple[str, ...] = ()
    title_block: tuple[tuple[str, str], ...] = ()  # Label and value; an empty one is filled in by hand


def _letters(width: float, height: float) -> int:
    """Return how many letters of a height fit into a width [-]."""
    return max(int(width / (_BROAD * height)), 4)


class _Pen:
    """Draws lines and texts on one layer."""

    def __init__(self, space: Modelspace, layer: str) -> None:
        self.space, self.attributes = space, {"layer": layer, "style": _STYLE}

    def text(self, text: str, place: tuple[float, float], height: float = _TEXT) -> None:
        """Write one line whose lower left end is at a place."""
        self.space.add_text(text.replace("\n", " "), height=height, dxfattribs=self.attributes).set_placement(place)

    def paragraph(self, text: str, place: tuple[float, float], width: float) -> None:
        """Write a text that is wrapped, its upper left corner at a place."""
        plain = text.replace("\\", "\\\\").replace("{", "\\{").replace("}", "\\}")
        own = {"insert": place, "char_height": _TEXT, "width": width, "attachment_point": 1}
        self.space.add_mtext(plain, dxfattribs={**self.attributes, **own})

    def box(self, left: float, top: float, width: float, height: float) -> None:
        """Draw a rectangle."""
        corners = [(left, top), (left + width, top), (left + width, top - height), (left, top - height)]
        self.lines(corners, close=True)

    def lines(self, points: Sequence[tuple[float, float]], *, close: bool = False, **attributes: Any) -> None:
        """Draw lines from point to point."""
        own = {"layer": self.attributes["layer"], **attributes}
        self.space.add_lwpolyline(points, close=close, dxfattribs=own)

    def arrow(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw an upright arrow."""
        (x, y), back = end, 1.2 if end[1] < start[1] else -1.2
        self.lines([start, end])
        self.lines([(x - 0.6, y + back), end, (x + 0.6, y + back)])


def write_sheet(sheet: DrawingSheet, path: Path) -> None:
    """Write a sheet into a DXF file in millimetres, replaced if it is there; every frame is a block of its own."""
    drawing = new_drawing()
    drawing.styles.add(_STYLE, font="DejaVuSans.ttf")
    drawing.linetypes.add("DASHED", [1.5, 1.0, -0.5], description="wheel without the amount")
    for layer, colour in LAYERS.items():
        drawing.layers.add(layer, color=colour)
    placed = _Placed(sheet)
    space = drawing.modelspace()
    _frames(space, sheet, placed)
    top, left = -_MARGIN, placed.right
    for table in sheet.tables:
        top = _table(_Pen(space, "TABLE"), table, left, top) - _GAP
    if sheet.sketches:
        top = _sketches(_Pen(space, "SIGN_PICTURE"), sheet.sketches, left, top) - _GAP
    for note in sheet.notes:
        _Pen(space, "TEXT").paragraph(note, (left, top), _WIDTH)
        top -= _note_height(note)
    _title_block(_Pen(space, "TITLE_BLOCK"), sheet, placed)
    width, height = PAPERS[placed.paper]
    drawing.set_modelspace_vport(height=height, center=(width / 2, -height / 2))
    drawing.saveas(path)


def _note_height(note: str) -> float:
    return len(wrap(note, _letters(_WIDTH, _TEXT))) * _TEXT * _LINE + 1.5


class _Placed:
    """The paper that holds a sheet, and where its columns stand.

    Attributes
    ----------
    paper
        One of `PAPERS`.
    columns
        For every frame its column and the height of its line [-, mm].
    right
        Left edge of tables and title block [mm].
    """

    def __init__(self, sheet: DrawingSheet) -> None:
        longest = max((len(line) for own in sheet.frames for line in own.lines), default=0)
        self.names = _BALLOON + longest * _BROAD * _TEXT + 3.0
        last = (boxes(own.frame)[-1] for own in sheet.frames)
        self.width = self.names + max(((left + width) * _SCALE for left, width, _ in last), default=0.0) + _GAP
        self.heights = [max(len(own.lines) * _TEXT * _LINE, _TALL) + 3.0 for own in sheet.frames]
        beside = sum(table.height + _GAP for table in sheet.tables) + sum(map(_note_height, sheet.notes))
        beside += _sketches_height(sheet.sketches) + _block_height(sheet) + _GAP
        for paper, (width, height) in PAPERS.items():
            self.paper, room = paper, height - 2 * _MARGIN
            self.places, count = self._placed(room)
            self.right = width - _MARGIN - _WIDTH
            if beside <= room and _MARGIN + count * self.width <= self.right:
                break

    def _placed(self, room: float) -> tuple[list[tuple[float, float]], int]:
        """Return the upper left corner of every line, columns no higher than a room, and how many columns these are."""
        found, column, top = [], 0, 0.0
        for height in self.heights:
            if top + height > room and top > 0.0:
                column, top = column + 1, 0.0
            found.append((_MARGIN + column * self.width, -_MARGIN - top))
            top += height
        return found, column + 1


def _frames(space: Modelspace, sheet: DrawingSheet, placed: _Placed) -> None:
    """Draw all frames, each with its balloon, its name and what it demands of its parts beside it."""
    named, demanded, balloons = _Pen(space, "TEXT"), _Pen(space, "POPULATION"), {"layer": "BALLOONS"}
    for own, (left, top) in zip(sheet.frames, placed.places, strict=True):
        assert space.doc is not None
        block = space.doc.blocks.new(f"FRAME_{own.number}")
        for x, width, text in ((box[0] * _SCALE, box[1] * _SCALE, box[2]) for box in boxes(own.frame)):
            if own.frame.is_framed:
                block.add_lwpolyline([(x, 0), (x + width, 0), (x + width, _TALL), (x, _TALL)], close=True)
            if text:
                written = block.add_text(text, height=_BIG, dxfattribs={"style": _STYLE})
                centre(written, (x + width / 2, _TALL / 2))
        lines, circles = drawn_symbol(own.frame.characteristic)
        for line in lines:
            block.add_lwpolyline([(x * _TALL, y * _TALL) for x, y in line])
        for radius in circles:
            block.add_circle((_TALL / 2, _TALL / 2), radius * _TALL)
        space.add_blockref(block.name, (left + placed.names, top - _TALL), dxfattribs={"layer": "FRAMES"})
        middle = (left + _TALL / 2, top - _TALL / 2)
        space.add_circle(middle, _TALL / 2, dxfattribs=balloons)
        centre(space.add_text(str(own.number), height=_TEXT, dxfattribs={**balloons, "style": _STYLE}), middle)
        count = len(wrap(own.name, _NAMES))
        for at, text in enumerate(own.lines, start=1):
            pen = named if at <= count else demanded
            pen.text(text, (left + _BALLOON, top - 1.5 - at * _TEXT * _LINE + 0.6))


def _table(pen: _Pen, table: SheetTable, left: float, top: float) -> float:
    """Draw a table and return where it ends [mm]."""
    pen.text(table.title, (left, top - _BIG), _BIG)
    top -= _BIG * _LINE + 1.0
    for row, height in zip(table.cells, table.heights, strict=True):
        x = left
        for lines, width in zip(row, table.widths, strict=True):
            pen.box(x, top, width, height)
            for at, line in enumerate(lines, start=1):
                pen.text(line, (x + 1.0, top - at * _TEXT * _LINE + 0.4))
            x += width
        top -= height
    return top


def _sketches_height(sketches: Sequence[SignSketch]) -> float:
    if not sketches:
        return 0.0
    lines = max(len(wrap(own.caption, _letters(_WIDTH / len(sketches) - 5.0, _TEXT))) for own in sketches)
    return _SKETCH + lines * _TEXT * _LINE + _GAP


def _sketches(pen: _Pen, sketches: Sequence[SignSketch], left: float, top: float) -> float:
    """Draw the sign pictures beside each other and return where they end [mm]."""
    wide = _WIDTH / len(sketches)
    for at, own in enumerate(sketches):
        _sketch(pen, own, left + at * wide + wide / 2, top - 13.0)
        pen.paragraph(own.caption, (left + at * wide, top - _SKETCH), wide - 5.0)
    return top - _sketches_height(sketches) + _GAP


def _sketch(pen: _Pen, own: SignSketch, x: float, y: float) -> None:
    """Draw both wheels about a place, the part below them, and the way from one to the other."""
    (height, radius), (new_height, new_radius), surface = own.nominal, own.changed, 4.0
    own_layer: dict[str, Any] = {"layer": "SIGN_PICTURE"}
    pen.space.add_circle((x, y + height), radius, dxfattribs={**own_layer, "linetype": "DASHED"})
    pen.space.add_circle((x, y + new_height), new_radius, dxfattribs=own_layer)
    rise = degrees(asin((surface - new_height) / new_radius))
    thick = {**own_layer, "lineweight": 50}
    pen.space.add_arc((x, y + new_height), new_radius, 180.0 - rise, rise, dxfattribs=thick)
    edge = (new_radius**2 - (surface - new_height) ** 2) ** 0.5
    for side in (-1.0, 1.0):
        pen.lines([(x + side * edge, y + surface), (x + side * 26.0, y + surface)], lineweight=50)
    pen.arrow((x, y + own.arrow[0]), (x, y + own.arrow[1]))
    pen.arrow((x + 21.0, y + 1.0), (x + 21.0, y - 12.0))
    pen.text("to the axis", (x + 22.5, y - 8.0), _SMALL)
    pen.text(f"of the {own.part}", (x + 22.5, y - 11.0), _SMALL)
    pen.text(own.part, (x - 22.0, y - 3.0), _TEXT)
    pen.text("wheel", (x - 4.0, y + new_height + 3.0), _SMALL)


def _block_height(sheet: DrawingSheet) -> float:
    return -(-len(sheet.title_block) // _ACROSS) * _CELL


def _title_block(pen: _Pen, sheet: DrawingSheet, placed: _Placed) -> None:
    """Draw the border and the title block at its lower right corner."""
    width, height = PAPERS[placed.paper]
    pen.box(_MARGIN / 2, -_MARGIN / 2, width - _MARGIN, height - _MARGIN)
    top, wide = -height + _MARGIN + _block_height(sheet), _WIDTH / _ACROSS
    for at, (label, value) in enumerate(sheet.title_block):
        x, y = placed.right + at % _ACROSS * wide, top - at // _ACROSS * _CELL
        pen.box(x, y, wide, _CELL)
        pen.text(label, (x + 1.0, y - _SMALL - 0.8), _SMALL)
        lines = wrap(value, _letters(wide - 2.0, _TEXT))
        for line_number, line in enumerate(lines[:2], start=1):
            pen.text(line, (x + 1.0, y - _SMALL - 0.8 - line_number * 3.3), _TEXT)

"""A tolerance as a drawing shows it: its frame with symbol, zone and datum, as text, as SVG and as DXF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

SYMBOLS = {
    "position": "⌖",
    "coaxiality": "◎",
    "circular run-out": "↗",
    "parallelism": "∥",
    "cumulative pitch": "Fp",
    "size": "",
}
"""Characteristic → its symbol of ISO 1101; the pitch has the letters of ISO 1328-1, a size has deviations alone."""

_HEIGHT, _LETTER = 20.0, 9.0
"""Height of a frame and width of a letter in it [px]."""
_SCALE = 7.0 / _HEIGHT
"""Height of a frame on paper is 7 mm, for letters of 3.5 mm [mm/px]."""

Lines = tuple[tuple[tuple[float, float], ...], ...]


@dataclass(frozen=True)
class FeatureFrame:
    """What stands on a drawing for one tolerance.

    Parameters
    ----------
    characteristic
        One of `SYMBOLS`.
    zone
        The zone as it is written, such as ``⌀0.0047`` or ``±0.001``, in millimetres.
    datums
        Letters of the datums, the first one first.
    exact
        The zone that the drawing was verified with, in words.
    """

    characteristic: str
    zone: str
    datums: tuple[str, ...] = ()
    exact: str = ""

    @property
    def symbol(self) -> str:
        """The symbol as a letter."""
        return SYMBOLS[self.characteristic]

    @property
    def cells(self) -> tuple[str, ...]:
        """What stands in the boxes of the frame, from the left."""
        return tuple(cell for cell in (self.symbol, self.zone, *self.datums) if cell)

    def __str__(self) -> str:
        return " ".join(self.cells)

    def _repr_html_(self) -> str:
        said = escape(f"{self.characteristic}: {self.exact or self.zone}")
        return f'<span class="frame" title="{said}">{svg_of(self)}</span>'


class Frames(tuple[FeatureFrame, ...]):
    """The frames of one dimension: one, or several where its members keep different zones."""

    def __str__(self) -> str:
        return ", ".join(map(str, self))

    def _repr_html_(self) -> str:
        return " ".join(frame._repr_html_() for frame in self)


def drawn_symbol(characteristic: str) -> tuple[Lines, tuple[float, ...]]:
    """Return polylines in a unit square, y upwards, and radii of circles about its middle [of the height].

    Fonts draw these symbols too differently for a drawing.
    """
    lines: dict[str, Lines] = {
        "position": (((0.1, 0.5), (0.9, 0.5)), ((0.5, 0.1), (0.5, 0.9))),
        "circular run-out": (((0.2, 0.15), (0.75, 0.85)), ((0.72, 0.6), (0.75, 0.85), (0.52, 0.75))),
        "parallelism": (((0.2, 0.15), (0.5, 0.85)), ((0.5, 0.15), (0.8, 0.85))),
    }
    circles = {"position": (0.24,), "coaxiality": (0.16, 0.32)}
    return lines.get(characteristic, ()), circles.get(characteristic, ())


def _boxes(frame: FeatureFrame) -> list[tuple[float, float, str]]:
    """Return left edge, width [px] and text of every box; no text where a symbol is drawn."""
    found, left = [], 0.5
    is_drawn = any(drawn_symbol(frame.characteristic))
    for at, cell in enumerate(frame.cells):
        width = _HEIGHT if at == 0 and is_drawn else max(_HEIGHT, _LETTER * len(cell) + 8.0)
        found.append((left, width, "" if at == 0 and is_drawn else cell))
        left += width
    return found


def svg_of(frame: FeatureFrame) -> str:
    """Return the frame as a picture that stands in a line of text."""
    boxes, height = _boxes(frame), _HEIGHT
    right = boxes[-1][0] + boxes[-1][1]
    is_size = frame.characteristic == "size"
    parts = []
    for left, width, text in boxes:
        if not is_size:
            parts.append(f'<rect x="{left:g}" y="0.5" width="{width:g}" height="{height:g}"/>')
        if text:
            parts.append(
                f'<text x="{left + width / 2:g}" y="15" fill="currentColor" stroke="none">{escape(text)}</text>'
            )
    lines, circles = drawn_symbol(frame.characteristic)
    for line in lines:
        points = " ".join(f"{0.5 + x * height:g},{0.5 + (1 - y) * height:g}" for x, y in line)
        parts.append(f'<polyline points="{points}"/>')
    parts += [f'<circle cx="{0.5 + height / 2:g}" cy="{0.5 + height / 2:g}" r="{r * height:g}"/>' for r in circles]
    size = f'width="{right + 0.5:g}" height="{height + 1:g}" viewBox="0 0 {right + 0.5:g} {height + 1:g}"'
    style = 'fill="none" stroke="currentColor" text-anchor="middle" style="font: 14px sans-serif"'
    label = f'role="img" aria-label="{escape(str(frame))}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} {label} {style}>{"".join(parts)}</svg>'


def write_frames(frames: Sequence[tuple[str, FeatureFrame]], path: Path, notes: Sequence[str] = ()) -> None:
    """Write named frames below each other into a DXF file in millimetres, one block each, to be put on a drawing.

    Parameters
    ----------
    frames
        Name of the dimension and its frame.
    path
        File, replaced if it is there.
    notes
        What must be said beside the frames, a line each below them, such as the tooth modification.
    """
    from ezdxf import units
    from ezdxf.enums import TextEntityAlignment
    from ezdxf.filemanagement import new

    drawing = new("R2010", units=units.MM)
    drawing.styles.add("FRAME", font="DejaVuSans.ttf")
    space, tall = drawing.modelspace(), _HEIGHT * _SCALE
    for number, (name, frame) in enumerate(frames):
        block = drawing.blocks.new(f"FRAME_{number + 1}")
        for left, width, text in _boxes(frame):
            x, wide = (left - 0.5) * _SCALE, width * _SCALE
            if frame.characteristic != "size":
                block.add_lwpolyline([(x, 0), (x + wide, 0), (x + wide, tall), (x, tall)], close=True)
            if text:
                block.add_text(text, height=tall / 2, dxfattribs={"style": "FRAME"}).set_placement(
                    (x + wide / 2, tall / 2), align=TextEntityAlignment.MIDDLE_CENTER
                )
        lines, circles = drawn_symbol(frame.characteristic)
        for line in lines:
            block.add_lwpolyline([(x * tall, y * tall) for x, y in line])
        for radius in circles:
            block.add_circle((tall / 2, tall / 2), radius * tall)
        at = -1.6 * tall * number
        space.add_blockref(block.name, (60.0, at))
        space.add_text(name, height=tall / 2, dxfattribs={"style": "FRAME"}).set_placement((0.0, at + tall / 4))
    for below, note in enumerate(notes, start=len(frames)):
        at = -1.6 * tall * below
        space.add_text(note, height=tall / 2, dxfattribs={"style": "FRAME"}).set_placement((0.0, at + tall / 4))
    drawing.saveas(path)

"""A tolerance as a drawing shows it: its frame with symbol, zone and datum, as text, as SVG and as DXF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor
from pathlib import Path

from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import PHASE, ROTATION, TILT, Feature
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers.family import RV

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

STEP = 0.01 * MICROMETRE
"""Finest step in which a drawing writes a zone [m]; an allocated zone has the step of its row already."""
_ROUNDING = 1e-6
"""Part of a step that a zone may lack and still count as whole [-]."""

_OF_FEATURE = {
    Feature.POSITION: "position",
    Feature.RUNOUT: "circular run-out",
    Feature.PITCH: "cumulative pitch",
    Feature.SIZE: "size",
}
"""Feature → its characteristic on the drawing, where nothing else is said of the source."""
_OF_ANGLE = {
    (Feature.SIZE, "tilt"): TILT,
    (Feature.POSITION, "tilt"): TILT,
    (Feature.SIZE, "rotation"): ROTATION,
    (Feature.SIZE, "phase"): PHASE,
}
"""Feature and last part of the name of an angle that no reducer declares."""

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


def _found(source: Source) -> tuple[str, str]:
    """Return the characteristic of a source, and what of it is assumed."""
    kind = RV.sources.of(source.name)
    if kind is None:
        own = _OF_ANGLE.get((source.feature, source.name.rpartition(".")[2]))
    else:
        own = kind.characteristic if source.feature in (Feature.SIZE, Feature.POSITION) else None
    return (own.name, own.assumed) if own else (_OF_FEATURE[source.feature], "")


def written(length: float) -> str:
    """Return a width as a drawing writes it [mm], rounded down to 0.01 µm so that nothing wider is allowed.

    >>> written(4.7503e-6), written(10e-6), written(0.5e-6)
    ('0.00475', '0.01', '0.0005')
    """
    steps = floor(length / STEP + _ROUNDING)
    return f"{steps * STEP / MILLIMETRE:.5f}".rstrip("0").rstrip(".") or "0"


def callout(source: Source) -> FeatureFrame:
    """Return what stands on the drawing for a source.

    References
    ----------
    ISO 1101 (symbols), ISO 1328-1 (total cumulative pitch deviation), ISO 129-1 (limit deviations).
    """
    characteristic, _ = _found(source)
    exact = f"{source.zone / MICROMETRE:.6g} µm"
    if characteristic == "size":
        return FeatureFrame("size", _deviations(source), exact=exact)
    round_zone = source.feature is Feature.POSITION
    over = f"/{source.over / MILLIMETRE:g}" if source.over else ""
    datums = () if characteristic == "cumulative pitch" else ("A",)
    return FeatureFrame(characteristic, f"{'⌀' if round_zone else ''}{written(source.zone)}{over}", datums, exact)


def _deviations(source: Source) -> str:
    """Return the limit deviations of a size [mm]; half a zone is rounded, so that both sides are alike."""
    if source.middle == 0.0:
        return f"±{written(source.zone / 2)}"
    upper = floor((source.middle + source.zone / 2) / STEP + _ROUNDING)
    lower = ceil((source.middle - source.zone / 2) / STEP - _ROUNDING)
    return " / ".join(
        f"{'−' if steps < 0 else '+' if steps else ''}{written(abs(steps) * STEP)}" for steps in (upper, lower)
    )


def callout_assumptions(sources: tuple[Source, ...]) -> tuple[str, ...]:
    """Return what the frames of some sources take for granted."""
    said = [assumed for _, assumed in map(_found, sources) if assumed]
    if any(callout(source).datums for source in sources):
        said.append("datum A of a frame is the axis that centres or turns its part; the tolerance table names no datum")
    return tuple(dict.fromkeys(said))


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
    from tolalloc.reports.drawing_files import centre, new_drawing

    drawing = new_drawing()
    drawing.styles.add("FRAME", font="DejaVuSans.ttf")
    space, tall = drawing.modelspace(), _HEIGHT * _SCALE
    for number, (name, frame) in enumerate(frames):
        block = drawing.blocks.new(f"FRAME_{number + 1}")
        for left, width, text in _boxes(frame):
            x, wide = (left - 0.5) * _SCALE, width * _SCALE
            if frame.characteristic != "size":
                block.add_lwpolyline([(x, 0), (x + wide, 0), (x + wide, tall), (x, tall)], close=True)
            if text:
                middle = (x + wide / 2, tall / 2)
                centre(block.add_text(text, height=tall / 2, dxfattribs={"style": "FRAME"}), middle)
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

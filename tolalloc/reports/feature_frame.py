"""A tolerance as a drawing shows it: its frame with symbol, zone and datum, as text and as SVG."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from html import escape
from math import ceil, floor

from tolalloc.drawings.sources import INCHES, LENGTHS, Source
from tolalloc.drawings.zones import PHASE, ROTATION, TILT, Feature
from tolalloc.reading.units import INCH, MICROMETRE
from tolalloc.reducers.equivalent.sources import ErrorSource

SYMBOLS = {
    "position": "⌖",
    "coaxiality": "◎",
    "circular run-out": "↗",
    "parallelism": "∥",
    "cumulative pitch": "Fp",
    "tooth run-out": "Fr",
    "single tooth": "",
    "size": "",
}
"""Characteristic → its symbol of ISO 1101; pitch and run-out of teeth have the letters of ISO 1328, sizes and single
teeth have deviations alone."""
INSPECTED = ("cumulative pitch", "tooth run-out", "single tooth")
"""Characteristics that are inspection data of a gear part, which stand in a table and in no frame."""
_DEVIATIONS = ("size", "single tooth")
"""Characteristics of which limit deviations are written."""
_HALVED = (*_DEVIATIONS, TILT.name)
"""Characteristics of which half the zone is written, to either side; a parallelism of t over L lets an axis lean by
t/L in any direction, so it is half the width or diameter of what the axis may do (ISO 1101)."""

HEIGHT, _LETTER = 20.0, 9.0
"""Height of a frame and width of a letter in it [px]."""

STEP = 0.01 * MICROMETRE
"""Finest step in which a drawing writes a zone [m]; an allocated zone has the step of its row already."""
FINEST = {"mm": (STEP, 5), INCHES: (1e-6 * INCH, 6)}
"""Unit of a drawing → its finest step [m], and the decimals of that [-]."""
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

_TEETH = (
    "Fp and Fr are named after ISO 1328, which is about involute gears: for cycloid discs and the ring of pins their "
    "definitions are taken over, over one turn about axis A"
)

Lines = tuple[tuple[tuple[float, float], ...], ...]


@dataclass(frozen=True)
class FeatureFrame:
    """What stands on a drawing for one tolerance."""

    characteristic: str  # One of `SYMBOLS`
    zone: str  # The zone as it is written, such as ``⌀0.0047`` or ``±0.001``, in millimetres
    datums: tuple[str, ...] = ()  # Letters of the datums, the first one first
    exact: str = ""  # The zone that the drawing was verified with, in words
    # Where the zone holds if the feature does not say so, such as ``at R 0.9`` in millimetres; it stands beside the
    # frame
    place: str = ""

    @property
    def symbol(self) -> str:
        """The symbol as a letter."""
        return SYMBOLS[self.characteristic]

    @property
    def cells(self) -> tuple[str, ...]:
        """What stands in the boxes of the frame, from the left."""
        return tuple(cell for cell in (self.symbol, self.zone, *self.datums) if cell)

    @property
    def is_framed(self) -> bool:
        """Whether it is a frame of ISO 1101, and not limit deviations or inspection data of a gear part."""
        return self.characteristic not in ("size", *INSPECTED)

    @property
    def is_deviation(self) -> bool:
        """Whether limit deviations are written."""
        return self.characteristic in _DEVIATIONS

    @property
    def share(self) -> float:
        """What is written over the zone [-]."""
        return _share(self.characteristic)

    def __str__(self) -> str:
        return " ".join(filter(None, (*self.cells, self.place)))

    def _repr_html_(self) -> str:
        said = escape(f"{self.characteristic}: {self.exact or self.zone}")
        return (
            f'<span class="frame" title="{said}">{svg_of(self)}{f" {escape(self.place)}" if self.place else ""}</span>'
        )


class Frames(tuple[FeatureFrame, ...]):
    """The frames of one dimension: one, or several where its members keep different zones."""

    def __str__(self) -> str:
        return ", ".join(map(str, self))

    def _repr_html_(self) -> str:
        return " ".join(frame._repr_html_() for frame in self)


def _share(characteristic: str) -> float:
    return 0.5 if characteristic in _HALVED else 1.0


def _found(source: Source, kind: ErrorSource | None) -> tuple[str, str]:
    """Return the characteristic of a source, and what of it is assumed."""
    if kind is not None and kind.each == "tooth":
        return "single tooth", ""
    if kind is not None and kind.shape == "waves" and source.feature in (Feature.PITCH, Feature.RUNOUT):
        name = "tooth run-out" if source.feature is Feature.RUNOUT else _OF_FEATURE[source.feature]
        return name, "" if kind.first_stage else _TEETH
    if kind is None:
        own = _OF_ANGLE.get((source.feature, source.name.rpartition(".")[2]))
    else:
        own = kind.characteristic if source.feature in (Feature.SIZE, Feature.POSITION) else None
    return (own.name, own.assumed) if own else (_OF_FEATURE[source.feature], "")


def written(length: float, unit: str = "mm") -> str:
    """Return a width as a drawing writes it, rounded down to 0.01 µm or 1e-6 in so that nothing wider is allowed.

    >>> written(4.7503e-6), written(10e-6), written(0.5e-6), written(50.8e-6, "in")
    ('0.00475', '0.01', '0.0005', '0.002')
    """
    step, decimals = FINEST[unit]
    steps = floor(length / step + _ROUNDING)
    return f"{steps * step / LENGTHS[unit]:.{decimals}f}".rstrip("0").rstrip(".") or "0"


def writing_unit(sources: Iterable[Source]) -> str:
    """Return what a head says of the widths that a drawing writes; one in inches states its unit itself."""
    stated = {own.length_name for own in sources} or {"mm"}
    return stated.pop() if len(stated) == 1 else "mm unless stated"


def callout(source: Source, kind: ErrorSource | None = None) -> FeatureFrame:
    """Return what stands on the drawing for a source, of the kind that its model declares, if it does.

    References
    ----------
    ISO 1101 (symbols), ISO 1328-1 and -2 (total cumulative pitch deviation, run-out), ISO 129-1 (limit deviations).
    """
    characteristic, _ = _found(source, kind)
    exact, unit = source.said(source.zone, ".6g"), source.length_name
    stated = f" {unit}" if unit == INCHES else ""
    if characteristic in _DEVIATIONS:
        return FeatureFrame(characteristic, _deviations(source), exact=exact)
    round_zone = source.feature is Feature.POSITION
    over, place = "", ""
    if source.over and characteristic == "position":
        place = f"at R {source.over / LENGTHS[unit]:g}{stated}"  # A turn about the axis; only a tilt is by length
    elif source.over:
        over = f"/{source.over / LENGTHS[unit]:g}"
    datums = () if characteristic in INSPECTED else ("A",)
    zone = f"{'⌀' if round_zone else ''}{written(_share(characteristic) * source.zone, unit)}{over}{stated}"
    return FeatureFrame(characteristic, zone, datums, exact, place)


def _deviations(source: Source) -> str:
    """Return the limit deviations of a size [mm or in]; half a zone is rounded, so that both sides are alike."""
    unit = source.length_name
    stated = f" {unit}" if unit == INCHES else ""
    if source.middle == 0.0:
        return f"±{written(source.zone / 2, unit)}{stated}"
    step, _ = FINEST[unit]
    ends = (
        f"{'−' if steps < 0 else '+' if steps else ''}{written(abs(steps) * step, unit)}"
        for steps in reversed(_steps(source))
    )
    return " / ".join(ends) + stated


def _steps(source: Source) -> tuple[int, int]:
    """Return both limit deviations of a size in steps of a drawing, inside its zone [-]."""
    step, _ = FINEST[source.length_name]
    lower = ceil((source.middle - source.zone / 2) / step - _ROUNDING)
    return lower, floor((source.middle + source.zone / 2) / step + _ROUNDING)


def stated_limits(source: Source, frame: FeatureFrame) -> tuple[float | None, float]:
    """Return the limits that a drawing states of a source: both deviations, or none and what its frame says [m].

    As they are written, so no wider than the zone that was verified.
    """
    step, _ = FINEST[source.length_name]
    if not frame.is_deviation:
        return None, floor(frame.share * source.zone / step + _ROUNDING) * step
    lower, upper = _steps(source)
    return lower * step, upper * step


def callout_assumptions(sources: Iterable[Source], kind_of: Callable[[Source], ErrorSource | None]) -> tuple[str, ...]:
    """Return what the frames of some sources take for granted."""
    known = [(source, kind_of(source)) for source in sources]
    said = [assumed for own in known if (assumed := _found(*own)[1])]
    if any(callout(*own).datums for own in known):
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


def boxes(frame: FeatureFrame) -> list[tuple[float, float, str]]:
    """Return left edge, width [px] and text of every box; no text where a symbol is drawn."""
    found, left = [], 0.5
    is_drawn = any(drawn_symbol(frame.characteristic))
    for at, cell in enumerate(frame.cells):
        width = HEIGHT if at == 0 and is_drawn else max(HEIGHT, _LETTER * len(cell) + 8.0)
        found.append((left, width, "" if at == 0 and is_drawn else cell))
        left += width
    return found


def svg_of(frame: FeatureFrame) -> str:
    """Return the frame as a picture that stands in a line of text."""
    cells, height = boxes(frame), HEIGHT
    right = cells[-1][0] + cells[-1][1]
    parts = []
    for left, width, text in cells:
        if frame.is_framed:
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

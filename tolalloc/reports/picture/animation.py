"""The moving picture as a small file of its own: an animated PNG of a turn of the cranks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib.figure import Figure

from tolalloc.reports.picture.pose import Pose
from tolalloc.reports.picture.still import draw_still, mixed

_FRAMES_PER_SECOND = 12
_EDGES = (("#1c2733", 3), ("#5b6876", 3), ("#b00020", 2))
"""Colours of lines, and into how many steps each goes over into a face."""
_FACES = ("#ffffff", "#dadcde", "#b2b6ba", "#bed2e2", "#bbd9c7", "#c8cbce", "#d5d7d9")


def animate(record: Mapping[str, Any], shares: Mapping[str, float], path: Path, frames: int, title: str) -> None:
    """Write an animated PNG of one turn of the cranks as the output sees it, after which the nominal picture closes.

    Seen from the carrier a turn of the cranks moves the ring of pins by one pin and the sun by whole teeth; for an eye
    in the housing nothing less than a whole output turn brings everything back. A frame holds what has changed since
    the one before, the rest of it is transparent.
    """
    from PIL import Image

    angles = 2 * np.pi / record["outline"]["pin_count"] * np.arange(frames) / frames
    largest = max(float(Pose(record, angle).state("force")[0].max()) for angle in angles)
    pictures = [
        _pixels(
            draw_still(
                record,
                shares,
                angle,
                title=f"{title}, seen from its output",
                turned=-angle,
                discs=(0,),
                largest=largest or None,
            )
        )
        for angle in angles.tolist()
    ]
    palette = Image.new("P", (1, 1))
    palette.putpalette(_palette())
    images = [Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    colours = [np.asarray(image) + 1 for image in images]
    written = []
    for at, colour in enumerate(colours):
        changed = colour if at == 0 else np.where(colour == colours[at - 1], 0, colour)
        image = Image.fromarray(changed.astype(np.uint8), "P")
        image.putpalette([0, 0, 0, *_palette()])
        written.append(image)
    written[0].save(
        path,
        format="PNG",
        save_all=True,
        append_images=written[1:],
        duration=1000 / _FRAMES_PER_SECOND,
        loop=0,
        transparency=0,
        blend=1,
        disposal=0,
        optimize=True,
    )


def _pixels(drawing: Figure) -> UInt8[np.ndarray, "row column 3"]:
    """Return a drawing as red, green and blue."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(drawing)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _palette() -> list[int]:
    """Return the colours of the picture: its faces, and lines as they go over into them [0 to 255]."""
    colours = [mixed(face, face, 0.0) for face in _FACES]
    for edge, steps in _EDGES:
        colours += [mixed(face, edge, step / steps) for face in _FACES for step in range(1, steps)]
        colours.append(mixed(edge, edge, 0.0))
    return [round(255 * channel) for colour in colours for channel in colour]

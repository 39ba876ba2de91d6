"""A font for letters that matplotlib's own has not, such as Chinese ids: one of those installed, none is shipped."""

from __future__ import annotations

import sys
import warnings
from functools import cache

from matplotlib import font_manager
from matplotlib.figure import Figure as Canvas
from matplotlib.ft2font import FT2Font
from matplotlib.text import Text

_BOXES = "Last Resort"
"""Begins the name of a font that has a box for every letter."""


def with_letters(canvas: Canvas) -> Canvas:
    """Return a picture that is drawn with a second font where the usual one lacks letters.

    Where no installed font has them they are drawn as boxes, which is said once.
    """
    texts = [own for own in canvas.findobj(Text) if isinstance(own, Text)]
    letters = frozenset("".join(own.get_text() for own in texts)) - {"\n"}
    usual = font_manager.findfont(font_manager.FontProperties())
    if missing := letters - _letters_of(usual):
        second = font_with(missing)
        if second:
            for own in texts:
                own.set_fontfamily([*own.get_fontfamily(), second.name])
        if boxes := missing - (_letters_of(second.fname) if second else frozenset()):
            _say_once("".join(sorted(boxes)[:8]))
    return canvas


@cache
def font_with(letters: frozenset[str]) -> font_manager.FontEntry | None:
    """Return the installed font that has most of some letters, none where no font has any."""
    known = [entry for entry in font_manager.fontManager.ttflist if not entry.name.startswith(_BOXES)]
    most = max(known, key=lambda entry: len(letters & _letters_of(entry.fname)), default=None)
    return most if most and letters & _letters_of(most.fname) else None


@cache
def _letters_of(file: str) -> frozenset[str]:
    try:
        return frozenset(map(chr, FT2Font(file).get_charmap()))
    except (OSError, RuntimeError):  # a file that is no font that matplotlib can draw with
        return frozenset()


@cache
def _say_once(letters: str) -> None:
    sys.stderr.write(f"No installed font has the letters {letters}: pictures show boxes instead.\n")
    warnings.filterwarnings("ignore", message="Glyph .* missing from")

"""What a drawing limits of a source: the number that a gauge shows, comparable with the zone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.drawing.sources import Source
from tolalloc.drawing.zones import Feature

_POINTS_PER_WAVE = 32
"""Points of the shortest wave of a spectrum; the range between them is at most 0.5 % too small."""


def limited_measure(source: Source, columns: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
    """Return what a gauge would show of one source, in such a way that it compares with the zone [m].

    Parameters
    ----------
    source
        The source.
    columns
        Its own columns [m, angles rad].

    Notes
    -----
    A size: its deviation from the middle, for like features the largest magnitude. A position: twice the distance from
    the true one, the largest of like features. Pitch and run-out: the range over a turn, or at the teeth for a spectrum
    with a random part.
    """
    length = columns * source.lever - source.middle
    if source.feature is Feature.SIZE:
        return np.asarray(np.abs(length).max(axis=1) if source.each > 1 else length[:, 0])
    if source.feature is Feature.POSITION:
        return np.asarray(2.0 * np.hypot(length[:, 0::2], length[:, 1::2]).max(axis=1))
    orders = np.array([order for order, _ in source.spectrum])
    high, low = np.full(length.shape[0], -np.inf), np.full(length.shape[0], np.inf)
    points = source.teeth or _POINTS_PER_WAVE * int(orders.max())
    # Point by point, because all points of many units at once would fill the memory.
    for turn in np.linspace(0.0, 2 * np.pi, points, endpoint=False):
        wave = length @ np.column_stack([np.cos(orders * turn), np.sin(orders * turn)]).ravel()
        high, low = np.maximum(high, wave), np.minimum(low, wave)
    return np.asarray(high - low)

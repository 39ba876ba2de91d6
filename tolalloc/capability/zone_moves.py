"""Moves of units inside the zone of one source; their columns are deviations from its middle per unit of zone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.drawing.sources import Source
from tolalloc.drawing.zones import Feature

_TURNS = 0.5 ** np.arange(2, 8)
"""Steps of the search over the phases of waves [turn]."""


def extreme_in_zone(
    source: Source, units: Float[np.ndarray, "unit column"], gradients: Float[np.ndarray, "unit column"]
) -> Float[np.ndarray, "unit column"]:
    """Return, for every unit, the part inside the zone that goes furthest along a gradient.

    Parameters
    ----------
    source
        The source.
    units
        Its columns now, from which waves are searched [-].
    gradients
        Derivatives of an output by these columns [output].

    Notes
    -----
    Exact for sizes and positions. Waves keep the relative amplitudes of the spectrum, and how large all of them may be
    follows from their phases by the range over a turn; the phases are searched one at a time and together, as if the
    part were turned, from those of the unit or of the gradient, whichever is the better start.
    """
    if source.feature is Feature.SIZE:
        return source.at_limit(np.where(gradients > 0.0, 0.75, 0.25))
    if source.feature is Feature.POSITION:
        return _filled(source, _phases(gradients))

    def along(phases: Float[np.ndarray, "unit order"]) -> Float[np.ndarray, " unit"]:
        return np.asarray((_filled(source, phases) * gradients).sum(axis=1))

    orders = np.array([order for order, _ in source.spectrum], float)
    directions = np.concatenate([np.eye(orders.size), orders[np.newaxis] / orders.max()])
    phases = _phases(units)
    furthest = along(phases)
    moves = [_phases(gradients) - phases, *(turn * way for turn in _TURNS for way in (*directions, *-directions))]
    for move in moves:
        found = along(phases + move)
        better = found > furthest
        phases = np.where(better[:, np.newaxis], phases + move, phases)
        furthest = np.maximum(found, furthest)
    return _filled(source, phases)


def moved_towards(
    source: Source,
    units: Float[np.ndarray, "unit column"],
    targets: Float[np.ndarray, "unit column"],
    part: float,
) -> Float[np.ndarray, "unit column"]:
    """Return the parts that lie between two parts inside the zone, waves with phases between theirs.

    Parameters
    ----------
    source
        The source.
    units, targets
        Its columns of either part [-].
    part
        Part of the way, 0 to 1 [-].
    """
    if not source.spectrum:
        return np.asarray(units + part * (targets - units))
    phases = _phases(units)
    way = np.remainder(_phases(targets) - phases + 0.5, 1.0) - 0.5
    return _filled(source, phases + part * way)


def _phases(columns: Float[np.ndarray, "unit column"]) -> Float[np.ndarray, "unit vector"]:
    """Return the direction of every vector [turn]."""
    return np.asarray(np.arctan2(columns[:, 1::2], columns[:, 0::2]) / (2 * np.pi))


def _filled(source: Source, phases: Float[np.ndarray, "unit vector"]) -> Float[np.ndarray, "unit column"]:
    """Return the vectors or waves with these phases [turn] that fill the zone."""
    return np.asarray(source.at_limit(np.repeat(phases % 1.0, 2, axis=1)))

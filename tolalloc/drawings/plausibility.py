"""What of a tolerance table is allowed but hardly meant: units, signs and sizes that no drawing has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.reading.units import MICROMETRE, MILLIMETRE

_FINEST, _COARSEST = 0.2, 640.0
"""Zone over the standard tolerance factor i of ISO 286-1 outside which it is doubted: IT01 is 0.4 of it and more, and
IT15 is 640 [-]."""
_WIDE = 0.12
"""Zone over the nominal size from which on it is doubted [-]."""
_SMALLEST_SIZE = 0.1 * MILLIMETRE
"""Nominal size below which it is doubted, where one is stated [m]."""
_FINEST_ZONE = 0.1 * MICROMETRE
"""Zone of a feature without a nominal size below which it is doubted [m]."""
_LARGEST_SIZE = 3150.0 * MILLIMETRE
"""Largest nominal size of ISO 286-1 [m]."""
_OFF = 3.0
"""Distance of the middle of a zone from the nominal size, over the zone, from which on it is doubted: ISO 286 has such
fits, but hardly in a precision part [-]."""
_RANGE = 100.0
"""Factor between a zone and its smallest or largest one from which on their units are doubted [-]."""
_COST, _FEWEST = 50.0, 3
"""Factor between a cost and the middle one of a table of so many rows from which on it is doubted [-]."""
_CAPABILITY = (0.4, 4.0)
"""Cp outside which a process is doubted [-]."""
_STEEP = 0.01
"""Zone over the length that an angle is taken over, from which on the length is doubted [rad]."""
_FLAT = 5e-6
"""The same below which the length is doubted, 1″ [rad]; assumption."""


def doubts(sources: Sequence[Source], table: str) -> tuple[str, ...]:
    """Return what is allowed in a table but hardly meant, a sentence a row.

    Parameters
    ----------
    sources
        All rows, in metres.
    table
        What the table is called, for messages.
    """
    costs = np.array([source.cost for source in sources if source.zone > 0 and source.cost > 0])
    middle = float(np.median(costs)) if costs.size >= _FEWEST else 0.0
    found = []
    for source in sources:
        if reasons := _reasons(source, middle):
            said = "; ".join(reasons)
            found.append(f"{table}, {source.own_id or source.name}: {said}. Is it meant?")
    return tuple(found)


def _reasons(source: Source, middle_cost: float) -> list[str]:
    """Return what is doubted of a row."""
    if source.zone == 0.0:
        off = abs(source.middle) > 0
        return [f"its zone is 0 and {_length(source.middle)} off the nominal size"] if off else []
    return [*_of_size(source), *_of_zone(source), *_of_process(source, middle_cost)]


def _of_size(source: Source) -> list[str]:
    """Return what is doubted of the nominal size and of where the zone lies beside it."""
    found, zone, nominal = [], source.zone, source.nominal
    if nominal < 0:
        found.append(f"the nominal size is {_length(nominal)}, below 0")
    if 0 < nominal < _SMALLEST_SIZE:
        found.append(f"the nominal size is {_length(nominal)}")
    if abs(nominal) > _LARGEST_SIZE:
        found.append(f"the nominal size is {_length(nominal)}, beyond those of ISO 286")
    if source.feature is Feature.SIZE and not source.over and 0 < nominal * _WIDE < zone:
        found.append(f"the zone of {_length(zone)} is {zone / nominal:.0%} of the nominal size of {_length(nominal)}")
    if abs(source.middle) > _OFF * zone:
        found.append(f"the middle of its zone of {_length(zone)} is {_length(source.middle)} off the nominal size")
    elif source.feature is Feature.SIZE and abs(source.middle) > 0.5 * zone * (1 + 1e-9):
        found.append(
            f"both deviations have one sign, so the nominal size lies outside its zone, whose middle is "
            f"{_length(source.middle)} off"
        )
    return found


def _of_zone(source: Source) -> list[str]:
    """Return what is doubted of the size of the zone and of its range."""
    found, zone = [], source.zone
    if zone < _FINEST_ZONE:
        found.append(f"the zone of {_length(zone)} is finer than any process holds")
    elif source.nominal > 0 and source.feature is Feature.SIZE and not source.over:
        factor = zone / _tolerance_factor(source.nominal)
        if not _FINEST <= factor <= _COARSEST:
            than = "finer than IT01" if factor < _FINEST else "coarser than IT15"
            found.append(f"the zone of {_length(zone)} is {than} at a nominal size of {_length(source.nominal)}")
    if source.over and not _FLAT <= zone / source.over <= _STEEP:
        found.append(
            f"a zone of {_length(zone)} over {_length(source.over)} is an angle of {zone / source.over:.2g} rad"
        )
    if not source.locked and source.maximum > _RANGE * zone:
        found.append(f"max of {_length(source.maximum)} is {source.maximum / zone:.3g} times the zone")
    if not source.locked and 0 < source.minimum < zone / _RANGE:
        found.append(f"min of {_length(source.minimum)} is 1/{zone / source.minimum:.3g} of the zone")
    return found


def _of_process(source: Source, middle_cost: float) -> list[str]:
    """Return what is doubted of capability and cost."""
    found = []
    if not _CAPABILITY[0] <= source.cp <= _CAPABILITY[1]:
        found.append(f"Cp is {source.cp:g}")
    if middle_cost and source.cost and not middle_cost / _COST <= source.cost <= middle_cost * _COST:
        found.append(f"its cost of {source.cost:g} is far from {middle_cost:g}, the middle one of the table")
    return found


def _tolerance_factor(nominal: float) -> float:
    """Return the standard tolerance factor of ISO 286-1, i = 0.45·D^⅓ + 0.001·D in µm for D in mm [m].

    Zones of IT6 are 10·i and of IT16 1,000·i; a nominal size of 10 mm has i = 0.98 µm.
    """
    size = max(nominal / MILLIMETRE, 1.0)
    return float((0.45 * size ** (1 / 3) + 0.001 * size) * MICROMETRE)


def _length(length: float) -> str:
    """Return a length in the unit that a drawing would have."""
    if abs(length) >= MILLIMETRE / 2:
        return f"{length / MILLIMETRE:.4g} mm"
    return f"{length / MICROMETRE:.4g} µm"

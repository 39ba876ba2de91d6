"""What a drawing costs at other zones: each by the cheapest process that holds it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source, known_as, meant
from tolalloc.drawings.tolerance_table import with_zones
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import MICROMETRE

_ROUNDING = 1e-6
"""Share of a zone up to which it is a rounded bound [-]."""


def named_zones(errors: ErrorModel, zones: Mapping[str, float]) -> dict[str, float]:
    """Return source → zone [m] of names and patterns with zones [µm]; later patterns take over from earlier ones.

    Raises
    ------
    InputError, UnknownNameError
        No zone, a pattern that fits no source or only neglected ones, a zone that is not above 0.
    """
    found: dict[str, float] = {}
    if not zones:
        raise InputError("difference: no zone is given; give one or more, such as pin.diameter=3.")
    for pattern, zone in zones.items():
        own = meant(pattern, errors.active)
        if not own and meant(pattern, errors.sources):
            raise InputError(
                f"difference: source {pattern!r} is neglected, because its zone is 0 in the tolerance table; give it a "
                "zone above 0 there."
            )
        if not own:
            raise UnknownNameError.among("difference", "source", pattern, known_as(errors.active))
        if not (isinstance(zone, int | float) and 0 < zone < 1e6):
            raise InputError.at("difference", pattern, zone, "a zone above 0 and below 1 m, in µm")
        found |= dict.fromkeys(own, zone * MICROMETRE)
    return found


def outside_range(source: Source) -> str:
    """Return a sentence on a zone that lies outside what its row allows, empty for any other."""
    low, zone, high = (size / MICROMETRE for size in (source.minimum, source.zone, source.maximum))
    if high == 0 or low * (1 - _ROUNDING) <= zone <= high * (1 + _ROUNDING):
        return ""
    name = source.own_id or source.name
    meant = f" Write {name}={zone:g}mm if millimetres are meant." if low <= 1000 * zone <= high else ""
    return f"{name}: its zone of {zone:.4g} µm lies outside the {low:.4g} to {high:.4g} µm that its row allows.{meant}"


def repriced(space: DesignSpace, zones: Mapping[str, float]) -> tuple[Source, ...]:
    """Return the sources that vary, some at other zones [m] and what these cost by the cheapest process.

    Raises
    ------
    InputError
        A zone that no process holds.
    """
    sources = space.errors.active
    costs = {name: _price(space, name, zone) for name, zone in zones.items() if name in space.processes}
    return with_zones(sources, [zones.get(own.name, own.zone) for own in sources], costs)


def cheapest(space: DesignSpace, name: str, zone: float) -> Process | None:
    """Return the cheapest process of a source that holds a zone [m], none where none does."""
    holding = [own for own in space.processes[name] if own.minimum <= zone <= own.maximum]
    return min(holding, key=lambda own: float(own.total(np.array(zone))), default=None)


def _price(space: DesignSpace, name: str, zone: float) -> float:
    """Return the cost of a zone by the cheapest process that holds it [cost units]."""
    made = cheapest(space, name, zone)
    if made is None:
        held = f"{min(own.minimum for own in space.processes[name]) / MICROMETRE:.3g} to " + (
            f"{max(own.maximum for own in space.processes[name]) / MICROMETRE:.3g} µm, what its processes hold"
        )
        raise InputError.at("difference", name, f"{zone / MICROMETRE:g} µm", held)
    return float(made.total(np.array(zone)))

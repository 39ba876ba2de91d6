"""What may be chosen of a reducer: the clearances that its modification leaves, and how warm its discs may be."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from tolalloc.models.settings import Setting
from tolalloc.reading.named_fields import is_number, number

FLANK = "flank clearance [µm]"
RADIAL = "radial clearance [µm]"
TURNED = "rotation clearance [µm]"
_STEP = 0.1
"""Step of a difference by a clearance, to either side [µm]."""
FARTHEST_TEMPERATURE = 50.0
"""Largest difference of temperature between discs and ring that is believed, either way [K]."""
TEMPERATURE = number(
    f"−{FARTHEST_TEMPERATURE:g} to {FARTHEST_TEMPERATURE:g} K", least=-FARTHEST_TEMPERATURE, most=FARTHEST_TEMPERATURE
)
"""Rule of a difference of temperature between discs and ring."""


Ranges = tuple[tuple[float, float] | None, ...]
"""Smallest and largest clearance by turned flanks, on the flank, and at tip and root; none locks it."""


def is_range(value: Any, farthest: float) -> bool:
    """Return whether a value is two numbers, neither beyond the farthest to either side, the smaller one first."""
    pair = isinstance(value, Sequence) and len(value) == 2 and all(map(is_number, value))
    return pair and -farthest <= value[0] <= value[1] <= farthest


def clearance_settings(present: Sequence[float], bounds: Iterable[tuple[float, float] | None]) -> tuple[Setting, ...]:
    """Return flank and radial clearance as settings, before them the rotation clearance if there is a third [µm].

    Without bounds one is locked at its present value.
    """
    return tuple(
        Setting(name=name, value=value, lower=own[0] if own else value, upper=own[1] if own else value, step=_STEP)
        for name, value, own in zip((TURNED, FLANK, RADIAL)[-len(present) :], present, bounds, strict=True)
    )

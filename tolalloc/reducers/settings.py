"""What may be chosen of a reducer: the clearances that its modification leaves, and a torque, which changes no part."""

from __future__ import annotations

from collections.abc import Iterable

from tolalloc.models.settings import Setting
from tolalloc.reducers import TORQUE

FLANK = "flank clearance [µm]"
RADIAL = "radial clearance [µm]"
_STEP = 0.1
"""Step of a difference by a clearance, to either side [µm]."""


def clearance_settings(
    present: tuple[float, float], bounds: Iterable[tuple[float, float] | None]
) -> tuple[Setting, ...]:
    """Return flank and radial clearance as settings [µm]; without bounds one is locked at its present value."""
    return tuple(
        Setting(name=name, value=value, lower=own[0] if own else value, upper=own[1] if own else value, step=_STEP)
        for name, value, own in zip((FLANK, RADIAL), present, bounds, strict=True)
    )


def torque_condition(present: float, rated: float) -> Setting:
    """Return the torque as an operating condition, up to twice the rated one either way, or as far as it is [N·m]."""
    largest = max(2 * rated, abs(present))
    return Setting(name=TORQUE, value=present, lower=-largest, upper=largest, step=rated / 100)

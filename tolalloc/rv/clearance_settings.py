"""The tooth modification as a designer chooses it: the clearances that it leaves on the flank, and at tip and root."""

from __future__ import annotations

from collections.abc import Iterable

from tolalloc.settings import Setting

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

"""A small picture of which way a negative amount is ground."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SignSketch:
    """Two positions of a grinding wheel in a groove of the part below it, whose axis lies further down.

    Parameters
    ----------
    caption
        What the amount is, and what its two signs do.
    nominal
        Height of the wheel's middle and its radius without the amount [mm of the picture].
    changed
        The same with the amount negative [mm of the picture].
    arrow
        Heights at which the arrow from one to the other begins and ends [mm of the picture].
    """

    caption: str
    nominal: tuple[float, float]
    changed: tuple[float, float]
    arrow: tuple[float, float]

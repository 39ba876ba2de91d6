"""What may be chosen of a reducer: the clearances that its modification leaves, and conditions that change no part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from tolalloc.exceptions import InputError
from tolalloc.models.settings import Setting
from tolalloc.reading.named_fields import is_number
from tolalloc.reducers import DISC_TEMPERATURE, TORQUE

FLANK = "flank clearance [µm]"
RADIAL = "radial clearance [µm]"
TURNED = "rotation clearance [µm]"
_STEP = 0.1
"""Step of a difference by a clearance, to either side [µm]."""


def clearance_settings(present: Sequence[float], bounds: Iterable[tuple[float, float] | None]) -> tuple[Setting, ...]:
    """Return flank and radial clearance as settings, before them the rotation clearance if there is a third [µm].

    Without bounds one is locked at its present value.
    """
    return tuple(
        Setting(name=name, value=value, lower=own[0] if own else value, upper=own[1] if own else value, step=_STEP)
        for name, value, own in zip((TURNED, FLANK, RADIAL)[-len(present) :], present, bounds, strict=True)
    )


def torque_condition(present: float, rated: float) -> Setting:
    """Return the torque as an operating condition, up to twice the rated one either way, or as far as it is [N·m]."""
    largest = max(2 * rated, abs(present))
    return Setting(name=TORQUE, value=present, lower=-largest, upper=largest, step=rated / 100)


_WIDEST_TEMPERATURE = 20.0
"""Difference of temperature that the live page offers either way [K]."""
FARTHEST_TEMPERATURE = 50.0
"""Largest difference of temperature between discs and ring that is believed, either way [K]."""


def temperature_condition(present: float) -> Setting:
    """Return the temperature of the discs above the ring as an operating condition, up to 20 K either way [K]."""
    largest = max(_WIDEST_TEMPERATURE, abs(present))
    return Setting(name=DISC_TEMPERATURE, value=present, lower=-largest, upper=largest, step=0.1)


def require_temperature(place: str, field: str, warmer: Any) -> None:
    """Raise unless a difference of temperature between discs and ring can be meant.

    Raises
    ------
    InputError
        What is no number, or beyond 50 K.
    """
    if not (is_number(warmer) and abs(warmer) <= FARTHEST_TEMPERATURE):
        allowed = f"−{FARTHEST_TEMPERATURE:g} to {FARTHEST_TEMPERATURE:g} K"
        raise InputError.of_argument(place, field, warmer, allowed)


def at(output: str, *, disc_temperature: float) -> str:
    """Return the name of an output under an operating condition of its own, to be limited beside the same under others.

    Parameters
    ----------
    output
        Output of a reducer, such as `PEAK_TO_PEAK`.
    disc_temperature
        Temperature of the discs less that of the ring; one of ``further_disc_temperatures`` of `reducer` [K].

    Raises
    ------
    InputError
        An output without a unit, or a temperature that cannot be meant.

    Examples
    --------
    >>> at("lost motion [arcmin]", disc_temperature=-5)
    'lost motion, discs −5 K [arcmin]'
    """
    require_temperature("at", "disc_temperature", disc_temperature)
    what, found, unit = output.rpartition(" [") if isinstance(output, str) else ("", "", "")
    if not found:
        raise InputError.of_argument("at", "output", output, "an output of a reducer, such as ta.PEAK_TO_PEAK")
    return f"{what}, discs {f'{disc_temperature:+g}'.replace('-', '−')} K [{unit}"

"""Settings: what a designer chooses beside the zones, such as a clearance that the tooth modification leaves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.named_fields import NamedFields, is_number, number

_FINITE = number("a finite number")
_ROUNDING = 1e-9
"""How far a value may stand outside its bounds, as it was computed [unit of the setting]."""


@dataclass(frozen=True, kw_only=True)
class Setting(NamedFields):
    """A quantity that the designer chooses beside the zones, such as a clearance that the tooth modification leaves.

    Parameters
    ----------
    name
        Name with its unit.
    value
        As it is today [unit of the name].
    lower, upper
        Smallest and largest value that may be chosen; equal bounds lock it [unit of the name].
    step
        Step to either side of a difference by it [unit of the name].
    """

    called: ClassVar[str] = "setting"

    name: str
    value: Annotated[float, _FINITE]
    lower: Annotated[float, _FINITE]
    upper: Annotated[float, _FINITE]
    step: Annotated[float, _FINITE, number("above 0", above=0)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lower > self.upper:
            raise InputError.at(f"setting {self.name}", "lower", self.lower, f"at most upper = {self.upper:g}")

    def allows(self, value: float) -> bool:
        """Return whether a value may be chosen."""
        return self.lower - _ROUNDING <= value <= self.upper + _ROUNDING

    @property
    def out_of_bounds(self) -> bool:
        """Whether the setting as it is today lies outside what may be chosen."""
        return not self.allows(self.value)

    @property
    def sentence(self) -> str:
        """How it is today, and what it may become."""
        name, _, unit = self.name.rstrip("]").partition(" [")
        value, lower, upper = (f"{own:.3g}".replace("-", "−") for own in (self.value, self.lower, self.upper))
        present, allowed = f"{name}: {value} {unit}", f"{lower}…{upper} {unit}"
        if self.out_of_bounds:
            return f"{present} today, not among the {allowed} that it may become; only the table as it is may keep it"
        return f"{present}; {f'may become {allowed}' if self.lower < self.upper else 'locked'}"


@dataclass(frozen=True, kw_only=True)
class DrawnAmounts:
    """What a drawing says of the settings: amounts that are linear in them, in steps."""

    names: tuple[str, ...]  # Names of the amounts with their units, as many as settings
    # Change of every amount (row) with every setting (column) [unit of the amount per unit of the setting]
    by_setting: Float[np.ndarray, "amount setting"]
    steps: tuple[float, ...]  # Step of every amount on a drawing whose zones climb ladders [unit of the amount]
    # Step of every amount on any other drawing; none if it states them as they were found [unit of the amount]
    finest: tuple[float, ...] = ()
    convention: str = ""  # What their signs mean, a sentence without its full stop; empty where a name says all
    # Source whose zone is the tolerance of each amount, whether the drawing states it or not; none if there is none
    sources: tuple[str, ...] = ()


def require_settings(place: str, known: Iterable[Setting], wanted: Mapping[str, float]) -> None:
    """Raise unless every wanted value is one of a known setting, within its bounds."""
    own = {setting.name: setting for setting in known}
    for name, value in wanted.items():
        UnknownNameError.require(place, "setting", name, own)
        if not (is_number(value) and own[name].allows(value)):
            allowed = f"{own[name].lower:g} to {own[name].upper:g}, the bounds of this setting"
            raise InputError.at(place, name, value, allowed)

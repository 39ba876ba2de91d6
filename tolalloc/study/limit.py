"""A limit of an output with what must be shown of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Guarantee
from tolalloc.capability.indices import Limits
from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields, is_number


@dataclass(frozen=True, kw_only=True)
class Limit(NamedFields):
    """Limits of an output and what must be shown of them.

    Parameters
    ----------
    upper, lower
        Largest and smallest value allowed; an open side is None [unit of the output].
    show
        What must be shown: ``AtYield(target=…)``, ``AtCpk(target=…)``, ``WorstCase()``, ``RootSumSquare()``;
        99.73 % of units unless given.

    Raises
    ------
    InputError
        No side, sides in the wrong order, or numbers that are not finite.

    Examples
    --------
    >>> Limit(upper=60.0).upper
    60.0
    """

    called: ClassVar[str] = "limit"

    upper: float | None = None
    lower: float | None = None
    show: Guarantee | None = None

    def __post_init__(self) -> None:
        if isinstance(self.show, type) or not (self.show is None or isinstance(self.show, Guarantee)):
            raise InputError.at("limit", "show", self.show, "AtYield(...), AtCpk(...), WorstCase() or RootSumSquare()")
        for name in ("upper", "lower"):
            side = getattr(self, name)
            if side is None:
                continue
            if not (is_number(side) and abs(side) < float("inf")):
                raise InputError.at("limit", name, side, "a finite number; an open side is None")
            object.__setattr__(self, name, float(side))  # a study asks the same with 60 and with 60.0
        _ = self.limits

    @property
    def guarantee(self) -> Guarantee:
        """What must be shown."""
        return self.show or AtYield(target=USUAL_YIELD)

    @property
    def limits(self) -> Limits:
        """The limits alone."""
        return Limits(upper=self.upper, lower=self.lower)

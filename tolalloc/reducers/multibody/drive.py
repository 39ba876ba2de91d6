"""What moves a virtual prototype: input speed and torque over time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError

_KNOTS = 513  # of a smooth step: its straight pieces miss the cubic by less than a millionth of the step


@dataclass(frozen=True, kw_only=True)
class TimeCourse:
    """A quantity over time: straight between its knots, constant before the first and after the last.

    Raises
    ------
    InputError
        Knots that do not rise, or a number that is not finite.
    """

    time: Float[np.ndarray, " knot"]  # Knots, rising [s]
    value: Float[np.ndarray, " knot"]  # Speed or torque at the knots [rad/s or N·m]

    def __post_init__(self) -> None:
        finite = np.isfinite(self.time).all() and np.isfinite(self.value).all()
        if not (self.time.size and finite and (np.diff(self.time) > 0).all()):
            raise InputError("course over time: its knots are not rising, finite numbers; allowed are only such.")

    @classmethod
    def step(cls, value: float, start: float, end: float) -> TimeCourse:
        """Return a smooth rise from 0 to a value, 3s² − 2s³ between two times [s]."""
        share = np.linspace(0.0, 1.0, _KNOTS)
        return cls(time=start + (end - start) * share, value=value * share**2 * (3.0 - 2.0 * share))

    @cached_property
    def _pieces(self) -> tuple[list[float], list[float], list[float], list[float]]:
        """Knots, values, slopes after the knots, integrals up to them, as plain numbers: they are asked one by one."""
        step = np.diff(self.time)
        slope = np.append(np.diff(self.value) / step, 0.0)
        integral = np.concatenate([[0.0], np.cumsum(step * (self.value[1:] + self.value[:-1]) / 2)])
        return self.time.tolist(), self.value.tolist(), slope.tolist(), integral.tolist()

    def at(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(np.interp(time, self.time, self.value))

    def integral(self, time: float) -> float:
        """Return the integral from the first knot to a time [s]."""
        knots, values, slopes, integrals = self._pieces
        at = max(bisect_right(knots, time) - 1, 0)
        after = time - knots[at]
        return integrals[at] + after * (values[at] + (after * slopes[at] / 2 if after > 0 else 0.0))

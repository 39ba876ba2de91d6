"""Preferred zones for callouts without a nominal size: position, pitch, run-out.

Notes
-----
The values are the rounded ones of ISO 3, R′10 and R′20, which a drawing can carry: 3.2 rather than 3.15. R10 is the
default. One step is 26 %, about what a shop's cost tells apart; with the customary 1–2–5 a step is 100 % or 150 %, and
rounding a zone down to it gives away up to 60 % of that zone; with R20 a step is 12 %, and ladders double their length
for savings below the uncertainty of any cost.

References
----------
ISO 3, Preferred numbers: Series of preferred numbers; ISO 497, more rounded values.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.units import MICROMETRE


class Series(Enum):
    """A series of preferred numbers, its values within one decade [-]."""

    R10 = (1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.3, 8.0)
    R20 = (1, 1.1, 1.25, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3.2, 3.6, 4, 4.5, 5, 5.6, 6.3, 7.1, 8, 9)

    @property
    def zones(self) -> Float[np.ndarray, " step"]:
        """All zones from 0.1 µm to 1 mm [m]."""
        decades = [float(f"{value}e{power}") for power in range(-1, 3) for value in self.value]
        return np.array([*decades, 1000.0]) * MICROMETRE


def multiples(step: float, minimum: float, maximum: float) -> Float[np.ndarray, " value"]:
    """Return the multiples of a step that lie in a range, the values that a drawing would carry.

    Parameters
    ----------
    step
        Distance between two values [unit of the values].
    minimum, maximum
        The range [unit of the values].

    Raises
    ------
    InputError
        The step is not above 0, or the range holds no multiple of it.
    """
    if not 0 < step < np.inf:
        raise InputError.at("drawing values", "step", step, "a number above 0")
    rounding = 1e-9
    first, last = np.ceil(minimum / step - rounding), np.floor(maximum / step + rounding)
    if last < first:
        raise InputError.at(
            "drawing values", "min and max", (minimum, maximum), f"a range that holds a multiple of {step:g}"
        )
    return np.arange(first, last + 1) * step

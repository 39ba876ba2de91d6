"""Where something begins to hold, found by halving: for many intervals at once, and on the side where it holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

Ends = Float[np.ndarray, "*interval"] | float


def halved(
    holds: Callable[[Any], Bool[np.ndarray, "*interval"] | bool], inside: Ends, outside: Ends, steps: int
) -> Any:
    """Return the ends of intervals where something holds, after so many halvings; it need not be continuous."""
    for _ in range(steps):
        middle = (inside + outside) / 2.0
        there = holds(middle)
        inside, outside = np.where(there, middle, inside), np.where(there, outside, middle)
    return inside

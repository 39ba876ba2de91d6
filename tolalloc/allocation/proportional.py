"""What an engineer does with a few Monte Carlo runs: all zones scaled alike until the requirements are met."""

from __future__ import annotations

import numpy as np

from tolalloc.allocation.programs import SETTLED
from tolalloc.allocation.verification import VerifiedDesign, Verifier

_LEAST_RISE = 1e-6
"""What all zones together take of a limit is at least so much of the limit, where it is what a step divides by [-]."""


def scale_in_proportion(verifier: Verifier, steps: int) -> tuple[VerifiedDesign, ...]:
    """Return designs with all zones scaled alike, the first the tolerance table as it is.

    Notes
    -----
    The scale follows the design's own gradient until a met design has next to nothing left to gain: what an
    engineer does with a few Monte Carlo runs.
    """
    space, scale = verifier.space, 1.0
    tried: list[VerifiedDesign] = []
    for step in range(steps):
        # The stream of random units keeps the name that it had.
        tried.append(verifier.verify(space.uniform(scale), f"by hand {step + 1}"))
        factor = _factor(tried[-1])
        if tried[-1].met and factor < 1 + SETTLED:
            break
        scale *= factor
    return tuple(tried)


def _factor(tried: VerifiedDesign) -> float:
    """Return the common factor of all scales that takes a design to its limits [-]."""
    factors = []
    for side in tried.sides:
        rise = side.load_of_zones(tried.design)
        budget = -float(side.predicted(tried.design)) - side.standard_error
        factors.append(1 + budget / max(rise, _LEAST_RISE * side.scale))
    return float(np.clip(min(factors), 0.4, 2.5))

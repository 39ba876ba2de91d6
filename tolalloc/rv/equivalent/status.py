"""How the solution of one sample at one angle, or of one sample over all angles, ended."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

import numpy as np
from jaxtyping import Integer

from tolalloc.rv.equivalent.solvers.records import CONVERGED, NOT_CONVERGED, NOT_FINITE, NOT_RESISTED


class Status(IntEnum):
    """Outcome of an equilibrium; the larger, the worse."""

    CONVERGED = CONVERGED
    NOT_CONVERGED = NOT_CONVERGED
    NOT_RESISTED = NOT_RESISTED
    NOT_FINITE = NOT_FINITE

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return {
            Status.CONVERGED: "equilibrium found",
            Status.NOT_CONVERGED: "no equilibrium within the allowed number of Newton steps",
            Status.NOT_RESISTED: "no pin resists the torque in its direction",
            Status.NOT_FINITE: "an error value is not a finite number",
        }[self]


OUTCOMES: Mapping[int, str] = {int(item): item.sentence for item in Status}
"""Status → outcome in words."""


def count_statuses(status: Integer[np.ndarray, "..."]) -> Mapping[str, int]:
    """Return how often each outcome occurred, by its sentence; every outcome is listed."""
    return {item.sentence: int(np.count_nonzero(status == item)) for item in Status}

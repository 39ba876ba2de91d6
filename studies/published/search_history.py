"""The way of a search: its best objective after so many evaluations, and the band of many seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, kw_only=True)
class History:
    """Best objective of a search, batch by batch; a generation is a batch."""

    evaluations: Int[np.ndarray, " batch"]  # Evaluations up to the end of each batch [-]
    # Smallest objective until then of a point that meets the constraints, infinite before the first [objective]
    best: Float[np.ndarray, " batch"]

    def after(self, evaluations: Int[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return the best objective after so many evaluations [objective]."""
        batch = np.searchsorted(self.evaluations, evaluations, side="right")
        return np.asarray(np.append(np.inf, self.best)[batch])

    def then(self, following: History) -> History:
        """Return the history of a search and of what followed it."""
        return History(
            evaluations=np.concatenate([self.evaluations, self.evaluations[-1] + following.evaluations]),
            best=np.concatenate([self.best, following.best]),
        )


def quartiles(histories: Sequence[History], evaluations: Int[np.ndarray, " n"]) -> Float[np.ndarray, "3 n"]:
    """Return lower quartile, median and upper quartile of the best objective after so many evaluations [objective]."""
    best = np.stack([history.after(evaluations) for history in histories])
    # No interpolation: it would take infinity from infinity where some seeds have met nothing yet.
    return np.asarray(np.quantile(best, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf"))

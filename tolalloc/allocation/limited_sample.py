"""Random units of a limited output, and its law where it is linear: what a guarantee judges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearLaw
from tolalloc.capability.near_limit import SolvedUnits

_EVEN_ODDS = 0.5


@dataclass(frozen=True, kw_only=True)
class LimitedSample:
    """Units of one output with its limits."""

    values: Float[np.ndarray, " solved"]  # Of every solved unit, not a number where it has none [unit of the output]
    units: SolvedUnits  # Which of the drawn units they are
    limits: Limits  # [unit of the output]
    law: LinearLaw | None = None  # Law of the output, known before these units were drawn or the same units' own
    leaving: int = 0  # Units solved whatever was predicted whose value the law does not give [-]

    @property
    def excess(self) -> Float[np.ndarray, " solved"]:
        """How far every unit lies beyond the limits, negative inside, infinite without a value [unit of the output]."""
        found = np.max([sign * (self.values - limit) for sign, limit in self.limits.turned], axis=0)
        return np.where(np.isfinite(found), found, np.inf)

    @property
    def plain(self) -> Float[np.ndarray, " good"]:
        """Values of the units that were solved whatever was predicted of them [unit of the output]."""
        return np.asarray(self.values[self.units.whatever & np.isfinite(self.values)])

    def most_leaving(self, confidence: float) -> float:
        """Return the largest share of units that the law may be wrong of, with one-sided confidence [-].

        Clopper–Pearson's bound; at one half the share of these units itself.
        """
        from scipy.stats import beta

        units = self.units.drawn.whatever
        if confidence <= _EVEN_ODDS:
            return self.leaving / units
        return float(beta.ppf(confidence, self.leaving + 1, units - self.leaving)) if self.leaving < units else 1.0

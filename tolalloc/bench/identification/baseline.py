"""What one constant explains, before any stiffness is blamed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, kw_only=True)
class BiasOnly:
    """Model readings less one constant, against measured ones.

    Parameters
    ----------
    difference
        Model less measured, pair by pair [any].
    """

    difference: Float[np.ndarray, " pair"]

    @property
    def bias(self) -> float:
        """The constant: the mean difference [as difference]."""
        return float(self.difference.mean())

    @property
    def spread(self) -> float:
        """Sample standard deviation of the difference [as difference]."""
        return float(self.difference.std(ddof=1))

    @property
    def rms(self) -> float:
        """Root-mean-square of what the constant leaves [as difference]."""
        return float(self.difference.std())

    @property
    def leave_one_out(self) -> float:
        """Root-mean-square of what the constant of all other pairs leaves of each pair [as difference].

        Notes
        -----
        Leaving one of n pairs out moves the mean by its residual over n − 1, so its own residual grows by n/(n − 1).
        """
        pairs = self.difference.size
        return self.rms * pairs / (pairs - 1)


def improvement(before: Float[np.ndarray, " pair"], after: Float[np.ndarray, " pair"]) -> Float[np.ndarray, " pair"]:
    """Return (before − after)/before of the differences, what liu2020's Table 7 calls its gain [-]."""
    return np.asarray((before - after) / before)

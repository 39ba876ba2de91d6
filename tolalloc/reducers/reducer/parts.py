"""A part that yields in an interface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.reducer.rolling_bearing import RollingBearing


@dataclass(frozen=True)
class Part:
    """A part that yields in an interface: a rolling bearing, or a body with a constant compliance."""

    interface: str  # Field of `tolalloc.reducers.reducer.stiffness.Stiffness` that it belongs to
    name: str  # What it is, such as ``carrier twist``
    yields: RollingBearing | float  # The bearing, or what the body yields [m/N]
    stiffer: float = 1.0  # Stiffness over what the dimensions give, where it was identified [-]

    def compliance(self, force: float) -> float:
        """Return the way over the force [m/N]."""
        own = _bearing(self.yields, force) if isinstance(self.yields, RollingBearing) else self.yields
        return own / self.stiffer

    def ways(self, force: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return the way beyond the play under every force [m]."""
        own = self.yields.ways(force) if isinstance(self.yields, RollingBearing) else self.yields * force
        return np.asarray(own / self.stiffer)


@lru_cache(maxsize=256)
def _bearing(bearing: RollingBearing, force: float) -> float:
    """Return what a bearing yields; loops of torque ask the same few forces again and again."""
    return bearing.compliance(force)

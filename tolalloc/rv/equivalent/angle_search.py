"""At which carrier angles the kernel looks for the extremes of the transmission error."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.rv.equivalent.solvers.records import Halving

_MARGIN = 2
"""Nodes beyond the coarse angles before and behind the turn that the cubic interpolation needs."""


@dataclass(frozen=True, kw_only=True)
class AngleSearch:
    """At which carrier angles the extremes are looked for.

    With the defaults the peak-to-peak of 99 % of random RV-20E units lies within 0.05″ of the finest search;
    `tests/verification/test_extremes.py` measures it.
    """

    coarse: int = 936  # Equally spaced angles of the turn at which every sample is solved [-]
    nodes_per_coarse: int = 4  # Tabulated angles per coarse one; between them the tables are interpolated [-]
    levels: int = 10  # Halvings of the coarse step around a candidate [-]
    safety: float = 1.5  # A candidate is followed while this many times its flank's rise could make it the extreme [-]

    @property
    def halving(self) -> Halving:
        """The search as the solver takes it."""
        first = self.nodes_per_coarse + _MARGIN
        return Halving(first, self.nodes_per_coarse, self.coarse, self.levels, self.safety)

    @property
    def node_step(self) -> float:
        """Distance between tabulated angles [rad]."""
        return 2 * pi / (self.coarse * self.nodes_per_coarse)

    @property
    def node_angle(self) -> Float[np.ndarray, " node"]:
        """Tabulated angles, from before the turn to behind it [rad]."""
        before = self.halving.first
        return self.node_step * np.arange(-before, self.coarse * self.nodes_per_coarse + before + 1)

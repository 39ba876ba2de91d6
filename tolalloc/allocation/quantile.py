"""The requirement as a function of the design: the quantile of the peak-to-peak that the yield asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.local_model import Side
from tolalloc.model import Evaluation
from tolalloc.rv.response.kernel import KernelResponse


@dataclass(frozen=True, kw_only=True)
class QuantileResponse:
    """Quantile of the peak-to-peak of a design, on the real kernel with common random numbers.

    Parameters
    ----------
    space
        The design variables.
    kernel
        What answers for single units.
    standard
        Standard values of the units that all designs share [-].
    spread
        Quantile's distance from the mean over the standard deviation [-].

    Notes
    -----
    Mean + spread·σ of a few hundred shared units varies smoothly from design to design; the empirical quantile of
    so few would not. The spread is calibrated on large samples, and every design that counts is verified on one.
    """

    space: DesignSpace
    kernel: KernelResponse
    standard: Float[np.ndarray, "unit column"]
    spread: float

    @property
    def columns(self) -> tuple[str, ...]:
        """The design variables."""
        return self.space.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return ("quantile of the peak-to-peak transmission error [arcsec]",)

    def __call__(self, x: Float[np.ndarray, "design variable"]) -> Evaluation:
        """Return the quantile of every design; a design with a failed unit is a failed sample."""
        values, status = np.empty((x.shape[0], 1)), np.zeros(x.shape[0], np.uint8)
        for at, design in enumerate(x):
            response = self.kernel.with_modification(self.space.modification(design))
            evaluation = response(self.space.errors.deviations(self.standard, self.space.zones(design)))
            units = evaluation.values[evaluation.good, 0]
            values[at, 0] = units.mean() + self.spread * units.std(ddof=1) if units.size > 1 else np.nan
            status[at] = evaluation.status.max()
        return Evaluation(values=values, status=status)


@dataclass(frozen=True, kw_only=True)
class LocalQuantile:
    """The quantile that the convex model around a verified design predicts for other designs.

    Parameters
    ----------
    side
        The upper limit on the peak-to-peak at the verified design, with its model.
    """

    side: Side

    def __call__(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the model's quantile [arcsec]."""
        return self.side.limit + self.side.predicted(designs)

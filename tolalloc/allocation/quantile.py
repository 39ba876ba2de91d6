"""The leading requirement as a function of the design: the quantile of its output that the guarantee asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.models.model import Evaluation, Model


@dataclass(frozen=True, kw_only=True)
class QuantileResponse:
    """Quantile of an output of a design, on the real model with common random numbers.

    Notes
    -----
    Mean + spread·σ of a few hundred shared units varies smoothly from design to design; the empirical quantile of
    so few would not. The spread is calibrated on large samples, and every design that counts is verified on one.
    """

    space: DesignSpace  # The design variables
    model: Model  # What answers for single units
    output: str  # Name of the output with its unit
    standard: Float[np.ndarray, "unit column"]  # Standard values of the units that all designs share [-]
    spread: float  # Quantile's distance from the mean over the standard deviation [-]

    @property
    def columns(self) -> tuple[str, ...]:
        """The design variables."""
        return self.space.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (f"quantile of the {self.output}",)

    def __call__(self, x: Float[np.ndarray, "design variable"]) -> Evaluation:
        """Return the quantile of every design; a design with a failed unit is a failed sample."""
        values, status = np.empty((x.shape[0], 1)), np.zeros(x.shape[0], np.uint8)
        for at, design in enumerate(x):
            response = self.model.at(self.space.settings_of(design)).reading((self.output,))
            evaluation = response(self.space.errors.deviations(self.standard, self.space.zones(design)))
            units = evaluation.values[evaluation.good, 0]
            values[at, 0] = units.mean() + self.spread * units.std(ddof=1) if units.size > 1 else np.nan
            status[at] = evaluation.status.max()
        return Evaluation(values=values, status=status)

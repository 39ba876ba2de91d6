"""The requirement as a function of the design: the quantile of the peak-to-peak that the yield asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.response.interface import Evaluation
from tolalloc.response.kernel import KernelResponse


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
    """Convex model of the quantile around one design: offset + slopes·clearances + ‖weights∘scales‖₂.

    Parameters
    ----------
    offset
        Constant part [arcsec].
    slopes
        Change with flank and radial clearance [arcsec/µm].
    weights
        Contribution of each group at scale 1 [arcsec].

    Notes
    -----
    Theory page, equation (25). Value and gradient at the design are those of the kernel. The norm is how independent
    random errors combine, so the model bends the right way and is convex in scales and clearances together.
    """

    offset: float
    slopes: Float[np.ndarray, " 2"]
    weights: Float[np.ndarray, " group"]

    def __call__(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the model's quantile [arcsec]."""
        spread = np.sqrt(((self.weights * designs[..., :-2]) ** 2).sum(axis=-1))
        return np.asarray(self.offset + designs[..., -2:] @ self.slopes + spread)


def local_quantile(
    design: Float[np.ndarray, " variable"], quantile: float, gradient: Float[np.ndarray, " variable"]
) -> LocalQuantile:
    """Return the convex model with the given value and gradient at a design.

    Parameters
    ----------
    design
        Scales [-] and clearances [µm].
    quantile
        Quantile there [arcsec].
    gradient
        Its derivative by every variable [arcsec, arcsec/µm].

    Notes
    -----
    ‖weights∘scales‖ is homogeneous, so its value is gradient·scales. A group whose larger zone lowers the quantile,
    by noise or because its errors open the contact, gets weight zero: the model never rewards a larger error.
    """
    scales, clearances = design[:-2], design[-2:]
    by_scale = np.maximum(gradient[:-2], 0.0)
    spread = float(by_scale @ scales)
    return LocalQuantile(
        offset=float(quantile - spread - gradient[-2:] @ clearances),
        slopes=gradient[-2:].copy(),
        weights=np.sqrt(by_scale * spread / scales),
    )

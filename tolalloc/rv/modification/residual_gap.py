"""Equidistant and shift amounts that leave the smallest gap on the working flank, the problem of li2018."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.rv.cycloid.clearance import formula_gap
from tolalloc.rv.modification.problem import Amounts, ModificationProblem
from tolalloc.rv.reducer.design import CycloidStage, Modification
from tolalloc.units import DEGREE, MICROMETRE


@dataclass(frozen=True, kw_only=True)
class ResidualGap(ModificationProblem):
    """Minimise the mean gap that is left on the working flank once it is closed at φ0.

    Notes
    -----
    li2018's formulas are lost, and its "difference of two curves", taken literally, is least without any shift; this
    is a well-posed reading [A]: least mean gap (`rv.cycloid.clearance.formula_gap`) with a radial clearance of j
    or more and a gap of 0 or more everywhere. It is a linear program, `closed_form`.
    """

    interval: tuple[float, float] = (25 * DEGREE, 100 * DEGREE)  # First and last φ of the work interval [rad]
    intervals: int = 100  # n: the mean is over n + 1 equally spaced φ [-]

    @property
    def description(self) -> str:
        """What the objective measures."""
        first, last = (angle / DEGREE for angle in self.interval)
        return f"mean gap after closing at φ0, {self.intervals + 1} points from φ = {first:g}° to {last:g}°"

    @cached_property
    def _per_amount(self) -> Float[np.ndarray, " 2"]:
        """Mean gap by Δr_rp and by Δr_p [-]; the gap is linear in both."""
        angle = np.linspace(*self.interval, self.intervals + 1)
        units = (Modification(equidistant=1.0, shift=0.0), Modification(equidistant=0.0, shift=1.0))
        return np.array([formula_gap(self.stage, unit, angle).mean() for unit in units])

    def objective(self, amounts: Amounts) -> Float[np.ndarray, " n"]:
        """Return the mean gap [m]."""
        return np.asarray(amounts @ self._per_amount)


def residual_gap(
    stage: CycloidStage,
    radial_clearance: float,
    largest: float = 100 * MICROMETRE,
    interval: tuple[float, float] = (25 * DEGREE, 100 * DEGREE),
    intervals: int = 100,
) -> ResidualGap:
    """Return the problem with both amounts between 0 and a largest one, which is assumed.

    The default of the work interval is that of song2019; li2018 prints neither it nor the number of intervals.
    """
    return ResidualGap(
        name="residual gap",
        stage=stage,
        lower=np.zeros(2),
        upper=np.full(2, largest),
        radial_clearance=radial_clearance,
        require_gap=True,
        interval=interval,
        intervals=intervals,
    )


def closed_form(stage: CycloidStage, radial_clearance: float) -> Modification:
    """Return the optimum of `ResidualGap` with a radial clearance j, Δr_rp = j/(1 − q) and Δr_p = j·q/(1 − q).

    Notes
    -----
    With v = Δr_rp − Δr_p ≥ j and u = q·Δr_rp − Δr_p ≥ 0 the gap at one φ is
    [v·((1 − S) − q(C − qS)) + u·((C − qS) − (1 − S))]/(1 − q). Both factors are never negative: the first is the gap
    itself at u = 0, and C is concave from 1 at S = 0 to q at S = 1, so it lies above its chord 1 − (1 − q)S. So both v
    and u are best at their least, whatever the work interval and the number of its points.
    """
    ratio = stage.flank_ratio
    return Modification(
        equidistant=radial_clearance / (1 - ratio),
        shift=radial_clearance * ratio / (1 - ratio),
    )

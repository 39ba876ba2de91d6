"""Equidistant and shift amounts that leave the smallest gap on the working flank, the problem of li2018."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import DEGREE, MICROMETRE
from tolalloc.reducers.cycloid.clearance import formula_gap
from tolalloc.reducers.modification.problem import Amounts, ModificationProblem
from tolalloc.reducers.reducer.design import CycloidStage, Modification


def residual_gap(
    stage: CycloidStage,
    radial_clearance: float,
    largest: float = 100 * MICROMETRE,
    interval: tuple[float, float] = (25 * DEGREE, 100 * DEGREE),
    intervals: int = 100,
) -> ModificationProblem:
    """Return the problem of the least mean gap that is left on the working flank once it is closed at φ0.

    The mean is over n + 1 equally spaced φ of the work interval [rad]. Both amounts are between 0 and a largest one,
    which is assumed; the default of the work interval is that of song2019, as li2018 prints neither it nor n.

    Notes
    -----
    li2018's formulas are lost, and its "difference of two curves", taken literally, is least without any shift; this
    is a well-posed reading [A]: least mean gap (`rv.cycloid.clearance.formula_gap`) with a radial clearance of j
    or more and a gap of 0 or more everywhere. It is a linear program, `closed_form`.
    """
    angle, (first, last) = np.linspace(*interval, intervals + 1), (end / DEGREE for end in interval)
    units = (Modification(equidistant=1.0, shift=0.0), Modification(equidistant=0.0, shift=1.0))
    per_amount = np.array([formula_gap(stage, unit, angle).mean() for unit in units])  # the gap is linear in both

    def mean_gap(amounts: Amounts) -> Float[np.ndarray, " n"]:
        return np.asarray(amounts @ per_amount)

    return ModificationProblem(
        name="residual gap",
        description=f"mean gap after closing at φ0, {intervals + 1} points from φ = {first:g}° to {last:g}°",
        stage=stage,
        objective=mean_gap,
        lower=np.zeros(2),
        upper=np.full(2, largest),
        radial_clearance=radial_clearance,
        require_gap=True,
    )


def closed_form(stage: CycloidStage, radial_clearance: float) -> Modification:
    """Return the optimum of `residual_gap` with a radial clearance j, Δr_rp = j/(1 − q) and Δr_p = j·q/(1 − q).

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

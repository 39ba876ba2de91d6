"""The optimum of li2018's problem of the least mean gap in closed form."""

from __future__ import annotations

from tolalloc.reducers.reducer.design import CycloidStage, Modification


def closed_form(stage: CycloidStage, radial_clearance: float) -> Modification:
    """Return the optimum of the problem with a radial clearance j, Δr_rp = j/(1 − q) and Δr_p = j·q/(1 − q).

    The problem is that of `tolalloc.reducers.modification.residual_gap`.

    Notes
    -----
    With v = Δr_rp − Δr_p ≥ j and u = q·Δr_rp − Δr_p ≥ 0 the gap at one φ is
    [v·((1 − S) − q(C − qS)) + u·((C − qS) − (1 − S))]/(1 − q). Both factors are never negative: the first is the gap
    itself at u = 0, and C is concave from 1 at S = 0 to q at S = 1, so it lies above its chord 1 − (1 − q)S. So both v
    and u are best at their least, whatever the work interval and the number of its points. It holds for 0 < q < 1,
    which every stage that can be ground has, and as long as both amounts lie in the box of the problem.
    """
    ratio = stage.flank_ratio
    return Modification(
        equidistant=radial_clearance / (1 - ratio),
        shift=radial_clearance * ratio / (1 - ratio),
    )

"""How much of the exact front a front that was found is worth."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from pymoo.indicators.hv import HV

from tolalloc.allocation.front.pareto_problem import normalised

REFERENCE = 1.1
"""Where the hypervolume ends in every objective: ideal at 0, nadir at 1, so the ends of the front count too [-]."""


def hypervolume_ratio(
    losses: Float[np.ndarray, "design objective"], exact: Float[np.ndarray, "point objective"]
) -> float:
    """Return the hypervolume of a front over that of the exact one [-].

    Parameters
    ----------
    losses
        Losses of the front, dominated designs allowed.
    exact
        Losses of points on the exact front, its ends among them.

    Notes
    -----
    The volume of a few exact points is a staircase below the exact front's own, so a denser front may exceed 1.

    References
    ----------
    Zitzler & Thiele 1999, IEEE Trans. Evol. Comput. 3:257–271; reference point of Ishibuchi et al. 2018, Evol.
    Comput. 26:411–440.
    """
    volume = HV(ref_point=np.full(exact.shape[1], REFERENCE))
    return float(volume(normalised(losses, exact)) / volume(normalised(exact, exact)))

"""The "two-point exterior-difference mixed penalty" of li2018, whose formulas are lost, as it is read here.

Sequential unconstrained minimisation: constraints become penalties with a factor r that falls from search to search,
and the optima of two searches give away that at r → 0. All of it is assumed.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.rv.modification.problem import Amounts


def mixed_penalty(margin: Float[np.ndarray, "n c"], factor: float) -> Float[np.ndarray, " n"]:
    """Return Σ r/g over the constraints g that are met, plus Σ g²/√r over the violated ones [mm].

    Parameters
    ----------
    margin
        Constraints g, not negative where met [mm].
    factor
        Penalty factor r [mm²].
    """
    inside = factor / np.where(margin > 0, margin, np.inf)
    outside = np.minimum(margin, 0.0) ** 2 / np.sqrt(factor)
    return np.asarray((inside + outside).sum(axis=-1))


def extrapolated(last: Amounts, now: Amounts, fall: float) -> Amounts:
    """Return the optimum at r → 0 from those at two penalty factors [m].

    Both parts of the penalty keep its optimum away from the constrained one in proportion to √r.

    Parameters
    ----------
    last, now
        Optimum at a factor and at the following one [m].
    fall
        Ratio c of the second factor to the first [-].
    """
    root = np.sqrt(fall)
    return np.asarray((now - root * last) / (1 - root))

"""A cheap model of solved units, on which a Sobol analysis leans: blocks of the real one need only show the rest.

The indices of the cheap model follow from as many cheap samples as it takes. Blocks of the real model then correct
them, which leaves the estimate unbiased whatever the cheap model is worth (`tolalloc.sensitivity.saltelli`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.models.model import Response
from tolalloc.sensitivity.surrogate.regression import Regression, fitted, on_products

OfBlocks = Float[np.ndarray, "number block"]
"""What each block adds to each number."""
MOST_CONTROLLED = 2048
"""Blocks beyond which a model needs no cheap one: it answers hardly fewer samples itself [-]."""
_MOST_TERMS = 500
"""Products of columns at most, all products of two of 30 columns [-]: more of them need more units than a study has."""
_UNITS = 4096
"""Units that the weights are learnt from at most: more change them by less than the rest that no term can say [-]."""
_UNITS_PER_TERM = 2
"""Units per term below which there are no products of so many columns [-]."""
_LEAST_PART = 1e-10
"""Variance of a cheap number over that of the own one below which it is rounding [-]."""
_STRENGTHS = np.logspace(-3, 5, 9)
"""Strengths of the ridge among which leave-one-out errors choose, for each output its own [-]."""


def cheap_model(sample: MonteCarlo, columns: tuple[str, ...], outputs: tuple[str, ...]) -> Regression | None:
    """Return a regression of all outputs on products of the columns; none where the units are too few.

    The units have other random numbers than the blocks that will be corrected.

    Notes
    -----
    The terms are all products of up to d columns, d from 2 to 8 as large as 500 terms and half of the units allow.

    References
    ----------
    Hoerl & Kennard 1970, Technometrics 12, 55–67: ridge regression, its strength by leave-one-out errors.

    Examples
    --------
    y = x₁ + x₁·x₂ is found again.

    >>> from tolalloc.models.model import Evaluation
    >>> x = np.random.default_rng(1).normal(size=(200, 2))
    >>> y = Evaluation(values=(x[:, :1] + x[:, :1] * x[:, 1:]), status=np.zeros(200, np.uint8))
    >>> cheap = cheap_model(MonteCarlo(x=x, evaluation=y), ("x1", "x2"), ("y",))
    >>> cheap(np.array([[1.0, 2.0]])).values.round(2).tolist()
    [[3.0]]
    """
    from sklearn.linear_model import RidgeCV

    good = np.flatnonzero(sample.evaluation.good)[:_UNITS]
    degree = _degree(len(columns), good.size)
    if not degree:
        return None
    estimator = on_products(RidgeCV(_STRENGTHS, alpha_per_target=True), degree)
    found = fitted(estimator, sample.x[good], sample.evaluation.values[good])
    return Regression(columns=columns, outputs=outputs, estimator=found)


def learnt(experiment: Experiment[Response], blocks: int) -> Regression | None:
    """Return the cheap model of an experiment, learnt from as many units of its own as so many blocks of it have.

    None where it has too many columns, or where so many blocks need no help: the cheap model has hardly more samples.
    """
    columns, units = experiment.errors.columns, units_to_learn(experiment.errors, blocks)
    if not units:
        return None
    return cheap_model(monte_carlo(experiment.child("learnt"), units), columns, experiment.response.outputs)


def units_to_learn(errors: ErrorModel, blocks: int) -> int:
    """Return how many units `learnt` draws, 0 where it has no model [-].

    n = blocks·(D + 2) of D blocks of dependent sources, as many as the Sobol' blocks have (own derivation).
    """
    units = blocks * (len(errors.blocks) + 2)
    return units if blocks <= MOST_CONTROLLED and _degree(len(errors.columns), units) else 0


def _degree(columns: int, units: int) -> int:
    """Return how many columns a product may have, 0 where there are too many columns for products or units."""
    most = min(_MOST_TERMS, units / _UNITS_PER_TERM)
    return max((degree for degree in range(2, 9) if comb(columns + degree, degree) <= most), default=0)


@dataclass(frozen=True, kw_only=True)
class CheapAnswers:
    """What a cheap model answers to the samples of some blocks, and to those of many others."""

    own: Float[np.ndarray, "sample output"]  # To the samples of the blocks whose indices it corrects [output]
    # To the samples of the blocks from which its own indices follow, of another seed and as many replicates [output]
    many: Float[np.ndarray, "cheap_sample output"]


def optimal_weights(
    own: OfBlocks, cheap: OfBlocks, counts: Float[np.ndarray, "row block"]
) -> Float[np.ndarray, "number row"]:
    """Return with which weight the error of a cheap number corrects the own one, for every row of counts [-].

    Own and cheap are what each block adds to the error of a number, and to that of the cheap model's.

    Notes
    -----
    β = Cov(own, cheap)/Var(cheap), times 1 − (1 − ρ²)/(ρ²·(n − 2)) or 0 where that is negative: of a cheap number that
    has nothing to do with the own one nothing is taken over but chance, and as much as that is left out.

    References
    ----------
    Lavenberg & Welch 1981, Management Science 27, 322–335; the factor is that of James & Stein 1961 for one weight.

    Examples
    --------
    >>> cheap = np.array([[1.0, -1.0, 1.0, -1.0]])
    >>> optimal_weights(2 * cheap, cheap, np.ones((1, 4))).tolist()
    [[2.0]]
    >>> optimal_weights(np.array([[1.0, 1.0, -1.0, -1.0]]), cheap, np.ones((1, 4))).tolist()
    [[0.0]]
    """
    blocks = counts.sum(axis=1)
    means = [values @ counts.T / blocks for values in (own, cheap)]
    products = ((own, own, 0, 0), (own, cheap, 0, 1), (cheap, cheap, 1, 1))
    own_square, both, square = (
        one * other @ counts.T / blocks - means[at] * means[other_at] for one, other, at, other_at in products
    )
    known = square > _LEAST_PART * own_square
    weight = np.divide(both, square, out=np.zeros_like(both), where=known)
    rest = np.divide(own_square * square, both**2, out=np.full_like(both, np.inf), where=both != 0) - 1.0
    return np.asarray(weight * np.maximum(0.0, 1.0 - np.maximum(rest, 0.0) / np.maximum(blocks - 2, 1)))

"""What not knowing the model itself does to an output, and how far the first order that says so can be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag

from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Model

Units = Float[np.ndarray, "unit column"]
"""Deviations of units [m, angles rad]."""
_UNITS = 256
"""Units over which the effect is averaged [-]."""
_DIRECTIONS, _UNITS_PER_DIRECTION = 3, 32
"""Directions in which all that is uncertain is changed together, either way, and units that the model solves there [-].
"""


@dataclass(frozen=True, kw_only=True)
class FirstOrderError:
    """First order minus model at a change of what is uncertain."""

    # Of the difference [output]
    root_mean_square: float
    largest: float
    effect: float  # Root-mean-square of what the same changes do to the output [output]
    # Units and changes behind it [-]
    units: int
    changes: int
    accuracy: float  # How well the model answers; no smaller difference means anything [output]

    @property
    def fails(self) -> bool:
        """Whether the error is half of the effect or more, and more than the model's accuracy leaves."""
        return self.root_mean_square > max(0.5 * self.effect, self.accuracy)


@dataclass(frozen=True, kw_only=True)
class UncertainEffect:
    """What not knowing the model does to the output, and how well that is known."""

    sources: tuple[CorrelatedSource, ...]  # What is uncertain
    sigma: float  # Standard deviation of one unit's output from the sources alone, root-mean-square over units [output]
    sigma_of_mean: float  # Standard deviation of the mean over all units, which the sources shift together [output]
    first_order: FirstOrderError  # First order against model


def uncertain_effect(model: Model, output: str, x: Units, seeds: SeedTree) -> UncertainEffect:
    """Return what the model's uncertain columns alone do to good units, with the first order checked at ±2σ.

    σ² = gᵀ·C·g to first order, g the gradient by the uncertain columns, C their covariance: JCGM 100:2008, eq. (13). It
    holds where `FirstOrderError.fails` is false.
    """
    factor = block_diag(*(source.factor for source in model.uncertain))
    gradient = _gradient(model, output, x[:_UNITS])
    known = gradient[np.isfinite(gradient).all(axis=1)]
    directions = seeds.generator().standard_normal((_DIRECTIONS, len(factor)))
    ends = 2.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True) @ factor.T
    return UncertainEffect(
        sources=model.uncertain,
        sigma=float(np.sqrt(((known @ factor) ** 2).sum(axis=1).mean())),
        sigma_of_mean=float(np.linalg.norm(known.mean(axis=0) @ factor)),
        first_order=first_order_error(model, output, x[:_UNITS_PER_DIRECTION], np.concatenate([ends, -ends])),
    )


def first_order_error(
    model: Model, output: str, x: Units, changes: Float[np.ndarray, "change uncertain"]
) -> FirstOrderError:
    """Return how far the first order is from the model whose uncertain columns have changed.

    For each of the joint changes of these columns the model is made anew.

    e = g·Δ − (y(k + Δ) − y(k)), what Taylor's first order leaves: JCGM 100:2008, 5.1.2 [output].

    Examples
    --------
    y = x·(1 + k) is linear in k, so nothing is left.

    >>> from unittest.mock import Mock
    >>> from tolalloc.models.model import Evaluation, Model
    >>> answer = lambda x, k: Evaluation(values=(x[:, :1] * k), status=np.zeros(len(x), np.uint8))
    >>> k = CorrelatedSource(name="k", columns=("k",), covariance=np.eye(1) / 100)
    >>> model = Mock(spec=Model, uncertain=(k,), accuracy={}, reading=lambda _: lambda x: answer(x, 1.0))
    >>> model.with_uncertain = lambda _: lambda x: answer(x, 1.0 + x[:, 1:])
    >>> model.changed = lambda by: Mock(reading=lambda _: lambda x: answer(x, 1.0 + by[0]))
    >>> found = first_order_error(model, "y [mm]", np.array([[2.0]]), np.array([[0.1]]))
    >>> round(found.effect, 6), found.root_mean_square < 1e-12
    (0.2, True)
    """
    before = model.reading((output,))(x).known
    predicted = _gradient(model, output, x) @ changes.T
    after = [model.changed(change).reading((output,))(x).known for change in changes]
    effect = np.hstack(after) - before
    error = predicted - effect
    good = np.isfinite(error)
    if not good.any():
        raise SolveError(
            f"{' + '.join(source.name for source in model.uncertain)}: no unit has an answer at changes of up to "
            f"{float(np.abs(changes).max()):.3g}; allowed are standard uncertainties that leave a {model.name}."
        )
    return FirstOrderError(
        root_mean_square=float(np.sqrt((error[good] ** 2).mean())),
        largest=float(np.abs(error[good]).max()),
        effect=float(np.sqrt((effect[good] ** 2).mean())),
        units=x.shape[0],
        changes=changes.shape[0],
        accuracy=model.accuracy.get(output, 0.0),
    )


def _gradient(model: Model, output: str, x: Units) -> Float[np.ndarray, "unit uncertain"]:
    """Return the first order itself, NaN where a unit has no answer [output per uncertain column]."""
    columns = sum(len(source.columns) for source in model.uncertain)
    shifts = np.concatenate([np.zeros((1, columns)), np.eye(columns)])
    rows = np.concatenate([np.repeat(x, len(shifts), axis=0), np.tile(shifts, (len(x), 1))], axis=1)
    values = model.with_uncertain((output,))(rows).known.reshape(len(x), -1)
    return np.asarray(values[:, 1:] - values[:, :1])

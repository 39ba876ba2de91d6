"""What a hand calculation would say: each error alone at its limit, summed and root-sum-squared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.exceptions import SolveError
from tolalloc.models import Response

DIRECTIONS = 16


@dataclass(frozen=True, kw_only=True)
class ClassicalEstimate:
    """Single-error outputs and the two sums that assume they add up.

    Parameters
    ----------
    sources
        Names, in the order of ``alone``.
    without
        Output without any error, from modification and torque alone [output].
    alone
        Largest output of each source alone at the limit of its zone, over random phases, beyond ``without`` [output].
    """

    sources: tuple[str, ...]
    without: float
    alone: Float[np.ndarray, " source"]

    @property
    def worst_case(self) -> float:
        """Sum of all single errors [output]."""
        return self.without + float(self.alone.sum())

    @property
    def root_sum_square(self) -> float:
        """Root of the sum of the squared single errors [output]."""
        return self.without + float(np.sqrt((self.alone**2).sum()))


def classical_estimate(experiment: Experiment[Response]) -> ClassicalEstimate:
    """Return worst case and root-sum-square from one error at a time.

    Raises
    ------
    SolveError
        A sample failed.

    Notes
    -----
    Both sums assume that single errors add up, which contact switching denies; they stand beside Monte Carlo for
    comparison with a hand calculation.
    """
    errors = experiment.errors
    middle = experiment.deviations(np.zeros((1, len(errors.columns))))
    x, start = [middle], 0
    for source, zone in zip(errors.active, experiment.zones, strict=True):
        own = slice(start, start + len(source.columns))
        rows = np.repeat(middle, DIRECTIONS, axis=0)
        uniform = next(experiment.seeds.child(source.name).uniform_chunks(DIRECTIONS, len(source.columns)))
        rows[:, own] += zone * source.at_limit(uniform)
        x.append(rows)
        start = own.stop
    evaluation = experiment.response(np.concatenate(x))
    if not evaluation.good.all():
        raise SolveError(f"Classical estimate: {np.count_nonzero(~evaluation.good)} single-error units failed.")
    values = evaluation.values[:, 0]
    without = float(values[0])
    return ClassicalEstimate(
        sources=tuple(source.name for source in errors.active),
        without=without,
        alone=np.maximum(values[1:].reshape(len(errors.active), DIRECTIONS).max(axis=1) - without, 0.0),
    )

"""Each error alone: at its limit, as a hand calculation adds it, and by derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import AnsweredUnits, require_few_failures
from tolalloc.exceptions import SolveError
from tolalloc.models.model import Response, ResponseWithDerivatives
from tolalloc.reading.units import MICROMETRE


@dataclass(frozen=True, kw_only=True)
class LocalDerivatives:
    """What a micrometre of each source does to the output."""

    sources: tuple[str, ...]  # Names of the sources that a drawing limits, in the order of all arrays
    slope: Float[np.ndarray, " source"]  # `mean_slope` over random units, “Sens” on every page [output/µm]
    # Root mean square change of the output, to first order, by the errors that a source's zone lets through [output]
    by_zone: Float[np.ndarray, " source"]
    # The same by an error of one of its features, in its own directions and waves, per micrometre [output/µm]
    per_micrometre: Float[np.ndarray, " source"]

    def of_line(self, members: Sequence[str]) -> LineDerivatives:
        """Return what all places of one line of a drawing do, whose errors are independent of each other.

        √(Σ rᵢ²) over the places, with the root mean square change rᵢ of each (own derivation).
        """
        at = [self.sources.index(name) for name in members]
        return LineDerivatives(
            slope=(float(self.slope[at].min()), float(self.slope[at].max())),
            per_micrometre=float(np.linalg.norm(self.per_micrometre[at])),
            by_zone=float(np.linalg.norm(self.by_zone[at])),
        )


@dataclass(frozen=True, kw_only=True)
class LineDerivatives:
    """What the places of one line of a drawing do to the output."""

    slope: tuple[float, float]  # Smallest and largest of its places, as of `LocalDerivatives`
    per_micrometre: float  # Root mean square change by a micrometre in every place [output/µm]
    by_zone: float  # The same by what the zones let through [output]


_CANCELLED = 0.1
"""Mean of slopes over their root mean square, below which their signs cancel [-]."""


def mean_slope(slopes: Float[np.ndarray, "unit column"]) -> float:
    """Return what a deviation of one source does to an output over units of a drawing [unit of the output per length].

    The mean for a source of one column, with its sign. The root mean square length √(Σ (∂y/∂xᵢ)²) of the gradient (own
    derivation) where the direction is random, as of a position, or where signs cancel: at a mean below a tenth of it.

    Examples
    --------
    >>> [mean_slope(np.array(slopes)) for slopes in ([[-2.0], [-4.0]], [[-2.0], [2.0]], [[3.0, 4.0]])]
    [-3.0, 2.0, 5.0]
    """
    length = float(np.sqrt((slopes**2).sum(axis=1).mean()))
    mean = float(slopes.mean())
    return mean if slopes.shape[1] == 1 and abs(mean) >= _CANCELLED * length else length


def local_derivatives(experiment: Experiment[ResponseWithDerivatives], units: int = 1024) -> LocalDerivatives:
    """Return the derivatives by each source over random units; joint sources are no lengths.

    Notes
    -----
    A peak-to-peak has a kink wherever two angles share its maximum or minimum, and symmetry makes the nominal such a
    place: the derivative there is one of several one-sided ones, so none is told.

    An error has no steepest direction but its own: by a source's zone the output changes by √(Σ E[(∂y/∂xᵢ)²]·σᵢ²), and
    divided by √(Σ σᵢ²) by a micrometre of one of its features, which is the distance from the true position, or the
    amplitude of a wave (own derivation).
    """
    errors = experiment.errors
    x = experiment.deviations(errors.standard_values(experiment.uniform(units)))
    answer = experiment.response.with_derivatives(x)
    sample, good = AnsweredUnits(evaluation=answer.evaluation), answer.evaluation.good
    require_few_failures(sample, "derivatives", experiment.largest_failed_share)
    by_column = answer.by_column[good]
    where, slope = np.array(errors.source_of_column), []
    variance, mean_square = x[good].var(axis=0), (by_column**2).mean(axis=0)
    by_zone, per_micrometre = [], []
    for source in errors.active:
        own, per_length = where == source.name, MICROMETRE / source.lever
        slope.append(mean_slope(by_column[:, own] * per_length))
        by_zone.append(float(np.sqrt(mean_square[own] @ variance[own])))
        per_micrometre.append(by_zone[-1] / float(np.sqrt(variance[own].sum())) * per_length)
    return LocalDerivatives(
        sources=tuple(source.name for source in errors.active),
        slope=np.array(slope),
        by_zone=np.array(by_zone),
        per_micrometre=np.array(per_micrometre),
    )


DIRECTIONS = 16


@dataclass(frozen=True, kw_only=True)
class ClassicalEstimate:
    """Single-error outputs and the two sums that assume they add up."""

    sources: tuple[str, ...]  # Names, in the order of ``alone``
    without: float  # Output without any error, from modification and torque alone [output]
    # Largest output of each source alone at the limit of its zone, over random phases, beyond ``without`` [output]
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

    Notes
    -----
    With aᵢ the largest of 16 single-error outputs beyond y₀: worst case y₀ + Σ aᵢ, root sum square y₀ + √(Σ aᵢ²)
    [output]. For outputs linear in every error they are exact.

    References
    ----------
    Evans 1975, J. Quality Technology 7(1), 1–12.
    """
    errors = experiment.errors
    middle = experiment.deviations(np.zeros((1, len(errors.columns))))
    x, columns = [middle], zip(errors.active, errors.columns_of_source, experiment.zones, strict=True)
    for source, own, zone in columns:
        rows = np.repeat(middle, DIRECTIONS, axis=0)
        uniform = next(experiment.seeds.child(source.name).uniform_chunks(DIRECTIONS, len(source.columns)))
        rows[:, own] += zone * source.at_limit(uniform)
        x.append(rows)
    evaluation = experiment.response(np.concatenate(x))
    require_few_failures(AnsweredUnits(evaluation=evaluation), "classical estimate", experiment.largest_failed_share)
    values = np.where(evaluation.good, evaluation.values[:, 0], -np.inf)
    if not evaluation.good[0]:
        raise SolveError("Classical estimate: the unit without errors has no usable answer.")
    without = float(values[0])
    return ClassicalEstimate(
        sources=tuple(source.name for source in errors.active),
        without=without,
        alone=np.maximum(values[1:].reshape(len(errors.active), DIRECTIONS).max(axis=1) - without, 0.0),
    )

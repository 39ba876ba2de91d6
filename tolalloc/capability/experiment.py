"""What every statistical question is asked of: a response, the sources that vary, and where its random numbers hang."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts, StatedProcess
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Evaluation, Response, ResponseWithDerivatives

LARGEST_FAILED_SHARE = 0.01
"""Share of the units that may fail unless a study says otherwise [-]."""

FEWEST_RUNS = 2
"""Runs of the subset simulation without which their spread is not known [-]."""

Answering = TypeVar("Answering", bound=Response | ResponseWithDerivatives, covariant=True)
Given = TypeVar("Given", bound=Response | ResponseWithDerivatives)


@dataclass(frozen=True)
class Experiment(Generic[Answering]):
    """Units that may be drawn and solved."""

    # What answers; its columns are those of the error model. Where a question has one output, it is the first.
    response: Answering
    errors: ErrorModel  # The sources
    zones: Float[np.ndarray, " source"]  # Zones of the active sources [m], then 1 for every joint one [-]
    seeds: SeedTree  # Node of the seed tree that belongs to this experiment alone
    # Share of the units, blocks or samples that may fail; more would bias every figure [-]
    largest_failed_share: float = LARGEST_FAILED_SHARE

    @staticmethod
    def of(
        response: Given, errors: ErrorModel, seeds: SeedTree, largest_failed_share: float = LARGEST_FAILED_SHARE
    ) -> Experiment[Given]:
        """Return the experiment at the zones that the drawing has."""
        return Experiment(response, errors, errors.zones, seeds, largest_failed_share)

    def child(self, *names: str) -> Experiment[Answering]:
        """Return the same with random numbers of its own."""
        return replace(self, seeds=self.seeds.child(*names))

    def deviations(self, standard: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns [m, angles rad] that the standard values give at the zones."""
        return self.errors.deviations(standard, self.zones)

    def uniform(self, units: int) -> Float[np.ndarray, "sample column"]:
        """Return independent uniform numbers in (0, 1), one per unit and column [-]."""
        return np.concatenate(list(self.seeds.uniform_chunks(units, len(self.errors.columns))))


@dataclass(frozen=True, kw_only=True)
class SolvedSum:
    """Sums with their derivatives."""

    evaluation: Evaluation  # The sums [m]
    by_column: Float[np.ndarray, "sample column"]  # Derivatives, 1 each [-]


@dataclass(frozen=True)
class SumOfSizes:
    """A response whose only output is the sum of its columns, whose statistics are known in closed form."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...] = ("y [m]",)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the sum of every sample [m]."""
        return Evaluation(values=x.sum(axis=1, keepdims=True), status=np.zeros(x.shape[0], np.uint8))

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> SolvedSum:
        """Return the same with derivatives."""
        return SolvedSum(evaluation=self(x), by_column=np.ones_like(x))


def sum_of_sizes(*zones: float, seed: int = 1) -> Experiment[SumOfSizes]:
    """Return the experiment of y = Σ xᵢ, xᵢ normal sizes of σᵢ = zoneᵢ/6, for worked numbers [m].

    Its mean is 0 and its variance Σ σᵢ² (own derivation).

    Examples
    --------
    >>> experiment = sum_of_sizes(6.0, 12.0)
    >>> experiment.deviations(np.array([[0.1, 0.1]])).round(3).tolist()
    [[0.6, 1.2]]
    """
    errors = ErrorModel(
        tuple(
            Source(
                name=f"x{at}",
                part="part",
                feature=Feature.SIZE,
                zone=zone,
                minimum=zone / 10,
                maximum=10 * zone,
                cost=1.0,
            )
            for at, zone in enumerate(zones, start=1)
        )
    )
    return Experiment.of(SumOfSizes(errors.columns), errors, SeedTree(seed))


def measured_size(parts: int) -> ErrorModel:
    """Return the error model of one size whose measured parts have mean 0 and σ = 1, for worked numbers [m].

    Half its zone is 3σ (own derivation).

    Examples
    --------
    >>> (source,) = measured_size(parts=20).sources
    >>> source.measured.parts, round(source.measured.cp, 12)
    (20, 1.0)
    """
    made = MeasuredParts(
        path=Path("parts.csv"),
        values=(),
        are_radii=False,
        zone=6.0,
        middle=0.0,
        stated=StatedProcess(mean=0.0, deviation=1.0, parts=parts),
    )
    source = Source(
        name="x1",
        part="part",
        feature=Feature.SIZE,
        zone=6.0,
        minimum=0.6,
        maximum=60.0,
        cost=1.0,
        distribution=Distribution.EMPIRICAL,
        measured=made,
    )
    return ErrorModel((source,))

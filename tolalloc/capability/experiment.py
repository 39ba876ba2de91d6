"""What every statistical question is asked of: a response, the sources that vary, and where its random numbers hang."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Response, ResponseWithDerivatives, Samples

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

    def deviations(self, standard: Samples) -> Samples:
        """Return the columns [m, angles rad] that the standard values give at the zones."""
        return self.errors.deviations(standard, self.zones)

    def uniform(self, units: int) -> Samples:
        """Return independent uniform numbers in (0, 1), one per unit and column [-]."""
        return np.concatenate(list(self.seeds.uniform_chunks(units, len(self.errors.columns))))

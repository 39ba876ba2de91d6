"""Lower and double-sided limits as an upper one, which is what every method for units beyond a limit takes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.models.model import Evaluation, Response


@dataclass(frozen=True, kw_only=True)
class OneSided:
    """The first output of a response, turned so that only its large values are bad.

    Notes
    -----
    An upper limit leaves the output as it is, a lower one turns its sign. Two limits take the larger of the distances
    beyond either, to which the distance between them is added, so that a tolerance relative to the limit has a scale.
    """

    response: Response  # What answers
    limits: Limits  # Limits of its first output

    @property
    def columns(self) -> tuple[str, ...]:
        """The response's columns."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The response's outputs."""
        return self.response.outputs

    @property
    def limit(self) -> float:
        """Largest turned output allowed [output]."""
        if self.limits.width is not None:
            return self.limits.width
        return -self.limits.lower if self.limits.upper is None and self.limits.lower is not None else self._upper

    @property
    def _upper(self) -> float:
        assert self.limits.upper is not None
        return self.limits.upper

    def turned(self, values: Float[np.ndarray, "sample output"]) -> Float[np.ndarray, "sample output"]:
        """Return the outputs with the first one turned."""
        lower, width = self.limits.lower, self.limits.width
        if lower is None:
            return values
        first = (
            -values[:, :1] if width is None else width + np.maximum(lower - values[:, :1], values[:, :1] - self._upper)
        )
        return np.concatenate([first, values[:, 1:]], axis=1)

    def read(self, turned: float) -> float:
        """Return a turned output as a reader knows it: the output itself, or for two limits the distance beyond."""
        if self.limits.width is not None:
            return turned - self.limits.width
        return turned if self.limits.lower is None else -turned

    def facing(self, response: Response) -> Response:
        """Return another response of the same output, turned alike; itself for an upper limit."""
        return response if self.limits.lower is None else replace(self, response=response)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the turned output of every sample."""
        found = self.response(x)
        return replace(found, values=self.turned(found.values))

    def of_sample(self, sample: MonteCarlo) -> MonteCarlo:
        """Return the same units with their first output turned."""
        evaluation = replace(sample.evaluation, values=self.turned(sample.evaluation.values))
        return sample if self.limits.lower is None else replace(sample, evaluation=evaluation)

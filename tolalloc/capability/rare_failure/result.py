"""What an estimate of a rare failure says, whichever method made it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, kw_only=True)
class Level:
    """One level of a subset simulation.

    Parameters
    ----------
    run
        Which of the independent runs, from 0 [-].
    threshold
        Value of the limit state that bounds the next level, 0 at the last one [unit of the limited output].
    share
        Share of this level's samples beyond the threshold [-].
    correlation
        Factor γ by which correlated chains raise the variance of the share to (1 + γ) times [-].
    accepted
        Share of accepted chain steps, 1 at the first level, which has no chains [-].
    coefficient_of_variation
        Of the share [-].
    """

    run: int
    threshold: float
    share: float
    correlation: float
    accepted: float
    coefficient_of_variation: float


@dataclass(frozen=True, kw_only=True)
class RareFailure:
    """Probability of failure with its standard error and what it took.

    Parameters
    ----------
    probability
        Estimate [-].
    standard_error
        Of the estimate; infinite if no sample failed, because then nothing is known about the spread [-].
    calls, failed
        Calls of the limit state, and how many of them gave no usable answer [-].
    method
        Name of the method.
    cautions
        Reasons not to rely on the estimate; empty if the method sees none.
    effective_samples
        Number of equally weighted failures that would know as much; 0 if no sample failed [-].
    missed_share
        Share of the probability that lies where no design point explains it; 0 for subset simulation [-].
    levels
        Levels of a subset simulation, run by run; empty for other methods.
    failing
        Failing states of every run of a subset simulation, not independent of each other; empty for other methods [-].
    """

    probability: float
    standard_error: float
    calls: int
    failed: int
    method: str
    cautions: tuple[str, ...]
    effective_samples: float
    missed_share: float = 0.0
    levels: tuple[Level, ...] = ()
    failing: tuple[Float[np.ndarray, "_state variable"], ...] = field(default=(), repr=False, compare=False)

    @property
    def coefficient_of_variation(self) -> float:
        """Standard error over probability, infinite for a probability of zero [-]."""
        return self.standard_error / self.probability if self.probability > 0 else float("inf")

    def difference_from(self, other: RareFailure) -> float:
        """Return the difference from an independent estimate in standard errors of that difference [-].

        Notes
        -----
        Beyond 3 the two methods contradict each other, and one of them has missed something. An estimate without a
        failure contradicts nothing, so the difference from it is 0.
        """
        error = float(np.hypot(self.standard_error, other.standard_error))
        return (self.probability - other.probability) / error

    @property
    def trustworthy(self) -> bool:
        """Whether the method sees no reason against its own estimate."""
        return not self.cautions

    @property
    def status(self) -> str:
        """One sentence for a person."""
        text = (
            f"{self.method}: probability {self.probability:.3g} with standard error {self.standard_error:.2g} "
            f"from {self.calls} calls"
        )
        return f"{text}; do not rely on it: {'; '.join(self.cautions)}." if self.cautions else f"{text}."

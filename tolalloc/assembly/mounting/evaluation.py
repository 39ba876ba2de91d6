"""Peak-to-peaks of assembled units, each computed once."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.mounting.stock import Mountings, Stock
from tolalloc.exceptions import SolveError
from tolalloc.model import Response


@dataclass(kw_only=True)
class Memory:
    """Units that were evaluated, and how many failed.

    Parameters
    ----------
    stock
        The parts.
    response
        What is to be small, first output, such as `tolalloc.rv.response.kernel.KernelResponse`.
    evaluations, failures
        Units evaluated, and those of them without an answer [-].
    """

    stock: Stock
    response: Response
    evaluations: int = 0
    failures: int = 0
    _known: dict[bytes, float] = field(default_factory=dict)

    def __call__(self, mountings: Mountings) -> Float[np.ndarray, " unit"]:
        """Return the first output of every unit, infinite where it failed, so that nothing chooses it [arcsec]."""
        keys = [unit.tobytes() for unit in mountings]
        new = {key: at for at, key in enumerate(keys) if key not in self._known}
        if new:
            evaluation = self.response(self.stock.errors(mountings[list(new.values())]))
            values = np.where(evaluation.good, evaluation.values[:, 0], np.inf)
            self._known.update(zip(new, values.tolist(), strict=True))
            self.evaluations += len(new)
            self.failures += int(np.count_nonzero(~evaluation.good))
        return np.array([self._known[key] for key in keys])

    def require_few_failures(self, largest_failed_share: float) -> None:
        """Raise if more than a share of the units has no answer.

        Parameters
        ----------
        largest_failed_share
            Largest share [-].

        Raises
        ------
        SolveError
            Too many units failed.
        """
        if self.failures > largest_failed_share * self.evaluations:
            raise SolveError(
                f"Mounting: {self.failures} of {self.evaluations} units have no equilibrium that can be trusted; "
                f"allowed is a share of {largest_failed_share:g}."
            )

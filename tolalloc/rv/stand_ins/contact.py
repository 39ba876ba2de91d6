"""The contact solved at fewer angles: a stand-in that needs answers for one straight line only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.polynomial import polynomial

from tolalloc.model import Evaluation, Response
from tolalloc.rv.equivalent.angle_search import AngleSearch
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.response.kernel import KernelResponse


@dataclass(frozen=True, kw_only=True)
class Corrected:
    """A response with one output, brought by a straight line to that of a better one.

    Parameters
    ----------
    response
        What answers.
    offset
        Added to its answers [output].
    factor
        What its answers are multiplied by before [-].
    """

    response: Response
    offset: float
    factor: float

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of the response."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The output of the response."""
        return self.response.outputs

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the corrected answers; a sample that fails stays a failed one."""
        evaluation = self.response(x)
        return replace(evaluation, values=self.offset + self.factor * evaluation.values)


def corrected(response: Response, x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, " sample"]) -> Corrected:
    """Return the response with the line of least squares that brings it to the answers ``y``."""
    evaluation = response(x)
    offset, factor = polynomial.polyfit(evaluation.values[evaluation.good, 0], y[evaluation.good], 1)
    return Corrected(response=response, offset=float(offset), factor=float(factor))


@dataclass(frozen=True, kw_only=True)
class ContactCandidate:
    """The equivalent model itself, its curve read at equally spaced angles without a search between them.

    Parameters
    ----------
    kernel
        The model with the full search.
    angles
        Angles of the turn [-].

    Notes
    -----
    Angles miss the kinks where the extremes are, so the peak-to-peak comes out too small, by nearly the same amount
    for every unit; the line makes up for it. At 936 angles the RV-20E's line, fitted at the zones of its table, is off
    by 0.4″ on average at a quarter of them and by less at larger ones.
    """

    kernel: KernelResponse
    angles: int

    @property
    def name(self) -> str:
        """What a table calls it."""
        return f"contact at {self.angles} angles"

    def fit(self, x: Float[np.ndarray, "sample column"], y: Float[np.ndarray, " sample"]) -> Corrected:
        """Return the model at fewer angles, brought to the answers."""
        model, search = self.kernel.model, AngleSearch(coarse=self.angles, nodes_per_coarse=1, levels=0)
        fewer = EquivalentModel(model.reducer, search, model.orders)
        return corrected(replace(self.kernel, model=fewer), x, y)

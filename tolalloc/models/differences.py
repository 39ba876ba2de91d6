"""One output with its derivatives: exact ones where the model knows them, else central differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import Evaluation, Model, Response, ResponseWithDerivatives, SettingDerivatives

_STEP = 0.02
"""Step of a difference by a column over its standard deviation [-]."""


def derived(model: Model, output: str, deviation: Float[np.ndarray, " column"]) -> ResponseWithDerivatives:
    """Return an output of a model with its derivatives by the columns, whose standard deviations make the steps."""
    if output in model.exact:
        return _Exact(model=model, output=output)
    return DifferencedResponse(response=model.reading((output,)), output=output, steps=_STEP * deviation)


@dataclass(frozen=True, kw_only=True)
class _Exact:
    """An output with the exact derivatives that its model knows."""

    model: Model
    output: str

    @property
    def columns(self) -> tuple[str, ...]:
        """The model's columns."""
        return self.model.columns

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> SettingDerivatives:
        """Return the output of every sample and its derivatives."""
        return self.model.derivatives(self.output, x)


@dataclass(frozen=True, kw_only=True)
class DifferencedResponse:
    """One output of a response that knows no derivatives.

    Raises
    ------
    InputError, UnknownNameError
        A step that is not above zero, or an output that the response does not have.

    Notes
    -----
    A sample with derivatives costs one answer and two for every column. The truncation falls with the square of the
    step; across a kink a difference is a mean of both sides.
    """

    response: Response  # What answers
    output: str  # Name of the output with its unit
    steps: Float[np.ndarray, " column"]  # Step of every column to either side [unit of the column]

    def __post_init__(self) -> None:
        if self.output not in self.response.outputs:
            raise UnknownNameError.among("derivatives", "output", self.output, self.response.outputs)
        if not (self.steps > 0.0).all():
            raise InputError.at("derivatives", "steps", float(self.steps.min()), "above 0")

    @property
    def columns(self) -> tuple[str, ...]:
        """The response's columns."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (self.output,)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the output of every sample."""
        found = self.response(x)
        at = self.response.outputs.index(self.output)
        return Evaluation(values=found.values[:, [at]], status=found.status)

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> SettingDerivatives:
        """Return the output of every sample and its derivatives, NaN by neighbours that failed, all in one call."""
        columns = len(self.columns)
        shifts = np.concatenate([np.zeros((1, columns)), np.diag(self.steps), -np.diag(self.steps)])
        found = self((x[:, np.newaxis] + shifts).reshape(-1, columns))
        values, status = found.values.reshape(-1, shifts.shape[0]), found.status.reshape(-1, shifts.shape[0])
        slopes = (values[:, 1 : columns + 1] - values[:, columns + 1 :]) / (2 * self.steps)
        good = found.good.reshape(status.shape)[:, 1:].reshape(-1, 2, columns).all(axis=1)
        return SettingDerivatives(
            # The status is the worst one of the sample and of its neighbours.
            evaluation=Evaluation(values=values[:, :1], status=status.max(axis=1)),
            by_column=np.where(good, slopes, np.nan),
            by_setting=np.empty((x.shape[0], 0)),
        )

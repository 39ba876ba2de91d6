"""Stiffness as columns of the response: its exact derivative by ln K, and how far that first order holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import exp, inf
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Response, unobserved
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import KernelResponse, WithDerivatives

NAME = "stiffness (identified)"
PREFIX = "stiffness."

SEEN = 0.05
"""Accuracy of a peak-to-peak, below which no difference means anything [arcsec]."""


def stiffness_source(identified: IdentifiedStiffness, reducer: Reducer) -> CorrelatedSource:
    """Return what is not known of the identified stiffnesses as a source of relative changes ln K/K0 [-].

    Raises
    ------
    InputError
        A contact whose uncertainty the derivative does not tell from that of the bending pins.
    """
    if reducer.stiffness.pin_bending < inf and identified.standard_uncertainty.get("pin_contact", 0.0) > 0.0:
        raise InputError.at(
            identified.source,
            "standard_uncertainty of pin_contact",
            identified.standard_uncertainty["pin_contact"],
            f"0 where pins bend, as those of {reducer.name} do (pin_span_mm)",
        )
    return CorrelatedSource(
        name=NAME, columns=tuple(PREFIX + name for name in identified.values), covariance=identified.covariance
    )


@dataclass(frozen=True, kw_only=True)
class StiffnessResponse:
    """The kernel's peak-to-peak with stiffnesses as further columns, to first order in ln K."""

    kernel: KernelResponse  # The real model
    # Fields of `rv.reducer.stiffness.Stiffness` that vary, in the order of their columns, which are the last
    stiffnesses: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad], then ``stiffness.<field>`` [-]."""
        return (*self.kernel.columns, *(PREFIX + name for name in self.stiffnesses))

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output of the kernel."""
        return self.kernel.outputs

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the peak-to-peak of every sample [arcsec]."""
        own = len(self.kernel.columns)
        answers = self.kernel.with_derivatives(np.ascontiguousarray(x[:, :own]))
        change = (self.gradient(answers) * x[:, own:]).sum(axis=1, keepdims=True)
        return replace(answers.evaluation, values=answers.evaluation.values + change)

    def gradient(self, answers: WithDerivatives) -> Float[np.ndarray, "sample stiffness"]:
        """Return the derivative of the peak-to-peak by ln K of every stiffness [arcsec]."""
        return np.stack([answers.by_stiffness[name] for name in self.stiffnesses], axis=1)

    def changed(self, change: Float[np.ndarray, " stiffness"]) -> KernelResponse:
        """Return the kernel of the reducer whose stiffnesses are changed, by ln K/K0 [-]; it knows no first order."""
        model = self.kernel.model
        old = model.reducer.stiffness
        values: dict[str, Any] = {
            name: getattr(old, name) * exp(by) for name, by in zip(self.stiffnesses, change, strict=True)
        }
        reducer = replace(model.reducer, stiffness=replace(old, **values))
        return replace(self.kernel, model=replace(model, reducer=reducer))


@dataclass(frozen=True, kw_only=True)
class OutputsWithStiffness:
    """Several outputs with stiffnesses as further columns, to first order in ln K.

    Notes
    -----
    The peak-to-peak takes its exact derivative. Every other output takes the one-sided difference between the kernel at
    a stiffness raised by its standard uncertainty and the kernel as it is, unit by unit, so that the effect of one
    standard uncertainty is that of the kernel. A unit without an answer at one of them has none. What is counted of a
    unit is how its peak-to-peak ended, or its other outputs where that is not asked for.
    """

    peak: StiffnessResponse  # The peak-to-peak with its exact derivative
    outputs: tuple[str, ...]  # Names of the outputs with their units
    # From a kernel, the response of some outputs
    reading: Callable[[KernelResponse, tuple[str, ...]], Response]
    steps: tuple[float, ...]  # Standard uncertainty of ln K of every stiffness: what a difference is taken over [-]

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad], then ``stiffness.<field>`` [-]."""
        return self.peak.columns

    @property
    def _others(self) -> tuple[str, ...]:
        """The outputs without the peak-to-peak, which no difference is taken of."""
        return tuple(name for name in self.outputs if name != PEAK_TO_PEAK)

    def _raised(self) -> Iterator[tuple[int, Response]]:
        """Yield the position of every stiffness that is not known, and the others with it raised.

        One at a time, as the tables of each take tens of megabytes and are made in less time than a chunk is solved in.
        """
        for at, step in enumerate(self.steps):
            if step > 0.0:
                kernel = self.peak.changed(step * np.eye(len(self.steps))[at])
                # These solves belong to a unit that is counted already.
                yield at, self.reading(replace(kernel, observe=unobserved), self._others)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample."""
        if PEAK_TO_PEAK not in self.outputs:
            return self._differences(x, self.peak.kernel)
        others = self._differences(x, replace(self.peak.kernel, observe=unobserved))
        exact = self.peak(x)
        values = np.insert(others.values, self.outputs.index(PEAK_TO_PEAK), exact.values[:, 0], axis=1)
        return Evaluation(values=values, status=np.maximum(others.status, exact.status))

    def _differences(self, x: Float[np.ndarray, "sample column"], kernel: KernelResponse) -> Evaluation:
        """Return the others of every sample."""
        own = len(kernel.columns)
        sample, change = np.ascontiguousarray(x[:, :own]), x[:, own:]
        base = self.reading(kernel, self._others)(sample)
        values, status = base.values.copy(), base.status.copy()
        for at, response in self._raised():
            found = response(sample)
            values += (found.values - base.values) * (change[:, [at]] / self.steps[at])
            status = np.maximum(status, found.status)
        return Evaluation(values=values, status=status)

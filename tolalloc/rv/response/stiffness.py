"""Stiffness as columns of the response: its exact derivative by ln K, and how far that first order holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, inf
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models import Evaluation, Response, unobserved
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse, WithDerivatives

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
    standard uncertainty is that of the kernel. A unit without an answer at one of them has none.
    """

    peak: StiffnessResponse  # The peak-to-peak with its exact derivative
    outputs: tuple[str, ...]  # Names of the outputs with their units
    reading: Callable[[KernelResponse], Response]  # From a kernel, the response of these outputs
    steps: tuple[float, ...]  # Standard uncertainty of ln K of every stiffness: what a difference is taken over [-]

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad], then ``stiffness.<field>`` [-]."""
        return self.peak.columns

    @cached_property
    def _raised(self) -> dict[int, Response]:
        """Position of every stiffness that is not known → the outputs with it raised; tables are made once for each."""
        raised = ((at, step * np.eye(len(self.steps))[at]) for at, step in enumerate(self.steps) if step > 0.0)
        # These solves belong to a unit that is counted already.
        return {at: self.reading(replace(self.peak.changed(change), observe=unobserved)) for at, change in raised}

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the outputs of every sample."""
        own = len(self.peak.kernel.columns)
        sample, change = np.ascontiguousarray(x[:, :own]), x[:, own:]
        base = self.reading(self.peak.kernel)(sample)
        values, status = base.values.copy(), base.status.copy()
        for at, response in self._raised.items():
            found = response(sample)
            values += (found.values - base.values) * (change[:, [at]] / self.steps[at])
            status = np.maximum(status, found.status)
        if PEAK_TO_PEAK in self.outputs:
            exact = replace(self.peak, kernel=replace(self.peak.kernel, observe=unobserved))(x)
            values[:, self.outputs.index(PEAK_TO_PEAK)] = exact.values[:, 0]
            status = np.maximum(status, exact.status)
        return Evaluation(values=values, status=status)


@dataclass(frozen=True, kw_only=True)
class FirstOrderError:
    """First order minus kernel at changed stiffnesses."""

    # Of the difference [arcsec]
    root_mean_square: float
    largest: float
    effect: float  # Root-mean-square of what the same changes do to the peak-to-peak [arcsec]
    # Units and changes of the stiffnesses behind it [-]
    units: int
    changes: int

    @property
    def fails(self) -> bool:
        """Whether the error is half of the effect or more, and more than the angles of the search leave."""
        return self.root_mean_square > max(0.5 * self.effect, SEEN)


def first_order_error(
    response: StiffnessResponse,
    x: Float[np.ndarray, "unit kernel_column"],
    changes: Float[np.ndarray, "change stiffness"],
) -> FirstOrderError:
    """Return how far the first order is from the kernel whose reducer has the changed stiffnesses.

    Raises
    ------
    SolveError
        No unit has an answer at any of the changes.
    """
    answers = response.kernel.with_derivatives(x)
    predicted = response.gradient(answers) @ changes.T
    exact = [response.changed(change)(x).values[:, 0] - answers.evaluation.values[:, 0] for change in changes]
    effect = np.stack(exact, axis=1)
    error = predicted - effect
    good = np.isfinite(error)
    if not good.any():
        raise SolveError(
            f"{NAME}: no unit has an answer at stiffnesses changed by up to a factor of "
            f"{exp(float(np.abs(changes).max())):.3g}; allowed are standard uncertainties that leave a reducer."
        )
    return FirstOrderError(
        root_mean_square=float(np.sqrt((error[good] ** 2).mean())),
        largest=float(np.abs(error[good]).max()),
        effect=float(np.sqrt((effect[good] ** 2).mean())),
        units=x.shape[0],
        changes=changes.shape[0],
    )


@dataclass(frozen=True, kw_only=True)
class StiffnessEffect:
    """What not knowing the stiffness does to the peak-to-peak, and how well that is known."""

    source: CorrelatedSource  # The source
    # Standard deviation of one unit's peak-to-peak from the stiffness alone, root-mean-square over units [arcsec]
    sigma: float
    sigma_of_mean: float  # Standard deviation of the mean over all units, which the stiffness shifts together [arcsec]
    first_order: FirstOrderError  # First order against kernel


def stiffness_effect(
    response: StiffnessResponse,
    source: CorrelatedSource,
    x: Float[np.ndarray, "unit kernel_column"],
    directions: Float[np.ndarray, "direction stiffness"],
    units_on_kernel: int,
) -> StiffnessEffect:
    """Return what the source alone does to units, with the first order checked at ±2σ.

    Parameters
    ----------
    response
        The first order.
    source
        The uncertainty.
    x
        Units, in the kernel's columns [m, angles rad].
    directions
        Any directions of independent standard values; both ends at a distance of 2 are checked [-].
    units_on_kernel
        How many of the units the kernel solves again at changed stiffnesses [-].
    """
    answers = response.kernel.with_derivatives(x)
    gradient = response.gradient(answers)[answers.evaluation.good]
    mean = gradient.mean(axis=0)
    ends = 2.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True) @ source.factor.T
    return StiffnessEffect(
        source=source,
        sigma=float(np.sqrt(((gradient @ source.factor) ** 2).sum(axis=1).mean())),
        sigma_of_mean=float(np.linalg.norm(mean @ source.factor)),
        first_order=first_order_error(response, x[:units_on_kernel], np.concatenate([ends, -ends])),
    )

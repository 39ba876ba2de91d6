"""The equivalent model as a response: peak-to-peak transmission error of every sample.

Stiffness may be columns of it: its exact derivative by ln K, and how far that first order holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import exp, inf
from typing import Any

import numpy as np
from jaxtyping import Float, Shaped, UInt8

from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import Evaluation, Observer, Response, Samples, unobserved
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel, TurnExtremes, cached_model
from tolalloc.reducers.equivalent.outputs import compensated_peak_to_peak
from tolalloc.reducers.equivalent.wear import Wear
from tolalloc.reducers.load_case import LoadCase
from tolalloc.reducers.reducer.design import Modification, Reducer, at_torque, thermal_shift
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.running.chunks import Mapper, map_chunks

Answer = tuple[Float[np.ndarray, "chunk output"], UInt8[np.ndarray, " chunk"]]
"""Outputs of a chunk and the status of every sample."""
NAME = "stiffness (identified)"
PREFIX = "stiffness."
SEEN = 0.05
"""Accuracy of a peak-to-peak, below which no difference means anything [arcsec]."""
_LEAST_AXIS = 1e-9
"""Variance along an axis over the largest one below which it is rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class WithDerivatives:
    """Answers of the kernel with the exact derivative of the peak-to-peak."""

    evaluation: Evaluation  # Peak-to-peak and status of every sample
    by_column: Samples  # Derivative by every varied column [arcsec/m]
    # By the equidistant, the shift and the rotation amount [arcsec/m, arcsec/rad]
    by_modification: Float[np.ndarray, "sample 3"]
    # Derivative by the relative change of each stiffness of `tolalloc.reducers.reducer.stiffness.Stiffness` [arcsec]
    by_stiffness: dict[str, Float[np.ndarray, " sample"]]


@dataclass(frozen=True, kw_only=True)
class KernelResponse:
    """Peak-to-peak transmission error on the real model."""

    model: EquivalentModel  # The equivalent model
    torque: float  # Torque on the carrier, negative resists the rotation [N·m]
    columns: tuple[str, ...]  # Columns that vary, in the order of X
    # Value of every other column of the model, and what a column that varies varies around: the amounts of the
    # modification, which a row of a tolerance table lets deviate [m, angles rad]
    fixed: Mapping[str, float]
    offsets: Mapping[str, float] = field(default_factory=dict)  # Added to columns that are fixed [m, angles rad]
    disc_temperature: float = 0.0  # Of the discs less that of the ring [K]
    load: float | None = None  # Torque of what pins and bearings carry, the rated one as the torque unless given [N·m]
    # Part of the output turn that the peak-to-peak is taken of, all of it unless given [rad]
    window: tuple[float, float] | None = None
    compensated: tuple[int, ...] = ()  # Orders that are taken out of the error before its peak-to-peak counts [-]
    wear: Wear | None = None  # What hours have taken off the parts, none of new ones
    observe: Observer = unobserved  # Told the statuses of each chunk
    mapper: Mapper = map  # What solves the chunks, `tolalloc.running.chunks.map_chunks`

    def __post_init__(self) -> None:
        known, given = set(self.model.columns), {*self.columns, *self.fixed}
        for name in (*self.columns, *self.fixed):
            if name not in known:
                raise UnknownNameError.among(f"errors of {self.model.reducer.name}", "source", name, known)
        missing = dict.fromkeys(source_name(name) for name in self.model.columns if name not in given)
        if missing:
            stated = f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} not given"
            raise InputError(
                f"errors of {self.model.reducer.name}: {stated}; add rows to the tolerance table, or patterns to "
                "neglected of the study: '*' takes all that the table leaves out as exact."
            )

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (PEAK_TO_PEAK,)

    def with_modification(self, modification: Modification) -> KernelResponse:
        """Return the response of the same reducer with another tooth modification."""
        return replace(self, fixed={**self.fixed, **modification.deviations})

    def under(self, case: LoadCase) -> KernelResponse:
        """Return the response of the same reducer under a load case, which keeps what it does not state."""
        warmer = self.disc_temperature if case.disc_temperature is None else case.disc_temperature
        kernel = replace(self, window=case.window, compensated=case.compensated, disc_temperature=warmer)
        if case.torque is None:
            return kernel
        own = self.model
        # The next chunk under the same load case finds the tables as they are.
        model = cached_model(at_torque(own.reducer, case.torque), own.search, own.orders)
        return replace(kernel, model=model, torque=case.torque, load=case.torque)

    def worn(self, wear: Wear) -> KernelResponse:
        """Return the response of the same reducer after hours of turning."""
        own = self.model
        # The next chunk finds the tables as they are, as under a torque.
        model = cached_model(replace(own.reducer, form=wear.form), own.search, own.orders)
        return replace(self, model=model, wear=wear)

    @property
    def load_torque(self) -> float:
        """Torque under which pins and bearings are looked at, the rated one unless a load case states another [N·m]."""
        rated = float(np.copysign(self.model.reducer.load.rated_torque, self.torque))
        return rated if self.load is None else self.load

    def __call__(self, x: Samples) -> Evaluation:
        """Return the peak-to-peak of every sample [arcsec]."""
        values, status = np.empty((x.shape[0], 1)), np.empty(x.shape[0], np.uint8)
        self.fill(self.alone._peak_to_peak, x, values, status)
        return Evaluation(values=values, status=status)

    def with_derivatives(self, x: Samples) -> WithDerivatives:
        """Return the peak-to-peak of every sample and its derivatives, at hardly more cost than without."""
        values, status = np.empty((x.shape[0], 1)), np.empty(x.shape[0], np.uint8)
        by_column = np.empty(x.shape)
        by_modification = np.empty((x.shape[0], len(self.model.reducer.modification.deviations)))
        names = (*self.model.error_columns.rows_of_stiffness, "pin_contact")
        by_stiffness = np.empty((x.shape[0], len(names)))
        self.fill(self.alone._derivatives, x, values, by_column, by_modification, by_stiffness, status)
        return WithDerivatives(
            evaluation=Evaluation(values=values, status=status),
            by_column=by_column,
            by_modification=by_modification,
            by_stiffness=dict(zip(names, by_stiffness.T, strict=True)),
        )

    def fill(
        self,
        solve: Callable[[Float[np.ndarray, "chunk column"]], tuple[np.ndarray, ...]],
        x: Samples,
        *filled: Shaped[np.ndarray, "sample ..."],
    ) -> None:
        """Fill arrays with what a function gives of every chunk, the statuses last, which the observer is told."""
        for rows, found in map_chunks(solve, x, self.mapper):
            for whole, own in zip(filled, found, strict=True):
                whole[rows] = own
            self.observe(found[-1])

    @property
    def alone(self) -> KernelResponse:
        """The response without what must stay in this process."""
        return replace(self, observe=unobserved, mapper=map)

    def release(self) -> None:
        """Let go of the model's tables."""
        self.model.release()

    def extremes(self, errors: Float[np.ndarray, "chunk all_columns"]) -> TurnExtremes:
        """Return the extremes of the transmission error at errors in the order of the model's columns."""
        if self.window is None:
            return self.model.extremes(errors, self.torque)
        return self.model.extremes_within(errors, self.torque, self.window)

    def peak_to_peak(self, errors: Float[np.ndarray, "chunk all_columns"]) -> Answer:
        """Return the peak-to-peak at errors in the order of the model's columns [arcsec], and the statuses."""
        if self.compensated:
            span, status = compensated_peak_to_peak(self.model, errors, self.torque, self.compensated)
            return span[:, np.newaxis] / ARCSECOND, status
        found = self.extremes(errors)
        return found.peak_to_peak[:, np.newaxis] / ARCSECOND, found.status

    def _peak_to_peak(self, x: Float[np.ndarray, "chunk column"]) -> Answer:
        return self.peak_to_peak(self.errors(x))

    def _derivatives(self, x: Float[np.ndarray, "chunk column"]) -> tuple[np.ndarray, ...]:
        """Return what `with_derivatives` fills of a chunk, of the columns those that vary and the amounts alone.

        What is asked for is a fraction of all columns, and a chunk's answer is kept in a file or sent by a worker.
        """
        extremes, found = self.model.peak_to_peak_derivatives(self.errors(x), self.torque)
        varied, amounts = (
            found.by_error[:, [self.model.columns.index(name) for name in names]] / ARCSECOND
            for names in (self.columns, self.model.reducer.modification.deviations)
        )
        by_stiffness = np.stack(list(found.by_stiffness.values()), axis=1) / ARCSECOND
        return extremes.peak_to_peak[:, np.newaxis] / ARCSECOND, varied, amounts, by_stiffness, extremes.status

    def errors(self, x: Samples) -> Float[np.ndarray, "sample all_columns"]:
        """Return the varied columns and the fixed ones together, in the order of the model [m].

        A column that is both deviates from its fixed value, worn pins are thinner, each unit's by its own forces, and
        warmer discs shift their teeth, `thermal_shift`.
        """
        where = {name: at for at, name in enumerate(self.model.columns)}
        errors = np.zeros((x.shape[0], len(where)))
        for name, value in self.fixed.items():
            errors[:, where[name]] = value
        errors[:, [where[name] for name in self.columns]] += x
        for name, offset in self.offsets.items():
            errors[:, where[name]] += offset
        if self.wear is not None:
            errors = self.wear.aged(self.model, errors)
        if self.disc_temperature:
            stage = self.model.reducer.cycloid_stage
            errors[:, where["modification.shift"]] += thermal_shift(stage, self.disc_temperature)
        return errors


def stiffness_source(identified: IdentifiedStiffness, reducer: Reducer) -> CorrelatedSource:
    """Return what is not known of the identified stiffnesses as a source of relative changes ln K/K0 [-]."""
    if reducer.stiffness.pin_bending < inf and identified.standard_uncertainty.get("pin_contact", 0.0) > 0.0:
        stated = identified.standard_uncertainty["pin_contact"]
        allowed = f"0 where pins bend, as those of {reducer.name} do (pin_span_mm)"
        raise InputError.at(identified.source, "standard_uncertainty of pin_contact", stated, allowed)
    return CorrelatedSource(
        name=NAME, columns=tuple(PREFIX + name for name in identified.values), covariance=identified.covariance
    )


@dataclass(frozen=True, kw_only=True)
class StiffnessResponse:
    """The kernel's peak-to-peak with stiffnesses as further columns, to first order in ln K."""

    kernel: KernelResponse  # The real model
    # Fields of `reducers.reducer.stiffness.Stiffness` that vary, in the order of their columns, which are the last
    stiffnesses: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad], then ``stiffness.<field>`` [-]."""
        return (*self.kernel.columns, *(PREFIX + name for name in self.stiffnesses))

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output of the kernel."""
        return self.kernel.outputs

    def __call__(self, x: Samples) -> Evaluation:
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


def principal_axes(covariance: Float[np.ndarray, "stiffness stiffness"]) -> Float[np.ndarray, "axis stiffness"]:
    """Return one standard deviation along every principal axis of a covariance, upwards on the whole [-].

    Axes √λ·q of C·q = λ·q with λ > 0 (own derivation): C is the sum of their squares. Two stiffnesses that are
    uncertain together have one axis.
    """
    variance, axes = np.linalg.eigh(covariance)
    kept = variance > _LEAST_AXIS * max(variance[-1], 0.0)
    found = np.sqrt(variance[kept])[:, np.newaxis] * axes.T[kept]
    return np.asarray(found * np.where(found.sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0))


@dataclass(frozen=True, kw_only=True)
class OutputsWithStiffness:
    """Several outputs with stiffnesses as further columns, to first order in ln K.

    Notes
    -----
    The peak-to-peak takes its exact derivative. Every other output takes one-sided differences between the kernel with
    its stiffnesses changed by one standard uncertainty, along every principal axis of their covariance, and the kernel
    as it is, unit by unit, so that the effect of one standard uncertainty is that of the kernel. Stiffnesses that are
    uncertain together, such as bearings identified by one measured rigidity, have one axis. A unit without an answer at
    one of them has none. What is counted of a unit is how its peak-to-peak ended, or its other outputs where that is
    not asked for.
    """

    peak: StiffnessResponse  # The peak-to-peak with its exact derivative
    outputs: tuple[str, ...]  # Names of the outputs with their units
    # From a kernel, the response of some outputs
    reading: Callable[[KernelResponse, tuple[str, ...]], Response]
    # Changes of ln K that differences are taken over, those of `principal_axes` [-]
    axes: Float[np.ndarray, "axis stiffness"]

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns [m, angles rad], then ``stiffness.<field>`` [-]."""
        return self.peak.columns

    @property
    def _others(self) -> tuple[str, ...]:
        """The outputs without the peak-to-peak, which no difference is taken of."""
        return tuple(name for name in self.outputs if name != PEAK_TO_PEAK)

    def __call__(self, x: Samples) -> Evaluation:
        """Return the outputs of every sample."""
        if PEAK_TO_PEAK not in self.outputs:
            return self._differences(x, self.peak.kernel)
        others = self._differences(x, replace(self.peak.kernel, observe=unobserved))
        exact = self.peak(x)
        values = np.insert(others.values, self.outputs.index(PEAK_TO_PEAK), exact.values[:, 0], axis=1)
        return Evaluation(values=values, status=np.maximum(others.status, exact.status))

    def _differences(self, x: Samples, kernel: KernelResponse) -> Evaluation:
        """Return the others of every sample."""
        own = len(kernel.columns)
        sample, along = np.ascontiguousarray(x[:, :own]), x[:, own:] @ np.linalg.pinv(self.axes)
        base = self.reading(kernel, self._others)(sample)
        values, status = base.values.copy(), base.status.copy()
        # One at a time: the tables of each take tens of megabytes and are made in less time than a chunk is solved in.
        for steps, axis in zip(along.T, self.axes, strict=True):
            # These solves belong to a unit that is counted already.
            found = self.reading(replace(self.peak.changed(axis), observe=unobserved), self._others)(sample)
            values += (found.values - base.values) * steps[:, np.newaxis]
            status = np.maximum(status, found.status)
        return Evaluation(values=values, status=status)

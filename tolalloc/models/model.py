"""What a model is: named inputs that vary, named outputs with units, and settings that a designer may choose.

The equivalent model of a reducer, a surrogate of it and a user's own function all look like this to the rooms that
rank, judge and allocate; any output of one has derivatives, exact ones where the model knows them, else differences.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.identity import identity
from tolalloc.models.settings import DrawnAmounts, Setting
from tolalloc.reading.plugins import plugins
from tolalloc.running.chunks import Mapper

if TYPE_CHECKING:
    from tolalloc.drawings.correlation import CorrelatedSource
    from tolalloc.drawings.error_model import ErrorModel

Samples = Float[np.ndarray, "sample column"]
"""Deviations of samples in the columns of a response [m, angles rad], or what has their shape."""

Units = Mapping[str, tuple[Float[np.ndarray, " setting"], Float[np.ndarray, " column"]]]
"""Label → settings [units of their names] and deviations [m, angles rad] of one unit."""

_STEP = 0.02
"""Step of a difference by a column over its standard deviation [-]."""

Observer = Callable[[UInt8[np.ndarray, " sample"]], None]
"""Told the statuses of each chunk as soon as it is solved: a progress bar, a counter."""
ARRAY_RATE = 500_000.0
"""Units a second that a model which takes whole arrays is taken to answer, assumed: no clock is read [1/s]."""


def unobserved(status: UInt8[np.ndarray, " sample"]) -> None:
    """Observe nothing."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Answers of a response.

    Parameters
    ----------
    values
        Outputs [as the response's output names state].
    status
        0 for a good sample; anything else is a failed one, whose values must not be used [-].
    """

    values: Float[np.ndarray, "sample output"]
    status: UInt8[np.ndarray, " sample"]

    @property
    def good(self) -> Bool[np.ndarray, " sample"]:
        """Which samples may be used."""
        return np.asarray((self.status == 0) & np.isfinite(self.values).all(axis=1))

    @property
    def known(self) -> Float[np.ndarray, "sample output"]:
        """The values, NaN in samples that failed."""
        return np.where(self.good[:, np.newaxis], self.values, np.nan)

    @classmethod
    def joined(cls, parts: Sequence[Evaluation]) -> Evaluation:
        """Return the answers of several parts, one after the other."""
        return cls(
            values=np.concatenate([own.values for own in parts]), status=np.concatenate([own.status for own in parts])
        )


@runtime_checkable
class Response(Protocol):
    """Anything that maps named columns to named outputs, sample by sample."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs, in the order of X."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units, in the order of Y."""

    def __call__(self, x: Samples) -> Evaluation:
        """Return the outputs of every sample."""


@dataclass(frozen=True, kw_only=True)
class Passing:
    """A response that asks another one, and has its columns and outputs."""

    response: Response  # What answers

    @property
    def columns(self) -> tuple[str, ...]:
        """The response's columns."""
        return self.response.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """The response's outputs."""
        return self.response.outputs


@runtime_checkable
class Derived(Protocol):
    """Answers with the derivative of the first output by every column."""

    @property
    def evaluation(self) -> Evaluation:
        """Outputs and status of every sample."""

    @property
    def by_column(self) -> Samples:
        """Derivatives [output per unit of the column]."""


@runtime_checkable
class ResponseWithDerivatives(Protocol):
    """A response that knows its derivatives."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs, in the order of X."""

    def with_derivatives(self, x: Samples) -> Derived:
        """Return the outputs of every sample and their derivatives."""


@runtime_checkable
class KeepsTables(Protocol):
    """What keeps tables, and makes them again when they are needed."""

    def release(self) -> None:
        """Let go of the tables."""


@dataclass(frozen=True, kw_only=True)
class SettingDerivatives:
    """Answers of one output with its exact derivatives."""

    evaluation: Evaluation  # The output and the status of every sample
    by_column: Samples  # Derivative by every column [output per unit of the column]
    by_setting: Float[np.ndarray, "sample setting"]  # Derivative by every setting [output per unit of the setting]


class Model(ABC):
    """A model at the sources of one drawing: what every question asks.

    A subclass says what it varies and what it answers; everything else has a default that asks for nothing special.
    Words and pictures are no part of it: `tolalloc.reports.portrait.Portrait`.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """What a report calls it."""

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs that the drawing lets vary, in the order of X."""

    @property
    @abstractmethod
    def outputs(self) -> tuple[str, ...]:
        """Names of all outputs with their units."""

    @abstractmethod
    def reading(self, outputs: tuple[str, ...]) -> Response:
        """Return the response of these outputs alone, in their order, which may cost less than all of them."""

    @property
    def settings(self) -> tuple[Setting, ...]:
        """What the designer chooses beside the zones."""
        return ()

    def at(self, values: Float[np.ndarray, " setting"]) -> Model:
        """Return the model at other values of its settings."""
        if values.size:
            raise ValueError(f"{self.name} has no settings")
        return self

    @property
    def exact(self) -> tuple[str, ...]:
        """Names of the outputs whose exact derivatives cost hardly more than they do."""
        return ()

    @property
    def stated_rate(self) -> float:
        """Units a second that its effort is counted at, assumed: no clock is read [1/s]."""
        return 20_000.0

    @property
    def differentiable(self) -> tuple[str, ...]:
        """Names of the outputs whose exact derivatives cost much more than they do, and are asked of few samples."""
        return ()

    def derivatives(self, output: str, x: Samples) -> SettingDerivatives:
        """Return an output of `exact` or `differentiable` of every sample with its derivatives."""
        raise ValueError(f"{self.name} knows no exact derivatives of {output} at {x.shape[0]} samples")

    def observed(self, observe: Observer) -> Model:  # noqa: ARG002
        """Return the model that tells someone the statuses of each chunk; a model may not care."""
        return self

    def mapped(self, mapper: Mapper) -> Model:  # noqa: ARG002
        """Return the model whose chunks of samples a mapper solves; `tolalloc.running.chunks` has one."""
        return self

    @property
    def conditions(self) -> Mapping[str, float | str]:
        """Under which conditions it answers, units in the names."""
        return {}

    @property
    def operating_conditions(self) -> tuple[Setting, ...]:
        """Those of its conditions that a user may vary, which change no part: a torque and not a name."""
        return ()

    @property
    def content(self) -> Any:
        """What tells it from other models, for the digest of a study: all that it is made of; its ``repr`` counts."""
        return identity(self)

    @property
    def uncertain(self) -> tuple[CorrelatedSource, ...]:
        """What is not known of the model itself and stands on no drawing; a column is ln of a factor, 0 as assumed."""
        return ()

    def with_uncertain(self, outputs: tuple[str, ...]) -> Response:
        """Return the response of these outputs with the columns of `uncertain` after its own."""
        return self.reading(outputs)

    def changed(self, change: Float[np.ndarray, " uncertain_column"]) -> Model:
        """Return the model with other values in the columns of `uncertain`, exactly and for all units."""
        if change.size:
            raise ValueError(f"nothing is uncertain of {self.name}")
        return self

    @property
    def accuracy(self) -> Mapping[str, float]:
        """Output → how well it answers for it; no smaller difference means anything [unit of the output]."""
        return {}

    @property
    def spectra(self) -> Mapping[float, tuple[str, str]]:
        """Order → names of the outputs that hold its cosine and sine, for models with a periodic curve.

        `reading` knows them beside `outputs`.
        """
        return {}

    def stand_ins(self) -> tuple[Any, ...]:
        """Return surrogates that know the model's structure, `tolalloc.sensitivity.surrogate.validation.Candidate`."""
        return ()

    @property
    def drawn_amounts(self) -> DrawnAmounts:
        """What a drawing says of the settings; the settings themselves unless a model says otherwise."""
        settings = self.settings
        return DrawnAmounts(
            names=tuple(setting.name for setting in settings),
            by_setting=np.eye(len(settings)),
            steps=tuple(setting.step for setting in settings),
        )

    @property
    def ranked(self) -> tuple[str, ...]:
        """Outputs that every ranking looks at; others, that cost more than they tell, once they are limited."""
        return self.outputs

    @property
    def own_limits(self) -> Mapping[str, float]:
        """Output → largest value at which a unit works at all: a requirement of every study that does not lift it."""
        return {}

    def examined(self, x: Samples) -> Mapping[str, float]:  # noqa: ARG002
        """Return what is counted of some random units when a study is checked, units in the names."""
        return {}

    def release(self) -> None:  # noqa: B027
        """Let go of what is made again when it is needed, such as tables; a model may have no such thing."""


def derived(model: Model, output: str, deviation: Float[np.ndarray, " column"]) -> ResponseWithDerivatives:
    """Return an output of a model with its derivatives by the columns, whose standard deviations make the steps."""
    if output in (*model.exact, *model.differentiable):
        return _Exact(model=model, output=output)
    return DifferencedResponse(response=model.reading((output,)), output=output, steps=_STEP * deviation)


@dataclass(frozen=True, kw_only=True)
class _Exact:
    """An output with the exact derivatives that its model knows."""

    model: Model
    output: str

    @property
    def columns(self) -> tuple[str, ...]:
        return self.model.columns

    def with_derivatives(self, x: Samples) -> SettingDerivatives:
        return self.model.derivatives(self.output, x)


@dataclass(frozen=True, kw_only=True)
class DifferencedResponse:
    """One output of a response that knows no derivatives.

    A sample with derivatives costs one answer and two for every column. The truncation falls with the square of the
    step; across a kink a difference is a mean of both sides.
    """

    response: Response  # What answers
    output: str  # Name of the output with its unit
    steps: Float[np.ndarray, " column"]  # Step of every column to either side [unit of the column]

    def __post_init__(self) -> None:
        UnknownNameError.require("derivatives", "output", self.output, self.response.outputs)
        if not (self.steps > 0.0).all():
            raise InputError.at("derivatives", "steps", float(self.steps.min()), "above 0")

    @property
    def columns(self) -> tuple[str, ...]:
        """The response's columns."""
        return self.response.columns

    def with_derivatives(self, x: Samples) -> SettingDerivatives:
        """Return the output of every sample and its derivatives, NaN by neighbours that failed, all in one call."""
        columns = len(self.columns)
        shifts = np.concatenate([np.zeros((1, columns)), np.diag(self.steps), -np.diag(self.steps)])
        found = self.response((x[:, np.newaxis] + shifts).reshape(-1, columns))
        found = replace(found, values=found.values[:, [self.response.outputs.index(self.output)]])
        values, status = found.values.reshape(-1, shifts.shape[0]), found.status.reshape(-1, shifts.shape[0])
        slopes = (values[:, 1 : columns + 1] - values[:, columns + 1 :]) / (2 * self.steps)
        good = found.good.reshape(status.shape)[:, 1:].reshape(-1, 2, columns).all(axis=1)
        return SettingDerivatives(
            # The status is the worst one of the sample and of its neighbours.
            evaluation=Evaluation(values=values[:, :1], status=status.max(axis=1)),
            by_column=np.where(good, slopes, np.nan),
            by_setting=np.empty((x.shape[0], 0)),
        )


def is_fast(model: Model) -> bool:
    """Return whether a million units take seconds, as of a function that takes whole arrays."""
    return model.stated_rate >= ARRAY_RATE


def installed_model(name: str) -> ModelSource:
    """Return a model that another installed package brings, by its name.

    Raises
    ------
    UnknownNameError
        No package brings a model of that name.
    """
    known = plugins("models", (), ("bound", "name"))
    UnknownNameError.require("ta.installed_model", "model", name, known)
    found: ModelSource = known[name]
    return found


@runtime_checkable
class HasCopies(Protocol):
    """A model source some of whose parts are copies of each other, made to one drawing."""

    def shared_lines(self, stated: Mapping[str, Hashable]) -> Mapping[str, str]:
        """Return the line of the drawing, part and feature, of every source that is one of several copies.

        Copies of which the table states different things, by source, have lines of their own.
        """


@runtime_checkable
class ModelSource(Protocol):
    """What a study names as its model: it becomes a `Model` once the drawing says what varies."""

    @property
    def name(self) -> str:
        """What a report calls the model."""

    @property
    def source_names(self) -> Sequence[str]:
        """Names of all sources that it knows, of which a row for several like places means some."""

    def leaving_out(self, patterns: Sequence[str]) -> ModelSource:
        """Return the same that takes as exact what a drawing leaves out of the sources that patterns name, too."""

    def bound(self, errors: ErrorModel, place: str) -> Model:
        """Return the model at the sources of a drawing, none unknown and none wanting; nothing is solved."""

    def set_to(self, settings: Mapping[str, float]) -> ModelSource:
        """Return the same at other values of its settings and operating conditions [units of their names]."""

"""The equivalent model as a response: peak-to-peak transmission error of every sample."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import Evaluation, Observer, unobserved
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.equivalent.answers import Derivatives, Extremes
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Modification
from tolalloc.running.chunks import Mapper, map_chunks


@dataclass(frozen=True, kw_only=True)
class WithDerivatives:
    """Answers of the kernel with the exact derivative of the peak-to-peak."""

    evaluation: Evaluation  # Peak-to-peak and status of every sample
    by_column: Float[np.ndarray, "sample column"]  # Derivative by every varied column [arcsec/m]
    by_modification: Float[np.ndarray, "sample 2"]  # By the equidistant and the shift amount [arcsec/m]
    # Derivative by the relative change of each stiffness of `tolalloc.reducers.reducer.stiffness.Stiffness` [arcsec]
    by_stiffness: dict[str, Float[np.ndarray, " sample"]]


@dataclass(frozen=True, kw_only=True)
class KernelResponse:
    """Peak-to-peak transmission error on the real model.

    Raises
    ------
    UnknownNameError
        A column that the model does not have.
    InputError
        A column of the model that is neither varied nor fixed.
    """

    model: EquivalentModel  # The equivalent model
    torque: float  # Torque on the carrier, negative resists the rotation [N·m]
    columns: tuple[str, ...]  # Columns that vary, in the order of X
    # Value of every other column of the model, and what a column that varies varies around: the amounts of the
    # modification, which a row of a tolerance table lets deviate [m]
    fixed: Mapping[str, float]
    offsets: Mapping[str, float] = field(default_factory=dict)  # Added to columns that are fixed [m]
    observe: Observer = unobserved  # Told the statuses of each chunk
    mapper: Mapper = map  # What solves the chunks, `tolalloc.running.chunks.map_chunks`

    def __post_init__(self) -> None:
        known, given = set(self.model.columns), {*self.columns, *self.fixed}
        for name in (*self.columns, *self.fixed):
            if name not in known:
                raise UnknownNameError.among(f"errors of {self.model.reducer.name}", "source", name, known)
        missing = [name for name in self.model.columns if name not in given]
        if missing:
            raise InputError(
                f"errors of {self.model.reducer.name}: {missing[0]} (the first of {len(missing)} columns) is not "
                "given; add its source to the tolerance table or name it under neglected in the study."
            )

    @property
    def outputs(self) -> tuple[str, ...]:
        """The one output."""
        return (PEAK_TO_PEAK,)

    def with_modification(self, modification: Modification) -> KernelResponse:
        """Return the response of the same reducer with another tooth modification."""
        return replace(self, fixed={**self.fixed, **modification.deviations})

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the peak-to-peak of every sample [arcsec]."""
        values, status = np.empty((x.shape[0], 1)), np.empty(x.shape[0], np.uint8)
        for rows, extremes in map_chunks(self.alone._extremes, x, self.mapper):
            values[rows, 0] = extremes.peak_to_peak / ARCSECOND
            status[rows] = extremes.status
            self.observe(extremes.status)
        return Evaluation(values=values, status=status)

    def with_derivatives(self, x: Float[np.ndarray, "sample column"]) -> WithDerivatives:
        """Return the peak-to-peak of every sample and its derivatives, at hardly more cost than without."""
        values, status = np.empty((x.shape[0], 1)), np.empty(x.shape[0], np.uint8)
        by_column, by_modification = np.empty(x.shape), np.empty((x.shape[0], 2))
        by_stiffness: dict[str, Float[np.ndarray, " sample"]] = defaultdict(lambda: np.empty(x.shape[0]))
        for rows, (extremes, derivatives) in map_chunks(self.alone._derivatives, x, self.mapper):
            values[rows, 0] = extremes.peak_to_peak / ARCSECOND
            status[rows] = extremes.status
            by_column[rows] = derivatives.by_error[:, : len(self.columns)] / ARCSECOND
            by_modification[rows] = derivatives.by_error[:, len(self.columns) :] / ARCSECOND
            for name, derivative in derivatives.by_stiffness.items():
                by_stiffness[name][rows] = derivative / ARCSECOND
            self.observe(extremes.status)
        return WithDerivatives(
            evaluation=Evaluation(values=values, status=status),
            by_column=by_column,
            by_modification=by_modification,
            by_stiffness=dict(by_stiffness),
        )

    @property
    def alone(self) -> KernelResponse:
        """The response without what must stay in this process."""
        return replace(self, observe=unobserved, mapper=map)

    def put_away(self) -> None:
        """Let go of the model's tables."""
        self.model.put_away()

    def _extremes(self, x: Float[np.ndarray, "chunk column"]) -> Extremes:
        return self.model.extremes(self.errors(x), self.torque)

    def _derivatives(self, x: Float[np.ndarray, "chunk column"]) -> tuple[Extremes, Derivatives]:
        """Return the extremes of a chunk and their derivatives, of the columns those that vary and the amounts alone.

        What is asked for is a fraction of all columns, and a chunk's answer is kept in a file or sent by a worker.
        """
        extremes, found = self.model.peak_to_peak_derivatives(self.errors(x), self.torque)
        asked = [
            self.model.columns.index(name) for name in (*self.columns, *self.model.reducer.modification.deviations)
        ]
        return extremes, replace(found, by_error=found.by_error[:, asked])

    def errors(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample all_columns"]:
        """Return the varied columns and the fixed ones together, in the order of the model [m].

        A column that is both deviates from its fixed value.
        """
        where = {name: at for at, name in enumerate(self.model.columns)}
        errors = np.zeros((x.shape[0], len(where)))
        for name, value in self.fixed.items():
            errors[:, where[name]] = value
        errors[:, [where[name] for name in self.columns]] += x
        for name, offset in self.offsets.items():
            errors[:, where[name]] += offset
        return errors

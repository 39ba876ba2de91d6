"""Fresh random units of one design: their outputs, the derivatives of these, and the worst unit inside the zones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.capability.worst_unit import worst_unit
from tolalloc.differences import DifferencedResponse
from tolalloc.drawing.seeds import SeedTree
from tolalloc.model import Evaluation
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse, WithDerivatives
from tolalloc.rv.response.outputs import REQUIREMENTS, OutputsResponse
from tolalloc.units import MICROMETRE

_SCALE_STEP = 0.05
"""Step of a scale to either side, over the scale [-]."""
_CLEARANCE_STEP = 0.1
"""Step of a clearance to either side [µm]."""
_COLUMN_STEP = 0.02
"""Step of a column to either side, over its standard deviation [-]."""


@dataclass(frozen=True, kw_only=True)
class FreshUnits:
    """Random units of one design.

    Parameters
    ----------
    space
        The design variables.
    kernel
        The real kernel.
    design
        Scales [-] and clearances [µm].
    standard
        Standard values of the units [-].
    outputs
        Names of the outputs besides the peak-to-peak.
    slope_units
        Units, the first ones, that the derivatives of these outputs are averaged over [-].
    seeds
        Node of the seed tree, for the worst units.
    """

    space: DesignSpace
    kernel: KernelResponse
    design: Float[np.ndarray, " variable"]
    standard: Float[np.ndarray, "unit column"]
    outputs: tuple[str, ...]
    slope_units: int
    seeds: SeedTree

    @cached_property
    def x(self) -> Float[np.ndarray, "unit column"]:
        """Deviations [m, angles rad]."""
        return self.space.errors.deviations(self.standard, self.space.zones(self.design))

    @cached_property
    def answers(self) -> WithDerivatives:
        """Peak-to-peak with its exact derivatives."""
        return self._kernel_at(self.design).with_derivatives(self.x)

    @cached_property
    def sample(self) -> MonteCarlo:
        """The units with their peak-to-peak."""
        return MonteCarlo(x=self.x, evaluation=self.answers.evaluation)

    @cached_property
    def others(self) -> Evaluation:
        """The other outputs, in the order of their names; a unit is good if all of them are."""
        found = self._others_at(self.design)(self.x)
        return Evaluation(values=found.values[:, self._columns], status=found.status)

    def values(self, output: str) -> Float[np.ndarray, " unit"]:
        """Return one output of every unit, NaN where it has none [unit of the output]."""
        evaluation, at = (
            (self.answers.evaluation, 0) if output == PEAK_TO_PEAK else (self.others, self.outputs.index(output))
        )
        return np.where(evaluation.good, evaluation.values[:, at], np.nan)

    @cached_property
    def by_zone(self) -> Float[np.ndarray, "good source"]:
        """Derivative of every good unit's peak-to-peak by the zones [arcsec/m]."""
        good, names = self.answers.evaluation.good, self.space.errors.source_of_column
        starts = [names.index(source.name) for source in self.space.errors.active]
        return np.asarray(np.add.reduceat(self.answers.by_column[good] * self.standard[good], starts, axis=1))

    def derived(self, output: str) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return an output of some units and its derivative by every variable [unit of the output]."""
        if output != PEAK_TO_PEAK:
            values, slopes = self._differences
            at = self.outputs.index(output)
            return values[:, at], slopes[:, at]
        good = self.answers.evaluation.good
        by_clearance = self.answers.by_modification[good] @ self.space.modification_by_clearance * MICROMETRE
        return self.values(output)[good], np.concatenate([self.space.by_scale(self.by_zone), by_clearance], axis=1)

    def worst(self, output: str, sense: Literal[1, -1]) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones and its derivative by every variable [unit of the output].

        Notes
        -----
        The worst unit moves with the design, but to first order its value does not feel that (envelope theorem).
        """
        kernel = self._kernel_at(self.design)
        response = kernel if output == PEAK_TO_PEAK else self._differenced(output)
        zones = self.space.zones(self.design)
        found = worst_unit(Experiment(response, self.space.errors, zones, self.seeds.child(output)), sense=sense)
        by_clearance = []
        for step in _CLEARANCE_STEP * np.eye(self.design.size)[-2:]:
            ends = [self._one(output, self.design + side * step, found.x) for side in (1, -1)]
            by_clearance.append((ends[0] - ends[1]) / (2 * _CLEARANCE_STEP))
        return found.value, np.append(self.space.by_scale(found.by_zone), by_clearance)

    @cached_property
    def _differences(
        self,
    ) -> tuple[Float[np.ndarray, "known output"], Float[np.ndarray, "known output variable"]]:
        """Other outputs of the first units, and their derivatives by central differences with the same units."""
        standard = self.standard[: self.slope_units]
        steps = np.append(_SCALE_STEP * self.design[:-2], [_CLEARANCE_STEP] * 2)
        slopes = np.empty((len(standard), len(self.outputs), steps.size))
        for at, step in enumerate(np.diag(steps)):
            ends = [self._others_of(self.design + side * step, standard) for side in (1, -1)]
            slopes[..., at] = (ends[0] - ends[1]) / (2 * steps[at])
        values = np.where(self.others.good[:, np.newaxis], self.others.values, np.nan)[: len(standard)]
        known = np.isfinite(values).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        return values[known], slopes[known]

    def _others_of(
        self, design: Float[np.ndarray, " variable"], standard: Float[np.ndarray, "unit column"]
    ) -> Float[np.ndarray, "unit output"]:
        """Return the other outputs of the units at another design, NaN where one has none."""
        found = self._others_at(design)(self.space.errors.deviations(standard, self.space.zones(design)))
        return np.where(found.good[:, np.newaxis], found.values, np.nan)[:, self._columns]

    def _one(self, output: str, design: Float[np.ndarray, " variable"], x: Float[np.ndarray, " column"]) -> float:
        """Return one output of one unit at another design's clearances [unit of the output]."""
        if output == PEAK_TO_PEAK:
            return float(self._kernel_at(design)(x[np.newaxis]).values[0, 0])
        return float(self._others_at(design)(x[np.newaxis]).values[0, self._columns[self.outputs.index(output)]])

    def _differenced(self, output: str) -> DifferencedResponse:
        steps = _COLUMN_STEP * self.x.std(axis=0)
        return DifferencedResponse(response=self._others_at(self.design), output=output, steps=steps)

    def _kernel_at(self, design: Float[np.ndarray, " variable"]) -> KernelResponse:
        return self.kernel.with_modification(self.space.modification(design))

    def _others_at(self, design: Float[np.ndarray, " variable"]) -> OutputsResponse:
        readings = tuple(reading for reading in REQUIREMENTS if not {*reading.outputs}.isdisjoint(self.outputs))
        return OutputsResponse(kernel=self._kernel_at(design), readings=readings)

    @property
    def _columns(self) -> list[int]:
        """Where the other outputs stand among those of their readings."""
        return [self._others_at(self.design).outputs.index(output) for output in self.outputs]


@dataclass(frozen=True, kw_only=True)
class OutputTrial:
    """What fresh units of a design say of one output; a `tolalloc.allocation.requirement.Trial`.

    Parameters
    ----------
    units
        The units.
    output
        Name of the output with its unit.
    """

    units: FreshUnits
    output: str

    @property
    def design(self) -> Float[np.ndarray, " variable"]:
        """Scales [-] and clearances [µm]."""
        return self.units.design

    @cached_property
    def values(self) -> Float[np.ndarray, " unit"]:
        """The output of the units that have one [unit of the output]."""
        values = self.units.values(self.output)
        return np.asarray(values[np.isfinite(values)])

    @property
    def failed(self) -> int:
        """Number of units without a usable answer [-]."""
        return len(self.units.standard) - self.values.size

    def derived(self) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return the output of some units and its derivative by every variable [unit of the output]."""
        return self.units.derived(self.output)

    def worst(self, sense: Literal[1, -1]) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones and its derivative by every variable [unit of the output]."""
        return self.units.worst(self.output, sense)

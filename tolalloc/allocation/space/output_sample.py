"""Random units of one design: their outputs, the derivatives of these, and the worst unit inside the zones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearFunction, LinearLaw
from tolalloc.capability.monte_carlo import CONFIDENCE, MonteCarlo
from tolalloc.capability.near_limit import SolvedUnits
from tolalloc.capability.worst_unit import worst_unit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.models.differences import derived
from tolalloc.models.model import Evaluation, Model, ResponseWithDerivatives, SettingDerivatives

_EVEN_ODDS = 0.5


@dataclass(frozen=True, kw_only=True)
class LimitedSample:
    """Units of one output with its limits."""

    values: Float[np.ndarray, " solved"]  # Of every solved unit, not a number where it has none [unit of the output]
    units: SolvedUnits  # Which of the drawn units they are
    limits: Limits  # [unit of the output]
    law: LinearLaw | None = None  # Law of the output, known before these units were drawn or the same units' own
    leaving: int = 0  # Units solved whatever was predicted whose value the law does not give [-]

    @classmethod
    def all_of(cls, values: Float[np.ndarray, " unit"], limits: Limits, law: LinearLaw | None = None) -> LimitedSample:
        """Return plain random units, all of which were solved."""
        return cls(values=values, units=SolvedUnits.all_of(values.size), limits=limits, law=law)

    @property
    def excess(self) -> Float[np.ndarray, " solved"]:
        """How far every unit lies beyond the limits, negative inside, infinite without a value [unit of the output]."""
        found = np.max([sign * (self.values - limit) for sign, limit in self.limits.turned], axis=0)
        return np.where(np.isfinite(found), found, np.inf)

    @property
    def plain(self) -> Float[np.ndarray, " good"]:
        """Values of the units that were solved whatever was predicted of them [unit of the output]."""
        return np.asarray(self.values[self.units.whatever & np.isfinite(self.values)])

    def most_leaving(self, confidence: float) -> float:
        """Return the largest share of units that the law may be wrong of, with one-sided confidence [-].

        Clopper–Pearson's bound (1934), the quantile of a beta distribution with parameters k + 1 and n − k for k of n
        units that leave the law; at one half the share of these units itself.

        Examples
        --------
        >>> sample = LimitedSample.all_of(np.zeros(1000), Limits(upper=1.0))
        >>> round(sample.most_leaving(0.95), 6)  # 1 − 0.05^(1/1000)
        0.002991
        """
        from scipy.stats import beta

        units = self.units.drawn.whatever
        if confidence <= _EVEN_ODDS:
            return self.leaving / units
        return float(beta.ppf(confidence, self.leaving + 1, units - self.leaving)) if self.leaving < units else 1.0


_SCALE_STEP = 0.05
"""Step of a scale to either side, over the scale [-]."""


@dataclass(frozen=True, kw_only=True)
class DesignSample:
    """Random units of one design."""

    space: DesignSpace  # The design variables
    model: Model  # The real model
    design: Float[np.ndarray, " variable"]  # Scales [-] and settings
    standard: Float[np.ndarray, "unit column"]  # Standard values of the units [-]
    outputs: tuple[str, ...]  # Names of the outputs, the leading one first
    # Units, the first ones, over which derivatives that the model does not know exactly are averaged [-]
    slope_units: int
    derivative_units: int  # Units, the first ones, whose exact derivatives are asked for [-]
    seeds: SeedTree  # Node of the seed tree, for the worst units

    @cached_property
    def x(self) -> Float[np.ndarray, "unit column"]:
        """Deviations [m, angles rad]."""
        return self.space.errors.deviations(self.standard, self.space.zones(self.design))

    @cached_property
    def exact(self) -> dict[str, SettingDerivatives]:
        """Outputs whose derivatives the model knows exactly, of the first units."""
        model, first = self._at(self.design), self.x[: self.derivative_units]
        return {output: model.derivatives(output, first) for output in self.outputs if output in model.exact}

    @cached_property
    def _rest(self) -> Evaluation:
        """The same outputs of the other units."""
        return self._at(self.design).reading(tuple(self.exact))(self.x[self.derivative_units :])

    @cached_property
    def _others(self) -> tuple[str, ...]:
        """Names of the other outputs."""
        return tuple(output for output in self.outputs if output not in self.model.exact)

    @cached_property
    def others(self) -> Evaluation:
        """The other outputs, in the order of their names; a unit is good if all of them are."""
        return self._at(self.design).reading(self._others)(self.x)

    def evaluation(self, output: str) -> Evaluation:
        """Return one output of every unit."""
        if output in self.exact:
            first = self.exact[output].evaluation
            if self.derivative_units >= len(self.standard):
                return first
            own = self._rest.values[:, [[*self.exact].index(output)]]
            return Evaluation(
                values=np.concatenate([first.values[:, :1], own]),
                status=np.concatenate([first.status, self._rest.status]),
            )
        at = self._others.index(output)
        return Evaluation(values=self.others.values[:, [at]], status=self.others.status)

    @cached_property
    def samples(self) -> tuple[MonteCarlo, ...]:
        """The units with every output that is solved on its own, the leading one first."""
        first = MonteCarlo(x=self.x, evaluation=self.evaluation(self.outputs[0]))
        rest = [MonteCarlo(x=self.x, evaluation=self.evaluation(name)) for name in [*self.exact][1:]]
        others = [MonteCarlo(x=self.x, evaluation=self.others)] if self._others else []
        return (first, *rest, *others)

    def values(self, output: str) -> Float[np.ndarray, " unit"]:
        """Return one output of every unit, NaN where it has none [unit of the output]."""
        evaluation = self.evaluation(output)
        return np.where(evaluation.good, evaluation.values[:, 0], np.nan)

    @cached_property
    def laws(self) -> dict[str, LinearLaw]:
        """Law of every output that is linear in the deviations, as far as these units tell."""
        errors, zones = self.space.errors, self.space.zones(self.design)
        planes = {output: LinearFunction.through(self.x, self.values(output)) for output in self.outputs}
        found = {output: LinearLaw.of(plane, errors, zones) for output, plane in planes.items() if plane}
        return {output: law for output, law in found.items() if law}

    def sensitivity(self, output: str) -> Float[np.ndarray, " source"]:
        """Return the change of an output with a deviation of each source; one of `exact` [unit of the output per m].

        Of a source of one column the mean over the units, with its sign; of any other the root mean square length of
        the gradient, as its direction is random. An angle counts as the length that its zone limits.
        """
        found, errors = self.exact[output], self.space.errors
        by_column, slopes = found.by_column[found.evaluation.good], []
        for source, own in zip(errors.active, errors.columns_of_source, strict=False):
            part = by_column[:, own] / source.lever
            alone = part.shape[1] == 1
            slopes.append(float(part.mean()) if alone else float(np.sqrt((part**2).sum(axis=1).mean())))
        return np.array(slopes)

    def by_zone(self, output: str) -> Float[np.ndarray, "good source"]:
        """Return the derivative of every good unit's output by the zones; one of `exact` [unit of the output per m].

        Theory page, equation (23): a deviation is its zone times a standard value, so ∂y/∂zone = Σ ∂y/∂xᵢ·standardᵢ.
        """
        return self._by_zone(self.exact[output])

    def _by_zone(self, found: SettingDerivatives) -> Float[np.ndarray, "good source"]:
        good, names = found.evaluation.good, self.space.errors.source_of_column
        starts = [names.index(source.name) for source in self.space.errors.active]
        moved = found.by_column[good] * self.standard[: good.size][good]
        return np.asarray(np.add.reduceat(moved, starts, axis=1))

    def _slopes(self, found: SettingDerivatives) -> Float[np.ndarray, "first variable"]:
        """Return the derivatives of the first units by every variable, NaN where a unit has none."""
        good = found.evaluation.good
        slopes = np.full((good.size, self.design.size), np.nan)
        by_scale = self.space.by_scale(self._by_zone(found))
        slopes[good] = np.concatenate([by_scale, found.by_setting[good]], axis=1)
        return slopes

    def derived(self, output: str) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return an output of some units and its derivative by every variable [unit of the output]."""
        values, slopes = self.of_first(output)
        known = np.isfinite(values) & np.isfinite(slopes).all(axis=1)
        return values[known], slopes[known]

    def of_first(self, output: str) -> tuple[Float[np.ndarray, " first"], Float[np.ndarray, "first variable"]]:
        """Return an output of the first units and its derivative by every variable, NaN where a unit has none."""
        if output not in self.exact:
            values, slopes = self._others_of_first
            at = self._others.index(output)
            return values[:, at], slopes[:, at]
        slopes = self._slopes(self.exact[output])
        return self.values(output)[: len(slopes)], slopes

    def worst(self, output: str, sense: Literal[1, -1]) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones and its derivative by every variable [unit of the output].

        Notes
        -----
        The worst unit moves with the design, but to first order its value does not feel that (envelope theorem).
        """
        zones = self.space.zones(self.design)
        experiment = Experiment(self._differentiable(output), self.space.errors, zones, self.seeds.child(output))
        found = worst_unit(experiment, sense=sense)
        return found.value, np.append(self.space.by_scale(found.by_zone), self._by_setting(output, found.x))

    def linear(self, output: str) -> tuple[float, Float[np.ndarray, " source"], Float[np.ndarray, " setting"]]:
        """Return the output of the nominal unit, what each source adds to it at its limit, and its change by settings.

        Raises
        ------
        InputError
            A source whose zone is neither a size nor a position, which has no single limit.
        """
        errors, zones = self.space.errors, self.space.zones(self.design)
        for source in errors.active:
            if source.feature not in (Feature.SIZE, Feature.POSITION):
                raise InputError(
                    f"{source.name}: a root-sum-square guarantee takes sizes and positions; its feature is "
                    f"{source.feature.value}. Ask for a yield or a Cpk instead."
                )
        nominal = errors.deviations(np.zeros((1, len(errors.columns))), zones)
        found = self._differentiable(output).with_derivatives(nominal)
        slopes = [np.linalg.norm(found.by_column[0, own]) for own in errors.columns_of_source[: len(errors.active)]]
        limits = zones / 2 / np.array([source.lever for source in errors.active])
        return float(found.evaluation.values[0, 0]), np.array(slopes) * limits, self._by_setting(output, nominal[0])

    def _by_setting(self, output: str, x: Float[np.ndarray, " column"]) -> Float[np.ndarray, " setting"]:
        """Return the derivative of one unit's output by the settings, by central differences."""
        slopes, model = [], self.model
        present = self.space.settings_of(self.design)
        for step, size in zip(np.diag(self.space.setting_steps), self.space.setting_steps, strict=True):
            ends = [model.at(present + side * step).reading((output,))(x[np.newaxis]) for side in (1, -1)]
            slopes.append((float(ends[0].values[0, 0]) - float(ends[1].values[0, 0])) / (2 * size))
        return np.array(slopes)

    @cached_property
    def _others_of_first(
        self,
    ) -> tuple[Float[np.ndarray, "first output"], Float[np.ndarray, "first output variable"]]:
        """Other outputs of the first units, and their derivatives."""
        standard, model = self.standard[: self.slope_units], self._at(self.design)
        slopes = {
            output: self._slopes(model.derivatives(output, self.x[: len(standard)]))
            for output in self._others
            if output in model.differentiable
        }
        if rest := tuple(output for output in self._others if output not in slopes):
            slopes |= dict(zip(rest, self._differences(rest, standard), strict=True))
        values = np.where(self.others.good[:, np.newaxis], self.others.values, np.nan)[: len(standard)]
        return values, np.stack([slopes[output] for output in self._others], axis=1)

    def _differences(
        self, outputs: tuple[str, ...], standard: Float[np.ndarray, "unit column"]
    ) -> Float[np.ndarray, "output unit variable"]:
        """Return the derivatives of outputs by central differences with the same units, NaN where one has none."""
        groups = len(self.space.groups)
        steps = np.append(_SCALE_STEP * self.design[:groups], self.space.setting_steps)
        slopes = np.empty((len(outputs), len(standard), steps.size))
        for at, step in enumerate(np.diag(steps)):
            ends = []
            for design in (self.design + step, self.design - step):
                deviations = self.space.errors.deviations(standard, self.space.zones(design))
                found = self._at(design).reading(outputs)(deviations)
                ends.append(np.where(found.good[:, np.newaxis], found.values, np.nan))
            slopes[..., at] = (ends[0] - ends[1]).T / (2 * steps[at])
        return slopes

    def _differentiable(self, output: str) -> ResponseWithDerivatives:
        """Return the output at the design with derivatives by the columns, exact ones where the model knows them."""
        return derived(self._at(self.design), output, self.x.std(axis=0))

    def _at(self, design: Float[np.ndarray, " variable"]) -> Model:
        return self.model.at(self.space.settings_of(design))


@dataclass(frozen=True, kw_only=True)
class OutputSample:
    """What random units of a design say of one output, which guarantees compare with its limits."""

    units: DesignSample  # The units
    output: str  # Name of the output with its unit
    confidence: float = CONFIDENCE  # With which a guarantee must be shown, one-sided; one half is even odds [-]

    @property
    def design(self) -> Float[np.ndarray, " variable"]:
        """Scales [-] and settings."""
        return self.units.design

    @property
    def groups(self) -> int:
        """Number of scales; what follows them in a design are the settings [-]."""
        return len(self.units.space.groups)

    @cached_property
    def values(self) -> Float[np.ndarray, " unit"]:
        """The output of the units that have one [unit of the output]."""
        values = self.units.values(self.output)
        return np.asarray(values[np.isfinite(values)])

    @property
    def failed(self) -> int:
        """Number of units without a usable answer [-]."""
        return len(self.units.standard) - self.values.size

    def limited(self, limits: Limits) -> LimitedSample:
        """Return what the units say of limits; a search solves all of them."""
        return LimitedSample.all_of(np.append(self.values, np.full(self.failed, np.nan)), limits, self.law)

    @property
    def law(self) -> LinearLaw | None:
        """The law of the output, where it is linear."""
        return self.units.laws.get(self.output)

    def derived(self) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return the output of some units and its derivative by every variable [unit of the output]."""
        return self.units.derived(self.output)

    def worst(self, sense: Literal[1, -1]) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones and its derivative by every variable [unit of the output]."""
        return self.units.worst(self.output, sense)

    def linear(self) -> tuple[float, float, Float[np.ndarray, " group"], Float[np.ndarray, " setting"]]:
        """Return the nominal output, what locked zones and each group add in quadrature, and its change by settings.

        All to first order [unit of the output].
        """
        value, added, by_setting = self.units.linear(self.output)
        group = self.units.space.group_of_source
        own = np.array([np.linalg.norm(added[group == at]) for at in range(self.groups)])
        return value, float(np.linalg.norm(added[group < 0])), own, by_setting

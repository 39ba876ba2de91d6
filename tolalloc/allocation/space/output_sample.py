"""Random units of one design: their outputs, the derivatives of these, and the worst unit inside the zones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.tail import FurthestUnits, tail_units
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.halving import halved
from tolalloc.capability.indices import Limits
from tolalloc.capability.linear_function import LinearFunction, LinearLaw, NearPlane
from tolalloc.capability.monte_carlo import CONFIDENCE, MonteCarlo, ProcessUncertainty
from tolalloc.capability.near_limit import SolvedUnits, largest_first
from tolalloc.capability.worst_unit import worst_unit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Model, ResponseWithDerivatives, SettingDerivatives, derived, is_fast
from tolalloc.sensitivity.derivatives import mean_slope

_EVEN_ODDS, _TENTH = 0.5, 0.1
_FURTHER, _SURELY = 4, 200
"""Units that are compared with planes: so many times the share that may fail, and so many more [-]."""
_HALVINGS = 40
_MISSED, _ROUNDED = 0.005, 1e-12
"""Most of the way from the nominal unit to the worst one by which an ascent may have missed it, and of its value what
sums in another order may differ by [-]."""
_STEP, _NEAREST = 1e-3, 100
"""Step of the derivative of a share by law, over the range of the furthest units, and units that tell it otherwise [-].
"""


@dataclass(frozen=True, kw_only=True)
class ControlPlane:
    """A plane through an output whose law is known: what units say beside it bounds what they do.

    Notes
    -----
    A control variate of the share of failures: P(fails) = Σ P(plane beyond) + E[V], V = 1 for a unit that fails though
    no plane calls it, −1 or less for one that more planes call than fail. Nothing is believed of the planes, whose
    shares are exact; the better they are, the fewer units have a V (Law & Kelton, Simulation Modeling and Analysis).
    """

    near: NearPlane  # At the zones of the design; of the output itself where it is linear
    values: Float[np.ndarray, " solved"]  # What it says of the units [unit of the output]
    limits: Limits  # [unit of the output]
    relative: bool = False  # Whether an excess is one over the limit [-]

    @cached_property
    def excess(self) -> Float[np.ndarray, " solved"]:
        """How far every unit lies beyond the limits by the plane [unit of the output, or -]."""
        return np.asarray(self.limits.excess(self.values, relative=self.relative).max(axis=0))

    def share(self, by: float) -> float:
        """Return the share of units that the plane has further beyond a limit than so far [-]."""
        sides = [(sign, limit, (abs(limit) or 1.0) if self.relative else 1.0) for sign, limit in self.limits.turned]
        return sum(self.near.share_above(sign, limit + sign * by * scale) for sign, limit, scale in sides)


def _half(error: float) -> float:
    """Return the error of each of two kinds of units that together err no more than so much [-].

    Notes
    -----
    Half of it up to 10 %. Above, where a search with few units aims at what a test with many takes, 1 − Φ(1.28·z) with
    the z of the error: like that of one kind it falls to the estimate itself at even odds, in proportion to z. 1.28 is
    z(5 %)/z(10 %), and z·√(s₁² + s₂²) ≤ 1.28·z·(s₁ + s₂) for the standard errors s of the kinds (own derivation).

    Examples
    --------
    >>> _half(0.05), round(_half(0.1), 6), round(_half(0.33), 3), _half(0.5)
    (0.025, 0.05, 0.286, 0.5)
    """
    from scipy.special import ndtr, ndtri

    if error <= _TENTH:
        return error / 2
    return float(ndtr(ndtri(_TENTH / 2) / ndtri(_TENTH) * ndtri(error)))


@dataclass(frozen=True, kw_only=True)
class ControlResiduals:
    """Units of which planes say something else than the units themselves, and what the planes say of all units."""

    units: int  # All [-]
    more: int  # That fail though no plane calls them [-]
    fewer: int  # That more planes call than fail [-]
    sum: int  # Of V [-]
    by_law: float  # Σ of the shares that the planes call [-]

    @classmethod
    def among(
        cls, fails: Bool[np.ndarray, " unit"], called: Int[np.ndarray, " unit"], by_law: float, units: int
    ) -> ControlResiduals:
        """Return those among units that hold all that fail or are called, of so many."""
        v = fails.astype(int) - called
        return cls(
            units=units,
            more=int(np.count_nonzero(v > 0)),
            fewer=int(np.count_nonzero(v < 0)),
            sum=int(v.sum()),
            by_law=by_law,
        )

    def share(self, confidence: float) -> float:
        """Return what fails at most, with one-sided confidence; at one half the estimate itself [-].

        Each kind of V takes half of the error, by Clopper–Pearson's bounds (1934); see `_half` for errors above 10 %.
        Below even odds it is what fails at least, of one output: where planes call a unit twice, V below −1 would make
        that too large.

        Examples
        --------
        >>> residuals = ControlResiduals(units=1000, more=0, fewer=0, sum=0, by_law=0.01)
        >>> round(residuals.share(0.95), 6)  # 0.01 + 1 − 0.025^(1/1000)
        0.013682
        """
        if confidence == _EVEN_ODDS:
            return self.by_law + self.sum / self.units
        tail = _half(min(confidence, 1 - confidence))
        if confidence > _EVEN_ODDS:
            return self.by_law + self._end(self.more, 1 - tail) - self._end(self.fewer, tail)
        return self.by_law + self._end(self.more, tail) - self._end(self.fewer, 1 - tail)

    def _end(self, count: int, at: float) -> float:
        """Return an end of the interval of the share of so many units, the upper one above one half [-]."""
        from scipy.stats import beta

        if at > _EVEN_ODDS:
            return float(beta.ppf(at, count + 1, self.units - count)) if count < self.units else 1.0
        return float(beta.ppf(at, count, self.units - count + 1)) if count else 0.0

    @property
    def standard_error(self) -> float:
        """Standard error of the estimate [-]."""
        return float(np.sqrt(self.more + self.fewer)) / self.units

    def bound_less_than(self, failed: int) -> bool:
        """Return whether the share of failures is bounded closer to its estimate than by counting those that failed.

        At 5 % error, where each kind of V has half of it: the planes must say more than that takes.

        Examples
        --------
        >>> few = ControlResiduals(units=10_000, more=4, fewer=4, sum=0, by_law=0.0027)
        >>> few.bound_less_than(27), replace(few, more=14, fewer=14).bound_less_than(27)
        (True, False)
        """
        counted = self._end(failed, CONFIDENCE) - failed / self.units
        return self.share(CONFIDENCE) - self.share(_EVEN_ODDS) < counted


@dataclass(frozen=True, kw_only=True)
class LimitedSample:
    """Units of one output with its limits."""

    values: Float[np.ndarray, " solved"]  # Of every solved unit, not a number where it has none [unit of the output]
    units: SolvedUnits  # Which of the drawn units they are
    limits: Limits  # [unit of the output]
    law: LinearLaw | None = None  # Law of the output, known before these units were drawn or the same units' own
    leaving: int = 0  # Units solved whatever was predicted whose value the law does not give [-]
    controls: tuple[ControlPlane, ...] = ()  # Planes near what is limited, none where not all units were solved
    uncertainty: ProcessUncertainty | None = None  # What measured parts leave open of what is limited

    @classmethod
    def all_of(
        cls,
        values: Float[np.ndarray, " unit"],
        limits: Limits,
        law: LinearLaw | None = None,
        controls: tuple[ControlPlane, ...] = (),
        uncertainty: ProcessUncertainty | None = None,
    ) -> LimitedSample:
        """Return plain random units, all of which were solved."""
        units = SolvedUnits.all_of(values.size)
        return cls(values=values, units=units, limits=limits, law=law, controls=controls, uncertainty=uncertainty)

    def side(self, sign: int) -> LimitedSample:
        """Return the units with the limit of one side."""
        limits = self.limits.side(sign)
        return replace(self, limits=limits, controls=tuple(replace(own, limits=limits) for own in self.controls))

    def controlled_excess(self, share: float, confidence: float) -> tuple[float, float]:
        """Return how far beyond the limits a share of units lies at most, and its standard error [unit of the excess].

        Parameters
        ----------
        share
            [-]
        confidence
            One-sided [-].

        Returns
        -------
        tuple
            Infinite where so few units show nothing.

        Notes
        -----
        By halving, in 40 steps, where `ControlResiduals.share` is the share; on the right side of the limits. Its error
        is that of the share over the density there, by the planes or by the units themselves, whichever is more.
        """
        own, planes = self._furthest(share)
        ends = np.maximum(own, planes.max(axis=0))
        finite = ends[np.isfinite(ends)]

        def residuals(by: float) -> ControlResiduals:
            called = sum(control.share(by) for control in self.controls)
            return ControlResiduals.among(own > by, (planes > by).sum(axis=0), called, self.values.size)

        if not finite.size or residuals(float(finite.max())).share(confidence) > share:
            return np.inf, np.nan
        low, high = float(finite.min()), float(finite.max())
        if low < 0 < high:
            low, high = (low, 0.0) if residuals(0.0).share(confidence) <= share else (0.0, high)
        high = float(halved(lambda by: residuals(by).share(confidence) <= share, high, low, _HALVINGS))
        step = _STEP * (float(np.ptp(finite)) or 1.0)
        by_law = sum(control.share(high - step) - control.share(high + step) for control in self.controls) / (2 * step)
        near = float(np.sort(np.abs(own - high))[min(_NEAREST, own.size) - 1])  # where planes are far, units are not
        by_units = min(_NEAREST, own.size) / (2 * max(near, step) * self.values.size)
        return high, residuals(high).standard_error / max(by_law, by_units)

    def _furthest(self, share: float) -> tuple[Float[np.ndarray, " few"], Float[np.ndarray, "control few"]]:
        """Return how far the units furthest beyond the limits lie, by themselves and by every plane.

        Some times the share of them: all that lie further beyond than the least of them are among them.
        """
        planes, excess = np.array([own.excess for own in self.controls]), self.excess
        few = largest_first(np.maximum(excess, planes.max(axis=0)), int(_FURTHER * share * excess.size) + _SURELY)
        return excess[few], planes[:, few]

    @cached_property
    def excess(self) -> Float[np.ndarray, " solved"]:
        """How far every unit lies beyond the limits, negative inside, infinite without a value [unit of the output]."""
        found = self.limits.excess(self.values).max(axis=0)
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
    """Random units of one design, whose moments and their gradient theory page equation (24) states."""

    space: DesignSpace  # The design variables
    model: Model  # The real model
    design: Float[np.ndarray, " variable"]  # Scales [-] and settings
    standard: Float[np.ndarray, "unit column"]  # Standard values of the units [-]
    outputs: tuple[str, ...]  # Names of the outputs, the leading one first
    # Units, the first ones, over which derivatives that the model does not know exactly are averaged [-]
    slope_units: int
    derivative_units: int  # Units, the first ones, whose exact derivatives are asked for [-]
    seeds: SeedTree  # Node of the seed tree, for the worst units
    tails: Mapping[str, tuple[Limits, float]]  # Output → its limits, and the share of units that may fail them [-]

    @cached_property
    def x(self) -> Float[np.ndarray, "unit column"]:
        """Deviations [m, angles rad]."""
        return self.space.errors.deviations(self.standard, self.space.zones(self.design))

    @cached_property
    def exact(self) -> dict[str, SettingDerivatives]:
        """Outputs whose derivatives the model knows exactly, of the first units."""
        first = np.arange(min(self.derivative_units, len(self.standard)))
        return {output: self._derivatives(output, first) for output in self.outputs if output in self.model.exact}

    @cached_property
    def _whole(self) -> dict[str, Evaluation]:
        """The same outputs of all units of a fast model without settings: one that is linear needs no derivatives."""
        if self.space.settings or not is_fast(self.model):
            return {}
        asked = (output for output in self.outputs if output in self.model.exact)
        return {output: self.model.reading((output,))(self.x) for output in asked}

    @cached_property
    def _linear(self) -> dict[str, LinearFunction]:
        """Outputs that are linear in the deviations, as far as these units tell."""
        return LinearFunction.through_each(self.x, {output: self.values(output) for output in self.outputs})

    def _derivatives(self, output: str, rows: Int[np.ndarray, " few"]) -> SettingDerivatives:
        if not (output in self._whole and output in self._linear):
            return self.at(self.design).derivatives(output, self.x[rows])
        whole, slopes = self._whole[output], self._linear[output].slopes
        return SettingDerivatives(
            evaluation=Evaluation(values=whole.values[rows], status=whole.status[rows]),
            by_column=np.broadcast_to(slopes, (rows.size, slopes.size)),
            by_setting=np.empty((rows.size, 0)),
        )

    @cached_property
    def _rest(self) -> Evaluation:
        """The same outputs of the other units."""
        return self.at(self.design).reading(tuple(self.exact))(self.x[self.derivative_units :])

    @cached_property
    def _others(self) -> tuple[str, ...]:
        """Names of the other outputs."""
        return tuple(output for output in self.outputs if output not in self.model.exact)

    @cached_property
    def others(self) -> Evaluation:
        """The other outputs, in the order of their names; a unit is good if all of them are."""
        return self.at(self.design).reading(self._others)(self.x)

    def evaluation(self, output: str) -> Evaluation:
        """Return one output of every unit."""
        if output in self._whole:
            return self._whole[output]
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
        return self.evaluation(output).known[:, 0]

    @cached_property
    def laws(self) -> dict[str, LinearLaw]:
        """Law of every output that is linear in the deviations, as far as these units tell."""
        errors, zones = self.space.errors, self.space.zones(self.design)
        found = {output: LinearLaw.of(plane, errors, zones) for output, plane in self._linear.items()}
        return {output: law for output, law in found.items() if law}

    @cached_property
    def nearest(self) -> dict[str, NearPlane]:
        """Plane near every output that one is near, its own where it is linear; of a fast model, whose units are many.

        What no plane is near to, or none near its limits, is judged by the units alone.
        """
        found = {output: NearPlane(law=law) for output, law in self.laws.items()}
        if is_fast(self.model):
            zones = self.space.zones(self.design)
            rest = [output for output in self.outputs if output not in found]
            near = {output: NearPlane.of(self.x, self.values(output), self.space.errors, zones) for output in rest}
            found |= {output: own for output, own in near.items() if own and self._says_more(own, output)}
        return found

    def _says_more(self, near: NearPlane, output: str) -> bool:
        """Return whether a plane says more than the units alone where the share lies that may be beyond the limits."""
        limits, share = self.tails[output]
        control = ControlPlane(near=near, values=near(self.x), limits=limits)
        excess = LimitedSample.all_of(self.values(output), limits).excess
        by = float(np.quantile(excess[np.isfinite(excess)], 1 - share))
        fails, called = excess > by, control.excess > by
        residuals = ControlResiduals.among(fails, called.astype(int), control.share(by), excess.size)
        return residuals.bound_less_than(int(np.count_nonzero(fails)))

    @cached_property
    def planes(self) -> dict[str, Float[np.ndarray, " unit"]]:
        """What these planes say of every unit [unit of the output]."""
        return {output: near(self.x) for output, near in self.nearest.items()}

    def uncertainty(self, values: Float[np.ndarray, " unit"]) -> ProcessUncertainty | None:
        """Return what measured parts leave open of what the units have, not a number where one has none."""
        uncertainty_of = ProcessUncertainty.about(self.space.errors, self.x)
        return uncertainty_of(values) if uncertainty_of else None

    def sensitivity(self, output: str) -> Float[np.ndarray, " source"]:
        """Return the change of an output with a deviation of each source; one of `exact` [unit of the output per m].

        By `mean_slope` over the units. An angle counts as the length that its zone limits.
        """
        found, errors = self.exact[output], self.space.errors
        by_column = found.by_column[found.evaluation.good]
        columns = zip(errors.active, errors.columns_of_source, strict=False)
        return np.array([mean_slope(by_column[:, own] / source.lever) for source, own in columns])

    def by_zone(self, output: str) -> Float[np.ndarray, "good source"]:
        """Return the derivative of every good unit's output by the zones; one of `exact` [unit of the output per m].

        Theory page, equation (23): a deviation is its zone times a standard value, so ∂y/∂zone = Σ ∂y/∂xᵢ·standardᵢ,
        with the standard values as parts are arranged at assembly.
        """
        return self._by_zone(self.exact[output], self.standard)

    def _by_zone(
        self, found: SettingDerivatives, standard: Float[np.ndarray, "unit column"]
    ) -> Float[np.ndarray, "good source"]:
        good, names = found.evaluation.good, self.space.errors.source_of_column
        starts = [names.index(source.name) for source in self.space.errors.active]
        arranged = self.space.errors.by_zone(standard[: good.size], self.space.zones(self.design))
        moved = found.by_column[good] * arranged[good]
        return np.asarray(np.add.reduceat(moved, starts, axis=1))

    def _slopes(
        self, found: SettingDerivatives, standard: Float[np.ndarray, "unit column"]
    ) -> Float[np.ndarray, "first variable"]:
        """Return the derivatives of the first of some units by every variable, NaN where a unit has none."""
        good = found.evaluation.good
        slopes = np.full((good.size, self.design.size), np.nan)
        by_scale = self.space.by_scale(self._by_zone(found, standard))
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
        slopes = self._slopes(self.exact[output], self.standard)
        return self.values(output)[: len(slopes)], slopes

    def slopes_at(self, output: str, rows: Int[np.ndarray, " few"]) -> Float[np.ndarray, "few variable"]:
        """Return the derivatives of an output of some units by every variable, NaN where one has none."""
        asked = output, rows.tobytes()
        if asked not in self._slopes_told:  # the same units are the furthest beyond other limits of another output
            self._slopes_told[asked] = self._slopes_at(output, rows)
        return self._slopes_told[asked]

    @cached_property
    def _slopes_told(self) -> dict[tuple[str, bytes], Float[np.ndarray, "few variable"]]:
        return {}

    def _slopes_at(self, output: str, rows: Int[np.ndarray, " few"]) -> Float[np.ndarray, "few variable"]:
        if output in self.exact and rows.max(initial=-1) < self.derivative_units:
            return np.asarray(self._slopes(self.exact[output], self.standard)[rows])
        model, standard = self.at(self.design), self.standard[rows]
        if output in (*model.exact, *model.differentiable):
            return self._slopes(self._derivatives(output, rows), standard)
        return np.asarray(self._differences((output,), standard)[0])

    def worst(self, output: str, sense: Literal[1, -1]) -> tuple[float, float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones, by how much it may be missed and its derivative by every variable.

        All in the unit of the output. Where all starts of the ascent end at one value, only its rounding is missed.

        Notes
        -----
        The worst unit moves with the design, but to first order its value does not feel that (envelope theorem).
        """
        zones = self.space.zones(self.design)
        experiment = Experiment(self._differentiable(output), self.space.errors, zones, self.seeds.child(output))
        found = worst_unit(experiment, sense=sense)
        apart = float(np.nanmax(found.ends) - np.nanmin(found.ends))
        missed = max(min(apart, _MISSED * abs(float(found.by_zone @ zones))), _ROUNDED * abs(found.value))
        return found.value, missed, np.append(self.space.by_scale(found.by_zone), self._by_setting(output, found.x))

    def linear(self, output: str) -> tuple[float, Float[np.ndarray, " source"], Float[np.ndarray, " setting"]]:
        """Return the output of the nominal unit, what each source adds at its limit, and its change by settings."""
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
        standard, model = self.standard[: self.slope_units], self.at(self.design)
        slopes = {
            output: self._slopes(model.derivatives(output, self.x[: len(standard)]), standard)
            for output in self._others
            if output in model.differentiable
        }
        if rest := tuple(output for output in self._others if output not in slopes):
            slopes |= dict(zip(rest, self._differences(rest, standard), strict=True))
        values = self.others.known[: len(standard)]
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
                ends.append(self.at(design).reading(outputs)(deviations).known)
            slopes[..., at] = (ends[0] - ends[1]).T / (2 * steps[at])
        return slopes

    def _differentiable(self, output: str) -> ResponseWithDerivatives:
        """Return the output at the design with derivatives by the columns, exact ones where the model knows them."""
        return derived(self.at(self.design), output, self.x.std(axis=0))

    def at(self, design: Float[np.ndarray, " variable"]) -> Model:
        """Return the model at the settings of a design."""
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

    def limited(self, limits: Limits) -> LimitedSample:
        """Return what the units say of limits; a search solves all of them."""
        if near := self.near:
            control = ControlPlane(near=near, values=self.units.planes[self.output], limits=limits)
            return LimitedSample.all_of(self.units.values(self.output), limits, None, (control,), self.uncertainty)
        values = np.append(self.values, np.full(len(self.units.standard) - self.values.size, np.nan))
        return LimitedSample.all_of(values, limits, self.law, uncertainty=self.uncertainty)

    @cached_property
    def uncertainty(self) -> ProcessUncertainty | None:
        """What measured parts leave open of the output."""
        return self.units.uncertainty(self.units.values(self.output))

    @property
    def near(self) -> NearPlane | None:
        """The plane near the output, none where it is linear or no plane is near."""
        return None if self.law else self.units.nearest.get(self.output)

    @property
    def law(self) -> LinearLaw | None:
        """The law of the output, where it is linear."""
        return self.units.laws.get(self.output)

    def derived(self) -> tuple[Float[np.ndarray, " known"], Float[np.ndarray, "known variable"]]:
        """Return the output of some units and its derivative by every variable [unit of the output]."""
        return self.units.derived(self.output)

    def slopes_at(self, rows: Int[np.ndarray, " few"]) -> Float[np.ndarray, "few variable"]:
        """Return the derivative of some units' distance from an upper limit by every variable, NaN without one."""
        return self.units.slopes_at(self.output, rows)

    @cached_property
    def _furthest(self) -> dict[tuple[int, float], FurthestUnits]:
        return {}

    def furthest(self, limits: Limits, share: float) -> tuple[FurthestUnits, ...]:
        """Return the units furthest beyond every limit, as many as tell what a share of all lies beyond."""
        values = self.units.values(self.output)
        count = tail_units(values.size, share, cheap=self.output in self.units.exact)
        for sign, limit in limits.turned:
            if (sign, limit) not in self._furthest:
                turned = partial(self._turned_slopes, sign)
                found = FurthestUnits.of(sign * (values - limit), abs(limit) or 1.0, count, turned)
                self._furthest[sign, limit] = found
        return tuple(self._furthest[own] for own in limits.turned)

    def _turned_slopes(self, sign: int, rows: Int[np.ndarray, " few"]) -> Float[np.ndarray, "few variable"]:
        return sign * self.slopes_at(rows)

    def worst(self, sense: Literal[1, -1]) -> tuple[float, float, Float[np.ndarray, " variable"]]:
        """Return the worst value inside the zones, by how much it may be missed and its derivatives."""
        return self.units.worst(self.output, sense)

    def linear(self) -> tuple[float, float, Float[np.ndarray, " group"], Float[np.ndarray, " setting"]]:
        """Return the nominal output, what locked zones and each group add in quadrature, and its change by settings.

        All to first order [unit of the output].
        """
        value, added, by_setting = self.units.linear(self.output)
        group = self.units.space.group_of_source
        own = np.array([np.linalg.norm(added[group == at]) for at in range(self.groups)])
        return value, float(np.linalg.norm(added[group < 0])), own, by_setting

"""The cheapest drawing that keeps every requirement, in numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.process_costs import today
from tolalloc.allocation.cost.unit_price import QualityLoss, YieldLadder
from tolalloc.allocation.front.cost_front import CostFront
from tolalloc.allocation.front.what_if import Robustness, SettingTrade
from tolalloc.allocation.search.candidates import Candidates
from tolalloc.allocation.search.discrete import GradedAllocation
from tolalloc.allocation.search.proven_bound import ProvenBound
from tolalloc.allocation.search.zone_allocation import ModelRange, ZoneAllocation, model_range
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.problem import OneSidedConstraint, Solution
from tolalloc.allocation.space.requirement import AtYield, Check, Requirement
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import KeptLimits, Yield
from tolalloc.capability.near_limit import SolvedUnits
from tolalloc.drawings.compensators import Compensator
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.sources import Source
from tolalloc.models.model import Model
from tolalloc.reading.units import unit_of
from tolalloc.sensitivity.sobol import SourceIndices

_SAME = 1e-12
"""Distance up to which two zones are one number on a drawing [m]."""

_ROUNDING = 1e-6
"""Smallest share of the cost that a solver tells from nothing, however small its gap [-]."""


@dataclass(frozen=True, kw_only=True)
class Amount:
    """What must be made with the zones: an amount that a drawing states of the settings, or a setting itself."""

    name: str  # With its unit
    value: float  # On the drawing [unit of the name]
    before: float  # In the tolerance table [unit of the name]
    tolerance: float | None = None  # Half of the zone that the table states for it, if it does [m]


@dataclass(frozen=True, kw_only=True)
class AssemblyChoice:
    """One way to choose parts at assembly, and what its cheapest drawing costs."""

    compensators: tuple[Compensator, ...]  # What acts
    label: str  # In words
    met: bool  # Whether its drawing was shown to keep the limits
    zones_cost: float  # Of the zones [cost units]
    assembly_cost: float  # Of classes, sizes and parts that are left over, per unit [cost units]
    bound: float | None  # Lower bound on the cost of its zones, if there is one [cost units]
    joint: Yield  # Share of units that keep all limits at once
    left_over: float = 0.0  # Largest share of parts that find no mate, of all that are sorted [-]

    @property
    def cost(self) -> float:
        """Cost of zones and assembly [cost units]."""
        return self.zones_cost + self.assembly_cost


@dataclass(frozen=True, kw_only=True)
class AssembledDrawing:
    """What was compared of the ways to choose parts at assembly."""

    choices: tuple[AssemblyChoice, ...]
    chosen: int  # Which of them the drawing is for
    as_they_come: KeptLimits  # Units of the drawing if nothing is chosen

    @property
    def best(self) -> AssemblyChoice:
        """The choice that the drawing is for."""
        return self.choices[self.chosen]

    @property
    def nothing_chosen(self) -> AssemblyChoice | None:
        """The choice of taking parts as they come, if it was compared."""
        return next((own for own in self.choices if not own.compensators), None)


@dataclass(frozen=True, kw_only=True)
class AllocationResult:
    """The cheapest drawing that keeps every requirement."""

    name: str  # Name of the study
    model: Model  # The model at the sources of the tolerance table
    requirements: tuple[Requirement, ...]  # What must be kept, the leading one first
    space: DesignSpace  # Design variables with every setting free
    # The allocation with the settings as they are, if the question asks for it and the model has any
    fixed: ZoneAllocation | None
    free: ZoneAllocation  # The allocation of tolerances and settings together
    graded: GradedAllocation | None  # The same on ladders of zones, if the question asks for it
    # Sobol indices of the leading output by the dimensions of the drawing, at its zones; none where it is the same for
    # all units
    shares: SourceIndices | None
    trade: SettingTrade | None  # Cost of the cheapest zones over the settings, if asked for
    front: CostFront | None  # What other limits of the leading output cost, if asked for
    robustness: Robustness | None  # Answers under changed assumptions, if asked for
    # Price of a good unit over yield targets, if the question states what becomes of the others
    prices: YieldLadder | None
    loss: QualityLoss | None  # What the leading output costs a user, if the question states it
    error: float  # Probability up to which the answer may call a design met that misses a limit [-]
    examination: Mapping[str, float]  # What the model counted of random units of the drawing, units in the names
    # What was compared of the ways to choose parts at assembly, if the question names any
    assembled: AssembledDrawing | None = None
    proven: ProvenBound | None = None  # What no drawing with free zones costs less than on the real model, if asked for
    # Units of the drawing whose parts only keep their zones, spread evenly over them; none where more is promised
    evenly: KeptLimits | None = None

    @property
    def leading(self) -> str:
        """Name of the leading output, which the first requirement limits."""
        return self.requirements[0].output

    @property
    def candidates(self) -> Candidates:
        """What the searches found, among which the drawing is the cheapest."""
        return Candidates(fixed=self.fixed, free=self.free, graded=self.graded)

    @cached_property
    def chosen(self) -> VerifiedDesign:
        """What the drawing shall show: the cheapest of all that was shown to keep the limits."""
        return self.candidates.drawn

    @property
    def keeps_table(self) -> bool:
        """Whether nothing that was verified is cheaper than the tolerance table as it is."""
        return self.chosen is self.free.baseline

    @property
    def drawn(self) -> DesignSpace:
        """Design variables of the chosen design; groups share one zone where it is graded."""
        return self.chosen.space

    @property
    def met(self) -> bool:
        """Whether units that no search has seen show every requirement to be kept, with the stated error."""
        return self.chosen.accepted

    @property
    def yields(self) -> dict[str, Yield]:
        """Limited output → share of units of the drawing that keep its limits, the leading one first."""
        asked = (check.requirement for check in self.chosen.checks_alone)
        return {own.output: self.chosen.yield_of(own) for own in asked}

    @property
    def cost(self) -> float:
        """Cost of the drawing [cost units]."""
        return self.chosen.cost

    @property
    def least_saving(self) -> float:
        """Saving against proportional scaling that uses the limit to its last unit, as a share of its cost [-]."""
        return 1 - (1 - self.free.saving_at_least) * self.chosen.cost / self.free.chosen.cost

    @property
    def bound(self) -> float | None:
        """Lower bound on the cost of drawings that keep the limits; none if a verified one undercuts it [cost units].

        For drawings near the verified ones, unless `bound_is_certified`; `LowerBound` says with which confidence.
        """
        return self.candidates.bound

    @property
    def bound_is_certified(self) -> bool:
        """Whether the bound holds for every allowed drawing with free zones rather than near the verified ones."""
        return self.candidates.unrestricted.lower_bound.certified

    @cached_property
    def model_range(self) -> ModelRange:
        """Where the local models of the drawing are believed, and how far all that was verified there differs."""
        tried = (*self.free.proportional_tried, *self.free.tried)
        tried += (*(self.fixed.tried if self.fixed else ()), *(self.graded.tried if self.graded else ()))
        return model_range(self.chosen, {id(own): own for own in tried}.values())

    @cached_property
    def drawn_sources(self) -> tuple[Source, ...]:
        """All sources of the tolerance table at the zones of the drawing, with process, grade and cost."""
        space, chosen, graded = self.drawn, self.chosen, self.graded
        zones = dict(zip((source.name for source in space.errors.active), space.zones(chosen.design), strict=True))
        made, costs = space.made_by(chosen.design), space.cost_of_sources(chosen.design)
        on_grades = graded is not None and chosen is graded.chosen
        labels = dict(zip(space.groups, graded.labels, strict=True)) if graded and on_grades else {}
        return tuple(
            replace(
                source,
                zone=float(zones[source.name]),
                cost=costs[source.name],
                process=made[source.name].name if self._has_prices(source) else source.process,
                grade=labels.get(source.dimension, ""),
            )
            if source.name in made
            else source
            for source in self.space.errors.sources
        )

    def _has_prices(self, source: Source) -> bool:
        """Return whether the process cost table knows a source; where it does not, no process was chosen."""
        alone = (today(source),)
        return self.space.processes.get(source.name, alone) != alone

    @cached_property
    def amounts(self) -> tuple[Amount, ...]:
        """Amounts that are made with the zones, and the settings that they come from; none without settings."""
        if not self.space.settings:
            return ()
        drawn, names = self.model.drawn_amounts, self.space.shared.names
        value, before = (
            {
                **dict(zip(names, design.settings.tolist(), strict=True)),
                **dict(zip(drawn.names, (drawn.by_setting @ design.settings).tolist(), strict=True)),
            }
            for design in (self.chosen, self.free.baseline)
        )
        zones = {own.name: own.zone for own in self.drawn_sources}
        tolerances = {
            name: zones.get(source, 0.0) / 2 for name, source in zip(drawn.names, drawn.sources, strict=False)
        }
        return tuple(
            Amount(name=name, value=value[name], before=before[name], tolerance=tolerances.get(name) or None)
            for name in dict.fromkeys([*drawn.names, *names])
        )

    @cached_property
    def dimensions(self) -> dict[str, tuple[Source, ...]]:
        """Dimension of the drawing that has a zone → its members as drawn."""
        found: dict[str, list[Source]] = {}
        for source in self.drawn_sources:
            if source.zone > 0.0:
                found.setdefault(source.dimension, []).append(source)
        return {name: tuple(members) for name, members in found.items()}

    @cached_property
    def lines(self) -> tuple[tuple[str, tuple[Source, ...]], ...]:
        """Lines of the drawing, each with one value: the dimension, and those of its members that have this value."""
        found: dict[tuple[object, ...], list[Source]] = {}
        for name, members in self.dimensions.items():
            for own in members:
                value = (own.feature, round(own.zone / _SAME), round(own.middle / _SAME), own.over)
                found.setdefault((name, *value), []).append(own)
        return tuple((str(key[0]), tuple(members)) for key, members in found.items())

    def line_name(self, line: tuple[str, tuple[Source, ...]]) -> str:
        """Return the name of a line: its dimension, and its members where others of the dimension have other values."""
        name, members = line
        alone = len(members) == len(self.dimensions[name])
        return name if alone else f"{name}: {', '.join(own.name for own in members)}"

    def price_of(self, check: Check, side: OneSidedConstraint) -> float:
        """Return what a limit of the drawing costs, nothing where the drawing does not touch it.

        Of limits that are kept at once, one that hardly a unit misses leaves all that may be missed to the others,
        unless many lie just inside it, as where all deviations end somewhere.

        Parameters
        ----------
        check, side
            One of the chosen design's limited sides, with its requirement's check.

        Returns
        -------
        float
            [cost units per unit of the output]
        """
        price, jointly = self.free.prices.get(side.stack.name, 0.0), self.chosen.jointly
        touches = price * side.scale > max(_WORTH * self.chosen.cost, solver_noise(self.free.optimum))
        if touches and jointly:
            inside = side.limit - side.sign * _INSIDE * side.scale
            near = replace(check.requirement, limits=Limits(upper=inside) if side.sign > 0 else Limits(lower=inside))
            touches = 1 - self.chosen.yield_of(near).estimate > _USED * jointly.joint.failures
        return price if touches else 0.0

    @cached_property
    def asked_by(self) -> dict[str, str]:
        """Dimension whose zone is free → limited output whose price holds it most; nothing where one limit binds alone.

        The largest of price·∂load/∂zone over the limited sides, by the local models of the drawing (own derivation).
        """
        chosen, held = self.chosen, dict[str, Float[np.ndarray, " group"]]()
        for check, side in chosen.limited_sides:
            if price := self.price_of(check, side):
                output, slopes = check.requirement.output, side.stack.zone_slopes(chosen.scales)
                held[output] = held.get(output, 0.0) + price * slopes
        if len(held) < 2:
            return {}
        outputs, most = [*held], np.argmax([*held.values()], axis=0)
        return dict(zip(chosen.space.groups, (outputs[at] for at in most), strict=True))

    @property
    def process_changes(self) -> dict[str, float]:
        """What leaving the old process costs once, of every source whose zone may change [cost units]."""
        return {name: own.change for name, own in self.drawn.made_by(self.chosen.design).items()}

    @cached_property
    def drawing(self) -> Drawing:
        """The drawing as the next study takes it, with the cost of every zone as it is made.

        Leaving the old process was paid for, once.
        """
        changes = self.process_changes
        sources = (replace(own, cost=own.cost - changes.get(own.name, 0.0)) for own in self.drawn_sources)
        errors = replace(self.space.errors, sources=tuple(sources))
        return Drawing(name=f"{self.name}, allocated", errors=errors)


_WORTH = 1e-3
"""Worth of a limit over the cost, from which it is said to bind [-]."""
_USED = 0.02
"""Part of the failures allowed to all limits at once that must lie beyond or near one for it to be said to bind [-]."""
_INSIDE = 0.01
"""How near, over the scale of the limit [-]."""


def solver_noise(solution: Solution) -> float:
    """Return the cost below which a price tells nothing of a solution [cost units].

    max(gap, 1e-6)·cost, with gap = cost/bound − 1 (own derivation).
    """
    return max(solution.gap, _ROUNDING) * solution.cost


def limit_step(side: OneSidedConstraint, limits: Limits) -> float:
    """Return a small change of a limit to tell its price by: a power of ten, at most a twentieth of what limits leave.

    10^⌊log₁₀(size/20)⌋ with half the distance of two limits or the size of one, of what outputs are compared by where
    that is 0 (own derivation) [unit of the output].
    """
    size = abs(side.limit) or side.scale
    if limits.lower is not None and limits.upper is not None:
        size = (limits.upper - limits.lower) / 2
    return float(10.0 ** np.floor(np.log10(size / 20) + _OF_A_LOGARITHM)) if size > 0 else 1.0


_OF_A_LOGARITHM = 1e-9
"""What rounding may take of a logarithm [-]."""


def limit_price(side: OneSidedConstraint, limits: Limits, price: float) -> tuple[float, str]:
    """Return the price of a small change of a limit [cost units], and that change with its unit.

    λ·step (own derivation), as every shadow price for small changes.
    """
    step, unit = limit_step(side, limits), unit_of(side.stack.name)
    return price * step, unit if step == 1 else f"{step:g} {unit}".removesuffix(" -")


def unit_quantile(design: VerifiedDesign, check: Check, side: OneSidedConstraint) -> float:
    """Return the limit that the target share keeps as a design's units show at even odds [unit of the output].

    Parameters
    ----------
    design
        The verified design.
    check
        How it stands against a requirement.
    side
        One of its limits: of two, half of the units beyond are left to it, or as many as lie there if these are more.

    Notes
    -----
    An order statistic (Hahn & Meeker 1991, Statistical Intervals); not a number unless a yield is asked for.
    """
    asked, tested = check.requirement, design.independent
    if not isinstance(asked.guarantee, AtYield):
        return float("nan")
    values = asked.read(tested.outputs if tested else design.outputs)
    units = tested.units if tested else SolvedUnits.all_of(values.size)
    sample = LimitedSample(values=values, units=units, limits=asked.limits)
    return next(own.value for own in asked.guarantee.bounds(sample, 0.5) if own.sign == side.sign)

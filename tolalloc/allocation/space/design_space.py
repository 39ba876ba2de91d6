"""What the allocation may change: one scale per drawing group, and the settings of the model; and its cost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.cost.model import Process, made_together
from tolalloc.allocation.cost.process_costs import today
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Shared, Stack
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import FIGURES, STEPS, Source, known_as, meant
from tolalloc.drawings.tolerance_table import with_zones
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.settings import DrawnAmounts, Setting
from tolalloc.reading.units import MICROMETRE

_ROUNDING = 1e-9
"""Distance from a bound, over the bound, up to which it is rounding [-]."""


@dataclass(frozen=True, kw_only=True)
class DesignSpace:
    """Design variables: the scale of each group's zones and the settings of the model.

    Notes
    -----
    A design is a vector: the scale of every group [-], then every setting [unit of its name].
    """

    errors: ErrorModel  # The sources at their zones in the tolerance table; a scale of 1 is that zone
    # What the designer chooses beside the zones, with bounds; none if the model has none
    settings: tuple[Setting, ...] = ()
    # Source → ways to make it, zones in [m]; without an entry it costs what the tolerance table says at its zone, and
    # that falls as 1/zone
    processes: Mapping[str, tuple[Process, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _ = self.features  # contradictions are found before anything long runs

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that may change."""
        return tuple(dict.fromkeys(source.dimension for source in self.errors.active if not source.locked))

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return (*(f"scale of {group} [-]" for group in self.groups), *(setting.name for setting in self.settings))

    @cached_property
    def group_of_source(self) -> Int[np.ndarray, " source"]:
        """Position of each active source's group; −1 for locked sources."""
        return np.array(
            [-1 if source.locked else self.groups.index(source.dimension) for source in self.errors.active], dtype=int
        )

    def by_scale(self, by_zone: Float[np.ndarray, "*units source"]) -> Float[np.ndarray, "*units group"]:
        """Return derivatives by the scales from those by the zones, ∂/∂scale = Σ zoneᵢ·∂/∂zoneᵢ [output/m → output]."""
        members = self.group_of_source[:, np.newaxis] == np.arange(len(self.groups))
        return np.asarray((by_zone * self.errors.zones) @ members)

    @cached_property
    def features(self) -> tuple[PricedFeature, ...]:
        """Every group with the processes that all of its members have, over its scale."""
        return tuple(PricedFeature(name=group, processes=self._processes(group)) for group in self.groups)

    @property
    def has_choices(self) -> bool:
        """Whether a feature may be made in more than one way."""
        return any(len(feature.processes) > 1 for feature in self.features)

    @cached_property
    def shared(self) -> Shared:
        """The settings."""
        return Shared(
            names=tuple(setting.name for setting in self.settings),
            lower=np.array([setting.lower for setting in self.settings], float),
            upper=np.array([setting.upper for setting in self.settings], float),
        )

    @property
    def fixed(self) -> DesignSpace:
        """The same with every setting locked at its present value."""
        locked = (replace(setting, lower=setting.value, upper=setting.value) for setting in self.settings)
        return replace(self, settings=tuple(locked))

    @property
    def holds_present_settings(self) -> bool:
        """Whether every setting as it is today lies between what it may be."""
        return not any(setting.out_of_bounds for setting in self.settings)

    @property
    def setting_steps(self) -> Float[np.ndarray, " setting"]:
        """Step of every setting to either side of a difference [unit of its name]."""
        return np.array([setting.step for setting in self.settings], float)

    def settings_of(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs setting"]:
        """Return the settings of designs [units of their names]."""
        return designs[..., len(self.groups) :]

    @cached_property
    def locked_cost(self) -> float:
        """Cost of the zones that may not change [cost units]."""
        return float(sum(source.cost for source in self.errors.active if source.locked))

    @cached_property
    def lower(self) -> Float[np.ndarray, " variable"]:
        """Smallest value of every variable."""
        scales = [min(process.minimum for process in feature.processes) for feature in self.features]
        return np.append(scales, self.shared.lower)

    @cached_property
    def upper(self) -> Float[np.ndarray, " variable"]:
        """Largest value of every variable."""
        scales = [max(process.maximum for process in feature.processes) for feature in self.features]
        return np.append(scales, self.shared.upper)

    def allows(self, design: Float[np.ndarray, " variable"]) -> bool:
        """Return whether zones and settings of a design lie between what they may be."""
        room = _ROUNDING * np.maximum(np.abs(self.lower), np.abs(self.upper))
        return bool(np.all((design >= self.lower - room) & (design <= self.upper + room)))

    def problem(self, stacks: tuple[Stack, ...]) -> AllocationProblem:
        """Return the allocation that keeps the stacks."""
        return AllocationProblem(features=self.features, stacks=stacks, shared=self.shared)

    def _processes(self, group: str) -> tuple[Process, ...]:
        """Return the processes that all members of a group have."""
        members = self.members(group)
        known = [{made.name for made in self._ways(source)} for source in members]
        common = [made.name for made in self._ways(members[0]) if all(made.name in names for names in known)]
        if not common:
            raise InputError(f"group {group}: {_apart(members, [self._ways(source) for source in members])}")
        found = [_joint(name, members, [self._made(source, name) for source in members]) for name in common]
        possible = tuple(process for process in found if process)
        if not possible:
            raise InputError(f"group {group}: no process can hold the ratios of its members' zones.")
        return possible

    def _ways(self, source: Source) -> tuple[Process, ...]:
        return self.processes.get(source.name) or (today(source),)

    def _made(self, source: Source, name: str) -> Process:
        """Return the process of a source by name, over its zone [m]."""
        return next(made for made in self._ways(source) if made.name == name)

    def made_by(self, design: Float[np.ndarray, " variable"]) -> dict[str, Process]:
        """Return the process of every source whose zone may change, over its zone [m]."""
        names = dict(zip(self.groups, self.process_names(design), strict=True))
        free = [source for source in self.errors.active if not source.locked]
        return {source.name: self._made(source, names[source.dimension]) for source in free}

    @cached_property
    def first_zones(self) -> Float[np.ndarray, " group"]:
        """Zone of the first member of every group in the tolerance table [m]."""
        return np.array([self.members(group)[0].zone for group in self.groups])

    def members(self, group: str) -> list[Source]:
        """Return the sources of a group."""
        return [source for source in self.errors.active if not source.locked and source.dimension == group]

    def zones(self, design: Float[np.ndarray, " variable"]) -> Float[np.ndarray, " source"]:
        """Return the zones of the active sources [m]."""
        scales = np.append(design[: len(self.groups)], 1.0)
        return np.asarray(self.errors.zones * scales[self.group_of_source])

    def rounded_down(
        self, design: Float[np.ndarray, " variable"], drawn: DrawnAmounts | None = None
    ) -> tuple[DesignSpace, Float[np.ndarray, " variable"]]:
        """Return a design as a drawing states it: zones rounded down to their steps, amounts to the nearest of theirs.

        Parameters
        ----------
        design
            Scales [-] and settings.
        drawn
            What the drawing says of the settings; they stay as they are if it is not given.

        Notes
        -----
        A zone that is the one of the tolerance table stays as its table states it. Rows without a step have the usual
        ones of a reducer, or else three figures.
        Members of a group that have one zone keep one; others are rounded one by one, in a space whose table has them
        at the rounded ratio. So the design costs what its rounded zones cost, and units of it lie in them.
        """
        usual = () if drawn is None else STEPS if drawn.finest else FIGURES
        found, zones = design.copy(), {own.name: own.zone for own in self.errors.sources}
        for at, group in enumerate(self.groups):
            members, scale = self.members(group), float(design[at])
            if abs(scale - 1.0) <= _ROUNDING:
                continue
            rounded = [own.rounded_down(own.zone * scale, usual) for own in members]
            ratios = [zone / own.zone for zone, own in zip(rounded, members, strict=True)]
            if max(ratios) - min(ratios) <= _ROUNDING * max(ratios):
                found[at] = min(ratios)
            else:
                zones |= {own.name: zone / scale for own, zone in zip(members, rounded, strict=True)}
        if drawn is not None and drawn.finest and self.settings:
            found[len(self.groups) :] = self._stated(self.settings_of(design), drawn)
        sources = with_zones(self.errors.sources, [zones[own.name] for own in self.errors.sources])
        changed = sources != self.errors.sources
        return (replace(self, errors=replace(self.errors, sources=sources)) if changed else self), found

    def _stated(self, settings: Float[np.ndarray, " setting"], drawn: DrawnAmounts) -> Float[np.ndarray, " setting"]:
        """Return the settings whose amounts are whole steps, nearest to some that are not those of today."""
        present = np.array([own.value for own in self.settings], float)
        locked = bool(np.all(self.shared.lower == self.shared.upper))
        if locked or np.allclose(settings, present, rtol=_ROUNDING, atol=0.0):
            return settings
        steps = np.array(drawn.finest, float)
        exact = drawn.by_setting @ settings / steps
        sides = product(*((np.floor(own + _ROUNDING), np.ceil(own - _ROUNDING)) for own in exact.tolist()))
        near = sorted(sides, key=lambda own: float(np.abs((np.array(own) - exact) * steps).max()))
        inverse = np.linalg.inv(drawn.by_setting)
        room = _ROUNDING * np.maximum(1.0, np.abs(self.shared.upper))
        for amounts in near:
            stated = inverse @ (np.array(amounts) * steps)
            if np.all((stated >= self.shared.lower - room) & (stated <= self.shared.upper + room)):
                return np.asarray(np.clip(stated, self.shared.lower, self.shared.upper))
        return settings

    def units(
        self, design: Float[np.ndarray, " variable"], seeds: SeedTree, units: int
    ) -> Float[np.ndarray, "unit column"]:
        """Return random units of a design, the same for the same node of the seed tree [m, angles rad]."""
        uniform = seeds.uniform_chunks(units, len(self.errors.columns))
        zones, standard = self.zones(design), (self.errors.standard_values(chunk) for chunk in uniform)
        return np.concatenate([self.errors.deviations(chunk, zones) for chunk in standard])

    def process_positions(self, designs: Float[np.ndarray, "*designs variable"]) -> Int[np.ndarray, "*designs group"]:
        """Return the position of the cheapest process that holds each scale, or comes nearest to it [-]."""
        return np.stack([self._cheapest(at, designs[..., at])[0] for at in range(len(self.groups))], axis=-1)

    def process_names(self, design: Float[np.ndarray, " variable"]) -> tuple[str, ...]:
        """Return the name of the process of every group."""
        positions = self.process_positions(design)
        return tuple(feature.processes[at].name for feature, at in zip(self.features, positions, strict=True))

    def cost(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the cost, each group made by the cheapest process that holds it [cost units]."""
        costs = [self._cheapest(at, designs[..., at])[1] for at in range(len(self.groups))]
        return np.asarray(np.sum(costs, axis=0) + self.locked_cost)

    def _cheapest(
        self, group: int, scales: Float[np.ndarray, "*designs"]
    ) -> tuple[Int[np.ndarray, "*designs"], Float[np.ndarray, "*designs"]]:
        processes = self.features[group].processes
        totals = np.stack([process.total(scales) for process in processes])
        outside = np.stack([np.maximum(made.minimum - scales, scales - made.maximum) for made in processes])
        outside = np.where(outside > _ROUNDING, outside, 0.0)
        allowed = np.where(outside <= outside.min(axis=0), totals, np.inf)
        return np.asarray(allowed.argmin(axis=0)), np.asarray(allowed.min(axis=0))

    def cost_of_sources(self, design: Float[np.ndarray, " variable"]) -> dict[str, float]:
        """Return the cost of every source whose zone may change, by the process that makes it [cost units]."""
        zones = dict(zip((source.name for source in self.errors.active), self.zones(design), strict=True))
        return {name: float(made.total(np.array(zones[name]))) for name, made in self.made_by(design).items()}

    def uniform(self, scale: float) -> Float[np.ndarray, " variable"]:
        """Return the design with all zones scaled alike and the settings as they are, whatever the bounds."""
        return np.array([*([scale] * len(self.groups)), *(setting.value for setting in self.settings)])


def _apart(members: list[Source], ways: list[tuple[Process, ...]]) -> str:
    """Return why members have no process in common, and what is allowed."""
    unpriced = [source.name for source, own in zip(members, ways, strict=True) if own == (today(source),)]
    if 0 < len(unpriced) < len(members):
        return (
            f"the process cost table has no row for {', '.join(unpriced)}, but for the other members; allowed are rows "
            "for all members or for none."
        )
    made = "; ".join(
        f"{source.name} {', '.join(process.name for process in own)}" for source, own in zip(members, ways, strict=True)
    )
    return f"its members have no process in common ({made}); allowed is one that all of them have."


def _joint(name: str, members: list[Source], made: list[Process]) -> Process | None:
    """Return a process of a whole group over its scale, none if the members' ranges do not meet."""
    zones = [source.zone for source in members]
    minimum = max(each.minimum / zone for each, zone in zip(made, zones, strict=True))
    maximum = min(each.maximum / zone for each, zone in zip(made, zones, strict=True))
    if minimum > maximum:
        return None
    return Process(
        name=name,
        cost=made_together([each.cost for each in made], zones),
        minimum=minimum,
        maximum=maximum,
        change=sum(each.change for each in made),
    )


_REPRICED = 1e-6
"""Share of a zone up to which it is a rounded bound [-]."""


def named_zones(errors: ErrorModel, zones: Mapping[str, float]) -> dict[str, float]:
    """Return source → zone [m] of names and patterns with zones [µm]; later patterns take over from earlier ones."""
    found: dict[str, float] = {}
    if not zones:
        raise InputError("whatif: no zone is given; give one or more, such as pin.diameter=3.")
    for pattern, zone in zones.items():
        own = meant(pattern, errors.active)
        if not own and meant(pattern, errors.sources):
            raise InputError(
                f"whatif: source {pattern!r} is neglected, because its zone is 0 in the tolerance table; give it a "
                "zone above 0 there."
            )
        if not own:
            said = {name for one in errors.active for name in (one.dimension, one.row) if name}
            raise UnknownNameError.among("whatif", "source", pattern, {*known_as(errors.active), *said})
        if not (isinstance(zone, int | float) and 0 < zone < 1e6):
            raise InputError.at("whatif", pattern, zone, "a zone above 0 and below 1 m, in µm")
        found |= dict.fromkeys(own, zone * MICROMETRE)
    return found


def outside_range(source: Source) -> str:
    """Return a sentence on a zone that lies outside what its row allows, empty for any other."""
    low, zone, high = (size / MICROMETRE for size in (source.minimum, source.zone, source.maximum))
    name = source.own_id or source.name
    if high == 0 or low * (1 - _REPRICED) <= zone <= high * (1 + _REPRICED):
        return ""
    meant = f" Write {name}={zone:g}mm if millimetres are meant." if low <= 1000 * zone <= high else ""
    return f"{name}: its zone of {zone:.4g} µm lies outside the {low:.4g} to {high:.4g} µm that its row allows.{meant}"


def repriced(space: DesignSpace, zones: Mapping[str, float]) -> tuple[Source, ...]:
    """Return the sources that vary, some at other zones [m], with what they cost by the processes that make them."""
    sources = space.errors.active
    costs = space.cost_of_sources(space.uniform(1.0)) if space.processes else {}
    costs = {name: cost for name, cost in costs.items() if name in space.processes}
    costs |= {name: _price(space, name, zone) for name, zone in zones.items() if name in space.processes}
    return with_zones(sources, [zones.get(own.name, own.zone) for own in sources], costs)


def cheapest(space: DesignSpace, name: str, zone: float) -> Process | None:
    """Return the cheapest process of a source that holds a zone [m], none where none does."""
    holding = [own for own in space.processes[name] if own.minimum <= zone <= own.maximum]
    return min(holding, key=lambda own: float(own.total(np.array(zone))), default=None)


def _price(space: DesignSpace, name: str, zone: float) -> float:
    """Return the cost of a zone by the cheapest process that holds it [cost units]."""
    made = cheapest(space, name, zone)
    if made is None:
        ways = space.processes[name]
        held = (
            f"{min(own.minimum for own in ways) / MICROMETRE:.3g} to "
            f"{max(own.maximum for own in ways) / MICROMETRE:.3g} µm, what its "
            f"{'row allows' if len(ways) == 1 else 'processes hold'}"
        )
        raise InputError.at("whatif", name, f"{zone / MICROMETRE:g} µm", held)
    return float(made.total(np.array(zone)))

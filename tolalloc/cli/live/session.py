"""A study on the live page: the design that somebody tries, what random units say of it, and one unit alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.difference import limited_shares
from tolalloc.allocation.space.design_space import cheapest, outside_range, repriced
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.capability.indices import quantile_interval
from tolalloc.capability.monte_carlo import proportion
from tolalloc.drawings.fields import LARGEST_ZONE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source, limited_measure
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import Model
from tolalloc.models.settings import Setting, require_settings
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import COST_UNITS, MICROMETRE, unit_of
from tolalloc.reports.figure import BINS, Figure, Series, chart, numbers, shares
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.wording import short
from tolalloc.study.prepared import Prepared

_DECIMALS = 4
"""Decimals of a zone; a table writes one more, so that half a zone is written whole too [-]."""
_SMALLEST = 10.0**-_DECIMALS
"""Smallest zone with these decimals [µm]."""
FIRST = 256
"""Units that are judged at once [-]."""
_FACTORS = (0.4, 0.55, 0.75, 1.0, 1.3, 1.7, 2.2)
"""What all zones of a drawing are multiplied by to show what its limits cost [-]."""
_LOOK = 128
"""Units that are solved between two looks whether somebody still wants them [-]."""
MOST = 6144
"""Most units of one design [-]."""
_STEPS = 400
"""Steps of the slider of a setting [-]."""
_MOST_CACHED = 24
"""Designs whose solved units are cached [-]."""
_SWEPT = 9
"""Values of an error between the ends of its zone [-]."""


@dataclass(frozen=True)
class LiveDesign:
    """Zones that differ from the drawing's, values of the settings, and under which conditions the model is asked."""

    zones: tuple[tuple[str, float], ...]  # Source and its zone [m], by name
    settings: tuple[float, ...]  # Values of all settings, in the model's order [units of their names]
    # Operating condition and its value, by name, where it differs from the study's [units of their names]
    operating: tuple[tuple[str, float], ...] = ()

    @classmethod
    def read(cls, sent: Any, prepared: Prepared) -> LiveDesign:
        """Return the design of a record ``{"zones": {source: µm}, "settings": {name: value}}``.

        Operating conditions stand among the settings.
        """
        zones, settings = (_numbers(sent, key) for key in ("zones", "settings"))
        present = {own.name: own.zone for own in prepared.errors.active}
        for name, zone in zones.items():
            UnknownNameError.require("page", "source", name, present)
            if not _SMALLEST <= zone <= LARGEST_ZONE:
                raise InputError.at("page", name, zone, f"a zone of {_SMALLEST:g} to {LARGEST_ZONE:g} µm")
        # A zone that the drawing has is said by the drawing, so that no bit of it depends on the way to the page.
        told = {
            name: round(zone, _DECIMALS) * MICROMETRE
            for name, zone in zones.items()
            if zone != shown_zone(present[name])
        }
        model = prepared.model
        require_settings("page", (*model.settings, *model.operating_conditions), settings)
        values = tuple(float(settings.get(own.name, own.value)) for own in model.settings)
        operating = tuple(
            (own.name, float(settings[own.name]))
            for own in model.operating_conditions
            if settings.get(own.name, own.value) != own.value
        )
        return cls(zones=tuple(sorted(told.items())), settings=values, operating=operating)


def shown_zone(zone: float) -> float:
    """Return a zone as the page shows it [m → µm]."""
    return float(f"{zone / MICROMETRE:.9g}")


def _numbers(sent: Any, key: str) -> Mapping[str, float]:
    """Return a record of numbers inside a record, empty where there is none."""
    found = sent.get(key, {}) if isinstance(sent, dict) else None
    if not isinstance(found, dict) or not all(is_number(value) for value in found.values()):
        raise InputError.at("page", key, found, "names with their numbers")
    return found


def _count(units: object) -> int:
    """Return a number of units that a request asks for."""
    if not (type(units) is int and 1 <= units <= MOST):
        raise InputError.at("page", "units", units, f"a whole number up to {MOST}")
    return units


def names_in(sent: Mapping[str, Any], key: str, known: Collection[str]) -> frozenset[str]:
    """Return the names that a request lists, none where it lists none."""
    found = sent.get(key, [])
    if not isinstance(found, list):
        raise InputError.at("page", key, found, "a list of names")
    for name in found:
        if name not in known:
            raise UnknownNameError.among("page", key, str(name), known)
    return frozenset(found)


def _output(
    requirement: Requirement, values: Float[np.ndarray, " unit"], kept: Bool[np.ndarray, " unit"]
) -> dict[str, Any]:
    limits, known = requirement.limits, values[np.isfinite(values)]
    inside = proportion(len(values), int(np.count_nonzero(~limits.kept_by(values))))
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    order = np.argsort(np.where(np.isfinite(values), values, -np.inf))
    return {
        "name": short(requirement.output),
        "output": requirement.output,
        "unit": unit_of(requirement.output),
        "lower": limits.lower,
        "upper": limits.upper,
        "quantiles": [_quantile(known, share) for share in limited_shares(requirement)],
        "inside": [inside.estimate, inside.low, inside.high],
        "histogram": shares(known, low, (high - low) / BINS or 1.0),
        "worst": int(order[-1]) + 1,
        "median": int(order[len(order) // 2]) + 1,
        "reject": int(np.flatnonzero(~kept)[0]) + 1 if not kept.all() else None,
    }


def _quantile(values: Float[np.ndarray, " known"], share: float) -> dict[str, Any]:
    """Return a quantile with its 95 % interval, whose ends are unknown where the units are too few."""
    if not values.size:
        return {"share": share, "value": None, "interval": [None, None]}
    found = quantile_interval(values, share)
    return {"share": share, "value": found.estimate, "interval": numbers([found.low, found.high])}


@dataclass(frozen=True, kw_only=True)
class Session:
    """A study that is open.

    Every design is tried on the random units that ``tolalloc whatif`` takes, so that the page and the command say the
    same. They count from 1; unit 0 has exact parts.
    """

    prepared: Prepared
    _known: dict[LiveDesign, Float[np.ndarray, "unit output"]] = field(default_factory=dict)
    _under: dict[tuple[tuple[str, float], ...], Model] = field(default_factory=dict)  # Latest conditions → model
    _lock: Lock = field(default_factory=Lock)

    @cached_property
    def standard(self) -> Float[np.ndarray, "unit column"]:
        """Random units per unit of their zones."""
        errors = self.prepared.errors
        seeds = SeedTree(self.prepared.study.seed).child("difference")
        return errors.standard_values(np.concatenate([*seeds.uniform_chunks(MOST, len(errors.columns))]))

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Names of the limited outputs."""
        return tuple(dict.fromkeys(own.output for own in self.prepared.requirements))

    def model(self, design: LiveDesign) -> Model:
        """Return the model at the settings and under the conditions of a design."""
        prepared, source = self.prepared, self.prepared.study.model
        model = prepared.model
        if design.operating and source is not None:
            bound = self._under.get(design.operating)
            if bound is None:
                bound = source.set_to(dict(design.operating)).bound(prepared.errors, "page").mapped(prepared.mapper)
                self._under.clear()  # a hand that moves on seldom comes back to the very value
                self._under[design.operating] = bound
            model = bound
        return model.at(np.array(design.settings))

    def sources(self, design: LiveDesign) -> tuple[Source, ...]:
        """Return the sources that vary, at the zones of a design and with their costs."""
        return repriced(self.prepared.space, dict(design.zones))

    def deviations(self, design: LiveDesign, units: slice) -> Float[np.ndarray, "unit column"]:
        """Return the deviations of random units [m, angles rad]."""
        zones = np.array([own.zone for own in self.sources(design)])
        return self.prepared.errors.deviations(self.standard[units], zones)

    def priced(self, design: LiveDesign) -> dict[str, Any]:
        """Return the cost of a design and of each of its sources [cost units]."""
        sources = self.sources(design)
        return {
            "cost": sum(own.cost for own in sources),
            "before": sum(own.cost for own in repriced(self.prepared.space, {})),
            "costs": {own.name: own.cost for own in sources},
            "made": {own.name: self._process(own) for own in sources if own.name in self.prepared.space.processes},
        }

    def _process(self, source: Source) -> str:
        """Return the cheapest process that holds a source's zone, the one that prices it."""
        made = cheapest(self.prepared.space, source.name, source.zone)
        return made.name if made else "as drawn"

    def units(self, design: LiveDesign, count: object, wanted: Callable[[], bool]) -> dict[str, Any] | None:
        """Return what random units of a design say; nothing if they are not wanted any more."""
        number = _count(count)
        values = self._solved(design, number, wanted)
        return None if values is None else self._judged(design, values[:number])

    def _judged(self, design: LiveDesign, values: Float[np.ndarray, "unit output"]) -> dict[str, Any]:
        """Return the yield of all limits, and of each output its quantiles, its share and its histogram.

        A unit without an output has NaN there; limits of the model's own are those in force at the design.
        """
        model = self.model(design)
        read = [(own.in_force(model), values[:, self.outputs.index(own.output)]) for own in self.prepared.requirements]
        kept = np.all([own.limits.kept_by(found) for own, found in read], axis=0)
        inside = proportion(len(values), int(np.count_nonzero(~kept)))
        broken = [(own, found) for own, found in read if own.output in model.own_limits]
        return {
            "units": len(values),
            "lost": int(np.count_nonzero(np.isnan(values).any(axis=1))),
            "yield": [inside.estimate, inside.low, inside.high],
            "target": self.prepared.target,
            # share of units that do not work at all, for every limit that the model has of its own
            "broken": {own.output: float((~own.limits.kept_by(found)).mean()) for own, found in broken},
            "outputs": [_output(own, found, kept) for own, found in read],
        }

    def _solved(
        self, design: LiveDesign, count: int, wanted: Callable[[], bool]
    ) -> Float[np.ndarray, "unit output"] | None:
        """Return the outputs of the first units, of which those that are known are not solved again."""
        with self._lock:
            values = self._known.get(design, np.empty((0, len(self.outputs))))
        response = self.model(design).reading(self.outputs)
        while len(values) < count and wanted():
            evaluation = response(self.deviations(design, slice(len(values), min(len(values) + _LOOK, count))))
            values = np.concatenate([values, evaluation.known])
        with self._lock:  # the units of the oldest designs are forgotten
            known = self._known.pop(design, values)
            self._known[design] = max(values, known, key=len)
            while len(self._known) > _MOST_CACHED:
                self._known.pop(next(iter(self._known)))
        return values if len(values) >= count else None

    def scaled(self, design: LiveDesign, wanted: Callable[[], bool]) -> list[dict[str, Any]] | None:
        """Return cost and limited quantiles of the drawing with all zones scaled alike, at the settings of a design.

        Every zone stays within its range or that of a process, and one that is locked stays as drawn. Nothing if it is
        not wanted any more.
        """
        found: list[dict[str, Any]] = []
        for factor in _FACTORS:
            zones = {own.name: zone for own in self.prepared.errors.active if (zone := self._scaled(own, factor))}
            as_drawn = factor == 1.0 and not self.prepared.space.processes  # else what its cheapest processes make it
            scaled = replace(design, zones=() if as_drawn else tuple(sorted(zones.items())))
            values = self._solved(scaled, FIRST, wanted)
            if values is None:
                return None
            outputs = self._judged(scaled, values[:FIRST])["outputs"]
            cost = sum(own.cost for own in self.sources(scaled))
            quantiles = [[item["value"] for item in own["quantiles"]] for own in outputs]
            found.append({"factor": factor, "cost": cost, "quantiles": quantiles})
        return found

    def _scaled(self, source: Source, factor: float) -> float | None:
        """Return the zone of a source times a factor, within its range; nothing where it stays as drawn [m]."""
        processes = self.prepared.space.processes.get(source.name, ())
        held = [(own.minimum, own.maximum) for own in processes] or [_range(source, ())]
        if source.locked or not max(high for _, high in held) > min(low for low, _ in held):
            return None
        wanted = source.zone * factor
        return min((min(max(wanted, low), high) for low, high in held), key=lambda zone: abs(np.log(zone / wanted)))

    def examined(self, design: LiveDesign, units: object) -> list[str]:
        """Return what a check says of the settings and so many random units, such as how many are preloaded."""
        count = _count(units)
        model, known = self.model(design), self.prepared.model.settings
        chosen = [replace(own, value=value) for own, value in zip(known, design.settings, strict=True)]
        beyond = [f"{own.sentence}." for own in chosen if own.out_of_bounds]
        beyond += [sentence for own in self.sources(design) if (sentence := outside_range(own))]
        counted = model.examined(self.deviations(design, slice(0, count)))
        return [*beyond, *portrait_of(model).examination(counted).sentences]

    @property
    def described(self) -> dict[str, Any]:
        """What the page shows before anything is solved: sources, settings, limits."""
        study, model = self.prepared.study, self.prepared.model
        return {
            "name": study.name,
            "model": model.name,
            "seed": study.seed,
            "most": MOST,
            "first": FIRST,
            "conditions": [[name, value] for name, value in model.conditions.items()],
            "sources": [
                _described(own, self.prepared.space.processes.get(own.name, ())) for own in self.prepared.errors.active
            ],
            "settings": [
                *(_setting(own, portrait_of(model).settings_word) for own in model.settings),
                # an odd number of steps leaves out the middle, a torque of 0, at which play leaves all undetermined
                *(
                    _setting(own, "operating condition", _STEPS + (own.value != 0.0))
                    for own in model.operating_conditions
                ),
            ],
            "limits": [own.sentence for own in self.prepared.requirements],
            "currency": self.prepared.currency or COST_UNITS,
        }

    def unit(self, design: LiveDesign, number: int) -> dict[str, Any]:
        """Return outputs and pictures of a unit."""
        x = self._columns(design, number)
        values = self._values(design, x[np.newaxis])[0]
        figures = self._pictured(design, _label(number), x)
        return {
            "unit": number,
            "values": [
                {"name": short(name), "unit": unit_of(name), "value": value}
                for name, value in zip(self.outputs, numbers(values), strict=True)
            ],
            "figures": [chart(figure) for figure in figures],
        }

    def _pictured(self, design: LiveDesign, label: str, x: Float[np.ndarray, " column"]) -> tuple[Figure, ...]:
        """Return the pictures of a unit, with the limit of the curve's height around the middle of the curve."""
        portrait = portrait_of(self.model(design))
        figures = portrait.pictured({label: (np.array(design.settings), x)})
        limits = {own.output: own.limits.upper for own in self.prepared.requirements}
        limit, values = limits.get(portrait.curve_height), [item for own in figures[:1] for item in own.series[-1].y]
        if limit is None or not np.isfinite(values).any():
            return figures
        middle = (np.nanmin(values) + np.nanmax(values)) / 2
        name = f"limit {limit:g} {unit_of(portrait.curve_height)} peak to peak"
        ends = ((float(middle - limit / 2), ""), (float(middle + limit / 2), name))
        return replace(figures[0], horizontal=ends), *figures[1:]

    def scene(self, design: LiveDesign, number: int, swept: tuple[str, float] | None = None) -> dict[str, Any]:
        """Return a unit as a moving picture needs it; nothing where the model has none.

        What may be swept is a source, to where its error stands in its zone, from -1 to 1 [-].
        """
        names = tuple(own.name for own in self.prepared.errors.active)
        x, label = self._columns(design, number), _label(number)
        if swept:
            source, share = swept
            if not (is_number(share) and abs(share) <= 1):
                raise InputError.at("page", "share", share, "a number from -1 to 1")
            x, label = self._at_shares(design, number, source, np.array([share]))[0], f"{label}, {source} moved"
        return {"scene": portrait_of(self.model(design)).scene(np.array(design.settings), x, label, names)}

    def swept(self, design: LiveDesign, number: int, source: str) -> dict[str, Any]:
        """Return the leading output of a unit while one of its errors goes from one end of its zone to the other."""
        shares = np.linspace(-1.0, 1.0, _SWEPT)
        tried = self._at_shares(design, number, source, shares)
        values = self._values(design, tried)[:, 0]
        labels = [f"{source} at {100 * share:.0f} % of its zone" for share in shares]
        curves = [self._pictured(design, label, row) for label, row in zip(labels, tried, strict=True)]
        leading = self.outputs[0]
        figure = Figure(
            name="sweep",
            title=f"{short(leading)} while {source} goes through its zone, all else of the unit as it is",
            x_label=f"{source} over its zone [-]",
            y_label=f"{short(leading)} [{unit_of(leading)}]",
            series=(Series(label=source, kind="line", x=list(shares), y=list(values)),),
        )
        known = values[np.isfinite(values)]
        return {
            "source": source,
            "figure": chart(figure),
            "spread": float(known.max() - known.min()) if known.size else None,
            "curves": [[chart(own) for own in figures] for figures in curves],
        }

    def _at_shares(
        self, design: LiveDesign, number: int, source: str, shares: Float[np.ndarray, " share"]
    ) -> Float[np.ndarray, "share column"]:
        """Return the deviations of a unit with one of its errors at places of its zone [m, angles rad]."""
        errors, sources = self.prepared.errors, {own.name: own for own in self.sources(design)}
        UnknownNameError.require("page", "source", source, sources)
        own = np.array([name == source for name in errors.source_of_column])
        tried = np.tile(self._columns(design, number), (len(shares), 1))
        tried[:, own] = sources[source].middles + np.outer(shares, self._full(sources[source], number, own))
        return tried

    def _columns(self, design: LiveDesign, number: int) -> Float[np.ndarray, " column"]:
        """Return the deviations of a unit [m, angles rad]."""
        if not (type(number) is int and 0 <= number <= MOST):
            raise InputError.at("page", "unit", number, f"a whole number up to {MOST}, 0 for exact parts")
        if number:
            return np.asarray(self.deviations(design, slice(number - 1, number))[0])
        errors, zones = self.prepared.errors, np.array([own.zone for own in self.sources(design)])
        return np.asarray(errors.deviations(np.zeros((1, len(errors.columns))), zones)[0])

    def _full(self, source: Source, number: int, at: np.ndarray) -> Float[np.ndarray, " own_column"]:
        """Return the deviations with which the source fills its zone, in the direction of the unit [m, angles rad]."""
        zones = np.ones(len(self.prepared.errors.active))
        own = self.prepared.errors.deviations(self.standard[max(number, 1) - 1 : max(number, 1)], zones)[0, at]
        centred = own - source.middles
        measure = float(limited_measure(source, own[np.newaxis])[0]) or 1.0
        half = source.zone / 2 if source.feature is Feature.SIZE else source.zone
        return np.asarray(centred * half / measure)

    def _values(self, design: LiveDesign, x: Float[np.ndarray, "unit column"]) -> Float[np.ndarray, "unit output"]:
        return self.model(design).reading(self.outputs)(x).known


def _label(number: int) -> str:
    return f"unit {number}" if number else "exact parts"


def _setting(own: Setting, word: str, steps: int = _STEPS) -> dict[str, Any]:
    step = (own.upper - own.lower) / steps
    return {"name": own.name, "value": own.value, "lower": own.lower, "upper": own.upper, "step": step, "word": word}


def _range(source: Source, processes: tuple[Process, ...]) -> tuple[float, float]:
    """Return the smallest and the largest zone of a source, by its processes where it has any [m]."""
    smallest = min((own.minimum for own in processes), default=source.minimum)
    return smallest, max((own.maximum for own in processes), default=source.maximum)


def _described(source: Source, processes: tuple[Process, ...]) -> dict[str, Any]:
    smallest, largest = _range(source, processes)
    return {
        "name": source.name,
        "part": source.part,
        "label": ", ".join(filter(None, (source.own_id, source.label, source.drawing))),
        "feature": source.feature.value,
        "meaning": source.feature.zone_meaning,
        "zone": shown_zone(source.zone),
        "lower": smallest / MICROMETRE,
        "upper": largest / MICROMETRE,
        "processes": [[own.name, own.minimum / MICROMETRE, own.maximum / MICROMETRE] for own in processes],
        "group": source.dimension,
        "locked": source.locked,
        "cost": source.cost,
    }

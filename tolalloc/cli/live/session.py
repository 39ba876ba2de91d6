"""What the page asks of a study: price and curve at once, then the yield of more and more of the same random units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.model import Process
from tolalloc.allocation.space.design_space import cheapest, outside_range, repriced
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.cli.live.design import LiveDesign, shown_zone
from tolalloc.cli.live.judged import judged
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.exceptions import InputError
from tolalloc.models.model import Model
from tolalloc.models.settings import Setting
from tolalloc.reading.units import COST_UNITS, MICROMETRE
from tolalloc.study.prepared import Prepared

FIRST = 256
"""Units that are judged at once [-]."""
_LOOK = 128
"""Units that are solved between two looks whether somebody still wants them [-]."""
MOST = 6144
"""Most units of one design [-]."""
_STEPS = 400
"""Steps of the slider of a setting [-]."""
_REMEMBERED = 24
"""Designs whose solved units are remembered [-]."""


@dataclass(frozen=True, kw_only=True)
class Session:
    """A study that is open.

    Every design is tried on the random units that ``tolalloc whatif`` takes, so that the page and the command say the
    same.
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

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the study limits, the leading output first."""
        return self.prepared.requirements

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Names of the limited outputs."""
        return tuple(dict.fromkeys(own.output for own in self.requirements))

    def model(self, design: LiveDesign) -> Model:
        """Return the model at the settings and under the conditions of a design.

        Raises
        ------
        InputError
            A condition that is not allowed, such as a torque of 0.
        """
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
        """Return the sources that vary, at the zones of a design and with their costs.

        Raises
        ------
        InputError
            A zone that no process holds.
        """
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
            "before": sum(own.cost for own in self.prepared.errors.active),
            "costs": {own.name: own.cost for own in sources},
            "made": {own.name: self._process(own) for own in sources if own.name in self.prepared.space.processes},
        }

    def _process(self, source: Source) -> str:
        """Return the cheapest process that holds a source's zone, the one that prices it."""
        made = cheapest(self.prepared.space, source.name, source.zone)
        return made.name if made else "as drawn"

    def units(self, design: LiveDesign, count: object, wanted: Callable[[], bool]) -> dict[str, Any] | None:
        """Return what random units of a design say; nothing if they are not wanted any more.

        Raises
        ------
        InputError
            A number of units that is none.
        """
        if not (type(count) is int and 1 <= count <= MOST):
            raise InputError.at("page", "units", count, f"a whole number up to {MOST}")
        values = self._solved(design, count, wanted)
        return None if values is None else judged(self.prepared, self.outputs, values[:count])

    def _solved(
        self, design: LiveDesign, count: int, wanted: Callable[[], bool]
    ) -> Float[np.ndarray, "unit output"] | None:
        """Return the outputs of the first units, of which those that are known are not solved again."""
        with self._lock:
            values = self._known.get(design, np.empty((0, len(self.outputs))))
        response = self.model(design).reading(self.outputs)
        while len(values) < count and wanted():
            evaluation = response(self.deviations(design, slice(len(values), min(len(values) + _LOOK, count))))
            good = np.where(evaluation.good[:, np.newaxis], evaluation.values, np.nan)
            values = np.concatenate([values, good])
        self._remember(design, values)
        return values if len(values) >= count else None

    def _remember(self, design: LiveDesign, values: Float[np.ndarray, "unit output"]) -> None:
        """Remember the units of a design, and forget those of the oldest ones."""
        with self._lock:
            known = self._known.pop(design, values)
            self._known[design] = max(values, known, key=len)
            while len(self._known) > _REMEMBERED:
                self._known.pop(next(iter(self._known)))

    def examined(self, design: LiveDesign) -> list[str]:
        """Return what a check says of the settings and the first random units, such as how many are preloaded."""
        model, known = self.model(design), self.prepared.model.settings
        chosen = [replace(own, value=value) for own, value in zip(known, design.settings, strict=True)]
        beyond = [f"{own.sentence}." for own in chosen if own.strays]
        beyond += [sentence for own in self.sources(design) if (sentence := outside_range(own))]
        return [*beyond, *model.examined(self.deviations(design, slice(0, FIRST))).sentences]

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
                *(_setting(own, model.settings_word) for own in model.settings),
                # an odd number of steps leaves out the middle, a torque of 0, at which play leaves all undetermined
                *(_setting(own, "operating condition", _STEPS + 1) for own in model.operating_conditions),
            ],
            "limits": [own.sentence for own in self.requirements],
            "currency": self.prepared.currency or COST_UNITS,
        }


def _setting(own: Setting, word: str, steps: int = _STEPS) -> dict[str, Any]:
    step = (own.upper - own.lower) / steps
    return {"name": own.name, "value": own.value, "lower": own.lower, "upper": own.upper, "step": step, "word": word}


def _described(source: Source, processes: tuple[Process, ...]) -> dict[str, Any]:
    smallest = min((own.minimum for own in processes), default=source.minimum)
    largest = max((own.maximum for own in processes), default=source.maximum)
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
        "group": source.group or source.name,
        "locked": source.locked,
        "cost": source.cost,
    }

"""What other zones do to cost, yield and quantiles: both drawings on the same random units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.design_space import DesignSpace, named_zones, repriced
from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Requirement
from tolalloc.capability.indices import Interval
from tolalloc.capability.monte_carlo import quantile_change, share_change
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import CHUNK, SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.models.model import Model, Response
from tolalloc.running.progress import RunRecord

_CHUNKS_AT_ONCE = 16
"""Chunks of units that are in memory at a time, enough for many workers [-]."""


@dataclass(frozen=True, kw_only=True)
class DifferenceResult:
    """Two drawings on the same random units."""

    requirements: tuple[Requirement, ...]  # What is limited, the leading output first
    # The sources that change, as they are and at their other zones with their costs
    before: tuple[Source, ...]
    after: tuple[Source, ...]
    whole_cost: float  # Cost of the whole drawing before [cost units]
    outputs: tuple[str, ...]  # Names of the outputs
    # Of the drawing before and after, NaN where a unit has none [as the names state]
    values: Float[np.ndarray, "2 unit output"]
    seeds: SeedTree  # Of the resamples

    @property
    def cost_change(self) -> float:
        """Change of the cost [cost units]."""
        return sum(own.cost for own in self.after) - sum(own.cost for own in self.before)

    @cached_property
    def yields(self) -> tuple[float, float]:
        """Share of units that keep all limits, before and after [-]."""
        return float(self._kept(0).mean()), float(self._kept(1).mean())

    @cached_property
    def yield_change(self) -> Interval:
        """Change of the share of units that keep all limits [-]."""
        return share_change(self._kept(0), self._kept(1))

    @cached_property
    def limited(self) -> tuple[tuple[Requirement, float], ...]:
        """Every requirement with the share of a quantile that is limited, with both where it has two limits [-]."""
        return tuple((own, share) for own in self.requirements for share in limited_shares(own))

    @property
    def quantiles(self) -> tuple[tuple[float, float], ...]:
        """Every limited quantile before and after, in the order of `limited` [unit of the output]."""
        found = (tuple(float(np.nanquantile(side, share)) for side in self._values(own)) for own, share in self.limited)
        return tuple((before, after) for before, after in found)

    @cached_property
    def quantile_changes(self) -> tuple[Interval, ...]:
        """Change of every limited quantile, in the order of `limited` [unit of the output]."""
        return tuple(
            quantile_change(before, after, share, self.seeds.child(own.output).generator())
            for own, share in self.limited
            for before, after in (self._values(own),)
        )

    @property
    def unanswered(self) -> int:
        """Number of solutions without an answer, of both drawings together [-]."""
        return int(np.count_nonzero(np.isnan(self.values).any(axis=2)))

    def _kept(self, side: int) -> Bool[np.ndarray, " unit"]:
        """Return which units keep all limits."""
        return np.asarray(np.all([own.limits.kept_by(self._values(own)[side]) for own in self.requirements], axis=0))

    def _values(self, requirement: Requirement) -> Float[np.ndarray, "2 unit"]:
        return self.values[:, :, self.outputs.index(requirement.output)]


def difference(
    model: Model,
    space: DesignSpace,
    requirements: tuple[Requirement, ...],
    zones: Mapping[str, float],
    units: int,
    seeds: SeedTree,
    record: RunRecord,
) -> DifferenceResult:
    """Return what other zones change, with the settings as they are.

    Parameters
    ----------
    zones
        Source, or a pattern of several as ``disc*.pitch``, and its full zone [µm].

    Notes
    -----
    Var(y′ − y) = Var y′ + Var y − 2·Cov(y′, y) is small as both drawings use the same uniform numbers (common random
    numbers): Glasserman & Yao 1992, Management Science 38, 884–908.
    """
    errors = space.errors
    wanted = named_zones(errors, zones)
    present, changed = repriced(space, {}), repriced(space, wanted)
    outputs = tuple(dict.fromkeys(own.output for own in requirements))
    drawings = [np.array([source.zone for source in own]) for own in (present, changed)]
    with record.stage("difference", 2 * units):
        values = _solved(model.observed(record.observe).reading(outputs), errors, drawings, units, seeds)
    pairs = [(old, new) for old, new in zip(present, changed, strict=True) if old.name in wanted]
    return DifferenceResult(
        requirements=requirements,
        before=tuple(old for old, _ in pairs),
        after=tuple(new for _, new in pairs),
        whole_cost=sum(own.cost for own in present),
        outputs=outputs,
        values=values,
        seeds=seeds.child("resamples"),
    )


def _solved(
    response: Response, errors: ErrorModel, drawings: list[Float[np.ndarray, " source"]], units: int, seeds: SeedTree
) -> Float[np.ndarray, "drawing unit output"]:
    """Return the outputs of the same units by the zones of every drawing, NaN where a unit has none.

    The units themselves are in memory some at a time: ten million of them would be gigabytes.
    """
    values, columns = np.empty((len(drawings), units, len(response.outputs))), len(errors.columns)
    for first in range(0, units, _CHUNKS_AT_ONCE * CHUNK):
        indices = range(first // CHUNK, -(-min(first + _CHUNKS_AT_ONCE * CHUNK, units) // CHUNK))
        uniform = np.concatenate([seeds.uniform_chunk(index, columns) for index in indices])
        standard = errors.standard_values(uniform[: units - first])
        for own, zones in zip(values, drawings, strict=True):
            found = response(errors.deviations(standard, zones))
            own[first : first + len(standard)] = found.known
    return values


def limited_shares(requirement: Requirement) -> tuple[float, ...]:
    """Return the share of the quantile that each limit must keep, the upper one's first [-].

    Two limits leave half of the rejects beyond either of them.

    1 − (1 − Y)/k of k limits, or its complement for a lower one (own derivation).
    """
    target = requirement.guarantee.target if isinstance(requirement.guarantee, AtYield) else USUAL_YIELD
    sides = requirement.limits.turned
    beyond = (1 - target) / len(sides)
    return tuple(1 - beyond if sign > 0 else beyond for sign, _ in sides)

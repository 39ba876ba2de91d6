"""What other zones do to cost, yield and quantiles: both drawings on the same random units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.design_space import DesignSpace, named_zones, outside_range, repriced
from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Requirement
from tolalloc.capability.monte_carlo import Change, quantile_change, share_change
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import CHUNK, SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import with_own_words
from tolalloc.models.model import Model, Response
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header
from tolalloc.reports.wording import short
from tolalloc.running.progress import RunRecord

if TYPE_CHECKING:
    import pandas as pd

_CHUNKS_AT_ONCE = 16
"""Chunks of units that are in memory at a time, enough for many workers [-]."""
_BEYOND = 10
"""Units beyond a quantile below which its interval is too narrow [-]."""


@dataclass(frozen=True, kw_only=True)
class DifferenceAnswer(Answer):
    """Two drawings on the same random units."""

    kind: ClassVar[str] = "difference"

    requirements: tuple[Requirement, ...]  # What is limited, the leading output first
    before: tuple[Source, ...]  # The sources that change, as they are
    after: tuple[Source, ...]  # The same with other zones and their costs
    whole_cost: float  # Cost of the whole drawing before [cost units]
    outputs: tuple[str, ...]  # Names of the outputs
    values: Float[np.ndarray, "2 unit output"]  # Of the drawing before and after, NaN where a unit has none
    seeds: SeedTree  # Of the resamples

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"Other zones of {self.header.model}: {self.header.name}"

    @property
    def cost_change(self) -> float:
        """Change of the cost [cost units]."""
        return sum(own.cost for own in self.after) - sum(own.cost for own in self.before)

    @cached_property
    def yield_change(self) -> Change:
        """Change of the share of units that keep all limits [-]."""
        return share_change(*(self._kept(side) for side in (0, 1)))

    def _kept(self, side: int) -> Bool[np.ndarray, " unit"]:
        """Return which units keep all limits."""
        return np.asarray(np.all([own.limits.kept_by(self._values(own)[side]) for own in self.requirements], axis=0))

    def _values(self, requirement: Requirement) -> Float[np.ndarray, "2 unit"]:
        return self.values[:, :, self.outputs.index(requirement.output)]

    @cached_property
    def limited(self) -> tuple[tuple[Requirement, float], ...]:
        """Every requirement with the share of a quantile that is limited, with both where it has two limits [-]."""
        return tuple((own, share) for own in self.requirements for share in limited_shares(own))

    @cached_property
    def quantile_changes(self) -> tuple[Change, ...]:
        """Change of every limited quantile, in the order of `limited` [unit of the output]."""
        return tuple(
            quantile_change(before, after, share, self.seeds.child(own.output).generator())
            for own, share in self.limited
            for before, after in (self._values(own),)
        )

    @cached_property
    def changes(self) -> pd.DataFrame:
        """Cost, yield and every limited quantile before and after, with the intervals of what is random."""
        import pandas as pd

        def row(what: str, unit: str, before: float, after: float, change: Change | None) -> dict[str, object]:
            own = change or Change(estimate=after - before, low=float("nan"), high=float("nan"))
            return {
                "what": what,
                "unit": unit,
                "before [unit]": before,
                "after [unit]": after,
                "change [unit]": own.estimate,
                "low 95 % [unit]": own.low,
                "high 95 % [unit]": own.high,
            }

        shares, found = [100 * float(self._kept(side).mean()) for side in (0, 1)], self.yield_change
        percent = Change(estimate=100 * found.estimate, low=100 * found.low, high=100 * found.high)
        rows = [
            row("cost", "cost units", self.whole_cost, self.whole_cost + self.cost_change, None),
            row("yield, all limits", "%", shares[0], shares[1], percent),
        ]
        for (own, share), change in zip(self.limited, self.quantile_changes, strict=True):
            before, after = (float(np.nanquantile(side, share)) for side in self._values(own))
            what = f"{_percent(share)} of {short(own.output)}"
            rows.append(row(what, unit_of(own.output), before, after, change))
        return pd.DataFrame(rows)

    @cached_property
    def zones(self) -> pd.DataFrame:
        """The zones that change, with their costs."""
        import pandas as pd

        changed = pd.DataFrame(
            {
                "source": [own.name for own in self.before],
                "zone before [µm]": [own.zone / MICROMETRE for own in self.before],
                "zone after [µm]": [own.zone / MICROMETRE for own in self.after],
                "cost before [cost units]": [own.cost for own in self.before],
                "cost after [cost units]": [own.cost for own in self.after],
            }
        )
        return with_own_words(changed, "source", {own.name: (own,) for own in self.before})

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        found, unit = self.yield_change, unit_of(self.requirements[0].output)
        quantiles = " and ".join(
            f"the {_percent(share)} quantile of the {short(own.output)} by {change.estimate:+.3g} {unit} "
            f"({change.low:+.3g}…{change.high:+.3g})"
            for (own, share), change in zip(self.limited, self.quantile_changes, strict=True)
            if own is self.requirements[0]
        )
        return (
            f"The drawing costs {self.whole_cost + self.cost_change:.2f} cost units instead of {self.whole_cost:.2f} "
            f"({self.cost_change:+.2f}).",
            f"On the same {self.values.shape[1]} random units the share that keeps all limits changes by "
            f"{100 * found.estimate:+.2f} points (95 % interval {100 * found.low:+.2f}…{100 * found.high:+.2f}), "
            f"{quantiles}.",
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        units = self.values.shape[1]
        found = [sentence for own in self.after if (sentence := outside_range(own))]
        if any(units * min(share, 1 - share) < _BEYOND for _, share in self.limited):
            found.append(
                f"Of {units} units fewer than {_BEYOND} lie beyond a quantile: its interval is too narrow. Take more."
            )
        if lost := int(np.count_nonzero(np.isnan(self.values).any(axis=2))):
            found.append(f"{lost} of {2 * units} solutions have no answer; they count as outside the limits.")
        return tuple(found)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their tables."""
        return (
            Section(heading="What changes", paragraphs=(), tables=(("changes", self.changes),)),
            Section(heading="Which zones", paragraphs=(), tables=(("changed zones", self.zones),)),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        return {
            "study": self.header.name,
            "seed": self.header.seed,
            "units [-]": self.values.shape[1],
            "changes": self.changes.replace({np.nan: None}).to_dict("records"),
            "zones": self.zones.to_dict("records"),
            "statuses": dict(self.header.statuses),
            "warnings": list(self.warnings),
        }


def difference(
    model: Model,
    space: DesignSpace,
    requirements: tuple[Requirement, ...],
    zones: Mapping[str, float],
    units: int,
    seeds: SeedTree,
    record: RunRecord,
    header: Header,
) -> DifferenceAnswer:
    """Return what other zones change, with the settings as they are.

    Parameters
    ----------
    zones
        Source, or a pattern of several as ``disc*.pitch``, and its full zone [µm].

    Raises
    ------
    InputError, UnknownNameError
        A pattern that fits no source with a zone, a zone that is not above 0 or that no process holds.
    """
    errors = space.errors
    wanted = named_zones(errors, zones)
    changed = repriced(space, wanted)
    outputs = tuple(dict.fromkeys(own.output for own in requirements))
    drawings = [np.array([source.zone for source in own]) for own in (errors.active, changed)]
    with record.stage("difference"):
        values = _solved(model.observed(record.observe).reading(outputs), errors, drawings, units, seeds)
    pairs = [(old, new) for old, new in zip(errors.active, changed, strict=True) if old.name in wanted]
    return DifferenceAnswer(
        header=replace(header, statuses=record.counts, stages=record.stages),
        requirements=requirements,
        before=tuple(old for old, _ in pairs),
        after=tuple(new for _, new in pairs),
        whole_cost=sum(own.cost for own in errors.active),
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
            own[first : first + len(standard)] = np.where(found.good[:, np.newaxis], found.values, np.nan)
    return values


def limited_shares(requirement: Requirement) -> tuple[float, ...]:
    """Return the share of the quantile that each limit must keep, the upper one's first [-].

    Two limits leave half of the rejects beyond either of them.
    """
    target = requirement.guarantee.target if isinstance(requirement.guarantee, AtYield) else USUAL_YIELD
    sides = requirement.limits.turned
    beyond = (1 - target) / len(sides)
    return tuple(1 - beyond if sign > 0 else beyond for sign, _ in sides)


def _percent(share: float) -> str:
    """Return a share in percent, with as many digits as half of the usual rejects take."""
    return f"{100 * share:.5g}%"

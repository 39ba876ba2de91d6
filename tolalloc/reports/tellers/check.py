"""What a study reads, in lines for a person, before anything long runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.capability.monte_carlo import KeptLimits, Yield
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source, by_row
from tolalloc.drawings.tolerance_table import doubts
from tolalloc.models.model import Model
from tolalloc.reports.document import Section
from tolalloc.reports.finished_run import told_yields
from tolalloc.reports.portrait import Examination, Portrait, portrait_of
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import short, with_unit

_say = Sentences("check")

MORE_PARTS = 100
"""Measured parts of every source whose worth is said where there are fewer [-]."""


@dataclass(frozen=True, kw_only=True)
class CheckedTime:
    """About how long a question takes."""

    effort: str  # Quick or full
    kind: str  # Name of the question
    units: tuple[int, int]  # About how many units it solves, at least and at most [-]
    seconds: tuple[float, float]  # About how long that takes here, once everything is compiled [s]

    @property
    def sentence(self) -> str:
        """The same in words."""
        least, most = (in_words(seconds) for seconds in self.seconds)
        return f"{self.kind}: about {self.units[0]:,} to {self.units[1]:,} units, {least} to {most} here."


def in_words(seconds: float) -> str:
    """Return a time as a person says it.

    >>> in_words(0.4), in_words(42.0), in_words(300.0), in_words(9000.0)
    ('1 s', '42 s', '5.0 min', '2.5 h')
    """
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.1f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@dataclass(frozen=True, kw_only=True)
class Checked:
    """What a study reads; where no question reads anything there is no model."""

    questions: tuple[str, ...]  # Kinds of its questions
    script: str = ""  # Script that defines it; empty where it was made elsewhere
    model: Model | None = None
    errors: ErrorModel = field(default_factory=lambda: ErrorModel(()))
    space: DesignSpace | None = None
    requirements: tuple[Requirement, ...] = ()
    notes: tuple[str, ...] = ()  # What the drawing says beside its rows
    examined: Mapping[str, float] = field(default_factory=dict)  # Counted of some random units, units in the names
    times: tuple[CheckedTime, ...] = ()  # How long the questions take; none unless asked for
    missed: tuple[str, ...] = ()  # On limits that no settings let parts in the middle of their zones keep
    kept: KeptLimits | None = None  # Shares of some random units that keep the limits; none where none were solved


class CheckTeller(Teller[Checked]):
    """What is said of a checked study."""

    @property
    def title(self) -> str:
        """The sentence that sums it up."""
        kinds = ", ".join(self.result.questions)
        if self.result.model is None:
            return _say("in_order_asks", study=self.header.name, kinds=kinds)
        doubted = _say("doubted_row" if self._doubted == 1 else "doubted_rows", count=self._doubted)
        missed = _say("missed_limits") if self.result.missed else ""
        but = "; ".join(own for own in (doubted if self._doubted else "", missed, self._examination.but) if own)
        state = _say("can_be_run" if self._examination.fault or missed else "in_order")
        return _say("verdict_but" if but else "verdict", study=self.header.name, state=state, but=but)

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """What was read, line by line."""
        result, lines = self.result, list[str]()
        if result.model is not None:
            lines = [*self._read, *_zones(result.errors.active)]
            lines += [f"  {own}" for own in result.errors.correlation.mappings(result.errors.sources)]
            lines += [f"  {setting.sentence}" for setting in result.model.settings]
            lines += [*self._costs, *self._neglected, *result.notes, *self._examination.sentences, *result.missed]
            lines += [today_sentence(result.kept)] if result.kept else []
            quick = _say("quick")
            lines += [f"{f'{quick} ' if own.effort == 'quick' else ''}{own.sentence}" for own in result.times]
        if result.script:
            lines.append(_say("program", script=result.script))
        return (*lines, self.title)

    @property
    def sections(self) -> tuple[Section, ...]:
        """None: the sentences say all."""
        return ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What was read, for a program."""
        result, model = self.result, self.result.model
        if model is None or result.space is None:
            return {"study": self.header.name, "questions": ", ".join(result.questions)}
        found: dict[str, Any] = {
            "study": self.header.name,
            "model": model.name,
            "sources": len(result.errors.sources),
            "varying": len(result.errors.active),
            "groups": list(result.space.groups),
            "limits": {own.output: [own.limits.lower, own.limits.upper] for own in result.requirements},
            "questions": list(result.questions),
        }
        if "allocation" in result.questions:
            found["cost of the tolerance table [cost units]"] = _cost(result.space)
        found["neglected"] = [*self._zero, *self._portrait.left_out]
        found |= {"examined": list(self._examination.sentences), "but": self._examination.but}
        found["doubted rows"] = self._doubted
        if result.kept:
            found |= told_yields(result.kept.each, result.kept.joint)
        if result.times:
            found["durations"] = {
                f"{own.effort} {own.kind}": {"units": list(own.units), "seconds": list(own.seconds)}
                for own in result.times
            }
        return found

    @property
    def _read(self) -> tuple[str, ...]:
        """Which study, model, sources and limits."""
        result, name = self.result, self.header.name
        said = {
            "model": self.header.model,
            "varying": len(result.errors.active),
            "sources": len(result.errors.sources),
            "groups": len(result.space.groups) if result.space else 0,
            "kinds": ", ".join(result.questions),
        }
        first = _say("script", script=result.script, study=name) if result.script else _say("study", study=name)
        limits = (f"  limit: {requirement.sentence}" for requirement in result.requirements)
        return (first, _say("model", **said), *limits)

    @property
    def _costs(self) -> tuple[str, ...]:
        """What the zones of the table cost, where an allocation asks."""
        space = self.result.space
        if space is None or "allocation" not in self.result.questions:
            return ()
        said = {"cost": _cost(space), "unit": self.header.cost_unit, "locked": space.locked_cost}
        return (_say("cost_locked" if space.locked_cost else "cost", **said),)

    @property
    def _neglected(self) -> tuple[str, ...]:
        """Rows with a zone of 0, and what the model leaves out."""
        kinds = ", ".join(dict.fromkeys(map(_without_numbers, self._zero)))
        counts = {"count": len(self._zero), "rows": len(self.result.errors.sources)}
        rows = (_say("neglected_rows", kinds=kinds, **counts),) if self._zero else ()
        return (*rows, *(_say("neglected", what=own) for own in self._portrait.left_out))

    @property
    def _zero(self) -> list[str]:
        """Sources with a zone of 0."""
        return [source.name for source in self.result.errors.sources if source.zone == 0.0]

    @cached_property
    def _portrait(self) -> Portrait[Any]:
        if self.result.model is None:
            raise TypeError("a study that reads nothing has no model to tell of")
        return portrait_of(self.result.model)

    @cached_property
    def _examination(self) -> Examination:
        return self._portrait.examination(self.result.examined)

    @cached_property
    def _doubted(self) -> int:
        return len(doubts(self.result.errors.sources, self.result.errors.table))


def missed_sentence(output: str, value: float, limit: float, settings: Mapping[str, float]) -> str:
    """Return how near parts in the middle of their zones come to a limit that they miss [unit of the output]."""
    at = ", ".join(f"{name} = {own:.3g}" for name, own in settings.items())
    reached, end = (with_unit(f"{own:.4g}", output) for own in (value, limit))
    return _say("missed", output=short(output), limit=end, value=reached, settings=f" ({at})" if at else "")


def today_sentence(kept: KeptLimits) -> str:
    """Return how many random units of the drawing as it is keep its limits."""
    joint = kept.joint
    each = ", ".join(_say("each", output=short(name), share=own.estimate) for name, own in kept.each.items())
    one = {"output": short(next(iter(kept.each)))} if len(kept.each) == 1 else {}
    today = _say("today_one" if one else "today", each=each, **one, **interval_gaps(joint))
    return " ".join((today, *few_parts(joint)))


def interval_gaps(found: Yield) -> dict[str, float]:
    """Return a share of units and the ends of its interval as sentences print them, ``{low:.2f}–{high:.2%}``."""
    return {"share": found.estimate, "low": 100 * found.low, "high": found.high, "units": found.units}


def few_parts(found: Yield) -> tuple[str, ...]:
    """Return that an interval holds what measured parts leave open, and what it would be with 100 of them.

    Nothing without measured parts.
    """
    if found.widening is None:
        return ()
    parts = found.widening.uncertainty.parts
    gaps = {"parts": min(parts), "sources": len(parts), **interval_gaps(found)}
    said = [_say("few_parts_one" if len(parts) == 1 else "few_parts", **gaps)]
    if min(parts) < MORE_PARTS:
        more = found.widening.with_parts(MORE_PARTS)
        said.append(_say("more_parts", more=MORE_PARTS, **interval_gaps(more)))
    return (" ".join(said),)


def _cost(space: DesignSpace) -> float:
    """Return what the zones of the table cost [cost units]."""
    return float(space.cost(space.uniform(1.0)))


def _zones(sources: tuple[Source, ...]) -> list[str]:
    """Return a line for every source, or one for all whose names differ by their numbers alone, if they are alike."""
    said: dict[str, dict[str, str]] = {}
    for source, members in by_row(sources):
        name = f"{source.own_id} ({source.name})" if source.own_id else source.name
        if source.name != members[0].name:
            name += f", {len(members)} places ({', '.join(own.name for own in members)})"
        span = f"may become {source.said(source.minimum).split()[0]}…{source.said(source.maximum)}"
        mapping = f"{source.mapping}; {'locked' if source.locked else span}"
        said.setdefault(_without_numbers(name), {})[name] = mapping
    lines = []
    for pattern, own in said.items():
        alike = len(own) > 1 and len({*own.values()}) == 1
        together = {f"{pattern} ({len(own)} rows, each)": next(iter(own.values()))} if alike else own
        lines += [f"  {name}: {mapping}" for name, mapping in together.items()]
    return lines


def _without_numbers(name: str) -> str:
    """Return the name of a source with a star for every number."""
    return re.sub(r"\d+", "*", name)


TELLER = CheckTeller

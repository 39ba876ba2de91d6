"""A study with all its files read and all names matched; nothing is solved."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.cost.process_costs import ProcessesOfSources, currency_of_costs, load_process_costs, priced
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.effort import AllocationEffort
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Guarantee, OwnLimit, Requirement, WorstCase
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import KeptLimits, ProcessUncertainty, deciding
from tolalloc.drawings.compensators import Compensator, all_choices, choice_label, in_force
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.population import ANYWHERE, STATED, taken_as
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source, is_angular
from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.models.identity import UnknownIdentityError
from tolalloc.models.model import HasCopies, Model
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.check import missed_sentence
from tolalloc.running.chunks import Mapper
from tolalloc.sensitivity.effort import RankingEffort
from tolalloc.study.problem import COMMON, Limit, Problem

_ASSEMBLED = "Units are judged as they are assembled, by an allocation with its own choice, else with {label}."
_AS_THEY_COME = "Units are judged with parts as they come, but by an allocation, which may choose {labels}."
_SHARED = "Rows without a group are one line where identical parts have the same zone, limits and price: {lines}."
"""What is said of the lines that `Prepared.errors` made, with the number of rows of each."""


JUDGED = 1024
"""Random units that say how a drawing stands as it is [-]."""
_TRIED = 5
"""Values over the range of each setting at which parts in the middle of their zones are tried [-]."""


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """A study that may be asked."""

    study: Problem  # What it is about
    mapper: Mapper = map  # What solves the model's chunks of samples

    @property
    def place(self) -> str:
        """Where the study stands, for messages."""
        return self.study.place

    @cached_property
    def _stated(self) -> ErrorModel:
        """The sources of the drawing as its table states them, each place of a row for several."""
        if self.study.drawing is None:
            raise InputError(f"{self.place}: drawing is missing; give ta.drawing(...), the tolerance table.")
        errors, model = self.study.drawing.as_asked, self.study.model
        counts = model and any(own.is_of_places for own in errors.sources)
        return errors.at_places(model.source_names) if model and counts else errors

    @cached_property
    def errors(self) -> ErrorModel:
        """The sources of the drawing, each with its group.

        Where the table states none, it is the line of the drawing on which the source stands with its copies on
        identical parts: those of which the table states the same zone, limits and price. A source that stands there
        alone is called what the user's table calls it.
        """
        source, rows = self.study.model, [own for own in self._stated.sources if not own.group]
        stated = {own.name: (own.stated, repr(self._processes.get(own.name))) for own in rows}
        lines: Mapping[str, str] = source.shared_lines(stated) if isinstance(source, HasCopies) else {}
        count = Counter(lines.values())

        def line(own: Source) -> str:
            named = lines.get(own.name, own.name)
            return own.own_id if own.own_id and count[named] <= 1 else named

        found = (replace(own, group=own.group or line(own)) for own in self._stated.sources)
        return replace(self._stated, sources=tuple(found), compensators=self.assemblies[0])

    @cached_property
    def assemblies(self) -> tuple[tuple[Compensator, ...], ...]:
        """What may act at assembly, every combination of classes and sizes; the first one is that of today."""
        choices = all_choices(self.study.compensators, self.place)
        return tuple(in_force(own, self._stated.sources, self.place) for own in choices)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the drawing: that of its table, and which rows share a line without a group."""
        stated = self.study.drawing.notes if self.study.drawing else ()
        rows = zip(self._stated.sources, self.errors.sources, strict=True)
        lines = Counter(own.group for before, own in rows if not before.group)
        shared = ", ".join(f"{line} ({rows})" for line, rows in lines.items() if rows > 1)
        acting, *others = self.assemblies
        asked = " or ".join(choice_label(own) for own in others if own)
        population = self.study.drawing.population if self.study.drawing else STATED
        return (
            *stated,
            *((taken_as(population),) if population != STATED else ()),
            *filter(None, [self.study.drawing and self.study.drawing.opened]),
            *((_SHARED.format(lines=shared),) if shared else ()),
            *((_ASSEMBLED.format(label=choice_label(acting)),) if acting else ()),
            *((_AS_THEY_COME.format(labels=asked),) if asked and not acting else ()),
        )

    @cached_property
    def model(self) -> Model:
        """The model at the sources of the drawing."""
        if self.study.model is None:
            raise InputError(f"{self.place}: model is missing; give ta.reducer(...) or ta.model(...).")
        settings = self.study.drawing.settings if self.study.drawing else {}
        source = self.study.model
        if self.study.neglected:
            source = source.leaving_out(self.study.neglected)
        if settings:
            try:
                source = source.set_to(settings)
            except (InputError, UnknownNameError) as error:
                raise type(error)(f"{self.place}: the drawing {self.errors.table} states settings: {error}") from None
        return source.bound(self.errors, self.place).mapped(self.mapper)

    @cached_property
    def requirements(self) -> tuple[Requirement, ...]:
        """What the study limits, the leading output first."""
        if not self.study.limits:
            raise InputError(f"{self.place}: limits is empty; limit one output at least, the leading one first.")
        for name in self.study.limits:
            UnknownNameError.require(self.place, "output in limits", name, self.model.outputs)
        asked = {name: limit for name, limit in self.study.limits.items() if limit is not None}
        for name in self.study.limits.keys() - asked.keys() - self.model.own_limits.keys():
            allowed = "ta.Limit(...): the model has no limit of its own to lift there"
            raise InputError.at(self.place, f"limits[{name!r}]", None, allowed)
        if not asked:
            raise InputError(f"{self.place}: every limit is None; limit one output at least, the leading one first.")
        own_joint = self.study.joint if isinstance(self.study.joint, AtYield) else None

        def shown(limit: Limit) -> Guarantee:
            return WorstCase() if self._promises_worst_unit else limit.show or own_joint or limit.guarantee

        stated = (
            Requirement(output=name, limits=limit.limits, guarantee=shown(limit)) for name, limit in asked.items()
        )
        own = (
            OwnLimit(output=name, limits=Limits(upper=upper), guarantee=shown(Limit(upper=upper)))
            for name, upper in self.model.own_limits.items()
            if name not in self.study.limits
        )
        return (*stated, *own)

    @property
    def _promises_worst_unit(self) -> bool:
        """Whether the drawing promises for parts anywhere in their zones, so that only the worst unit tells."""
        return self.study.drawing is not None and self.study.drawing.population == ANYWHERE

    @property
    def joint(self) -> AtYield | None:
        """What all limits at once must be shown for, unless told otherwise the one yield that all of them ask for.

        A limit that the model has of its own, which nobody wrote, is kept at once with them and has no say in it.
        """
        if self._promises_worst_unit:
            return None
        if self.study.joint != COMMON:
            return self.study.joint
        stated = [limit.guarantee for limit in self.study.limits.values() if limit is not None]
        first = stated[0]
        return first if isinstance(first, AtYield) and all(own == first for own in stated) else None

    @property
    def requirements_with_joint(self) -> tuple[Requirement, ...]:
        """What the study limits, and last that a share of the units keeps all limits at once, if it asks for that."""
        return self._with_joint(self.requirements)

    @property
    def led_by_what_decides(self) -> tuple[Requirement, ...]:
        """The same with the limit first that decides for the drawing as it is, one of those that the study states."""
        stated = [own.output for own in self.requirements if own.output in self.study.limits]
        if self.joint is None or len(stated) < 2:
            return self.requirements_with_joint
        first = deciding({output: 1.0 - self.judged.each[output].estimate for output in stated})
        return self._with_joint(tuple(sorted(self.requirements, key=lambda own: own.output != first)))

    def _with_joint(self, requirements: tuple[Requirement, ...]) -> tuple[Requirement, ...]:
        if len(requirements) == 1 or self.joint is None:
            return requirements
        return (*requirements, JointRequirement.of(requirements, self.joint))

    @property
    def target(self) -> float:
        """Share of units that must keep the first limit [-]."""
        shown = self.requirements[0].guarantee
        return shown.target if isinstance(shown, AtYield) else USUAL_YIELD

    @cached_property
    def space(self) -> DesignSpace:
        """Zones and settings that an allocation may choose."""
        return DesignSpace(errors=self.errors, settings=self.model.settings, processes=self._processes)

    @cached_property
    def _processes(self) -> ProcessesOfSources:
        """Ways to make the features whose zones may change; none but that of the table without process costs."""
        costs = self.study.drawing.costs if self.study.drawing else ""
        if isinstance(costs, Mapping):
            for name, row in ((name, row) for name, rows in costs.items() for row in rows):
                if len(row) != 5:
                    allowed = "(name, A, B, smallest t, largest t)"
                    raise InputError.at(f"{self.place}, process costs of {name}", "row", row, allowed)
            # What a person writes in Python is a tolerance ± t, half a zone.
            return priced(costs, self._stated.sources, "half zone")
        return load_process_costs(costs, self._stated.sources) if costs else {}

    @property
    def ranking_effort(self) -> RankingEffort:
        """How much a ranking may compute, more blocks for a model that answers for whole arrays."""
        return self.study.effort.of_ranking(self.model, self._dimensions, len(self._sharing))

    @property
    def allocation_effort(self) -> AllocationEffort:
        """How much an allocation may compute, more units for a model that answers for whole arrays."""
        return self.study.effort.of_allocation(self.model, len(self._sharing))

    @property
    def _dimensions(self) -> int:
        """Dimensions of the drawing, which a ranking tells apart [-]."""
        return len({*self.errors.dimension_of_column})

    @property
    def _sharing(self) -> tuple[str, ...]:
        """Questions that share a time: the rankings and allocations of the study, by kind."""
        kinds = tuple(getattr(question, "kind", "") for question in self.study.questions)
        return tuple(kind for kind in kinds if kind in ("ranking", "allocation")) or ("ranking",)

    @property
    def _counted(self) -> int:
        """About how many units the questions that share a time solve [-]."""
        counted = {
            "ranking": self.ranking_effort.counted(self._dimensions),
            "allocation": self.allocation_effort.counted,
        }
        return sum(counted[kind] for kind in self._sharing)

    @cached_property
    def currency(self) -> str:
        """What costs are in, by the headers of tolerance table and process costs; empty where they are cost units."""
        drawing = self.study.drawing
        own, made = (drawing.currency, currency_of_costs(drawing.costs)) if drawing else ("", "")
        if own and made and own != made:
            raise InputError.at(str(drawing and drawing.costs), "currency", made, f"{own} as in the tolerance table")
        return own or made

    @cached_property
    def digest(self) -> str:
        """Digest of the study and of what its files hold, wherever they stand; empty where that is not known."""
        if self.unknown:
            return ""
        study = self.study
        content = (
            (study.name, study.seed, study.largest_failed_share, study.effort, study.questions),
            (dict(study.limits), study.joint, *filter(None, [study.drawing and study.drawing.population])),
            self.model.content,
            self.errors.sources,
            self.errors.correlation,
            self.space.processes,
            *((self.assemblies,) if self.study.compensators else ()),
        )
        return hashlib.sha256(repr(content).encode()).hexdigest()

    @cached_property
    def unknown(self) -> str:
        """Why nothing tells whether its model is the same as before; nothing where something does."""
        try:
            repr(self.study.model and self.model.content)
        except UnknownIdentityError as reason:
            return f"whether the model of {self.place} is the same as before is not known: {reason}"
        return ""

    @cached_property
    def missed(self) -> tuple[str, ...]:
        """On stated limits that parts in the middle of their zones miss in force and at a grid over the settings."""
        settings, said = {own.name: own for own in self.model.settings}, []
        ranges = ({*np.linspace(own.lower, own.upper, _TRIED).tolist()} for own in settings.values())
        tried = [tuple(own.value for own in settings.values()), *product(*ranges)]
        for output, limit in ((own.output, own.limits) for own in self.requirements if own.output in self.study.limits):
            best = (-np.inf, np.nan, tried[0])
            for values in tried:
                model = self.model.at(np.array(values)) if values else self.model
                value = float(model.reading((output,))(self.errors.middles[np.newaxis]).values[0, 0])
                best = max(best, (np.nan_to_num(limit.distance(value), nan=-np.inf), value, values))
                if best[0] >= 0.0:
                    break
            if -np.inf < best[0] < 0.0:
                _, end = max(limit.turned, key=lambda own: own[0] * (best[1] - own[1]))
                said.append(missed_sentence(output, best[1], end, dict(zip(settings, best[2], strict=True))))
        return tuple(said)

    def random_units(self, units: int) -> Float[np.ndarray, "unit column"]:
        """Return the deviations of random units at the zones of the drawing [m, angles rad]."""
        return self.errors.random_units(units, SeedTree(self.study.seed).child("check"))

    def require_answers(self, units: int) -> None:
        """Raise unless enough random units have an answer, and say what one without it is like."""
        response, x = self.model.reading(tuple(own.output for own in self.requirements)), self.random_units(units)
        found, share = response(x), self.study.largest_failed_share
        failed = found.status != 0
        if np.mean(failed) <= share:
            return
        lost = [name for name, own in zip(response.outputs, found.values.T, strict=True) if not np.isfinite(own).all()]
        units_of = ("µrad" if is_angular(own) else "µm" for own in self.errors.source_of_column)
        first = zip(self.errors.columns, (x[failed][0] / MICROMETRE).tolist(), units_of, strict=True)
        outputs = f" of {' and '.join(lost)}" if lost else ""
        deviates = ", ".join(f"{name} {value:+.3g} {unit}" for name, value, unit in first if value).replace("-", "−")
        raise SolveError(
            f"{self.place}: {failed.sum()} of {units} random units have no usable answer{outputs}; allowed is a share "
            f"of {share:g}, `largest_failed_share` of the study. The first of them deviates by {deviates}."
        )

    def kept_limits(self, units: int) -> KeptLimits:
        """Return the shares of random units at the zones of the drawing that keep each limit and all at once."""
        limits = {own.output: own.limits for own in self.requirements}
        response = self.model.reading(tuple(limits))
        x = self.random_units(units)
        return KeptLimits.of(response(x), response.outputs, limits, ProcessUncertainty.about(self.errors, x))

    @cached_property
    def judged(self) -> KeptLimits:
        """Those of enough units to say how the drawing stands as it is."""
        return self.kept_limits(JUDGED)

    @property
    def header(self) -> Header:
        """What every answer of this study says of it; statuses and stages come with the answer."""
        return Header(
            name=self.study.name,
            model=self.model.name,
            seed=self.study.seed,
            quick=self.study.quick,
            digest=self.digest,
            conditions=self.model.conditions,
            currency=self.currency,
            title_block=self.study.title_block,
            assumptions=(
                *portrait_of(self.model).assumptions,
                *self.notes,
                *self.study.effort.notes(self.model, self._counted),
            ),
        )

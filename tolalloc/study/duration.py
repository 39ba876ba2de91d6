"""About how long a question takes on this machine: how many units it solves, and what one costs here."""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING

import numpy as np

from tolalloc.allocation.front.uncertain_region import doubted
from tolalloc.allocation.search.settings_scan import units_of_scan
from tolalloc.allocation.space.tail import tail_units
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reports.tellers.check import CheckedTime
from tolalloc.sensitivity.effort import BY_SOURCE
from tolalloc.sensitivity.inverse import fewest_units
from tolalloc.sensitivity.surrogate.control_variate import units_to_learn
from tolalloc.study.questions import Allocation, Ranking

if TYPE_CHECKING:
    from tolalloc.study.prepared import Prepared

_TIMED = 128
"""Units that are timed [-]."""
_TRIALS = 8
"""Units of the surrogates and their trials over those that they learn from, as counted in shipped studies [-]."""
_CONFIRMATIONS = (0.3, 16.0)
"""Units of a confirmation over its largest number for one design: the least as counted in shipped studies, the most of
four designs of each of four lines [-]."""


def durations(prepared: Prepared) -> tuple[CheckedTime, ...]:
    """Return what the ranking and the allocation of a study will take, those of them that it asks."""
    found, effort = [], "quick" if prepared.study.quick else "full"
    for question in prepared.study.questions:
        if isinstance(question, Ranking):
            parts = _of_ranking(question, prepared)
        elif isinstance(question, Allocation):
            parts = _of_allocation(question, prepared)
        else:
            continue
        least, most = (sum(part.units[at] for part in parts) for at in (0, 1))
        lower, upper = (sum((part.units[at] * part.seconds for part in parts), 0.0) for at in (0, 1))
        found.append(CheckedTime(effort=effort, kind=question.kind, units=(least, most), seconds=(lower, upper)))
    return tuple(found)


def expected_seconds(prepared: Prepared) -> float:
    """Return about how long the ranking and the allocation of a study take together on this machine [s].

    Units as `counted` by their efforts, each with what a few random ones take here: of a ranking with all outputs that
    it ranks, of an allocation with those that are limited.
    """
    model, effort = prepared.model, prepared.ranking_effort
    limited = tuple(dict.fromkeys(own.output for own in prepared.requirements))
    ranked = tuple(name for name in model.outputs if name in {*model.ranked, *limited})
    kinds = [question.kind for question in prepared.study.questions]
    units = {
        Ranking.kind: (effort.counted(len({*prepared.errors.dimension_of_column})), ranked),
        Allocation.kind: (prepared.allocation_effort.counted, limited),
    }
    asked = [units[kind] for kind in kinds if kind in units]
    return sum((count * _seconds(prepared, outputs) for count, outputs in asked), 0.0)


@dataclass(frozen=True, kw_only=True)
class _Workload:
    """Units of one kind."""

    units: tuple[int, int]  # At least and at most [-]
    seconds: float  # What one takes [s]


def _of_ranking(question: Ranking, prepared: Prepared) -> tuple[_Workload, ...]:
    """Return random units, Saltelli blocks and units of the leading output alone, each with what is asked of them."""
    model, errors, effort = prepared.model, prepared.errors, prepared.ranking_effort
    leading = prepared.requirements[0].output
    outputs = tuple(name for name in model.outputs if name in {*model.ranked, *prepared.study.limits})
    waves = tuple(name for names in model.spectra.values() for name in names)
    whole, alone = _seconds(prepared, outputs), _seconds(prepared, (leading,))
    of_all, of_leading = (_seconds(prepared, asked, uncertain=True) for asked in ((*outputs, *waves), (leading,)))
    by_source = question.by == BY_SOURCE
    ranked = len(errors.blocks if by_source else {*errors.dimension_of_column}) + len(model.uncertain)
    inverse = max(effort.inverse_units, fewest_units(prepared.target))
    trials = 2 * effort.derivative_units + (len(errors.blocks) + 2) * inverse
    first = effort.sobol.start * (ranked + 2)
    most = trials + _TRIALS * effort.surrogate_units + 3 * effort.units
    return (
        _Workload(units=(effort.units, effort.units), seconds=whole),
        _Workload(units=(first, first), seconds=of_all),
        _Workload(units=(0, effort.sobol.counted(ranked) - first), seconds=of_leading),
        _Workload(units=(0, most), seconds=alone),
    )


def _of_allocation(question: Allocation, prepared: Prepared) -> tuple[_Workload, ...]:
    """Return the units of searches, confirmation, fronts, what-ifs and shares, all with the limited outputs."""
    effort, model, errors = prepared.allocation_effort, prepared.model, prepared.errors
    settings = len(prepared.space.settings)
    searches = 2 if question.fixed_first and settings else 1
    outputs = tuple(dict.fromkeys(own.output for own in prepared.requirements))
    # A model without derivatives is solved on either side of every column, an output without on either side of every
    # variable of the design.
    around = effort.verification_units * (2 if model.differentiable else 1 + 2 * len(errors.columns))
    # Where settings are free, a search looks at others and begins at two.
    steps = searches * (effort.search.steps + 2) + 3 * question.grades * effort.graded_steps + 2 * bool(settings)
    scan = units_of_scan(effort.verification_units) * bool(settings)
    of_front = len(effort.front_limits) * (effort.front_steps + 1) * effort.front_units
    fronts = round(question.front * of_front * around / effort.verification_units)
    what_if = question.what_if * (
        sum(2 * len(own.columns) + 2 for own in doubted(model).uncertain) * effort.stiffness_units
        + prod(effort.setting_steps[:settings]) * 4 * effort.shared_units
    )
    shares = effort.share_blocks * (len({*errors.dimension_of_column}) + 2)
    shares += units_to_learn(errors, effort.share_blocks)
    confirmed = tuple(round(share * effort.confirmation_units) for share in _CONFIRMATIONS)
    least = effort.verification_units + confirmed[0]
    most = steps * around + scan + confirmed[1] + fronts + what_if + shares
    parts = (_Workload(units=(least, most), seconds=_seconds(prepared, outputs)),)
    rough = tuple(name for name in outputs if name not in {*model.exact, *model.differentiable})
    if not rough:
        return parts
    told = tail_units(effort.verification_units, 1 - prepared.target)
    differences = steps * 2 * told * (len(prepared.space.groups) + settings)
    return (*parts, _Workload(units=(0, differences), seconds=_seconds(prepared, rough)))


def _seconds(prepared: Prepared, outputs: tuple[str, ...], *, uncertain: bool = False) -> float:
    """Return what one unit takes, timed on a few random ones after others that compile what is needed [s]."""
    model, errors = prepared.model, prepared.errors
    response = model.reading(outputs)
    experiment = Experiment.of(response, errors, SeedTree(prepared.study.seed).child("duration"))
    x = experiment.deviations(errors.standard_values(experiment.uniform(_TIMED)))
    if uncertain and model.uncertain:
        response = model.with_uncertain(outputs)
        x = np.pad(x, ((0, 0), (0, len(response.columns) - x.shape[1])))
    response(x[:8])
    start = time.perf_counter()
    response(x)
    return (time.perf_counter() - start) / _TIMED

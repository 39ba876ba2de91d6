"""The stages of a study, in order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.by_hand import scale_by_hand
from tolalloc.allocation.fronts import exact_front, searched_front
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.search import allocate, require_reachable
from tolalloc.allocation.verification import Verifier
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.progress import Record
from tolalloc.report.results import ExampleUnit, StudyResults
from tolalloc.rv.cycloid.assessment import Assessment, assess
from tolalloc.rv.equivalent.hysteresis import LOOP_ANGLES, hysteresis_loop
from tolalloc.rv.equivalent.outputs import order_spectrum
from tolalloc.rv.reducer.design import Modification, Reducer
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse
from tolalloc.rv.response.stiffness import StiffnessEffect, StiffnessResponse, stiffness_effect
from tolalloc.sensitivity.classical import classical_estimate
from tolalloc.sensitivity.sobol import FactorGroup, SobolEffort, sobol_indices
from tolalloc.sensitivity.sobol_analysis import SobolIndices
from tolalloc.study.definition import Prepared
from tolalloc.units import ARCMINUTE

_FIRST_SPREAD = 3.1
"""Distance of the 99.73 % quantile from the mean over σ, until a large sample has said better [-]."""


_FRONT = (0.6, 1.5)
"""Ends of the front over the limit asked for [-]."""
_EFFECT_UNITS = 256
"""Units over which the effect of the stiffness is averaged [-]."""
_DIRECTIONS, _UNITS_PER_DIRECTION = 3, 32
"""Directions in which the stiffnesses are changed together, either way, and units that the kernel solves there [-]."""


def run_stages(prepared: Prepared, record: Record, quick: bool) -> StudyResults:
    """Return the results of a study; nothing is written.

    Parameters
    ----------
    prepared
        The checked study.
    record
        Keeps statuses and times.
    quick
        Whether the effort was shortened, for the report to say so.

    Raises
    ------
    InputError
        The limit is below what the smallest zones leave.
    SolveError
        Too many units failed.
    """
    study, space = prepared.study, prepared.space
    seeds, kernel = SeedTree(study.seed), replace(prepared.kernel, observe=record.observe)
    shared = next(seeds.child("shared").uniform_chunks(study.effort.shared_units, len(space.errors.columns)))
    quantile = QuantileResponse(
        space=space, kernel=kernel, standard=space.errors.standard_values(shared), spread=_FIRST_SPREAD
    )
    with record.stage("is the limit in reach"):
        require_reachable(quantile, study.limit_arcsec, study.yield_target, f"study {study.name}")
    with record.stage("allocation"):
        verifier = Verifier(
            space=space,
            kernel=kernel,
            requirements=prepared.requirements[:1],
            seeds=seeds.child("verification"),
            units=study.effort.verification_units,
            largest_failed_share=study.largest_failed_share,
        )
        search = study.effort.search
        by_hand = scale_by_hand(verifier, prepared.reducer.modification, search.steps)
        allocation = allocate(verifier, by_hand, search)
    with record.stage("front"):
        shares = np.linspace(*_FRONT, search.front.points)
        exact = exact_front(space, allocation.limit_stacks, allocation.limit, shares)
        front, surrogate = searched_front(
            quantile, allocation.chosen, allocation.limit_stacks, exact, seeds.child("front"), search.front
        )
    with record.stage("ranking"):
        sobol, stiffness = _ranking(prepared, kernel, allocation.baseline.sample, seeds)
        share = study.largest_failed_share
        classical = classical_estimate(Experiment.of(kernel, space.errors, seeds.child("classical"), share))
    with record.stage("report"):
        return StudyResults(
            name=study.name,
            seed=study.seed,
            quick=quick,
            reducer=prepared.reducer,
            torque=kernel.torque,
            identified=prepared.identified,
            torsional_stiffness=_torsional_stiffness(prepared),
            space=space,
            limit=study.limit_arcsec,
            target=study.yield_target,
            sobol=sobol,
            classical=classical,
            stiffness=stiffness,
            allocation=allocation,
            front=front,
            surrogate=surrogate,
            unit=prepared.unit,
            neglected=prepared.neglected,
            contacts=(
                _contact(prepared.reducer, prepared.reducer.modification),
                _contact(prepared.reducer, space.modification(allocation.chosen.design)),
            ),
            examples=_examples(
                prepared, allocation.baseline.sample, allocation.chosen.sample, allocation.chosen.design
            ),
            statuses=record.counts,
        )


def _ranking(
    prepared: Prepared, kernel: KernelResponse, sample: MonteCarlo, seeds: SeedTree
) -> tuple[SobolIndices, StiffnessEffect | None]:
    """Return the ranking at the zones of the tolerance table, and what not knowing the stiffness does, if it is one."""
    errors, own, blocks = prepared.space.errors, seeds.child("sobol"), prepared.study.effort.sobol_blocks
    effort, share = SobolEffort(start=blocks, limit=blocks), prepared.study.largest_failed_share
    # Correlated sources share their variance, so their block has the index.
    factor_group = FactorGroup.BLOCK if errors.is_correlated else FactorGroup.SOURCE
    if prepared.identified is None or prepared.stiffness is None:
        return sobol_indices(Experiment.of(kernel, errors, own, share), effort, factor_group).of(PEAK_TO_PEAK), None
    response = StiffnessResponse(kernel=kernel, stiffnesses=tuple(prepared.identified.values))
    joint = replace(errors, joint=(prepared.stiffness,))
    units = sample.x[sample.evaluation.good][:_EFFECT_UNITS]
    directions = seeds.child("stiffness").generator().standard_normal((_DIRECTIONS, len(response.stiffnesses)))
    effect = stiffness_effect(response, prepared.stiffness, units, directions, _UNITS_PER_DIRECTION)
    return sobol_indices(Experiment.of(response, joint, own, share), effort, factor_group).of(PEAK_TO_PEAK), effect


def _torsional_stiffness(prepared: Prepared) -> float:
    """Return the torsional stiffness of the perfect reducer between 3 % and 100 % of rated torque [N·m/arcmin]."""
    model = prepared.kernel.model
    perfect = np.zeros((1, len(model.columns)))
    return float(hysteresis_loop(model, perfect, LOOP_ANGLES).torsional_stiffness[0] * ARCMINUTE)


def _contact(reducer: Reducer, modification: Modification) -> Assessment | None:
    """Return how the exact teeth carry the rated torque; none where they interfere before any load."""
    try:
        return assess(replace(reducer, modification=modification), reducer.load.rated_torque)
    except InputError:
        return None


def _examples(
    prepared: Prepared, baseline: MonteCarlo, chosen: MonteCarlo, design: Float[np.ndarray, " variable"]
) -> tuple[ExampleUnit, ...]:
    """Return the curves of the built unit, if any, and of the median units before and after."""
    kernel, after = prepared.kernel, prepared.kernel.with_modification(prepared.space.modification(design))
    rows = [
        ("median unit before", kernel.errors(baseline.unit_at(0.5))),
        ("median unit after", after.errors(chosen.unit_at(0.5))),
    ]
    if prepared.unit:
        rows.insert(
            0,
            (
                f"unit {prepared.unit.name}",
                prepared.unit.errors(kernel.model.columns, prepared.reducer.modification.deviations),
            ),
        )
    curves = [(label, kernel.model.equilibria(errors, kernel.torque)) for label, errors in rows]
    return tuple(
        ExampleUnit(label=label, curves=curve, orders=order_spectrum(curve.transmission_error))
        for label, curve in curves
    )

"""From a study to what drives its outputs, with the confidence of every answer."""

from __future__ import annotations

from dataclasses import replace

from tolalloc.blas import one_blas_thread
from tolalloc.progress import Progress, Record
from tolalloc.rv.equivalent.status import OUTCOMES
from tolalloc.rv.response.kernel import PEAK_TO_PEAK
from tolalloc.rv.response.outputs import wave_outputs
from tolalloc.sensitivity.answer.results import RankingResults
from tolalloc.sensitivity.order_contribution import order_contribution
from tolalloc.study.definition import Study, prepare
from tolalloc.study.effort import QUICK
from tolalloc.study.measures import Measures


def rank(study: Study, progress: Progress, *, quick: bool = False) -> RankingResults:
    """Return what drives the outputs of a study's reducer at the zones of its tolerance table.

    Parameters
    ----------
    study
        What is asked for; its limit, target and other limits are the requirements.
    progress
        Told how far the work has come.
    quick
        Replace the study's effort by a small one.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    SolveError
        Too many units failed.
    """
    prepared, record = prepare(replace(study, effort=QUICK) if quick else study), Record(progress, OUTCOMES)
    measures = Measures(prepared=prepared, kernel=replace(prepared.kernel, observe=record.observe))
    limits, orders = measures.limits, measures.orders
    with one_blas_thread():
        with record.stage("random units"):
            sample = measures.sample()
        with record.stage("Sobol indices"):
            sobol = measures.sobol("sobol", orders)
        with record.stage("Sobol, second seed"):
            again = measures.sobol("second seed", (), sobol.growth.history[-1].blocks)
        with record.stage("other measures"):
            shapley, local, derivatives = measures.shapley(), measures.local(), measures.derivatives()
            effects, moments, classical = measures.effects(), measures.moments(sample), measures.classical()
        with record.stage("units out of the limit"):
            reject, beyond = measures.reject(sample), measures.beyond(sample)
        with record.stage("surrogates"):
            choice = measures.choice(sample)
        with record.stage("zones alone"):
            inverse = measures.inverse(choice)
    return RankingResults(
        name=study.name,
        quick=quick,
        digest=prepared.hash,
        seed=study.seed,
        reducer=prepared.reducer,
        torque=prepared.kernel.torque,
        identified=prepared.identified is not None,
        errors=measures.errors,
        limits=limits,
        target=study.yield_target,
        outputs=measures.requirements.outputs,
        sample=sample,
        spread=prepared.study.effort.ranking.design,
        sobol=sobol,
        reproduction=sobol.of(PEAK_TO_PEAK).reproduced_by(again.of(PEAK_TO_PEAK)),
        orders=order_contribution(sobol, {order: wave_outputs(order) for order in orders}),
        shapley=shapley,
        classical=classical,
        local=local,
        derivatives=derivatives,
        effects=effects,
        moments=moments,
        reject=reject,
        inverse=inverse,
        beyond=beyond,
        choice=choice,
        neglected=prepared.neglected,
        statuses=record.counts,
        stages=record.stages,
    )

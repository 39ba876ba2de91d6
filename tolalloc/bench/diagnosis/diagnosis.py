"""Diagnosis of one unit: from its transmission error curve to the errors of its parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, UInt8
from scipy.stats import chi2

from tolalloc.bench.diagnosis.dominance import dominant, named_set, reductions
from tolalloc.bench.diagnosis.groups import groups
from tolalloc.bench.diagnosis.half_turn import exchanged, has_half_turn
from tolalloc.bench.diagnosis.posterior import SampleEffort, posterior, with_twins
from tolalloc.bench.diagnosis.problem import CurveProblem
from tolalloc.bench.diagnosis.readings import Noise, thinned
from tolalloc.bench.diagnosis.result import IMPLAUSIBLE, TAILS, Diagnosis, Fit
from tolalloc.bench.diagnosis.search import SearchEffort, explain
from tolalloc.bench.measurement.records import MeasuredCurve
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.drawing.seeds import SeedTree
from tolalloc.drawing.sources import limited_measure
from tolalloc.exceptions import InputError, SolveError
from tolalloc.model import Observer
from tolalloc.rv.response.kernel import KernelResponse


@dataclass(frozen=True, kw_only=True)
class DiagnosisEffort:
    """How much a diagnosis may compute.

    Parameters
    ----------
    angles
        Most readings of a turn that are used [-].
    search, sample
        Effort of the search and of the sampling.
    judged
        Sampled units whose dominant source is looked for [-].
    """

    angles: int = 240
    search: SearchEffort = field(default_factory=SearchEffort)
    sample: SampleEffort = field(default_factory=SampleEffort)
    judged: int = 128


@dataclass
class _Tally:
    """Counts what passes on its way to the observer."""

    observe: Observer
    solved: int = 0
    failed: int = 0

    def __call__(self, status: UInt8[np.ndarray, " sample"]) -> None:
        self.solved, self.failed = self.solved + status.size, self.failed + int((status != 0).sum())
        self.observe(status)


def diagnose(
    curve: MeasuredCurve,
    kernel: KernelResponse,
    errors: ErrorModel,
    zones: Float[np.ndarray, " source"],
    noise: Noise,
    seeds: SeedTree,
    effort: DiagnosisEffort,
    level: float = 0.97,
    largest_failed_share: float = 0.01,
) -> Diagnosis:
    """Return what a measured curve tells of the errors of the unit's parts.

    Parameters
    ----------
    curve
        Transmission error over one output turn or a piece of one.
    kernel
        The real model, solved at the curve's torque; its columns are those of the errors.
    errors
        What the drawings say of the errors.
    zones
        Zones of the sources that vary [m].
    noise
        What separates a reading from the model.
    seeds
        Node of the seed tree.
    effort
        How much may be computed.
    level
        Probability that the named sources must have of containing the dominant one [-].
    largest_failed_share
        Largest share of solved curves that may fail [-].

    Raises
    ------
    InputError
        Too few readings, a level that is no probability, or sources that stand on no drawing.
    SolveError
        More of the curves failed.

    Notes
    -----
    Bayes' rule with the drawings as prior. The map from errors to curve has kinks wherever a pin takes over, and one
    curve has many near explanations: scouts led from the prior towards the curve find them, damped Gauss–Newton steps
    climb down, and sequential Monte Carlo on the kernel samples the errors around the best one.
    """
    if not 0.0 < level < 1.0:
        raise InputError.at("diagnosis", "level", level, "a number between 0 and 1")
    if errors.joint:
        raise InputError.at("diagnosis", "joint source", errors.joint[0].name, "none, sources of the drawings only")
    tally = _Tally(kernel.observe)
    problem = CurveProblem(
        kernel=replace(kernel, torque=curve.torque, observe=tally),
        errors=errors,
        zones=zones,
        readings=thinned(curve, noise, effort.angles),
    )
    explanation = explain(problem, seeds.child("search"), effort.search)
    numbers = posterior(problem, explanation, seeds.child("posterior").generator(), effort.sample)
    deviations = with_twins(problem, problem.deviations(numbers), seeds.child("twins").generator())
    judged = deviations[seeds.child("judged").generator().permutation(len(deviations))[: effort.judged]]
    fit = _fit(problem, numbers, judged)
    names, probability = tuple(source.name for source in errors.active), np.zeros(len(errors.active))
    if fit.explained:
        falls = reductions(problem, judged, largest_failed_share)
        probability = np.bincount(dominant(falls), minlength=len(names)) / len(falls)
    if tally.failed > largest_failed_share * tally.solved:
        raise SolveError(f"{tally.failed} of {tally.solved} curves of a diagnosis failed to solve.")
    gauge = np.stack(
        [limited_measure(source, deviations[:, _places(errors, source.name)]) for source in errors.active], axis=1
    )
    return Diagnosis(
        sources=names,
        columns=errors.columns,
        deviations=deviations,
        reading_mean=gauge.mean(axis=0),
        reading_interval=np.quantile(gauge, TAILS, axis=0),
        dominant_probability=probability,
        named=tuple(names[at] for at in named_set(probability, level)) if fit.explained else (),
        twins=_twins(names) if has_half_turn(kernel.model.reducer, errors.columns) else (),
        groups=groups(numbers, errors.columns, errors.source_of_column),
        fit=fit,
        evaluations=tally.solved,
        failed=tally.failed,
    )


def _places(errors: ErrorModel, name: str) -> list[int]:
    return [at for at, owner in enumerate(errors.source_of_column) if owner == name]


def _twins(names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((name, exchanged(name)) for name in names if name < exchanged(name))


def _fit(
    problem: CurveProblem, numbers: Float[np.ndarray, "particle column"], judged: Float[np.ndarray, "unit column"]
) -> Fit:
    """Return the measured curve beside those of the errors that it allows."""
    readings, misfit, curves = problem.readings, problem.misfit(numbers), problem.curves(judged)
    curves -= curves.mean(axis=1, keepdims=True)
    square = 2.0 * float(misfit.mean())
    return Fit(
        carrier_angle=readings.carrier_angle,
        measured=readings.values - readings.values.mean(),
        fitted=curves.mean(axis=0),
        band=np.quantile(curves, TAILS, axis=0),
        chi_square=square,
        freedom=readings.freedom,
        explained=bool(chi2.sf(square, readings.freedom) >= IMPLAUSIBLE),
    )

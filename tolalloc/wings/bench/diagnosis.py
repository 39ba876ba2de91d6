"""Diagnosis of one unit: from its transmission error curve to the errors of its parts."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float, UInt8
from scipy.stats import chi2

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.named_fields import NamedFields, number
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.chunks import one_blas_thread
from tolalloc.running.progress import SILENT, Progress, RunRecord
from tolalloc.wings.bench.measurements import MeasuredCurve
from tolalloc.wings.bench.posterior import (
    CurveProblem,
    DiagnosisEffort,
    GaugeReading,
    Noise,
    explain,
    gauges_shown,
    posterior,
    thinned,
)
from tolalloc.wings.bench.readings import ANGLE, TRANSMISSION_ERROR, clean_curve, load_readings, require_torque
from tolalloc.wings.bench.repair import Advice, Repair, advised
from tolalloc.wings.bench.sources import (
    InseparableColumns,
    dominant,
    exchanged,
    groups,
    has_half_turn,
    named_set,
    reductions,
    with_twins,
)

IMPLAUSIBLE = 0.001
"""Probability of residuals as large, were the model true, below which a curve is not explained [-]."""

TAILS = (0.025, 0.975)
"""Shares below the ends of the intervals [-]."""


PLACE = "diagnosis"


@dataclass(frozen=True, kw_only=True)
class CurveFit:
    """How the curve is explained."""

    carrier_angle: Float[np.ndarray, " angle"]  # Angles of the readings that were used [rad]
    # Readings, and mean curve of the errors that they allow, each without its mean [rad]
    measured: Float[np.ndarray, " angle"]
    fitted: Float[np.ndarray, " angle"]
    band: Float[np.ndarray, "2 angle"]  # 95 % interval of those curves [rad]
    # Mean sum of squared residuals in standard deviations, and what it would be on average, were the model true [-]
    chi_square: float
    freedom: int
    explained: bool  # Whether residuals as large have a probability of `IMPLAUSIBLE` or more


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """What the curve of a unit tells of its parts."""

    # Names of the sources and of their columns
    sources: tuple[str, ...]
    columns: tuple[str, ...]
    # Columns of units that have this curve, all equally likely [m, angles rad]
    deviations: Float[np.ndarray, "particle column"]
    # What the gauge of each source would show, mean and 95 % interval [m]
    reading_mean: Float[np.ndarray, " source"]
    reading_interval: Float[np.ndarray, "2 source"]
    # Probability that each source is the dominant one; 0 for all where the curve is not explained [-]
    dominant_probability: Float[np.ndarray, " source"]
    # Fewest sources that contain the dominant one at the level asked for, likeliest first; none where the curve is not
    # explained
    named: tuple[str, ...]
    # Pairs of sources that no curve tells apart: a unit turned by half a turn is the same reducer
    twins: tuple[tuple[str, str], ...]
    # Columns that this curve does not tell apart, and what it tells of them together; for one of two twins
    groups: tuple[InseparableColumns, ...]
    fit: CurveFit  # Measured and fitted curve
    # Curves solved, and those among them that failed [-]
    evaluations: int
    failed: int

    @property
    def column_interval(self) -> Float[np.ndarray, "2 column"]:
        """95 % interval of every column [m, angles rad]."""
        return np.asarray(np.quantile(self.deviations, TAILS, axis=0))


def diagnose(
    curve: MeasuredCurve,
    kernel: KernelResponse,
    errors: ErrorModel,
    zones: Float[np.ndarray, " source"],
    noise: Noise,
    seeds: SeedTree,
    effort: DiagnosisEffort,
    level: float = 0.97,
    progress: Progress = SILENT,
    gauged: tuple[GaugeReading, ...] = (),
) -> Diagnosis:
    """Return what a measured curve tells of the errors of the unit's parts.

    The kernel is solved at the curve's torque and has the columns of the errors; zones are those of the sources that
    vary [m]. The named sources contain the dominant one with the probability ``level`` [-]. Each stage of the work is
    told as it begins. What gauges have read of its parts already narrows them too.

    Bayes' rule with the drawings as prior. The map from errors to curve has kinks wherever a pin takes over, and one
    curve has many near explanations: scouts led from the prior towards the curve find them, damped Gauss–Newton steps
    climb down, and sequential Monte Carlo on the kernel samples the errors around the best one.
    """
    if errors.joint:
        raise InputError.at("diagnosis", "joint source", errors.joint[0].name, "none, sources of the drawings only")
    solved: Counter[bool] = Counter()

    def observe(status: UInt8[np.ndarray, " sample"]) -> None:
        solved.update({True: int((status == 0).sum()), False: int((status != 0).sum())})
        kernel.observe(status)

    problem = CurveProblem(
        kernel=replace(kernel, torque=curve.torque, observe=observe),
        errors=errors,
        zones=zones,
        readings=thinned(curve, noise, effort.angles),
        gauged=gauged,
    )
    progress.begin("explanations of the curve")
    explanation = explain(problem, seeds.child("search"), effort)
    progress.begin("errors that the curve allows")
    numbers = posterior(problem, explanation, seeds.child("posterior").generator(), effort)
    deviations = with_twins(problem, problem.deviations(numbers), seeds.child("twins").generator())
    judged = deviations[seeds.child("judged").generator().permutation(len(deviations))[: effort.judged]]
    progress.begin("dominant source")
    fit = _fit(problem, numbers, judged)
    names, probability = tuple(source.name for source in errors.active), np.zeros(len(errors.active))
    if fit.explained:
        falls = reductions(problem, judged)
        probability = np.bincount(dominant(falls), minlength=len(names)) / len(falls)
    if solved[False] > LARGEST_FAILED_SHARE * solved.total():
        raise SolveError(f"{solved[False]} of {solved.total()} curves of a diagnosis failed to solve.")
    gauge = gauges_shown(errors, errors.active, deviations)
    twins = tuple((name, exchanged(name)) for name in names if name < exchanged(name))
    return Diagnosis(
        sources=names,
        columns=errors.columns,
        deviations=deviations,
        reading_mean=gauge.mean(axis=0),
        reading_interval=np.quantile(gauge, TAILS, axis=0),
        dominant_probability=probability,
        named=tuple(names[at] for at in named_set(probability, level)) if fit.explained else (),
        twins=twins if has_half_turn(kernel.model.reducer, errors.columns) else (),
        groups=groups(numbers, errors.columns, errors.source_of_column),
        fit=fit,
        evaluations=solved.total(),
        failed=solved[False],
    )


def _fit(
    problem: CurveProblem, numbers: Float[np.ndarray, "particle column"], judged: Float[np.ndarray, "unit column"]
) -> CurveFit:
    """Return the measured curve beside those of the errors that it allows."""
    readings, misfit, curves = problem.readings, problem.misfit(numbers), problem.curves(judged)
    curves -= curves.mean(axis=1, keepdims=True)
    square = 2.0 * float(misfit.mean())
    return CurveFit(
        carrier_angle=readings.carrier_angle,
        measured=readings.values - readings.values.mean(),
        fitted=curves.mean(axis=0),
        band=np.quantile(curves, TAILS, axis=0),
        chi_square=square,
        freedom=problem.freedom,
        explained=bool(chi2.sf(square, problem.freedom) >= IMPLAUSIBLE),
    )


@dataclass(frozen=True, kw_only=True)
class DiagnosisRequest(NamedFields):
    """Which unit is to be diagnosed."""

    called: ClassVar[str] = PLACE
    are_arguments: ClassVar[bool] = True

    curve: Path  # CSV file with the columns ``angle [deg]`` and ``transmission error [arcsec]``
    reducer: Reducer  # Nominal design, with the stiffness in use
    errors: ErrorModel  # What the drawings say of its parts
    # Torque on the carrier, negative where it resists the rotation; the test torque unless given [N·m]
    torque_nm: float | None = None
    # Standard deviation of one reading, and of what the model leaves out [arcsec]
    noise_arcsec: Annotated[float, number("above 0 up to 60", above=0, most=60)] = 0.5
    discrepancy_arcsec: Annotated[float, number("0 to 60", least=0, most=60)] = 0.5
    # Added to every angle of the bench [deg]
    angle_offset_deg: Annotated[float, number("-360 to 360", least=-360, most=360)] = 0.0
    # Probability that the named sources must have of containing the dominant one [-]
    level: Annotated[float, number("0.5 up to but not 1", least=0.5, below=1)] = 0.97
    seed: int = 1  # Seed of every random number [-]
    neglected: tuple[str, ...] = ()  # Sources that the drawings may leave out, beside those that they may anyway
    repair: Repair | None = None  # What may be done with it, at which prices; None if nothing is to be decided
    effort: DiagnosisEffort = field(default_factory=DiagnosisEffort)  # How much may be computed


@dataclass(frozen=True, kw_only=True)
class DiagnosisResult:
    """A diagnosed unit."""

    request: DiagnosisRequest  # What was asked
    assumed: tuple[str, ...]  # What binding the drawings to the reducer assumes
    curve: MeasuredCurve  # Its cleaned curve, and the torque on the carrier at which it was measured
    noise: Noise  # What separates a reading from the model
    diagnosis: Diagnosis  # What was found
    advice: Advice | None = None  # What to do with it; None if no prices were given, or nothing explains the curve


def diagnose_unit(request: DiagnosisRequest, record: RunRecord) -> DiagnosisResult:
    """Return what the curve of a unit tells of its parts, and keep account of the curves that are solved."""
    kernel, assumed = bind(request.reducer, request.errors, request.torque_nm, PLACE, request.neglected)
    require_torque(request.curve, kernel.torque)
    cleaned = clean_curve(load_readings(request.curve, ANGLE, TRANSMISSION_ERROR), request.angle_offset_deg * DEGREE)
    kernel, errors = replace(kernel, observe=record.observe), request.errors
    curve = MeasuredCurve(
        unit=0,
        torque=kernel.torque,
        carrier_angle=cleaned.along,
        transmission_error=cleaned.values,
        repairs=cleaned.repairs,
    )
    noise = Noise(
        reading=request.noise_arcsec * cleaned.noise_factor * ARCSECOND,
        discrepancy=request.discrepancy_arcsec * ARCSECOND,
    )
    with one_blas_thread(), record.stage("diagnosis"):
        seeds = SeedTree(request.seed).child("diagnosis")
        asked, progress, repair = request.effort, record.progress, request.repair
        gauged = repair.readings(errors.active) if repair else ()
        found = diagnose(curve, kernel, errors, errors.zones, noise, seeds, asked, request.level, progress, gauged)
        advice = None
        if repair and found.fit.explained:
            progress.begin("worth of the next reading")
            advice = advised(kernel, errors, found.deviations, repair, seeds.child("repair").generator())
    return DiagnosisResult(
        request=request,
        assumed=assumed,
        curve=curve,
        noise=noise,
        diagnosis=found,
        advice=advice,
    )

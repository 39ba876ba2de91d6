"""From the measured curve of one unit to the errors of its parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from tolalloc.bench.diagnosis.answer import DiagnosisAnswer
from tolalloc.bench.diagnosis.diagnosis import diagnose
from tolalloc.bench.diagnosis.problem import Noise
from tolalloc.bench.diagnosis.search import DiagnosisEffort
from tolalloc.bench.measurement.cleaning import clean_curve
from tolalloc.bench.measurement.files import MeasuredCurve
from tolalloc.bench.measurement.readings import ANGLE, TRANSMISSION_ERROR, load_readings
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree, require_seed
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.equivalent.answers import OUTCOMES
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reports.header import Header
from tolalloc.running.blas import one_blas_thread
from tolalloc.running.progress import Progress, RunRecord

LARGEST_NOISE = 60.0
"""Largest error of a reading that is believed [arcsec]."""

PLACE = "diagnosis"


@dataclass(frozen=True, kw_only=True)
class DiagnosisRequest:
    """Which unit is to be diagnosed."""

    curve: Path  # CSV file with the columns ``angle [deg]`` and ``transmission error [arcsec]``
    reducer: Reducer  # Nominal design, with the stiffness in use
    errors: ErrorModel  # What the drawings say of its parts
    # Torque on the carrier, negative where it resists the rotation; the test torque unless given [N·m]
    torque_nm: float | None = None
    noise_arcsec: float = 0.5  # Standard deviation of one reading [arcsec]
    discrepancy_arcsec: float = 0.5  # Standard deviation of what the model leaves out [arcsec]
    angle_offset_deg: float = 0.0  # Added to every angle of the bench [deg]
    level: float = 0.97  # Probability that the named sources must have of containing the dominant one [-]
    seed: int = 1  # Seed of every random number [-]
    effort: DiagnosisEffort = field(default_factory=DiagnosisEffort)  # How much may be computed

    def __post_init__(self) -> None:
        for name, value, good, allowed in (
            (
                "noise_arcsec",
                self.noise_arcsec,
                0 < self.noise_arcsec <= LARGEST_NOISE,
                f"above 0 up to {LARGEST_NOISE:g}",
            ),
            ("discrepancy_arcsec", self.discrepancy_arcsec, 0 <= self.discrepancy_arcsec <= LARGEST_NOISE, "0 to 60"),
            ("angle_offset_deg", self.angle_offset_deg, -360 <= self.angle_offset_deg <= 360, "-360 to 360"),
            ("level", self.level, 0.5 <= self.level < 1, "0.5 up to but not 1"),
        ):
            if not good:
                raise InputError.of_argument(PLACE, name, value, allowed)
        require_seed(PLACE, self.seed)


def diagnose_unit(request: DiagnosisRequest, progress: Progress) -> DiagnosisAnswer:
    """Return what the curve of a unit tells of its parts, and tell how far the work has come.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    SolveError
        Too many curves failed.
    """
    record = RunRecord(progress, OUTCOMES)
    kernel, assumed = bind(request.reducer, request.errors, request.torque_nm, PLACE)
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
        found = diagnose(curve, kernel, errors, errors.zones, noise, seeds, request.effort, request.level)
    return DiagnosisAnswer(
        header=Header(
            name=request.curve.stem,
            model=request.reducer.name,
            seed=request.seed,
            assumptions=assumed,
            statuses=record.counts,
            stages=record.stages,
        ),
        reducer=request.reducer,
        torque=kernel.torque,
        errors=errors,
        curve=curve,
        noise=noise,
        level=request.level,
        diagnosis=found,
    )

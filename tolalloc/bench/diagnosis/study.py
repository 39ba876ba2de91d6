"""From the measured curve of one unit to the errors of its parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from tolalloc.bench.diagnosis.answer.results import DiagnosisResults
from tolalloc.bench.diagnosis.diagnosis import DiagnosisEffort, diagnose
from tolalloc.bench.diagnosis.readings import Noise
from tolalloc.bench.measurement.cleaning import clean_curve
from tolalloc.bench.measurement.readings import ANGLE, TRANSMISSION_ERROR, load_readings
from tolalloc.bench.measurement.records import MeasuredCurve
from tolalloc.blas import one_blas_thread
from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.progress import Progress, Record
from tolalloc.rv.equivalent.status import OUTCOMES
from tolalloc.study.definition import Study, prepare
from tolalloc.units import ARCSECOND, DEGREE

LARGEST_NOISE = 60.0
"""Largest error of a reading that is believed [arcsec]."""


@dataclass(frozen=True, kw_only=True)
class DiagnosisStudy:
    """Which unit is to be diagnosed.

    Parameters
    ----------
    curve
        CSV file with the columns ``angle [deg]`` and ``transmission error [arcsec]``.
    study
        Reducer, tolerance table, torque and seed; its limit plays no part.
    noise_arcsec
        Standard deviation of one reading [arcsec].
    discrepancy_arcsec
        Standard deviation of what the model leaves out [arcsec].
    angle_offset_deg
        Added to every angle of the bench [deg].
    level
        Probability that the named sources must have of containing the dominant one [-].
    effort
        How much may be computed.
    """

    curve: Path
    study: Study
    noise_arcsec: float = 0.5
    discrepancy_arcsec: float = 0.5
    angle_offset_deg: float = 0.0
    level: float = 0.97
    effort: DiagnosisEffort = field(default_factory=DiagnosisEffort)

    def __post_init__(self) -> None:
        for name, value, good, allowed in (
            ("--noise", self.noise_arcsec, 0 < self.noise_arcsec <= LARGEST_NOISE, f"above 0 up to {LARGEST_NOISE:g}"),
            ("--discrepancy", self.discrepancy_arcsec, 0 <= self.discrepancy_arcsec <= LARGEST_NOISE, "0 to 60"),
            ("--angle-offset", self.angle_offset_deg, -360 <= self.angle_offset_deg <= 360, "-360 to 360"),
            ("--level", self.level, 0.5 <= self.level < 1, "0.5 up to but not 1"),
        ):
            if not good:
                raise InputError.at("tolalloc diagnose", name, value, allowed)


def diagnose_unit(asked: DiagnosisStudy, progress: Progress) -> DiagnosisResults:
    """Return what the curve of a unit tells of its parts.

    Parameters
    ----------
    asked
        The unit.
    progress
        Told how far the work has come.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    SolveError
        Too many curves failed.
    """
    prepared, record = prepare(asked.study), Record(progress, OUTCOMES)
    cleaned = clean_curve(load_readings(asked.curve, ANGLE, TRANSMISSION_ERROR), asked.angle_offset_deg * DEGREE)
    kernel, errors = replace(prepared.kernel, observe=record.observe), prepared.space.errors
    curve = MeasuredCurve(
        unit=0,
        torque=kernel.torque,
        carrier_angle=cleaned.along,
        transmission_error=cleaned.values,
        repairs=cleaned.repairs,
    )
    noise = Noise(
        reading=asked.noise_arcsec * cleaned.noise_factor * ARCSECOND, discrepancy=asked.discrepancy_arcsec * ARCSECOND
    )
    with one_blas_thread(), record.stage("diagnosis"):
        found = diagnose(
            curve,
            kernel,
            errors,
            errors.zones,
            noise,
            SeedTree(asked.study.seed).child("diagnosis"),
            asked.effort,
            asked.level,
            asked.study.largest_failed_share,
        )
    return DiagnosisResults(
        name=asked.curve.stem,
        reducer=prepared.reducer,
        torque=kernel.torque,
        errors=errors,
        curve=curve,
        noise=noise,
        level=asked.level,
        seed=asked.study.seed,
        diagnosis=found,
        neglected=prepared.neglected,
        statuses=record.counts,
    )

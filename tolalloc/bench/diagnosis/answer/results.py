"""Everything a report on a diagnosis is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tolalloc.bench.diagnosis.readings import Noise
from tolalloc.bench.diagnosis.result import Diagnosis
from tolalloc.bench.measurement.records import MeasuredCurve
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.rv.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class DiagnosisResults:
    """A diagnosed unit.

    Parameters
    ----------
    name
        Of the unit.
    reducer, torque
        Its nominal design, and the torque on the carrier at which it was measured [N·m].
    errors
        What the drawings say of its parts.
    curve
        Its cleaned curve.
    noise
        What separates a reading from the model.
    level
        Probability that the named sources must have of containing the dominant one [-].
    seed
        Of the random numbers [-].
    diagnosis
        What was found.
    neglected
        Patterns of the sources that are taken as zero.
    statuses
        Outcome → number of curves solved [-].
    """

    name: str
    reducer: Reducer
    torque: float
    errors: ErrorModel
    curve: MeasuredCurve
    noise: Noise
    level: float
    seed: int
    diagnosis: Diagnosis
    neglected: tuple[str, ...]
    statuses: Mapping[str, int]

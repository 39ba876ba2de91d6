"""What the bench wing brings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tolalloc.study.wing import Wing
from tolalloc.wings.bench.ask.diagnose import Diagnose
from tolalloc.wings.bench.ask.identify import Identify
from tolalloc.wings.bench.ask.lot import Lot

if TYPE_CHECKING:
    from pydantic import BaseModel

    from tolalloc.study.sample import Sample


def _samples() -> Mapping[str, Sample]:
    from tolalloc.wings.bench.samples import SAMPLES

    return SAMPLES


def _measurements() -> type[BaseModel]:
    """Return the record of a measurement file with its inner tables, which are read one by one."""
    from pydantic import create_model

    from tolalloc.wings.bench.measurements import CurveRecord, LoopRecord, MeasurementRecord, PeakToPeakRecord

    inner: dict[str, Any] = {
        "units": (str | tuple[str, ...], ...),  # one name is read as a list of one
        "peak_to_peak": (PeakToPeakRecord | None, None),
        "curves": (tuple[CurveRecord, ...], ()),
        "loops": (tuple[LoopRecord, ...], ()),
    }
    return create_model("MeasurementRecord", __base__=MeasurementRecord, **inner)


BENCH = Wing(
    questions=(Identify, Diagnose, Lot),
    samples=_samples,
    schemas={"bench": _measurements},
)

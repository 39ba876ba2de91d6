"""Prepared studies of the shipped baseline: RV-20E, its tolerance table and 60″, with what a test changes."""

from __future__ import annotations

from typing import Any

import tolalloc as ta
from tolalloc.study.prepared import Prepared


def prepared(
    *,
    reducer: dict[str, Any] | None = None,
    drawing: dict[str, Any] | None = None,
    limits: dict[str, ta.Limit] | None = None,
    **changes: Any,
) -> Prepared:
    """Return the study of the baseline, with fields changed; nothing is solved.

    Parameters
    ----------
    reducer, drawing
        Fields of ``ta.reducer`` and ``ta.drawing`` that differ from the baseline.
    limits
        Limits of the study; 60″ for the peak-to-peak unless given.
    changes
        Other fields of ``ta.Study``.
    """
    chosen = {
        "name": "rv20e_liu2020",
        "flank_clearance": (1.0, 5.0),
        "radial_clearance": (5.0, 20.0),
        **(reducer or {}),
    }
    study = ta.Study(
        model=ta.reducer(**chosen),
        drawing=ta.drawing(**{"table": "rv20e_baseline", **(drawing or {})}),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)} if limits is None else limits,
        **{"name": "test", **changes},
    )
    return Prepared(study=study)

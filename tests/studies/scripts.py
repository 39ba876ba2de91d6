"""Study scripts as a user writes them, for tests that change one thing of the baseline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

BASELINE = {"name": "rv20e_liu2020", "flank_clearance": (1.0, 5.0), "radial_clearance": (5.0, 20.0)}
LIMIT = "{ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}"


def study_script(
    folder: Path,
    *,
    reducer: dict[str, Any] | None = None,
    drawing: dict[str, Any] | None = None,
    limits: str = LIMIT,
    written: str = "",
    imports: str = "",
    **fields: Any,
) -> Path:
    """Write a study of the RV-20E and its shipped table with what differs, and return its script.

    Parameters
    ----------
    folder
        Where the script goes.
    reducer, drawing
        Arguments of ``ta.reducer`` and ``ta.drawing`` that differ.
    limits, written, imports
        Limits, further fields and further imports as they stand in the script.
    fields
        Further fields by their values.
    """
    values = ", ".join(f"{name}={value!r}" for name, value in {"name": "written", **fields}.items())
    script = folder / "written_study.py"
    script.write_text(
        f"{imports}\nimport tolalloc as ta\n"
        f"study = ta.Study(ta.reducer(**{ {**BASELINE, **(reducer or {})}!r}), "
        f"ta.drawing(**{ {'table': 'rv20e_table4', **(drawing or {})}!r}), limits={limits}, {values}, {written})\n",
        encoding="utf-8",
    )
    return script

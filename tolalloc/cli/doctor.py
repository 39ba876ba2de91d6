"""The command ``tolalloc doctor``: what the program runs on, and whether it computes what it should."""

from __future__ import annotations

import platform
import time
from pathlib import Path

from tolalloc.cli.console import AsJson, announce_compilation, print_json, say, shown_progress
from tolalloc.exceptions import SolveError

_KNOWN = 96.629
"""Peak-to-peak of liu2020's Table 4 unit at −1 N·m, extremes refined: row 3 of the validation page [arcsec]."""
_AGREES = 0.001
"""Difference from it that is rounding [arcsec]."""


def doctor(as_json: AsJson = False) -> None:
    """Show versions, processor, threads and caches, and solve a published unit whose answer is known."""
    from tolalloc.reports.writer import versions
    from tolalloc.running.chunks import blas_libraries
    from tolalloc.running.compiled import KEPT, is_kept, processor, thread_count

    kept = [path.stat().st_size for path in Path("runs/.tolalloc-units").glob("*.units")]
    found = {
        "versions": versions(),
        "platform": platform.platform(),
        "processor": "{kind} {name}".format_map(processor()),
        "threads": thread_count(),
        "BLAS": blas_libraries(),
        "kernel compiled before": is_kept("turn"),
        "compiled code is kept in": str(KEPT or "no folder: none can be written"),
        "kept units in runs": f"{len(kept)} files, {sum(kept) / 2**20:.1f} MiB",
    }
    announce_compilation()
    start = time.perf_counter()
    with shown_progress() as progress:
        progress.begin("self-test")
        value = _peak_to_peak()
    found |= {"self-test [arcsec]": value, "known [arcsec]": _KNOWN, "seconds": round(time.perf_counter() - start, 1)}
    if as_json:
        print_json(found)
    else:
        for name, said in found.items():
            if isinstance(said, dict):
                said = ", ".join(f"{library} {number}" for library, number in said.items())
            say(f"{name}: {said}")
    if not abs(value - _KNOWN) <= _AGREES:
        raise SolveError(
            f"self-test: the peak-to-peak of liu2020's Table 4 unit is {value:.4f}″ here and must be {_KNOWN}″; "
            "do not trust this installation."
        )
    if not as_json:
        say("All is well: a published unit gives the expected result.")


def _peak_to_peak() -> float:
    """Return the peak-to-peak of liu2020's Table 4 unit [arcsec]."""
    from tolalloc.reading.units import ARCSECOND
    from tolalloc.reducers.equivalent.model import EquivalentModel
    from tolalloc.reducers.reducer.files import load_reducer
    from tolalloc.reducers.unit_file import load_unit

    reducer, unit = load_reducer("rv20e_liu2020"), load_unit("table4")
    model = EquivalentModel(reducer, orders=unit.orders)
    errors = unit.errors(model.columns, reducer.modification.deviations)
    return float(model.extremes(errors, -1.0).peak_to_peak[0] / ARCSECOND)

"""The whole answer of an allocation for a program."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.cautions import warnings
from tolalloc.allocation.answer.drawing import drawing_table
from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.answer.sentences import least_saving
from tolalloc.allocation.answer.tables import requirements_table
from tolalloc.units import MICROMETRE


def summary(results: AllocationResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    chosen, joint, amounts = results.chosen, results.joint, results.modification
    bound = results.graded.bound if results.graded else joint.bound
    answered = {
        "study": results.name,
        "study hash": results.digest,
        "reducer": results.reducer.name,
        "torque [N·m]": results.torque,
        "limit [arcsec]": joint.limit,
        "yield target [-]": results.target,
        "seed": results.seed,
        "quick": results.quick,
        "met": chosen.met,
        "yield [-]": chosen.achieved.estimate,
        "yield interval 95 % [-]": [chosen.achieved.low, chosen.achieved.high],
        "yield lower bound, one-sided 95 % [-]": chosen.achieved.bound,
        "yield of all limits [-]": chosen.joint.estimate,
        "cost [cost units]": chosen.cost,
        "cost of uniform scaling [cost units]": joint.by_hand.cost,
        "saving [-]": 1 - chosen.cost / joint.by_hand.cost,
        "saving at least [-]": least_saving(results),
        "cost of tolerances alone [cost units]": results.alone.chosen.cost,
        "cost of tolerances and modification [cost units]": joint.chosen.cost,
        "cost on grades [cost units]": results.graded.chosen.cost if results.graded else None,
        "certified bound [cost units]": bound if chosen.met else None,
        "gap of the convex program [-]": joint.optimum.gap,
        "blocking requirement": None if chosen.met else chosen.blocking.requirement.output,
        "beyond its limit by [unit of the output]": None if chosen.met else -chosen.blocking.slack,
        "equidistant amount [µm]": amounts.equidistant / MICROMETRE,
        "shift amount [µm]": amounts.shift / MICROMETRE,
        "requirements": _records(requirements_table(results)),
        "drawing": _records(drawing_table(results)),
        "zones that stay the same": [
            group for group, same in zip(results.robustness.groups, results.robustness.same, strict=True) if same
        ],
        "statuses": dict(results.statuses),
        "warnings": list(warnings(results)),
    }
    return {name: _known(value) for name, value in answered.items()}


def _known(value: object) -> object:
    """Return a number, or null where it is none; JSON knows neither NaN nor infinity."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table for JSON."""
    return [{str(name): _known(value) for name, value in row.items()} for row in frame.to_dict("records")]

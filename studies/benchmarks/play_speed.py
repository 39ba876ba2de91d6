"""How much longer units take whose interfaces have play, measured in turn with units that have none.

    python studies/benchmarks/play_speed.py

Peak-to-peak with refined extremes of units whose errors are normal, σ one micrometre, by processor time on all cores:

* line contact: an RV-20E without clearances, the same with 2 µm in its crank–disc bearings, at the test torque and at
  rated torque;
* linear law: an RV-20E of printed stiffness without clearances, and the single-stage drive `cd29`, whose output pins
  have play in their holes and which has no counterpart without.
"""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
from kernel_speed import SEED, figures, progress, run_benchmark

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.running.compiled import processor

CLEARANCE = 2 * MICROMETRE
CASES = {
    "rv20e": ("rv20e", 0.0, -5.0),
    "rv20e, 2 µm": ("rv20e", CLEARANCE, -5.0),
    "rv20e at 167 N·m": ("rv20e", 0.0, -167.0),
    "rv20e at 167 N·m, 2 µm": ("rv20e", CLEARANCE, -167.0),
    "rv20e_liu2020": ("rv20e_liu2020", 0.0, -1.0),
    "cd29": ("cd29", 0.0, -1.0),
}
RATIOS = {
    "rv20e, 2 µm": "rv20e",
    "rv20e at 167 N·m, 2 µm": "rv20e at 167 N·m",
    "cd29": "rv20e_liu2020",
}


def model_of(name: str, clearance: float) -> EquivalentModel:
    """Return the model of a preset, with a clearance of its crank–disc bearings [m]."""
    reducer = load_reducer(name)
    if clearance:
        reducer = replace(reducer, clearances=replace(reducer.clearances, crank_disc_bearing=clearance))
    return EquivalentModel(reducer)


def units_of(model: EquivalentModel, count: int) -> np.ndarray:
    """Return random units without tilt, with the modification of the reducer."""
    errors = MICROMETRE * np.random.default_rng(SEED).standard_normal((count, len(model.columns)))
    errors[:, ["tilt" in name for name in model.columns]] = 0.0
    for name, amount in model.reducer.modification.deviations.items():
        errors[:, model.columns.index(name)] = amount
    return errors


def answer(units: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    models = {title: model_of(name, clearance) for title, (name, clearance, _) in CASES.items()}
    errors = {title: units_of(model, units) for title, model in models.items()}
    found: dict[str, list[float]] = {title: [] for title in CASES}
    solves, status = {}, 0
    for number in range(-1, rounds):  # the first compiles, and makes tables
        for title, (_, _, torque) in CASES.items():
            started = process_time()
            extremes = models[title].extremes(errors[title], torque)
            solves[title], status = float(extremes.solves.mean()), max(status, int(extremes.status.max()))
            if number >= 0:
                found[title].append(1e3 * (process_time() - started) / units)
        progress(f"round {number + 1} of {rounds}")
    own = {title: np.array(values) for title, values in found.items()}
    return {
        "processor": {name: processor()[name] for name in ("kind", "name")} | {"machine": platform.processor()},
        "cores": os.cpu_count(),
        "units": units,
        "rounds": rounds,
        "milliseconds_per_unit": {title: figures(values) for title, values in own.items()},
        "microseconds_per_equilibrium": {title: figures(1e3 * own[title] / solves[title]) for title in own},
        "ratios": {title: figures(own[title] / own[base]) for title, base in RATIOS.items()},
        "agrees": status == Status.CONVERGED,
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    lines = [
        f"{found['units']} units, {found['rounds']} rounds, {found['cores']} cores; {found['processor']}",
        f"{'':26}{'ms a unit':>12}{'least':>8}{'most':>8}{'µs a solve':>12}{'ratio':>8}",
    ]
    for title, own in found["milliseconds_per_unit"].items():
        solve = found["microseconds_per_equilibrium"][title]["median"]
        ratio = f"{found['ratios'][title]['median']:8.2f}" if title in RATIOS else ""
        lines.append(f"{title:26}{own['median']:12.2f}{own['least']:8.2f}{own['most']:8.2f}{solve:12.2f}{ratio}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Time of units with play beside units without.", ("units", 256, "random units of each"), answer, table
        )
    )

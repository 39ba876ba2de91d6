"""How fast the equivalent model runs in time beside a multibody engine, at equal accuracy.

    python studies/benchmarks/multibody_speed.py

xi2015's RV-40E with an ideal first stage, shortened: 525 rpm within 0.1 s, 572 N·m within 0.05 s after that, 0.4 s in
all. Either engine is run at the coarsest of some time steps at which its transmission error from 0.3 s on is within
0.02″ rms of its own run at the finest step; then both are timed in turn, round after round, on one core:

* (a) `tolalloc.wings.motion.stepping.simulate` of one unit;
* (b) the same of a batch, per unit;
* (c) Exudyn's prototype with exact teeth, one unit, as it knows no batches.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from kernel_speed import figures, progress, run_benchmark
from numpy_cores import timed

from tolalloc.cli.console import shown_progress
from tolalloc.reading.units import ARCSECOND
from tolalloc.running.chunks import one_blas_thread
from tolalloc.running.compiled import use_threads
from tolalloc.wings.motion.motion import Damping
from tolalloc.wings.motion.simulation import (
    INTEGRATORS,
    PreparedSimulation,
    SimulationRequest,
    SimulationResult,
    prepare_simulation,
    simulate,
    with_ideal_gears,
)
from tolalloc.wings.motion.stepping import simulate as simulate_model

MODEL, PROTOTYPE = "generalised-alpha", "exudyn"
STEPS = (3.2e-3, 1.6e-3, 8e-4, 4e-4, 2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5)
FINEST = 3.125e-6
ACCURACY = 0.02  # arcsec, rms
ALLOWED_DIFFERENCE = 0.5  # arcsec between the means: the linear gap against exact teeth
TARGET = 20.0


def prepared(engine: str, step: float) -> PreparedSimulation:
    """Return the run at a time step."""
    asked = prepare_simulation(SimulationRequest(engine=engine, ramp=0.1, duration=0.4, step=step))
    return replace(asked, reducer=with_ideal_gears(asked.reducer))


def run(engine: str, step: float) -> SimulationResult:
    """Return what an engine says at a time step."""
    with shown_progress("ms") as shown:
        return simulate(prepared(engine, step), shown)


def last_turn(results: SimulationResult) -> tuple[np.ndarray, np.ndarray]:
    """Return times and transmission error of the last part [s, arcsec]."""
    time = results.series.time
    last = time > 0.3
    return time[last], results.series.transmission_error[last] / ARCSECOND


def coarsest(engine: str) -> tuple[float, float, float]:
    """Return the coarsest step that is accurate enough, its error, and the mean of the finest run [s, arcsec]."""
    fine_time, fine = last_turn(run(engine, FINEST))
    for step in STEPS:
        time, curve = last_turn(run(engine, step))
        error = float(np.sqrt(np.mean((curve - np.interp(time, fine_time, fine)) ** 2)))
        progress(f"{engine}: {step:g} s leaves {error:.4f} arcsec")
        if error <= ACCURACY:
            return step, error, float(fine.mean())
    raise ArithmeticError(f"{engine}: no step is accurate enough")


def answer(units: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    use_threads(1)
    steps = {engine: coarsest(engine) for engine in (MODEL, PROTOTYPE)}
    own, other = prepared(MODEL, steps[MODEL][0]), prepared(PROTOTYPE, steps[PROTOTYPE][0])
    damping = Damping(mass_proportional=own.mass_damping, stiffness_proportional=own.asked.damping)
    given = (own.motion, own.inertia, damping, INTEGRATORS[MODEL])
    batch = np.repeat(own.errors, units, axis=0)
    seconds: dict[str, list[float]] = {"one": [], "batch": [], "prototype": []}
    with one_blas_thread():
        for number in range(rounds):
            one, _ = timed(partial(simulate_model, own.model, own.errors, *given))
            many, _ = timed(partial(simulate_model, own.model, batch, *given))
            with shown_progress("ms") as shown:
                prototype = simulate(other, shown).seconds
            for name, value in zip(seconds, (one, many / units, prototype), strict=True):
                seconds[name].append(value)
            progress(f"round {number + 1} of {rounds}: " + ", ".join(f"{n} {v[-1]:.4g} s" for n, v in seconds.items()))
    apart = abs(steps[MODEL][2] - steps[PROTOTYPE][2])
    ratios = {name: np.array(seconds["prototype"]) / np.array(seconds[name]) for name in ("one", "batch")}
    return {
        "units": units,
        "rounds": rounds,
        "steps_seconds": {engine: found[0] for engine, found in steps.items()},
        "errors_arcsec": {engine: found[1] for engine, found in steps.items()},
        **{f"{name}_seconds": figures(np.array(values)) for name, values in seconds.items()},
        **{f"prototype_over_{name}": figures(values) for name, values in ratios.items()},
        "means_apart_arcsec": apart,
        "agrees": apart <= ALLOWED_DIFFERENCE,
        "target": TARGET,
        "met": bool(np.median(ratios["batch"]) >= TARGET),
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    rows = {
        "(a) one unit, s": "one_seconds",
        "(b) batch, s/unit": "batch_seconds",
        "(c) Exudyn, s": "prototype_seconds",
        "(c)/(a)": "prototype_over_one",
        "(c)/(b)": "prototype_over_batch",
    }
    lines = [f"RV-40E, 0.4 s, batches of {found['units']} units, one core", ""]
    lines += [f"{engine}: steps of {step:g} s" for engine, step in found["steps_seconds"].items()]
    lines += ["", f"{'':24}{'median':>12}{'least':>12}{'most':>12}"]
    for title, name in rows.items():
        lines.append(f"{title:24}" + "".join(f"{found[name][which]:12.4g}" for which in ("median", "least", "most")))
    lines.append(f"\n(c)/(b) at least {found['target']:g}: {'met' if found['met'] else 'missed'}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of the equivalent model in time beside a multibody engine.",
            ("units", 64, "units of a batch"),
            answer,
            table,
        )
    )

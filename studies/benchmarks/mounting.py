"""What choosing the mounting of measured parts is worth, and what the search for it takes.

    NUMBA_NUM_THREADS=2 python studies/benchmarks/mounting.py

Random sets of measured RV-20E parts inside the shipped tolerance table are mounted by the package,
`tolalloc.wings.assembly.mounting.best_mounting`:

* one unit: all mountings there are, so its best, mean and worst are exact;
* two units: against the exact best, from every unit that the parts can make;
* four units: selective assembly, against the mean, the best and the worst of random mountings that evaluate as many
  units, and, on some of the sets, against restarted random swaps that evaluate as many.

A gain is the share by which the mean peak-to-peak over the units is below that of the mean (or worst) random mounting.
Evaluations, not seconds, compare the searches; seconds are wall time of the package's search alone.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from typing import Any

import numpy as np
from kernel_speed import SEED, progress

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.compiled import thread_count
from tolalloc.wings.assembly.mounting import EvaluatedUnits, best_mounting, random_mounting, units_from
from tolalloc.wings.assembly.stock import PartStock, drawn_parts

TARGET_SECONDS = 2.0
CLIMBERS = 8

Figures = dict[str, list[float]]


def prepared() -> tuple[ErrorModel, KernelResponse]:
    """Return the sources and the kernel, compiled and with its tables made."""
    errors, model = ErrorModel(load_tolerance_table("rv20e_table4")), EquivalentModel(load_reducer("rv20e_liu2020"))
    still = {name: 0.0 for name in model.columns if name not in errors.columns}
    fixed = still | model.reducer.modification.deviations
    torque = model.reducer.load.test_torque
    kernel = KernelResponse(model=model, torque=torque, columns=errors.columns, fixed=fixed)
    kernel(np.zeros((64, len(errors.columns))))
    return errors, kernel


def exact_best(stock: PartStock, kernel: KernelResponse) -> float:
    """Return the least mean of two units: one unit, and the best one of the parts that it leaves [arcsec]."""
    units, whole = units_from(stock, range(len(stock.parts))), frozenset(range(len(stock.parts)))
    of_parts: dict[frozenset[int], float] = {}
    values = EvaluatedUnits(stock=stock, response=kernel)(units)
    for parts, value in zip(map(frozenset, units[:, :, 0].tolist()), values.tolist(), strict=True):
        of_parts[parts] = min(value, of_parts.get(parts, np.inf))
    return min((value + of_parts[whole - parts]) / 2 for parts, value in of_parts.items())


def random_swaps(stock: PartStock, kernel: KernelResponse, evaluations: int, seeds: SeedTree) -> float:
    """Return the least mean that climbers find which try random swaps and turns, one at a time [arcsec]."""
    generator, memory = seeds.generator(), EvaluatedUnits(stock=stock, response=kernel)
    now = np.array([stock.random_mountings(generator) for _ in range(CLIMBERS)])
    best = memory(now.reshape(-1, *now.shape[2:])).reshape(CLIMBERS, -1).mean(axis=1)
    while memory.evaluations < evaluations:
        trial = now.copy()
        for own in trial:
            slots = stock.slots[generator.integers(len(stock.slots))]
            unit, at = generator.integers(stock.units, size=2), generator.choice(slots, 2)
            own[unit, at, 0] = own[unit[::-1], at[::-1], 0]
            own[unit, at, 1] = [generator.integers(stock.turns[place]) for place in at]
        means = memory(trial.reshape(-1, *now.shape[2:])).reshape(CLIMBERS, -1).mean(axis=1)
        better = means < best
        now[better], best[better] = trial[better], means[better]
    return float(best.min())


def mounted_set(units: int, seeds: SeedTree, errors: ErrorModel, kernel: KernelResponse, swaps: bool) -> Figures:
    """Return the figures of one set of parts."""
    parts = drawn_parts(errors, kernel.model.reducer, units, seeds.child("parts"))
    start = time.perf_counter()
    stock = PartStock(reducer=kernel.model.reducer, parts=parts, columns=errors.columns)
    found = best_mounting(stock, kernel, seeds.child("search"))
    seconds, after = time.perf_counter() - start, float(found.after.mean())
    chance = random_mounting(stock, kernel, max(found.evaluations // units, 1), seeds.child("chance"))
    figures = {
        "peak_to_peak_arcsec": after,
        "gain_over_mean": 1 - after / chance.means.mean(),
        "gain_over_worst": 1 - after / chance.means.max(),
        "seconds": seconds,
        "evaluations": found.evaluations,
        "failures": found.failures + chance.failures,
        "mean_arcsec": chance.means.mean(),
        "worst_arcsec": chance.means.max(),
    }
    if units > 1:
        figures["gain_of_random_search"] = 1 - chance.means.min() / chance.means.mean()
        figures["random_search_over_package"] = chance.means.min() / after
    if units == 2:
        figures["package_over_exact_best"] = after / exact_best(stock, kernel)
    if swaps:
        climbed = random_swaps(stock, kernel, found.evaluations, seeds.child("swaps"))
        figures["random_swaps_over_package"] = climbed / after
    return {name: [value] for name, value in figures.items()}


def answer(sets: int, swapped: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    errors, kernel = prepared()
    found: dict[int, Figures] = {}
    for units in (1, 2, 4):
        found[units] = defaultdict(list)
        for number in range(sets):
            seeds = SeedTree(SEED).child(str(units), str(number))
            own = mounted_set(units, seeds, errors, kernel, swaps=units == 4 and number < swapped)
            for name, values in own.items():
                found[units][name] += values
        progress(f"{units} units: {sets} sets")
    summary = {
        units: {
            name: dict(zip(("p5", "median", "p95"), np.quantile(values, [0.05, 0.5, 0.95]).tolist(), strict=True))
            | {"sets": len(values)}
            for name, values in own.items()
        }
        for units, own in found.items()
    }
    failures = int(sum(sum(own["failures"]) for own in found.values()))
    met = summary[4]["seconds"]["median"] < TARGET_SECONDS
    return {
        "threads": thread_count(),
        "load_average_before": load,
        "sets": sets,
        "units": summary,
        "failures": failures,
        "target": {"seconds_per_set_of_four": TARGET_SECONDS, "met": met},
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    lines = [f"RV-20E, {found['sets']} sets each, {found['threads']} threads, load {found['load_average_before']:.1f}"]
    for units, own in found["units"].items():
        lines += ["", f"{f'{units} unit(s)':34}{'5 %':>12}{'median':>12}{'95 %':>12}{'sets':>8}"]
        for name, values in own.items():
            numbers = "".join(f"{values[which]:12.3f}" for which in ("p5", "median", "p95"))
            lines.append(f"{name.replace('_', ' '):34}{numbers}{values['sets']:8d}")
    verdict = "met" if found["target"]["met"] else "missed"
    return "\n".join([*lines, "", f"under {TARGET_SECONDS:g} s per set of four units: {verdict}"])


def main() -> int:
    """Run the benchmark; 1 if a unit failed."""
    parser = argparse.ArgumentParser(description="What choosing the mounting of measured parts is worth.")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--sets", type=int, default=100, help="random sets of parts of each size")
    parser.add_argument("--swapped", type=int, default=20, help="sets on which random swaps compete")
    options = parser.parse_args()
    if options.sets < 1:
        parser.error(f"--sets is {options.sets}; allowed is 1 or more.")
    found = answer(options.sets, options.swapped)
    print(json.dumps(found, indent=2) if options.json else table(found))
    return 1 if found["failures"] else 0


if __name__ == "__main__":
    sys.exit(main())

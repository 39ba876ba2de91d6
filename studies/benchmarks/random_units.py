"""A million random units through the kernel: how each ended, how good the equilibria are, how much memory it took.

Every error of liu2020's Table 4 is drawn from −3 to +3 times its printed magnitude, vectors and harmonics at any phase;
the modification leaves from 20 µm interference to 30 µm clearance at tip and root; torques are from −167 to 167 N·m. A
unit's outcome is the worst of all its angles.

    python studies/benchmarks/random_units.py [--units 1000000] [--seed 1] [--json]
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
from collections import Counter

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import ARCSECOND, MICROMETRE
from tolalloc.reducers.equivalent.model import EquivalentModel, count_statuses
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit

CHUNK, SCALE = 1024, 3.0
TORQUES = np.array([-167.0, -10.0, -1.0, -0.1, 1.0, 167.0])


def random_errors(
    unit: Float[np.ndarray, " column"], columns: tuple[str, ...], generator: np.random.Generator, count: int
) -> Float[np.ndarray, "sample column"]:
    """Return units around a printed one: magnitudes up to three times, any sign and phase, any modification."""
    errors = np.repeat(unit[np.newaxis], count, axis=0)
    for first, name in enumerate(columns):
        factor = generator.uniform(-SCALE, SCALE, count)
        if name.endswith(".x") or ".cos" in name:
            phase = generator.uniform(0, 2 * np.pi, count)
            magnitude = np.hypot(unit[first], unit[first + 1]) * factor
            errors[:, first], errors[:, first + 1] = magnitude * np.cos(phase), magnitude * np.sin(phase)
        elif not name.endswith(".y") and ".sin" not in name:
            errors[:, first] *= factor
    equidistant, shift = (columns.index(f"modification.{name}") for name in ("equidistant", "shift"))
    errors[:, shift] = generator.uniform(-40, 10, count) * MICROMETRE
    errors[:, equidistant] = errors[:, shift] + generator.uniform(-20, 30, count) * MICROMETRE
    return errors


def measure(units: int, seed: int) -> dict[str, object]:
    """Return statuses, residuals, angles solved and the largest memory of the process."""
    model = EquivalentModel(load_reducer("rv20e_liu2020"))
    unit = load_unit("table4").errors(model.columns)[0]
    statuses: Counter[str] = Counter()
    solves, residual, largest, interfering = 0, 0.0, 0.0, 0
    for number, start in enumerate(range(0, units, CHUNK)):
        generator = np.random.default_rng([seed, number])
        errors = random_errors(unit, model.columns, generator, min(CHUNK, units - start))
        extremes = model.extremes(errors, float(TORQUES[number % TORQUES.size]))
        statuses.update(count_statuses(extremes.status))
        found = extremes.status == 0
        solves += int(extremes.solves.sum())
        residual = max(residual, float(extremes.residual[found].max(initial=0.0)))
        largest = max(largest, float(extremes.peak_to_peak[found].max(initial=0.0)) / ARCSECOND)
        interfering += _interfering(errors, model.columns)
        sys.stderr.write(f"\r{start + errors.shape[0]:,} of {units:,} units")
    sys.stderr.write("\n")
    return {
        "units": units,
        "seed": seed,
        "magnitudes_over_table_4": SCALE,
        "torques_nm": TORQUES.tolist(),
        "units_with_interference_at_tip_and_root": interfering,
        "angles_solved": solves,
        "statuses_of_units": dict(statuses),
        "largest_residual_of_largest_force": residual,
        "largest_peak_to_peak_arcsec": largest,
        "largest_memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def _interfering(errors: Float[np.ndarray, "sample column"], columns: tuple[str, ...]) -> int:
    equidistant, shift = (columns.index(f"modification.{name}") for name in ("equidistant", "shift"))
    return int((errors[:, equidistant] < errors[:, shift]).sum())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--units", type=int, default=1_000_000, help="number of random units")
    parser.add_argument("--seed", type=int, default=1, help="seed of the units")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if asked.units < 1:
        parser.error(f"--units is {asked.units}; allowed is 1 or more.")
    answer = measure(asked.units, asked.seed)
    if asked.json:
        print(json.dumps(answer, ensure_ascii=False, indent=2))
        return
    for name, value in answer.items():
        print(f"{name.replace('_', ' ')}: {value}")


if __name__ == "__main__":
    main()

"""Rare rejects of the shipped drawing: the estimate from few units beside the count of very many.

    python studies/benchmarks/rare_units.py [--units 2000000] [--seeds 4] [--json]

Random units of the RV-20E at its baseline drawing, peak-to-peak; at each limit the estimate of every seed (16,384
random units, and the methods for rare failures where they see few rejects) stands beside the share of very many other
units. "apart" is the largest difference of an estimate from that share in standard errors of both.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

sys.path.insert(0, str(Path(__file__).parents[2]))

import tolalloc as ta
from tests.builders import prepared
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.limit_state import ResponseLimit
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.capability.yield_at_limit import yield_at_limit
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Response

LIMITS = (105.0, 115.0)
UNITS, AT_ONCE = 16_384, 65_536


@dataclass(frozen=True)
class Compared:
    """A limit and what is said of it."""

    limit: float  # Limit of the peak-to-peak [arcsec]
    counted: int  # Units beyond it of the very many [-]
    share: float  # Their share [-]
    estimates: tuple[float, ...]  # Probability of a unit beyond it, by seed [-]
    errors: tuple[float, ...]  # Stated standard errors [-]
    cautioned: int  # Estimates with a caution [-]

    def apart(self, units: int) -> float:
        """Return the largest difference of an estimate from the count [standard errors of both]."""
        counted = self.share / units
        return max(
            abs(own - self.share) / np.sqrt(error**2 + counted)
            for own, error in zip(self.estimates, self.errors, strict=True)
        )


def experiment_of(response: Response, name: str, seed: int) -> Experiment[Response]:
    """Return the experiment at the baseline drawing with random numbers of its own."""
    return Experiment.of(response, prepared().errors, SeedTree(seed).child("rare units", name))


def many(response: Response, units: int) -> Float[np.ndarray, " unit"]:
    """Return the peak-to-peak of very many units [arcsec]."""
    found = []
    for number, start in enumerate(range(0, units, AT_ONCE)):
        experiment = experiment_of(response, f"many {number}", 0)
        uniform = experiment.uniform(min(AT_ONCE, units - start))
        evaluation = response(experiment.deviations(experiment.errors.standard_values(uniform)))
        found.append(evaluation.values[evaluation.good, 0])
        sys.stderr.write(f"\r{start + len(uniform):,} of {units:,} units")
    return np.concatenate(found)


def compared(response: Response, values: Float[np.ndarray, " unit"], limit: float, seeds: int) -> Compared:
    """Return what the estimates of some seeds say of a limit beside the count."""
    found = []
    for seed in range(1, seeds + 1):
        experiment = experiment_of(response, "few", seed)
        x = experiment.deviations(experiment.errors.standard_values(experiment.uniform(UNITS)))
        sample = MonteCarlo(x=x, evaluation=response(x))
        found.append(yield_at_limit(ResponseLimit(experiment=experiment, limit=limit), sample).estimate)
    counted = int(np.count_nonzero(values > limit))
    return Compared(
        limit=limit,
        counted=counted,
        share=counted / values.size,
        estimates=tuple(own.probability for own in found),
        errors=tuple(own.standard_error for own in found),
        cautioned=sum(bool(own.cautions) for own in found),
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--units", type=int, default=2_000_000, help="units that are counted")
    parser.add_argument("--seeds", type=int, default=4, help="estimates at each limit")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    for name in ("units", "seeds"):
        if getattr(asked, name) < 1:
            parser.error(f"--{name} is {getattr(asked, name)}; allowed is 1 or more.")
    response = prepared().model.reading((ta.PEAK_TO_PEAK,))
    values = many(response, asked.units)
    rows = [compared(response, values, limit, asked.seeds) for limit in LIMITS]
    if asked.json:
        print(json.dumps([vars(own) | {"apart": own.apart(values.size)} for own in rows], indent=2))
        return
    print(f"{'limit':>7}{'counted':>9}{'share':>11}{'estimates':>24}{'apart':>7}{'with a caution':>16}")
    for own in rows:
        span = f"{min(own.estimates):.2e}…{max(own.estimates):.2e}"
        print(
            f"{own.limit:6.0f}″{own.counted:9}{own.share:11.2e}{span:>24}{own.apart(values.size):7.1f}{own.cautioned:16}"
        )


if __name__ == "__main__":
    main()

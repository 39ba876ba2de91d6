"""Sorted parts beside batches that are assigned exactly: the same law, the parts left over, and what each takes.

    python studies/benchmarks/sorted_batches.py

Batches of two normal sizes are assigned by SciPy's exact solver so that as many as can be find a mate of their class;
`ta.Sorting` maps as many random units and draws no batch. Both give the spread of the gap and the share left over.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import ks_2samp, norm

import tolalloc as ta
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.error_model import ErrorModel

ROW = {"plus": 3, "minus": -3, "unit": "µm", "min": 1, "max": 60, "cost": 1.0}


def assigned(classes: int, batch: int, batches: int, rng: np.random.Generator) -> tuple[np.ndarray, list[float]]:
    """Return the gaps of units from batches that are assigned exactly [σ], and the share that each leaves over."""
    gaps, left = [], []
    for _ in range(batches):
        hole, shaft = rng.normal(size=(2, batch))
        number = [np.floor(classes * norm.cdf(own)) for own in (hole, shaft)]
        one, other = linear_sum_assignment(number[0][:, np.newaxis] != number[1])
        fits = number[0][one] == number[1][other]
        gaps.append((hole[one] - shaft[other])[fits])
        left.append(1.0 - float(fits.mean()))
    return np.concatenate(gaps), left


def mapped(sorting: ta.Sorting, units: int, rng: np.random.Generator) -> np.ndarray:
    """Return the gaps of random units whose parts are sorted [σ]."""
    sources = Drawing.of_rows([{"id": name, "nominal": 10.0, **ROW} for name in ("hole", "shaft")]).sources
    errors = ErrorModel(sources, compensators=(sorting,))
    x = errors.deviations(errors.standard_values(rng.random((units, 2))), errors.zones)
    return (x[:, 0] - x[:, 1]) / 1e-6


def main() -> None:
    """Print a line per number of classes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--batch", type=int, default=1000)
    parser.add_argument("--batches", type=int, default=20)
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    for classes in (2, 4, 8):
        sorting = ta.Sorting("shaft", "hole", classes=classes, batch=given.batch)
        start = time.perf_counter()
        exact, left = assigned(classes, given.batch, given.batches, rng)
        between = time.perf_counter()
        own = mapped(sorting, exact.size, rng)
        took = (between - start, time.perf_counter() - between)
        error = np.std(left) / np.sqrt(given.batches)
        print(
            f"{classes} classes, {given.batches} batches of {given.batch}: spread {exact.std():.4f} and "
            f"{own.std():.4f} σ, left over {100 * np.mean(left):.2f} ± {100 * error:.2f} and "
            f"{100 * sorting.leftover:.2f} %, one law with p = {ks_2samp(exact, own).pvalue:.2f}; a batch takes "
            f"{1e3 * took[0] / given.batches:.0f} ms assigned and {1e3 * took[1] / given.batches:.1f} ms mapped"
        )


if __name__ == "__main__":
    main()

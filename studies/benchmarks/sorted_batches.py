"""Sorted parts beside batches that are assigned exactly: the same law, the parts left over, and what each takes.

    python studies/benchmarks/sorted_batches.py
    python studies/benchmarks/sorted_batches.py --reducer

Batches of two normal sizes are assigned by SciPy's exact solver so that as many as can be find a mate of their class;
`ta.Sorting` maps as many random units and draws no batch. Both give the spread of the gap and the share left over.
With ``--reducer`` the RV-20E's main study is allocated for classes of its pins and for pins in the size that fits, and
each drawing is judged on 20,000 other reducers, as mapped and as parts of batches that are assigned exactly.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.stats import ks_2samp, norm

import tolalloc as ta
from tolalloc.allocation.result import AllocationResult
from tolalloc.capability.monte_carlo import KeptLimits
from tolalloc.drawings.compensators import Compensator, Shim
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.script import load_study

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


PIN, GROOVE, PROFILE = "pin.diameter", "housing.groove.radius", "modification.equidistant"
UNITS, BATCH = 20_000, 200
CHOSEN: tuple[Compensator, ...] = (  # Prices are assumed
    ta.Sorting(PIN, GROOVE, classes=(1, 2, 4), batch=BATCH, class_cost=0.2, leftover_cost=0.5),
    ta.Shim(PIN, step=1.0, sizes=(3, 5), against={GROOVE: -1.0, PROFILE: -1.0}, size_cost=0.2),
    ta.Shim("each_pin.diameter", step=0.5, sizes=(3, 5), against={"each_pin.groove": -1.0}, size_cost=0.2),
)


def as_assigned(result: AllocationResult, acting: Compensator, x: np.ndarray) -> np.ndarray:
    """Return reducers of parts as they come [m] with the pins that a shop puts into them, batch by batch."""
    errors = result.chosen.space.errors
    pin, groove, profile = (x[:, errors.columns.index(name)] for name in (PIN, GROOVE, PROFILE))
    if isinstance(acting, Shim):
        sizes = acting.step * 1e-6 * np.arange(-acting.reach, acting.reach + 1)
        x = x.copy()
        x[:, errors.columns.index(PIN)] += sizes[np.abs((pin - groove - profile)[:, np.newaxis] + sizes).argmin(axis=1)]
        return x
    known = {source.name: source for source in result.drawn_sources}
    ends = {name: acting.limits(known[name]) for name in acting.named}
    built = []
    for start in range(0, len(x), BATCH):
        own = slice(start, start + BATCH)
        of_pins, of_grooves = np.searchsorted(ends[PIN], pin[own]), np.searchsorted(ends[GROOVE], groove[own])
        one, other = linear_sum_assignment(of_grooves[:, np.newaxis] != of_pins)
        fits = of_grooves[one] == of_pins[other]
        units = x[own][one[fits]]
        units[:, errors.columns.index(PIN)] = pin[own][other[fits]]
        built.append(units)
    return np.concatenate(built)


def reducer() -> None:
    """Print what the main study costs by how its pins are chosen, and how many reducers keep all limits."""
    study = load_study(Path(__file__).parents[1] / "rv20e_allocation.py")
    for compensator in CHOSEN:
        result = replace(study, compensators=[compensator]).allocate(effort="quick").result
        for choice in result.assembled.choices:
            print(f"{choice.label}: {choice.zones_cost:.2f} + {choice.assembly_cost:.2f} = {choice.cost:.2f}")
        drawn, limits = result.chosen, {own: limit.limits for own, limit in study.limits.items()}
        response = result.model.at(drawn.settings).reading(tuple(limits))
        plain = replace(drawn.space, errors=replace(drawn.space.errors, compensators=()))
        come = plain.units(drawn.design, SeedTree(78).child("exact"), UNITS)
        samples = {
            "mapped": drawn.space.units(drawn.design, SeedTree(77).child("fresh"), UNITS),
            "parts as they come": come,
        }
        if compensator.named[0] == PIN:
            samples["assigned exactly"] = as_assigned(result, result.assembled.best.compensators[0], come)
        for name, x in samples.items():
            kept = KeptLimits.of(response(x), response.outputs, limits).joint
            print(f"  {name}: {kept.estimate:.2%} ({kept.low:.2%}–{kept.high:.2%}) of {len(x):,} keep all limits")


def main() -> None:
    """Print a line per number of classes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--batch", type=int, default=1000)
    parser.add_argument("--batches", type=int, default=20)
    parser.add_argument("--reducer", action="store_true", help="the RV-20E, ten minutes on two cores")
    given = parser.parse_args()
    if given.reducer:
        reducer()
        return
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

"""Whether what is promised of measured parts holds for the process behind them: own functions with closed forms.

    python studies/benchmarks/measured_coverage.py --sets 500

A gap is a sum of normal sizes. The parts of some of them are drawn from a process that nobody is told, 20, 50 or 200 of
each, 500 times. All zones are opened or closed by one factor until the verification calls them just met; the process
then keeps the limits with a share that has a closed form. Counted are the sets of parts whose drawing keeps the yield
that was asked for, and those whose printed interval holds the true yield of the zones as they were. Beside them stand
drawings that take the mean and standard deviation of the parts for the process.

    python studies/benchmarks/measured_coverage.py --sets 100 --search

does the same with the search for the cheapest zones, about a second each.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from tests.builders import verifier_of_sum
from tolalloc.allocation.search.zone_allocation import allocate, scale_in_proportion
from tolalloc.allocation.space.effort import SearchEffort
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.capability.indices import Limits
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.seeds import SeedTree

TARGET = 0.9973
UNITS = 4096  # random units of every verification


@dataclass(frozen=True)
class Case:
    """Sizes with their true processes."""

    name: str
    zones: tuple[float, ...]  # [mm]
    # Mean off the middle and standard deviation over half the zone; the first ones are measured [-]
    processes: tuple[tuple[float, float], ...]
    measured: int
    limits: Limits  # [mm]

    def share(self, zones: np.ndarray) -> float:
        """Return the share of gaps that the true processes keep within the limits at zones [mm]."""
        halves = zones / 2
        mean = float(sum(own * half for (own, _), half in zip(self.processes, halves, strict=True)))
        deviation = float(
            np.sqrt(sum((own * half) ** 2 for (_, own), half in zip(self.processes, halves, strict=True)))
        )
        inside = ndtr((self.limits.upper - mean) / deviation)
        return float(inside - (ndtr((self.limits.lower - mean) / deviation) if self.limits.lower is not None else 0.0))


CASES = (
    Case("one measured size alone", (6.0,), ((0.1, 0.3),), 1, Limits(upper=3.5)),
    Case("two measured of three", (6.0, 8.0, 12.0), ((0.1, 0.3), (-0.15, 0.4), (0.0, 1 / 3)), 2, Limits(upper=9.0)),
    Case(
        "four measured of five, two limits",
        (6.0, 8.0, 5.0, 7.0, 6.0),
        ((0.1, 0.3), (-0.1, 0.35), (0.0, 0.3), (0.05, 0.25), (0.0, 1 / 3)),
        4,
        Limits(lower=-7.0, upper=7.0),
    ),
)


def verifier(case: Case, number: int, parts: int) -> Verifier:
    """Return what verifies drawings of the case with a set of so many parts, on units of its own."""
    generator = np.random.default_rng([parts, number])
    found = verifier_of_sum(*case.zones, limit=1.0, guarantee=AtYield(TARGET))
    sources = list(found.space.errors.sources)
    for at, (mean, deviation) in enumerate(case.processes[: case.measured]):
        half = sources[at].zone / 2
        values = tuple(generator.normal(mean * half, deviation * half, parts).tolist())
        made = MeasuredParts(path=Path("p.csv"), values=values, are_radii=False, zone=sources[at].zone, middle=0.0)
        sources[at] = replace(sources[at], distribution=Distribution.EMPIRICAL, measured=made)
    requirement = replace(found.requirements[0], limits=case.limits)
    space = replace(found.space, errors=ErrorModel(tuple(sources)))
    return replace(found, space=space, requirements=(requirement,), units=UNITS, seeds=SeedTree(number))


def just_met(own: Verifier) -> VerifiedDesign:
    """Return the drawing of one factor of all zones that is just met; what is compared with a limit goes with it."""
    scale, design = 1.0, own.verify(own.space.uniform(1.0), "first")
    for step in range(2):
        scale /= 1 + max(design.blocking.tightest.excess / own.limit, -0.9)
        design = own.verify(own.space.uniform(scale), f"step {step}")
    while not design.met:
        scale *= 0.995
        design = own.verify(own.space.uniform(scale), f"inwards to {scale}")
    return design


def as_if_known(case: Case, own: Verifier) -> float:
    """Return the factor of all zones that would be drawn if mean and standard deviation of the parts were right."""
    said = [
        (source.measured.shift, 1 / (3 * source.measured.cp)) if source.measured else process
        for source, process in zip(own.space.errors.sources, case.processes, strict=True)
    ]
    alike = replace(case, processes=tuple(said))
    zones = np.array(case.zones)
    return float(brentq(lambda scale: alike.share(scale * zones) - TARGET, 0.05, 10.0))


def cheapest(own: Verifier) -> VerifiedDesign:
    """Return the cheapest zones that are met."""
    return allocate(own, scale_in_proportion(own, 3), SearchEffort(steps=3)).chosen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=500)
    parser.add_argument("--parts", type=int, nargs="+", default=[20, 50, 200])
    parser.add_argument("--search", action="store_true")
    chosen = parser.parse_args()
    make = cheapest if chosen.search else just_met
    print("| case | parts | yield held | interval holds | as if known: held | margin/limit | cost | as if known |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|")
    for case in CASES:
        for parts in chosen.parts:
            held, inside, plain, margins, costs = [], [], [], [], []
            for number in range(chosen.sets):
                own, known = verifier(case, number, parts), np.array(case.zones)
                design = make(own)
                held.append(not design.met or case.share(own.space.zones(design.design) * 1e3) >= TARGET)
                drawn = own.verify(own.space.uniform(1.0), "drawn").achieved
                inside.append(drawn.low <= case.share(known) <= drawn.high)
                margin = design.uncertainties[own.requirements[0].output].margin(case.limits, 1 - TARGET)
                margins.append(margin / own.limit)
                scale = as_if_known(case, own)
                plain.append(case.share(scale * known) >= TARGET)
                costs.append((design.cost, known.size / scale))
            share, error = np.mean(held), np.sqrt(np.mean(held) * (1 - np.mean(held)) / len(held))
            cost, simple_cost = np.mean(costs, axis=0)
            print(
                f"| {case.name} | {parts} | {100 * share:.1f} ± {100 * error:.1f} % | {100 * np.mean(inside):.1f} % | "
                f"{100 * np.mean(plain):.1f} % | {np.mean(margins):.3f} | {cost:.2f} | {simple_cost:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()

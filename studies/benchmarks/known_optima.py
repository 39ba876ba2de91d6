"""How near an allocation comes to the optimum, and how true its lower bound is: own functions whose optimum is known.

    python studies/benchmarks/known_optima.py --functions 300 --effort quick

Linear, quadratic and product functions of 2 to 20 normal sizes, and two linear ones with a limit each; costs fall as
1/zone. Of two limits 99.73 or 99 % of the units must keep both at once, as is asked unless told otherwise. The share of
units beyond a limit has a closed form here (linear; two of them by Owen's function T, 1956), comes from the
characteristic function (quadratic, inverted by Gil-Pelaez' formula) or from densities of logarithms that are folded
(product): no random number and nothing of the package. The optimum is where cost and share have one ratio of
derivatives for every zone.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from operator import mul

import numpy as np
from scipy.optimize import brentq
from scipy.special import owens_t
from scipy.stats import beta, norm

import tolalloc as ta

KINDS = ("linear", "quadratic", "product", "two limits")
ZONE = 0.2  # first zone of every size [mm]
DEVIATION = ZONE / 6  # its standard deviation, Cp 1 [mm]
OUTPUTS = ("first [mm]", "second [mm]")
_ITERATIONS, _POINTS = 60, 2**13

Vector = np.ndarray


@dataclass(frozen=True)
class Case:
    """One function with its limits, costs and the exact share of units beyond each of its limits."""

    kind: str
    nominal: Vector
    costs: Vector
    targets: tuple[float, ...]  # Yield of each limited output [-]
    limits: tuple[tuple[float | None, float], ...]  # Lower and upper limit of each output [mm]
    function: Callable[..., object]
    beyond: tuple[Callable[[Vector], float], ...]  # Share beyond all limits at scales of all zones [-]

    def cost(self, scales: Vector) -> float:
        """Return the cost of zones at some scales."""
        return float((self.costs / scales).sum())


def linear_beyond(slopes: Vector, low: float | None, high: float) -> Callable[[Vector], float]:
    """Return the share of a normal value with mean 0 beyond limits that are counted from its mean."""

    def beyond(scales: Vector) -> float:
        deviation = DEVIATION * float(np.linalg.norm(slopes * scales))
        return float(norm.sf(high / deviation) + (norm.cdf(low / deviation) if low is not None else 0.0))

    return beyond


def both_above(first: float, second: float, alike: float) -> float:
    """Return the probability that two normal numbers of such a correlation lie above two positive ones (Owen 1956)."""
    apart = np.sqrt(max(1 - alike**2, 1e-300))
    parts = [owens_t(own, (other - alike * own) / (own * apart)) for own, other in ((first, second), (second, first))]
    return float(0.5 * (norm.sf(first) + norm.sf(second)) - sum(parts))


def two_beyond(slopes: Vector, rooms: Vector) -> Callable[[Vector], float]:
    """Return the share of units of which one of two linear outputs with mean 0 lies beyond its upper limit."""

    def beyond(scales: Vector) -> float:
        loads = DEVIATION * slopes * scales
        deviations = np.linalg.norm(loads, axis=1)
        scores = rooms / deviations
        alike = float(loads[0] @ loads[1] / deviations.prod())
        return float(norm.sf(scores).sum()) - both_above(float(scores[0]), float(scores[1]), alike)

    return beyond


def quadratic_beyond(slopes: Vector, bends: Vector, low: float | None, high: float) -> Callable[[Vector], float]:
    """Return the share of Σ cx + dx² beyond limits, from its characteristic function by Gil-Pelaez."""

    def above(value: float, deviations: Vector) -> float:
        c, d = slopes * deviations, bends * deviations**2
        size = float(np.sqrt((c**2).sum() + 2 * (d**2).sum()))
        t = (np.arange(_POINTS) + 0.5) * (14.0 / size / _POINTS)
        root = 1 - 2j * np.outer(t, d)
        phi = np.exp((-0.5 * np.outer(t, c) ** 2 / root - 0.5 * np.log(root)).sum(axis=1))
        step = float(t[1] - t[0])
        return 0.5 + float((np.imag(np.exp(-1j * t * value) * phi) / t).sum()) * step / np.pi

    def beyond(scales: Vector) -> float:
        deviations = DEVIATION * scales
        return above(high, deviations) + (1 - above(low, deviations) if low is not None else 0.0)

    return beyond


def product_beyond(nominal: Vector, low: float | None, high: float) -> Callable[[Vector], float]:
    """Return the share of Π (n + x) beyond limits: logarithms of the factors have densities that are folded."""

    def beyond(scales: Vector) -> float:
        deviations = DEVIATION * scales / nominal
        reach = 9 * float(np.linalg.norm(deviations)) + 9 * float(deviations.max()) ** 2 + 0.02
        step = 2 * reach / _POINTS
        edges = (np.arange(_POINTS + 1) - _POINTS / 2 - 0.5) * step
        whole = np.ones(_POINTS, complex)
        for deviation in deviations:
            masses = np.diff(norm.cdf(np.expm1(edges) / deviation))
            whole *= np.fft.fft(np.fft.ifftshift(masses))
        below = np.append(0.0, np.cumsum(np.fft.fftshift(np.fft.ifft(whole).real)))
        whole_nominal = float(np.prod(nominal))
        share = 1 - float(np.interp(np.log(high / whole_nominal), edges, below))
        return share + (float(np.interp(np.log(low / whole_nominal), edges, below)) if low is not None else 0.0)

    return beyond


def case(number: int, seed: int) -> Case:
    """Return one of the functions; its limits leave room for about four fifths of the first zones."""
    generator, kind = np.random.default_rng([seed, number]), KINDS[number % len(KINDS)]
    count = int(generator.integers(2, 21))
    costs = np.round(generator.uniform(0.3, 3.0, count), 3)
    slopes = generator.uniform(0.5, 2.0, count) * generator.choice([-1.0, 1.0], count)
    target = float(generator.choice([0.9973, 0.99]))
    two_sided = bool(generator.random() < 0.5)
    spread = float(norm.isf((1 - target) / (2 if two_sided else 1))) * DEVIATION * float(generator.uniform(0.6, 1.0))
    if kind in ("linear", "quadratic"):
        nominal = np.round(generator.uniform(1.0, 20.0, count), 2)
        room = spread * float(np.linalg.norm(slopes))
        bends = generator.uniform(-1.5, 1.5, count) if kind == "quadratic" else np.zeros(count)
        middle = float(slopes @ nominal)

        def function(*sizes: object) -> object:
            parts = zip(slopes, bends, nominal, sizes, strict=True)
            return sum(c * x + d * (x - n) ** 2 for c, d, n, x in parts)

        own = quadratic_beyond(slopes, bends, -room if two_sided else None, room)
        exact = own if kind == "quadratic" else linear_beyond(slopes, -room if two_sided else None, room)
        limits = ((middle - room if two_sided else None, middle + room),)
        return Case(kind, nominal, costs, (target,), limits, function, (exact,))
    if kind == "product":
        nominal = np.round(generator.uniform(2.0, 5.0, count), 2)
        whole = float(np.prod(nominal))
        room = spread * float(np.linalg.norm(1 / nominal))
        low, high = (whole * np.exp(-room) if two_sided else None), whole * np.exp(room)
        limits = ((low, high),)
        exact = product_beyond(nominal, low, high)
        return Case(kind, nominal, costs, (target,), limits, lambda *sizes: reduce(mul, sizes), (exact,))
    nominal = np.round(generator.uniform(1.0, 20.0, count), 2)
    both = np.stack([slopes, generator.permutation(slopes) * generator.uniform(0.2, 1.5, count)])
    rooms = [
        spread * float(np.linalg.norm(own)) * factor
        for own, factor in zip(both, generator.uniform(0.7, 1, 2), strict=True)
    ]
    limits = tuple((None, float(own @ nominal) + room) for own, room in zip(both, rooms, strict=True))

    def functions(*sizes: object) -> object:
        return tuple(sum(c * x for c, x in zip(own, sizes, strict=True)) for own in both)

    return Case(kind, nominal, costs, (target, target), limits, functions, (two_beyond(both, np.array(rooms)),))


def kept(own: Case, scales: Vector) -> float:
    """Return the largest share beyond a limit over what is allowed; 1 just at the limits [-]."""
    return max(beyond(scales) / (1 - target) for beyond, target in zip(own.beyond, own.targets, strict=False))


def at_limits(own: Case, scales: Vector) -> Vector:
    """Return scales in the same ratios that are just allowed."""
    even = scales / np.exp(np.log(scales).mean())
    factor = brentq(lambda log: np.log(max(kept(own, even * np.exp(log)), 1e-300)), -6.0, 3.0, xtol=1e-10)
    return np.asarray(even * np.exp(factor))


def optimum(own: Case) -> Vector:
    """Return the scales of the cheapest zones, where cost and share have one ratio of derivatives."""
    scales = at_limits(own, np.ones(own.costs.size))
    for _ in range(_ITERATIONS):
        slopes = np.empty(scales.size)
        for at in range(scales.size):
            step = 1e-4 * scales[at] * np.eye(scales.size)[at]
            slopes[at] = (own.beyond[0](scales + step) - own.beyond[0](scales - step)) / (2e-4 * scales[at])
        loads = np.maximum(slopes, 1e-12) / scales  # of a share that grows with Σ load·s²
        new = at_limits(own, np.sqrt(scales * at_limits(own, (own.costs / loads) ** (1 / 3))))  # half of the way
        done = np.abs(np.log(new / scales)).max() < 1e-5
        scales = new
        if done:
            break
    return scales


def study_of(own: Case, seed: int) -> ta.Study:
    """Return the study of a case."""
    names = tuple(f"x{at}" for at in range(own.costs.size))
    outputs = OUTPUTS[: len(own.limits)]
    zone = {"plus": ZONE / 2, "minus": -ZONE / 2, "unit": "mm", "min": ZONE / 50, "max": 9 * ZONE, "Cp": 1.0}
    rows = [
        {"id": name, "nominal": nominal, "cost": cost, "distribution": "normal", **zone}
        for name, nominal, cost in zip(names, own.nominal.tolist(), own.costs.tolist(), strict=True)
    ]
    limits = {
        output: ta.Limit(lower=low, upper=high, show=ta.AtYield(target))
        for output, (low, high), target in zip(outputs, own.limits, own.targets, strict=True)
    }
    return ta.Study(
        ta.model(own.function, inputs=names, outputs=outputs, name=own.kind),
        ta.Drawing.of_rows(rows),
        limits=limits,
        questions=[ta.Allocation(front=False, what_if=False)],
        seed=seed,
    )


@dataclass(frozen=True)
class Row:
    """What became of one case."""

    kind: str
    met: bool
    gap: float  # Cost over the optimum, minus one [-]
    bound: float  # Lower bound over the optimum, minus one; not a number where there is none [-]
    certified: bool
    missed: bool  # Whether the drawing is called met and keeps less than was asked
    seconds: float


def run(number: int, seed: int, effort: str) -> Row:
    """Return what an allocation makes of a case."""
    own = case(number, seed)
    best, start = own.cost(optimum(own)), time.perf_counter()
    answer = study_of(own, seed).allocate(effort=effort).result
    seconds = time.perf_counter() - start
    scales = np.array([source.zone * 1e3 / ZONE for source in answer.drawn_sources])
    return Row(
        kind=own.kind,
        met=answer.met,
        gap=answer.cost / best - 1,
        bound=float("nan") if answer.bound is None else answer.bound / best - 1,
        certified=answer.bound_is_certified,
        missed=answer.met and kept(own, scales) > 1,
        seconds=seconds,
    )


def interval(count: int, of: int) -> str:
    """Return a share with its 95 % interval (Clopper–Pearson) [%]."""
    low = beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return f"{count} of {of} ({100 * low:.1f}…{100 * high:.1f} %)"


def report(rows: list[Row], effort: str) -> str:
    """Return the figures of a kind."""
    met = [row for row in rows if row.met]
    bounded = [row for row in met if not np.isnan(row.bound)]
    gaps = 100 * np.array([row.gap for row in met] or [np.nan])
    below = 100 * np.array([row.bound for row in bounded] or [np.nan])
    return (
        f"{effort}, {len(rows)} functions: met {len(met)}; "
        f"cost above the optimum {np.median(gaps):.2f} % in the median, {np.quantile(gaps, 0.9):.2f} % in nine of ten, "
        f"{gaps.max():.2f} % at most; lower bound {np.median(below):.2f} % off the optimum in the median, above it "
        f"{interval(sum(row.bound > 1e-6 for row in bounded), len(bounded))}; called met below the yield asked for "
        f"{interval(sum(row.missed for row in met), len(met))}; {np.median([row.seconds for row in rows]):.1f} s each"
    )


def main() -> None:
    """Print the figures of all kinds."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--functions", type=int, default=40)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--effort", choices=("quick", "full"), default="quick")
    asked.add_argument("--seed", type=int, default=1)
    given = asked.parse_args()
    rows = []
    for number in range(given.first, given.first + given.functions):
        rows.append(run(number, given.seed, given.effort))
        row = rows[-1]
        print(
            f"{number}: {row.kind}, {'met' if row.met else 'NOT met'}{' MISSED' if row.missed else ''}, cost "
            f"{100 * row.gap:+.2f} %, bound {100 * row.bound:+.2f} %{' certified' if row.certified else ''}, "
            f"{row.seconds:.1f} s",
            flush=True,
        )
    for kind in KINDS:
        if own := [row for row in rows if row.kind == kind]:
            print(f"{kind}: {report(own, given.effort)}")
    print(f"all: {report(rows, given.effort)}")


if __name__ == "__main__":
    main()

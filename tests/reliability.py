"""Reliability problems with known probabilities, and the distributions that they are written in."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import factorial
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy.integrate import quad
from scipy.special import log_ndtr, ndtr
from scipy.stats import chi2, gamma, gumbel_r, norm

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.limit_state import RareFailure, ResponseLimit
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Distribution, Feature
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation


@runtime_checkable
class Marginal(Protocol):
    """Distribution of one input."""

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones."""
        ...


@dataclass(frozen=True, kw_only=True)
class Normal:
    """Normal distribution.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        return self.mean + self.deviation * u


@dataclass(frozen=True, kw_only=True)
class Uniform:
    """Uniform distribution.

    Parameters
    ----------
    low, high
        Ends [unit of the input].
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        _require_positive(self, "high − low", self.high - self.low)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        width = self.high - self.low
        # Each end is reached from its own side, where the small probability still has all its digits.
        return np.asarray(np.where(u < 0, self.low + width * ndtr(u), self.high - width * ndtr(-u)))


@dataclass(frozen=True, kw_only=True)
class LogNormal:
    """Lognormal distribution, given by the moments of the input itself.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation of the input, not of its logarithm [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "mean", self.mean)
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        variance = np.log1p((self.deviation / self.mean) ** 2)
        # A search may overshoot to where the value is infinite, which then reads as a failed sample.
        with np.errstate(over="ignore"):
            return np.asarray(self.mean * np.exp(np.sqrt(variance) * u - variance / 2))


@dataclass(frozen=True, kw_only=True)
class LargestValue:
    """Gumbel distribution of largest values, given by its moments.

    Parameters
    ----------
    mean, deviation
        Mean and standard deviation [unit of the input].
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _require_positive(self, "deviation", self.deviation)

    def value(self, u: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Return the values that are as probable as standard normal ones [unit of the input]."""
        scale = self.deviation * np.sqrt(6) / np.pi
        # The logarithm of Φ, not Φ itself, keeps the far upper tail finite.
        exponent = np.maximum(-log_ndtr(u), np.finfo(float).tiny)
        return np.asarray(self.mean - scale * (np.euler_gamma + np.log(exponent)))


@dataclass(frozen=True, kw_only=True)
class LimitOfInputs:
    """A limit state that is written in independent inputs instead of standard normal variables.

    Parameters
    ----------
    marginals
        Distributions of the inputs, in the order of the columns.
    margin
        Returns the distance of every sample from the limit, negative where the product fails.

    References
    ----------
    Transformation x = F⁻¹(Φ(u)) of independent inputs: Ditlevsen & Madsen, Structural Reliability Methods, ch. 7.
    """

    marginals: tuple[Marginal, ...]
    margin: Callable[[Float[np.ndarray, "sample variable"]], Float[np.ndarray, " sample"]]

    @property
    def variables(self) -> int:
        """Number of inputs."""
        return len(self.marginals)

    def inputs(self, u: Float[np.ndarray, "sample variable"]) -> Float[np.ndarray, "sample variable"]:
        """Return the inputs of points of standard normal space [units of the inputs]."""
        return np.column_stack([item.value(column) for item, column in zip(self.marginals, u.T, strict=True)])

    def __call__(self, u: Float[np.ndarray, "sample variable"]) -> np.ndarray:
        """Return the distance of every sample from the limit."""
        return self.margin(self.inputs(u))


def _require_positive(owner: object, field: str, value: float) -> None:
    """Raise unless a parameter of a distribution is positive."""
    if not value > 0:
        raise InputError.at(type(owner).__name__, field, value, "a number above 0")


PROBLEMS = {
    item["id"]: item
    for item in json.loads(
        Path(__file__).with_name("validation").joinpath("reliability.json").read_text(encoding="utf-8")
    )["problems"]
}
FOUR_BRANCHES = "FourBranch_p=7/sqrt2"
MARGINALS = {
    "normal": lambda first, second: Normal(mean=first, deviation=second),
    "uniform": lambda first, second: Uniform(low=first, high=second),
    "lognormal(mean,std)": lambda first, second: LogNormal(mean=first, deviation=second),
    "gumbel_max(mean,std)": lambda first, second: LargestValue(mean=first, deviation=second),
}


def four_branches(x: np.ndarray) -> np.ndarray:
    along, across = (x[:, 0] + x[:, 1]) / np.sqrt(2), x[:, 0] - x[:, 1]
    bent, straight = 3 + 0.1 * across**2, 7 / np.sqrt(2)
    return np.min([bent - along, bent + along, straight + across, straight - across], axis=0)


MARGINS = {
    "RP8": lambda x: x @ np.array([1.0, 2.0, 2.0, 1.0, -5.0, -5.0]),
    "RP14": lambda x: x[:, 0] - 32 / (np.pi * x[:, 1] ** 3) * np.sqrt(x[:, 2] ** 2 * x[:, 3] ** 2 / 16 + x[:, 4] ** 2),
    "RP22": lambda x: 2.5 - (x[:, 0] + x[:, 1]) / np.sqrt(2) + 0.1 * (x[:, 0] - x[:, 1]) ** 2,
    "RP31": lambda x: 2 - x[:, 1] + 256 * x[:, 0] ** 4,
    "RP75": lambda x: 3 - x[:, 0] * x[:, 1],
    "R-S": lambda x: x[:, 0] - x[:, 1],
    FOUR_BRANCHES: four_branches,
}


def problem(name: str) -> LimitOfInputs:
    inputs = PROBLEMS[name]["inputs"]
    return LimitOfInputs(
        marginals=tuple(MARGINALS[kind](float(first), float(second)) for _, kind, first, second in inputs),
        margin=MARGINS[name],
    )


def exact(name: str) -> float:
    return float(PROBLEMS[name]["computed"]["pf"])


Margin = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class RareCase:
    """A limit state with its exact probability of failure."""

    name: str
    variables: int
    margin: Margin
    probability: Callable[[], float]
    benign: bool = False  # Whether it has one region with a smooth limit

    @cached_property
    def exact(self) -> float:
        return float(self.probability())

    def __call__(self, u: np.ndarray) -> np.ndarray:
        return self.margin(u)

    def limit(self, seed: int) -> ResponseLimit:
        """Return the case as the upper limit 0 of a model with one normal source for each variable."""
        errors = normals(self.variables)
        return ResponseLimit(
            experiment=Experiment.of(_Output(errors.columns, self.margin), errors, SeedTree(seed)), limit=0.0
        )


@dataclass(frozen=True)
class _Output:
    """The margin below zero, as a model gives it."""

    columns: tuple[str, ...]
    margin: Margin
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=-self.margin(x)[:, np.newaxis], status=np.zeros(len(x), np.uint8))


def normals(count: int) -> ErrorModel:
    """Return sources with one standard normal column each."""
    return ErrorModel(
        tuple(
            Source(
                name=f"s{at}",
                part="part",
                feature=Feature.SIZE,
                zone=6.0,
                minimum=1.0,
                maximum=10.0,
                cost=1.0,
                distribution=Distribution.NORMAL,
            )
            for at in range(count)
        )
    )


def random_units(case: RareCase, seeds: SeedTree, units: int) -> RareFailure:
    """Return the share of random units that fail."""
    u = seeds.generator().standard_normal((units, case.variables))
    share = float((case(u) < 0).mean())
    return RareFailure(
        probability=share,
        standard_error=float(np.sqrt(share * (1 - share) / units)) if share else float("inf"),
        calls=units,
        failed=0,
        method="Monte Carlo",
        cautions=(),
        effective_samples=share * units,
    )


def _along(u: np.ndarray) -> np.ndarray:
    """Return the coordinate along the diagonal."""
    return u.sum(axis=1) / np.sqrt(u.shape[1])


def _mean_over_normal(function: Callable[[float], float], reach: float = 9.0) -> float:
    nodes = np.linspace(-reach, reach, 200_001)
    return float(np.trapezoid(function(nodes) * norm.pdf(nodes), nodes))


def _either(*probabilities: float) -> float:
    """Return the probability that one of several independent events happens."""
    return float(-np.expm1(np.sum(np.log1p(-np.array(probabilities)))))


def _noise(u: np.ndarray) -> np.ndarray:
    """Return numbers evenly spread from −1 to 1 that jump with every digit of a sample."""
    return 2 * np.modf(np.abs(1e6 * (u @ np.sqrt(np.arange(2.0, 2.0 + u.shape[1])))))[0] - 1


def flat(variables: int, beta: float) -> RareCase:
    return RareCase(
        name=f"hyperplane, β = {beta}", variables=variables, benign=True,
        margin=lambda u: beta - _along(u), probability=lambda: norm.sf(beta),
    )  # fmt: skip


def both_sides(variables: int, beta: float) -> RareCase:
    return RareCase(
        name=f"two opposite hyperplanes, β = {beta}", variables=variables,
        margin=lambda u: beta - np.abs(_along(u)), probability=lambda: 2 * norm.sf(beta),
    )  # fmt: skip


def any_of_all(variables: int, beta: float) -> RareCase:
    return RareCase(
        name=f"either side of every axis, β = {beta}", variables=variables,
        margin=lambda u: beta - np.abs(u).max(axis=1), probability=lambda: _either(*[2 * norm.sf(beta)] * variables),
    )  # fmt: skip


def all_of(variables: int, beta: float) -> RareCase:
    return RareCase(
        name=f"all above {beta}", variables=variables, benign=True,
        margin=lambda u: beta - u.min(axis=1), probability=lambda: norm.sf(beta) ** variables,
    )  # fmt: skip


def unequal(variables: int, scale: float) -> RareCase:
    """Two independent regions; the scale makes the less likely one look nearer."""
    return RareCase(
        name=f"β = 4 and 4.5, slopes 1 and {scale}", variables=variables,
        margin=lambda u: np.minimum(4 - u[:, 0], scale * (4.5 - u[:, 1])),
        probability=lambda: _either(norm.sf(4), norm.sf(4.5)),
    )  # fmt: skip


def outside_sphere(variables: int, active: int, radius: float) -> RareCase:
    return RareCase(
        name=f"outside a sphere of {active} of the variables", variables=variables, benign=True,
        margin=lambda u: radius - np.linalg.norm(u[:, :active], axis=1),
        probability=lambda: chi2.sf(radius**2, active),
    )  # fmt: skip


def paraboloid(variables: int, beta: float, bend: float) -> RareCase:
    others = variables - 1
    return RareCase(
        name=f"paraboloid, β = {beta}, curvature {bend}", variables=variables, benign=True,
        margin=lambda u: beta + bend / 2 * np.sum(u[:, 1:] ** 2, axis=1) - u[:, 0],
        probability=lambda: quad(
            lambda root: 2 * root * chi2.pdf(root**2, others) * norm.sf(beta + bend / 2 * root**2),
            0, np.sqrt(others) + 9, epsabs=0, epsrel=1e-9, limit=200,
        )[0],
    )  # fmt: skip


def exponential_sum(variables: int, largest: float) -> RareCase:
    return RareCase(
        name=f"sum of exponential inputs above {largest:g}", variables=variables, benign=True,
        margin=lambda u: largest + log_ndtr(-u).sum(axis=1), probability=lambda: gamma.sf(largest, variables),
    )  # fmt: skip


def exponential_sum_below(variables: int, smallest: float) -> RareCase:
    return RareCase(
        name=f"sum of exponential inputs below {smallest:g}", variables=variables, benign=True,
        margin=lambda u: -log_ndtr(-u).sum(axis=1) - smallest, probability=lambda: gamma.cdf(smallest, variables),
    )  # fmt: skip


def breitung(variables: int, first: int = 0, second: int = 1) -> RareCase:
    """Breitung 2019: the slope leads to the region that is a hundred times less likely."""

    def margin(u: np.ndarray) -> np.ndarray:
        one, other = u[:, first], u[:, second]
        return np.minimum(
            np.where(one > 3.5, 4 - one, 0.85 - 0.1 * one), np.where(other > 2, 0.5 - 0.1 * other, 2.3 - other)
        )

    return RareCase(
        name="piecewise linear, misleading slopes", variables=variables, margin=margin,
        probability=lambda: _either(norm.sf(4), norm.sf(5)),
    )  # fmt: skip


def hidden(variables: int, cliff: float) -> RareCase:
    """A slope leads to β = 5; at β = 4.2 there is a cliff with little warning."""

    def margin(u: np.ndarray) -> np.ndarray:
        return np.minimum(5 - u[:, 1], np.where(u[:, 0] > 4.2, -1.0, 4.0 - cliff * u[:, 0]))

    return RareCase(
        name=f"cliff beside a slope, warning {cliff}", variables=variables, margin=margin,
        probability=lambda: _either(norm.sf(4.2), norm.sf(5)),
    )  # fmt: skip


def metaballs(u: np.ndarray) -> np.ndarray:
    left = 4 * (u[:, 0] + 2) ** 2 / 9 + u[:, 1] ** 2 / 25
    right = (u[:, 0] - 2.5) ** 2 / 4 + (u[:, 1] - 0.5) ** 2 / 25
    return 30 / (left**2 + 1) + 20 / (right**2 + 1) - 5


def metaballs_probability(step: float = 2e-3) -> float:
    """Return the sum over the cells of a grid, each by its middle."""
    middle = np.arange(-9, 9, step) + step / 2
    mass = ndtr(middle + step / 2) - ndtr(middle - step / 2)
    return float(
        sum(
            one * mass[metaballs(np.column_stack([np.full_like(middle, at), middle])) < 0].sum()
            for at, one in zip(middle, mass, strict=True)
        )
    )


def wave(beta: float, height: float, turns: float) -> RareCase:
    return RareCase(
        name=f"wavy limit, β = {beta} ± {height}", variables=2,
        margin=lambda u: beta + height * np.sin(turns * u[:, 1]) - u[:, 0],
        probability=lambda: _mean_over_normal(lambda v: norm.sf(beta + height * np.sin(turns * v))),
    )  # fmt: skip


def noisy(variables: int, beta: float, size: float, sides: bool = False) -> RareCase:
    def margin(u: np.ndarray) -> np.ndarray:
        along = np.abs(u[:, 0]) if sides else u[:, 0]
        return beta - along + size * _noise(u)

    spread = np.linspace(-size, size, 20_001)
    return RareCase(
        name=f"{'two noisy hyperplanes' if sides else 'noisy hyperplane'}, β = {beta} ± {size}", variables=variables,
        margin=margin, probability=lambda: (1 + sides) * np.trapezoid(norm.sf(beta + spread), spread) / (2 * size),
    )  # fmt: skip


def stairs(variables: int, beta: float, steps: float) -> RareCase:
    return RareCase(
        name=f"stairs of 1/{steps:g}, β = {beta}", variables=variables,
        margin=lambda u: np.floor(steps * (beta - _along(u))) / steps, probability=lambda: norm.sf(beta),
    )  # fmt: skip


def product(variables: int, smallest: float) -> RareCase:
    return RareCase(
        name=f"product of two variables above {smallest:g}", variables=variables,
        margin=lambda u: smallest - u[:, 0] * u[:, 1],
        probability=lambda: 2 * quad(lambda v: norm.pdf(v) * norm.sf(smallest / v), 0, 12, epsabs=0, limit=400)[0],
    )  # fmt: skip


def narrow(beta: float, sharpness: float) -> RareCase:
    return RareCase(
        name=f"narrow wedge from {beta}", variables=2,
        margin=lambda u: beta - u[:, 1] + sharpness * u[:, 0] ** 4,
        probability=lambda: _mean_over_normal(lambda v: norm.sf(beta + sharpness * v**4)),
    )  # fmt: skip


def islands() -> RareCase:
    """A small region beside a half-plane that is further away and much larger."""
    inside = (norm.cdf(4.0) - norm.cdf(3.4)) * (norm.cdf(0.5) - norm.cdf(-0.5))
    return RareCase(
        name="island before a half-plane", variables=2,
        margin=lambda u: np.minimum(
            np.maximum(np.abs(u[:, 0] - 3.7) - 0.3, np.abs(u[:, 1]) - 0.5), 4.8 + u[:, 0]
        ),
        probability=lambda: inside + norm.sf(4.8),
    )  # fmt: skip


def ring() -> RareCase:
    return RareCase(
        name="ring from 4.4 to 4.8", variables=2,
        margin=lambda u: np.abs(np.linalg.norm(u, axis=1) - 4.6) - 0.2,
        probability=lambda: chi2.sf(4.4**2, 2) - chi2.sf(4.8**2, 2),
    )  # fmt: skip


def two_design_points(b: float, bend: float, shift: float) -> RareCase:
    return RareCase(
        name=f"two design points, b = {b:g}", variables=2,
        margin=lambda u: b - u[:, 1] - bend * (u[:, 0] - shift) ** 2,
        probability=lambda: _mean_over_normal(lambda v: norm.sf(b - bend * (v - shift) ** 2)),
    )  # fmt: skip


def uniform_sum(variables: int) -> RareCase:
    """The sum of n uniform inputs exceeds n − 1 in 1/n! of all cases."""
    limit = LimitOfInputs(
        marginals=(Uniform(low=0.0, high=1.0),) * variables, margin=lambda x: variables - 1 - x.sum(axis=1)
    )
    return RareCase(
        name="sum of uniform inputs", variables=variables, margin=limit, benign=True,
        probability=lambda: 1 / factorial(variables),
    )  # fmt: skip


def lognormal_product(variables: int, beta: float) -> RareCase:
    spread = np.sqrt(np.log1p(0.09))
    largest = np.exp(variables * (-(spread**2) / 2) + beta * spread * np.sqrt(variables))
    limit = LimitOfInputs(
        marginals=(LogNormal(mean=1.0, deviation=0.3),) * variables, margin=lambda x: largest - x.prod(axis=1)
    )
    return RareCase(
        name=f"product of lognormal inputs, β = {beta}", variables=variables, margin=limit, benign=True,
        probability=lambda: norm.sf(beta),
    )  # fmt: skip


def largest_of_extremes(variables: int, bound: float) -> RareCase:
    scale = np.sqrt(6) / np.pi
    limit = LimitOfInputs(
        marginals=(LargestValue(mean=0.0, deviation=1.0),) * variables, margin=lambda x: bound - x.max(axis=1)
    )
    return RareCase(
        name=f"largest of extreme-value inputs above {bound:g}", variables=variables, margin=limit,
        probability=lambda: _either(*[gumbel_r.sf(bound, -np.euler_gamma * scale, scale)] * variables),
    )  # fmt: skip


def three_regions(variables: int) -> RareCase:
    return RareCase(
        name="β = 4, 4.2, 4.4, slopes 1, 3, 10", variables=variables,
        margin=lambda u: np.min([4 - u[:, 0], 3 * (4.2 + u[:, 0]), 10 * (4.4 - u[:, 1])], axis=0),
        probability=lambda: norm.sf(4) + norm.sf(4.2) + (1 - norm.sf(4) - norm.sf(4.2)) * norm.sf(4.4),
    )  # fmt: skip


def published(name: str) -> RareCase:
    limit = problem(name)
    return RareCase(
        name=name, variables=limit.variables, margin=limit, probability=partial(exact, name),
        benign=name in ("RP8", "RP14", "RP22", "RP31", "R-S"),
    )  # fmt: skip


CASES = (
    *(published(name) for name in PROBLEMS),
    breitung(2), breitung(50),
    RareCase(name="metaballs", variables=2, margin=metaballs, probability=metaballs_probability),
    two_design_points(5.0, 0.5, 0.1), two_design_points(8.0, 0.5, 0.1),
    exponential_sum(10, 30), exponential_sum_below(20, 5),
    flat(2, 3.5), flat(10, 5.2), flat(100, 4.75),
    both_sides(2, 4.0), both_sides(100, 4.0),
    any_of_all(10, 4.5), any_of_all(100, 5.0),
    all_of(2, 2.5), all_of(5, 1.5),
    unequal(2, 5.0), unequal(10, 0.3), three_regions(5),
    hidden(2, 0.5), hidden(2, 0.1), hidden(20, 0.5),
    outside_sphere(2, 2, 5.0), outside_sphere(50, 2, 4.8), outside_sphere(100, 100, 13.2),
    paraboloid(2, 4.0, -0.15), paraboloid(2, 4.0, 1.0), paraboloid(10, 3.5, 0.2), paraboloid(50, 4.5, -0.02),
    wave(4.0, 0.5, 4.0),
    noisy(2, 4.0, 0.5), noisy(10, 4.5, 1.0), noisy(50, 4.2, 0.3, sides=True),
    stairs(2, 4.0, 4.0), stairs(20, 4.5, 2.0),
    product(2, 14.0), narrow(4.0, 16.0), islands(), ring(),
    uniform_sum(10), lognormal_product(5, 4.5), largest_of_extremes(10, 9.0),
)  # fmt: skip
"""Every case, with names that are unique together with their number of variables."""

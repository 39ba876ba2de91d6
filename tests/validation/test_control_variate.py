"""A control variate of the Sobol indices: exact where it can be, no harm where it knows nothing, honest in between."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.ranking import percentile_interval
from tolalloc.sensitivity.saltelli import SaltelliDesign, SaltelliIndices, saltelli_indices
from tolalloc.sensitivity.surrogate.control_variate import CheapAnswers, cheap_model

Function = Callable[[np.ndarray], np.ndarray]
WEIGHTS = np.array([1.0, 2.0, 0.5, 0.1])
A = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])
UNITS, BLOCKS, CHEAP_BLOCKS = 1024, 64, 1024


def ishigami(x: np.ndarray) -> np.ndarray:
    """Ishigami & Homma 1990."""
    z = np.pi * (2.0 * x - 1.0)
    return np.sin(z[:, 0]) + 7.0 * np.sin(z[:, 1]) ** 2 + 0.1 * z[:, 2] ** 4 * np.sin(z[:, 0])


def of_factors(means_and_squares: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of a product of independent factors, from their means and mean squares."""
    mean, square = np.array(means_and_squares).T
    ratio = square / mean**2
    own, whole = ratio - 1.0, ratio.prod() - 1.0
    return own / whole, own * ratio.prod() / ratio / whole


EXPONENTS, SLOPES = np.array([0.5, 0.3, 0.15, 0.1]), np.array([1.0, 0.5, 0.25])
FUNCTIONS: dict[str, tuple[Function, tuple[np.ndarray, np.ndarray]]] = {
    "linear": (lambda x: x @ WEIGHTS, (WEIGHTS**2 / (WEIGHTS**2).sum(),) * 2),
    "product": (
        lambda x: (1.0 + SLOPES * (x - 0.5)).prod(axis=1),
        of_factors([(1.0, 1.0 + slope**2 / 12.0) for slope in SLOPES]),
    ),
    "g": (
        lambda x: ((np.abs(4.0 * x - 2.0) + A) / (1.0 + A)).prod(axis=1),
        of_factors([(1.0, 1.0 + 1.0 / (3.0 * (1.0 + own) ** 2)) for own in A]),
    ),
    "ishigami": (ishigami, (np.array([0.313905, 0.442411, 0.0]), np.array([0.557589, 0.442411, 0.243684]))),
    "exponential": (
        lambda x: np.exp(x @ EXPONENTS),
        of_factors([(np.expm1(own) / own, np.expm1(2.0 * own) / (2.0 * own)) for own in EXPONENTS]),
    ),
    # max(x, y) of two uniform numbers: E[max | x] = (1 + x²)/2, variance 1/45 of 1/18
    "maximum": (lambda x: x.max(axis=1), (np.array([0.4, 0.4]), np.array([0.6, 0.6]))),
}


@cache
def learnt(name: str) -> Function:
    """Return the cheap model of a function."""
    function, (first, _) = FUNCTIONS[name]
    units = SeedTree(1).child("units").generator().random((UNITS, first.size))
    found = cheap_model(MonteCarlo(x=units, evaluation=good(function(units))), names(first.size), ("y",))
    assert found is not None
    return lambda x: found(x).values[:, 0]


def names(sources: int) -> tuple[str, ...]:
    return tuple(f"x{at}" for at in range(sources))


def analysed(name: str, seed: int, cheap: Function | None = None) -> dict[bool, SaltelliIndices]:
    """Return the indices without and with a cheap model, the learnt one unless it is given."""
    function, (first, _) = FUNCTIONS[name]
    x, many = (
        np.concatenate(list(SaltelliDesign(factor_groups=names(first.size), seed=own).chunks(0, blocks)))
        for own, blocks in ((2 * seed + 1, BLOCKS), (2 * seed + 2, CHEAP_BLOCKS))
    )
    answer = cheap or learnt(name)
    control = CheapAnswers(own=answer(x)[:, np.newaxis], many=answer(many)[:, np.newaxis])
    answers = good(function(x))
    return {
        own: saltelli_indices(answers, first.size, SeedTree(seed), control=control if own else None)
        for own in (False, True)
    }


def good(values: np.ndarray) -> Evaluation:
    return Evaluation(values=values[:, np.newaxis], status=np.zeros(values.size, np.uint8))


@pytest.mark.parametrize("name", ["linear", "product"])
def test_indices_of_a_polynomial_are_exact_from_few_blocks(name):
    """What is left is the error of the cheap model's own indices; plain ones are off by ten times as much or more."""
    known, found = FUNCTIONS[name][1], analysed(name, 3)
    for kind, expected in zip(("first", "total"), known, strict=True):
        error = {own: np.abs(getattr(one, kind)[0] - expected).max() for own, one in found.items()}
        assert error[True] < 5e-3
        assert error[False] > 10 * error[True]
    assert found[True].narrowed.max() < 0.1
    assert (found[False].narrowed == 1.0).all()


@pytest.mark.slow
def test_a_cheap_model_that_knows_nothing_does_no_harm():
    """Over 60 seeds the error is that without it, within what 60 seeds tell of a ratio of variances (F₉₅ = 1.5)."""
    known = FUNCTIONS["g"][1]
    errors: dict[bool, list[np.ndarray]] = {False: [], True: []}
    for seed in range(60):
        found = analysed("g", seed, cheap=lambda x: np.sin(40.0 * x).sum(axis=1))
        for own, one in found.items():
            errors[own].append(one.total[0] - known[1])
    variance = {own: np.square(all_of).mean(axis=0).sum() for own, all_of in errors.items()}
    assert variance[True] < 1.1 * variance[False]


def test_an_output_without_cheap_answers_is_as_without_control():
    found = analysed("g", 1, cheap=lambda x: np.zeros(len(x)))
    np.testing.assert_array_equal(found[True].total, found[False].total)
    np.testing.assert_allclose(found[True].first_resamples, found[False].first_resamples, rtol=1e-9, atol=1e-15)


def test_many_columns_or_few_units_have_no_cheap_model():
    few = MonteCarlo(x=np.ones((10, 5)), evaluation=good(np.arange(10.0)))
    assert cheap_model(few, tuple("abcde"), ("y",)) is None
    many = MonteCarlo(x=np.ones((4096, 60)), evaluation=good(np.arange(4096.0)))
    assert cheap_model(many, tuple(f"x{at}" for at in range(60)), ("y",)) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", FUNCTIONS)
def test_intervals_of_90_percent_hold_in_nine_of_ten(name):
    """200 seeds of 64 blocks: 86 to 94 % of the intervals of all indices, without and with a control variate."""
    held: dict[bool, list[np.ndarray]] = {False: [], True: []}
    for seed in range(200):
        for own, one in analysed(name, seed).items():
            for kind, expected in zip(("first", "total"), FUNCTIONS[name][1], strict=True):
                low, high = percentile_interval(getattr(one, f"{kind}_resamples")[0])
                held[own].append((low <= expected) & (expected <= high))
    shares = {own: float(np.concatenate(all_of).mean()) for own, all_of in held.items()}
    assert 0.86 <= min(shares.values()) <= max(shares.values()) <= 0.94, shares

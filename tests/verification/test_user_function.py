"""Functions that a user gives: what they return is taken as meant, and one function is told from another."""

from __future__ import annotations

import functools
import math
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from tolalloc.exceptions import InputError, SolveError
from tolalloc.user_function import UserFunction, identity


def returned(function, values, samples):
    return UserFunction(function=function, values=values, place="model m")(samples)


@pytest.mark.parametrize("samples", [2, 3, 64])
@pytest.mark.parametrize(
    "function",
    [
        lambda a, b: (a - b, a * b),
        lambda a, b: [a - b, a * b],
        lambda a, b: np.array([a - b, a * b]),
        lambda a, b: np.column_stack([a - b, a * b]),
        lambda a, b: np.stack([a - b, a * b]).T,
        lambda a, b: (math.hypot(a - b, 0.0) * math.copysign(1.0, a - b), a * b),
    ],
    ids=["tuple", "list", "array", "column_stack", "transposed", "numbers only"],
)
def test_two_outputs_are_never_shuffled(generator, function, samples):
    given = generator.normal(size=(samples, 2))
    wanted = np.column_stack([given[:, 0] - given[:, 1], given[:, 0] * given[:, 1]])
    assert returned(function, 2, given) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    "jacobian",
    [
        lambda a, b: [[1.0, -1.0], [b, a]],
        lambda a, b: np.array([[np.ones_like(a), -np.ones_like(a)], [b, a]]),
        lambda a, b: (
            np.moveaxis(np.array([[np.ones_like(a), -np.ones_like(a)], [b, a]]), -1, 0)
            if np.ndim(a)
            else [[1.0, -1.0], [b, a]]
        ),
    ],
    ids=["nested lists", "output, input, sample", "sample, output, input"],
)
@pytest.mark.parametrize("samples", [2, 7])
def test_a_jacobian_is_never_shuffled(generator, jacobian, samples):
    given = generator.normal(size=(samples, 2))
    wanted = np.column_stack([np.ones(samples), -np.ones(samples), given[:, 1], given[:, 0]])
    assert returned(jacobian, 4, given) == pytest.approx(wanted)


def test_a_number_for_all_samples_counts_for_each():
    assert returned(lambda a: 3.0, 1, np.zeros((4, 1))) == pytest.approx(np.full((4, 1), 3.0))


def test_a_function_that_mixes_its_samples_is_called_for_each_alone(generator):
    given = generator.normal(size=(9, 1))
    assert returned(lambda a: a - np.mean(a), 1, given) == pytest.approx(np.zeros((9, 1)))


def test_a_sample_without_an_answer_leaves_the_others():
    found = returned(lambda a: math.sqrt(a), 1, np.array([[4.0], [-1.0], [9.0]]))
    assert found[:, 0] == pytest.approx([2.0, np.nan, 3.0], nan_ok=True)


def thin(height):
    raise ValueError("tooth too thin")


def test_what_a_function_raises_is_said():
    with pytest.raises(SolveError, match=r"each of 40 samples, first ValueError \(tooth too thin\) for \(0\.5\)"):
        returned(thin, 1, np.full((40, 1), 0.5))
    assert np.isnan(returned(thin, 1, np.full((3, 1), 0.5))).all()
    with pytest.raises(InputError, match=r"the function has a fault: unsupported operand") as caught:
        returned(lambda h: h + "a", 1, np.zeros((3, 1)))
    assert isinstance(caught.value.__cause__, TypeError)


def made(factor):
    return lambda x: factor * x


class Scaled:
    def __init__(self, factor):
        self.factor = factor

    def __call__(self, x):
        return self.factor * x


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (lambda x: np.sin(x), lambda x: np.cos(x)),
        (made(1.0), made(2.0)),
        (functools.partial(max, 1.0), functools.partial(max, 2.0)),
        (Scaled(1.0), Scaled(2.0)),
        (lambda x, k=1: k * x, lambda x, k=2: k * x),
        (lambda x: [k * x for k in (1, 2)], lambda x: [k * x for k in (1, 3)]),
    ],
    ids=["names", "closure", "partial", "object", "default", "nested"],
)
def test_functions_are_told_apart(one, other):
    assert identity(one) == identity(one)
    assert identity(one) != identity(other)


def factor():
    return SCALE


SCALE = 2.0


def test_what_a_function_calls_in_its_module_tells_it_too(monkeypatch):
    def asks(x):
        return factor() * x

    before = identity(asks)
    monkeypatch.setitem(globals(), "factor", lambda: 3.0)
    assert identity(asks) != before


def test_a_function_is_the_same_in_another_process():
    code = textwrap.dedent("""
        from tolalloc.user_function import identity
        def outer(k):
            return lambda x: [k * y for y in (x, lambda: x) if y not in {"a", "b", "c", "d"}]
        print(identity(outer(2)))
    """)
    first, second = (subprocess.run([sys.executable, "-c", code], capture_output=True, check=True) for _ in range(2))
    assert first.stdout == second.stdout
    assert b" at 0x" not in first.stdout


def test_a_function_that_holds_itself_ends():
    def recursive(n):
        return recursive(n - 1) if n else 0

    assert identity(recursive)

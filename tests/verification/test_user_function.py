"""Functions that a user gives: what they return is taken as meant, and one function is told from another."""

from __future__ import annotations

import functools
import importlib
import math
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from scipy.optimize import newton

import tolalloc as ta
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.identity import identity
from tolalloc.models.model import ARRAY_RATE
from tolalloc.models.user_function import UserFunction


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
    with pytest.raises(InputError, match=r"the function has a fault: TypeError \(unsupported operand") as caught:
        returned(lambda h: h + "a", 1, np.zeros((3, 1)))
    assert isinstance(caught.value.__cause__, TypeError)


class Aside(BaseException):
    """What a library raises to be caught by nobody else."""


class SilentError(Exception):
    """What cannot say what it is."""

    def __str__(self):
        raise ValueError("no words")


@pytest.mark.parametrize(("kind", "said"), [(Aside, r"Aside \(no such pin\)"), (SilentError, "SilentError")])
def test_an_exception_that_is_hardly_one_is_a_fault_too(kind, said):
    with pytest.raises(InputError, match=f"the function has a fault: {said} in test_user_function.py, line"):
        returned(raising(kind), 1, np.array([[0.5], [2.0], [0.7]]))
    with pytest.raises(KeyboardInterrupt):
        returned(raising(KeyboardInterrupt), 1, np.array([[0.5], [2.0], [0.7]]))


@pytest.mark.parametrize("function", [lambda h: None, lambda h: h + 1j, lambda h: h * np.inf], ids=("None", "i", "inf"))
def test_a_function_without_a_number_for_any_of_many_samples_is_refused(function):
    with pytest.raises(SolveError, match=r"no number for any of 40 samples, as for \(0\.5\); allowed are numbers"):
        returned(function, 1, np.full((40, 1), 0.5))
    assert not np.isfinite(returned(function, 1, np.full((3, 1), 0.5))).any()


FAULTS = (
    *(KeyError, IndexError, AttributeError, AssertionError, NameError, UnboundLocalError, LookupError, TypeError),
    *(RecursionError, NotImplementedError, MemoryError, OSError, FileNotFoundError, TimeoutError, ImportError),
    *(StopIteration, StopAsyncIteration, EOFError, BufferError, SystemError, SystemExit, Warning, Exception),
)


def raising(kind):
    """Return a function that raises an exception of a kind for large values, in its second line."""

    def broken(height):
        if height > 1.0:
            raise kind("no such pin")
        return height

    return broken


@pytest.mark.parametrize("kind", FAULTS, ids=lambda kind: kind.__name__)
def test_whatever_else_a_function_raises_is_its_fault_said_with_its_line(kind):
    broken = raising(kind)
    line = broken.__code__.co_firstlineno + 2
    with pytest.raises(InputError) as caught:
        returned(broken, 1, np.array([[0.5], [2.0], [0.7]]))
    said = str(caught.value)
    assert f"the function has a fault: {kind.__name__} (" in said and "no such pin" in said
    assert said.endswith(f" in test_user_function.py, line {line}.")


NO_ANSWERS = (ValueError, ZeroDivisionError, OverflowError, FloatingPointError, RuntimeError, np.linalg.LinAlgError)


@pytest.mark.parametrize("kind", NO_ANSWERS, ids=lambda kind: kind.__name__)
def test_a_calculation_that_fails_leaves_one_unit_without_an_answer(kind):
    assert returned(raising(kind), 1, np.array([[0.5], [2.0], [0.7]]))[:, 0] == pytest.approx(
        [0.5, np.nan, 0.7], nan_ok=True
    )


def test_a_root_finder_that_does_not_converge_leaves_one_unit_without_an_answer():
    def root(a):
        return newton(lambda x: x**2 + a, 1.0, maxiter=30)

    found = returned(root, 1, np.array([[-4.0], [4.0]]))
    assert found[:, 0] == pytest.approx([2.0, np.nan], nan_ok=True)


def deepest(a, b):
    gap = a - b
    gap[gap < 0.0] = 0.0
    return gap


@pytest.mark.parametrize(
    "function",
    [
        lambda a, b: (a - b).astype(float).clip(0.0),
        lambda a, b: np.where((a - b).round(12) < 0, 0.0, a - b)[:],
        lambda a, b: (a - b).clip(min=0.0),
        lambda a, b: np.array([max(x - y, 0.0) for x, y in zip(a, b, strict=True)]),
        lambda a, b: np.zeros(len(a)) + np.maximum(a - b, 0.0),
        deepest,
    ],
)
@pytest.mark.parametrize("samples", [1, 2, 5])
def test_a_function_of_arrays_alone_is_given_arrays(function, samples, generator):
    given = generator.normal(size=(samples, 2))
    assert returned(function, 1, given)[:, 0] == pytest.approx(np.maximum(given[:, 0] - given[:, 1], 0.0), abs=1e-12)


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
        from tolalloc.models.identity import identity
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


def changes_its_arguments(a, b):
    a /= 2
    b /= 2
    return a + b


def returns_its_input(a, b):
    return a


def keeps_a_view(a, b):
    whole = np.stack(np.broadcast_arrays(a, b))
    kept = whole[:1]
    whole += 1.0
    return kept[0] - 1.0


def clears_after_use(a, b):
    found = a - b
    if np.ndim(a):
        a[:] = 0.0
        b.fill(np.nan)
    return found


def sorts_in_place(a, b):
    found = np.hypot(a, b)
    if np.ndim(a):
        a.sort()
    return found


def swaps_its_arguments(a, b):
    if np.ndim(a):
        kept = a.copy()
        a[:], b[:] = b, kept
        return b - a
    return a - b


@pytest.mark.parametrize(
    ("function", "meant"),
    [
        (changes_its_arguments, lambda a, b: (a + b) / 2),
        (returns_its_input, lambda a, b: a),
        (keeps_a_view, lambda a, b: a),
        (clears_after_use, lambda a, b: a - b),
        (sorts_in_place, np.hypot),
        (swaps_its_arguments, lambda a, b: a - b),
    ],
    ids=lambda own: getattr(own, "__name__", ""),
)
def test_a_function_may_change_what_it_is_given(generator, function, meant):
    given = generator.normal(size=(20, 2))
    kept = given.copy()
    for _ in range(2):
        assert returned(function, 1, given)[:, 0] == pytest.approx(meant(*kept.T), rel=1e-12)
    np.testing.assert_array_equal(given, kept)


def masked(a):
    return np.ma.masked_less(a, 0.0) * 2


def masked_alone(a):
    return np.ma.masked if np.ndim(a) == 0 and a < 0 else np.ma.masked_array(2 * a, np.asarray(a) < 0)


def first_of_roots(a):
    return 2 * np.roots([1.0, 0.0, -float(a)]).max() ** 2


@pytest.mark.parametrize("function", [masked, masked_alone, first_of_roots], ids=lambda own: own.__name__)
def test_a_masked_value_is_no_answer_and_a_complex_one_without_imaginary_part_is_one(function):
    given = np.array([[4.0], [1.0], [9.0], [0.25]])
    assert returned(function, 1, given)[:, 0] == pytest.approx(2 * given[:, 0])
    if function is not first_of_roots:
        given[2] = -9.0
        assert returned(function, 1, given)[:, 0] == pytest.approx([8.0, 2.0, np.nan, 0.5], nan_ok=True)


@pytest.mark.parametrize(
    "function",
    [
        lambda a: np.emath.sqrt(a),
        lambda a: a**0.5 if np.ndim(a) == 0 else np.emath.sqrt(a),
        lambda a: complex(a) ** 0.5,
        lambda a: [(a + 0j) ** 0.5],
        lambda a: np.array((a + 0j) ** 0.5, dtype=object),
    ],
    ids=["emath", "Python and NumPy", "Python", "listed", "objects"],
)
def test_an_imaginary_part_is_no_answer_whoever_computed_it(function):
    given = np.array([[4.0], [-1.0], [9.0]])
    assert returned(function, 1, given)[:, 0] == pytest.approx([2.0, np.nan, 3.0], nan_ok=True)


def counting():
    calls = []

    def drifts(a):
        calls.append(1)
        return a + 1e-3 * len(calls)

    return drifts


def remembering():
    last = [0.0]

    def lags(a):
        before, last[0] = last[0], float(np.max(a))
        return a + before

    return lags


def noisy():
    generator = np.random.default_rng(1)
    return lambda a: a + 1e-3 * generator.normal(size=np.shape(a))


def wearing():
    coefficients = np.array([1.0, 2.0])

    def wears(a):
        coefficients[1] *= 1.01
        return coefficients[0] + coefficients[1] * a

    return wears


def alternating():
    turn = [1.0]

    def turns(a):
        turn[0] = -turn[0]
        return turn[0] * float(a)

    return turns


@pytest.mark.parametrize("made", [counting, remembering, noisy, wearing, alternating], ids=lambda own: own.__name__)
def test_a_function_that_answers_differently_the_second_time_is_refused(made):
    given = np.linspace(1.0, 2.0, 12)[:, np.newaxis]
    with pytest.raises(InputError, match=r"model m: the function gives different results for the same arguments"):
        returned(made(), 1, given)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda a: np.float32(a), "float32"),
        (lambda a: np.asarray(a).astype(np.float16), "float16"),
        (lambda a: np.complex64(a), "complex64"),
        (lambda a: str(a), "text"),
        (lambda a: np.datetime64("2026-01-01"), "datetime64"),
    ],
    ids=["float32", "float16", "complex64", "text", "time"],
)
def test_what_is_no_number_of_64_bits_is_refused_by_name(function, said):
    with pytest.raises(InputError, match=f"the function returned {said}"):
        returned(function, 1, np.array([[1.0], [2.0]]))


def test_whole_numbers_and_truth_values_are_numbers():
    given = np.array([[1.2], [2.7], [0.1]])
    assert returned(lambda a: np.asarray(a).astype(int), 1, given)[:, 0].tolist() == [1.0, 2.0, 0.0]
    assert returned(lambda a: np.asarray(a) > 1.0, 1, given)[:, 0].tolist() == [1.0, 1.0, 0.0]


LARGE = "import numpy as np\nT = np.ones(9000)\n{}\ndef f(x):\n    return T.sum() * x\n"
INSIDE = "def g(x):\n    return {}\ndef f(x):\n    return [g(y) for y in (x,)][0]\n"


def with_helper(folder, text: str):
    """Return the function of a helper module that is read anew."""
    (folder / "helper_of_test.py").write_text(text, encoding="utf-8")
    sys.modules.pop("helper_of_test", None)
    importlib.invalidate_caches()
    return importlib.import_module("helper_of_test")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("def f(x):\n    return 2 * x\n", "def f(x):\n    return 3 * x\n"),
        ("K = 2.0\ndef f(x):\n    return K * x\n", "K = 3.0\ndef f(x):\n    return K * x\n"),
        (LARGE.format(""), LARGE.format("T[4500] = 2")),
        (
            "class C:\n    k = 2\ndef f(x):\n    return C.k * x\n",
            "class C:\n    k = 3\ndef f(x):\n    return C.k * x\n",
        ),
        (INSIDE.format("x"), INSIDE.format("2 * x")),
    ],
    ids=["code", "number", "large array", "class", "inside a comprehension"],
)
def test_what_a_helper_module_holds_tells_a_function(tmp_path, monkeypatch, before, after):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    found = []
    for text in (before, after, before):
        module = with_helper(tmp_path, text)
        called, named = (lambda x, f=module.f: f(x)), module
        through = eval("lambda x: named.f(x)", {"named": named})
        found.append((repr(identity(called)), repr(identity(through))))
    for way in (0, 1):
        assert found[0][way] != found[1][way]
        assert found[0][way] == found[2][way]


MIXES = {
    "sorts": lambda a, b: np.sort(a - b),
    "adds up": lambda a, b: np.cumsum(a - b),
    "centres": lambda a, b: (a - b) - np.mean(a - b),
    "shifts": lambda a, b: np.roll(a - b, 1),
    "scales": lambda a, b: (a - b) / (1.0 + np.max(np.abs(a - b))),
    "largest so far": lambda a, b: np.maximum.accumulate(np.abs(a - b)),
}


@pytest.mark.parametrize("function", MIXES.values(), ids=MIXES)
def test_a_function_that_mixes_its_samples_states_no_rate_of_arrays(function):
    """All of them say 0 wherever the two sizes are off by as much: such samples tell nothing."""
    zone = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 3.0, "nominal": 10.0}
    errors = ta.Drawing.of_rows([{"id": name, **zone} for name in "ab"]).errors
    rates = [
        ta.model(own, inputs=["a", "b"], outputs=("gap [mm]",)).bound(errors, "test").stated_rate
        for own in (function, lambda a, b: a - b)
    ]
    assert rates[0] < rates[1] == ARRAY_RATE

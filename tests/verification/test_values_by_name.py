"""Inputs and outputs of an own function go by their names where it has names for them, and by their order where not."""

from __future__ import annotations

import math
import pickle

import numba
import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH
from tolalloc.models.identity import identity
from tolalloc.models.user_function import UserFunction, by_name

NAMES = ("depth", "width")
OUTPUTS = ("sum [mm]", "ratio [-]")


def at_nominal(function, inputs, outputs=("y [mm]",), settings=(), **rows):
    """Return the outputs of a function without any deviation."""
    own = [{"id": name, **ZONE_OF_A_LENGTH, **rows.get(name, {})} for name in inputs]
    model = ta.model(function, inputs=inputs, outputs=outputs, settings=settings)
    bound = model.bound(ta.Drawing.of_rows(own).errors, "test")
    return bound(np.zeros((3, len(bound.columns)))).values[0]


@numba.njit
def compiled(width, depth):
    return width - depth


def only_by_place(width, depth, /):
    return width - depth


def only_by_name(*, width, depth):
    return width - depth


@pytest.mark.parametrize(
    "function",
    [
        lambda width, depth: width - depth,
        lambda depth, width: width - depth,
        lambda width, shift=0.0, depth=3.0: width - depth + shift,
        lambda depth, width, *more: width - depth,
        compiled,
        only_by_place,
    ],
    ids=["other order", "same order", "default between", "more", "compiled", "by place"],
)
@pytest.mark.parametrize("inputs", [{"depth": 5.0, "width": 10.0}, {"width": 10.0, "depth": 5.0}])
def test_a_parameter_takes_the_input_of_its_name(function, inputs):
    assert at_nominal(function, inputs) == pytest.approx([5.0])


def test_what_takes_its_values_by_name_goes_to_another_process():
    assert pickle.loads(pickle.dumps(by_name(only_by_place, NAMES, "model m")))(5.0, 10.0) == 5.0


def test_parameters_of_other_names_take_the_inputs_in_their_order():
    assert at_nominal(lambda a, b: b - a, {"depth": 5.0, "width": 10.0}) == pytest.approx([5.0])
    assert at_nominal(max, {"depth": 5.0, "width": 10.0}) == pytest.approx([10.0])
    assert at_nominal(lambda *all_: all_[0], {"depth": 5.0, "width": 10.0}) == pytest.approx([5.0])


def test_a_name_is_spelled_as_python_does_and_a_setting_has_one_too():
    found = at_nominal(
        lambda press, crank1_play, pin_1: 100 * press + 10 * crank1_play + pin_1,
        {"pin-1": 1.0, "crank1.play": 2.0},
        settings=(ta.Setting(name="press", value=3.0, lower=0.0, upper=9.0, step=0.1),),
    )
    assert found == pytest.approx([321.0])


@pytest.mark.parametrize(
    "function",
    [lambda width, other: width, lambda other, depth: depth, lambda a, b, width: a],
    ids=["first is the second", "second is the first", "three"],
)
def test_a_parameter_of_a_name_at_another_place_is_refused(function):
    with pytest.raises(ta.InputError, match=r"takes '\w+' as number \d .* number \d of the inputs"):
        at_nominal(function, dict.fromkeys(NAMES, 1.0))


def test_what_takes_names_alone_is_refused_unless_they_are_those_of_the_inputs():
    assert by_name(only_by_name, ("a", "b"), "model m") is only_by_name
    with pytest.raises(ta.InputError, match="cannot be called with 2 values"):
        at_nominal(only_by_name, {"a": 1.0, "b": 2.0})


def test_the_number_of_an_input_is_its_nominal_size_where_the_row_has_none():
    assert at_nominal(lambda width, depth: width - depth, {"depth": 5.0, "width": 10.0}, depth={"nominal": 5.0}) == 5.0
    assert at_nominal(lambda width: width, {"width": 1.0}, width={"unit": "in", "plus": 0.001, "minus": 0.0,
        "min": 0.0005, "max": 0.01}) == pytest.approx(1.0)  # fmt: skip
    with pytest.raises(ta.InputError, match="'depth' is 5 in inputs and 6 in its row"):
        at_nominal(lambda width, depth: width - depth, {"depth": 5.0, "width": 10.0}, depth={"nominal": 6.0})
    for wrong in ("5", math.nan, True):
        with pytest.raises(ta.InputError, match="inputs: width is"):
            at_nominal(lambda width: width, {"width": wrong})


def of_names(function, samples):
    """Return what a function of two numbers says of its outputs."""
    return UserFunction(function=function, values=2, place="model m", names=OUTPUTS)(samples)


RECORD = np.dtype([("ratio", float), ("sum", float)])


@pytest.mark.parametrize("samples", [1, 2, 64])
@pytest.mark.parametrize(
    "function",
    [
        lambda a, b: pd.DataFrame({"ratio": np.atleast_1d(a / b), "sum": np.atleast_1d(a + b)}),
        lambda a, b: pd.DataFrame({"ratio [-]": np.atleast_1d(a / b), "sum [mm]": np.atleast_1d(a + b)}),
        lambda a, b: {"ratio": a / b, "sum [mm]": a + b},
        lambda a, b: pd.Series({"ratio": a / b, "sum": a + b}),
        lambda a, b: np.rec.fromarrays([np.atleast_1d(a / b), np.atleast_1d(a + b)], dtype=RECORD),
        lambda a, b: (a + b, a / b),
    ],
    ids=["table", "table with units", "dict", "series", "fields", "order"],
)
def test_outputs_go_by_their_names(function, samples, generator):
    given = generator.uniform(1.0, 2.0, size=(samples, 2))
    wanted = np.column_stack([given.sum(axis=1), given[:, 0] / given[:, 1]])
    assert of_names(function, given) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("said", [{"sum": 1.0, "other": 2.0}, {"sum": 1.0}, {"sum": 1.0, "ratio": 2.0, "more": 3.0}])
def test_other_names_than_the_outputs_are_refused(said):
    with pytest.raises(ta.InputError, match="allowed are its outputs by name"):
        of_names(lambda a, b: said, np.ones((1, 2)))


def test_a_value_whose_square_is_none_is_no_answer():
    units = np.linspace(0.0, 1.0, 40)[:, np.newaxis]
    found = UserFunction(function=lambda a: np.where(a < 0.5, a, 1e300), values=1, place="model m")(units)
    assert np.isnan(found[:, 0]).tolist() == (units[:, 0] >= 0.5).tolist()
    with pytest.raises(ta.SolveError, match=r"within ±1e\+100"):
        UserFunction(function=lambda a: (1.0 + a) * 1e300, values=1, place="model m")(units)


def test_two_functions_of_one_code_and_other_names_are_told_apart():
    rows = [{"id": name, "nominal": 1.0, **ZONE_OF_A_LENGTH} for name in NAMES]
    errors = ta.Drawing.of_rows(rows).errors
    one, other = (
        ta.model(own, inputs=NAMES, outputs=("y [mm]",), name="m").bound(errors, "test")
        for own in (lambda depth, width: depth - width, lambda width, depth: width - depth)
    )
    assert one.content != other.content


def test_a_compiled_function_is_told_by_what_it_was_compiled_from():
    same, other = (numba.njit(own) for own in (lambda a, b: a - b, lambda a, b: a + b))
    assert identity(compiled) == identity(numba.njit(compiled.py_func))
    assert identity(same) != identity(other)

"""The tests that anybody's model, family or question inherits pass for the shipped ones, and fail for wrong ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import tolalloc as ta
from tests.golden.cases import small_effort
from tolalloc.reducers.families.centre_gear.family import CENTRE_GEAR
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.families.single_stage.family import SINGLE_STAGE
from tolalloc.testing import FamilyTests, ModelTests, QuestionTests

ROW = {"plus": 20, "minus": -20, "unit": "µm", "min": 5, "max": 100, "cost": 1}


def gap_study(function=lambda a, b, c: a - b + c, **own: object) -> ta.Study:
    """Return a study of a gap of two parts, which a setting opens."""
    setting = ta.Setting(name="c [mm]", value=0.1, lower=0.0, upper=0.2, step=0.01)
    gap = ta.model(function, inputs={"a": 10.0, "b": 9.9}, outputs=("gap [mm]",), settings=(setting,))
    drawing = ta.Drawing.of_rows([{"id": "a", **ROW}, {"id": "b", **ROW}])
    limits = {"gap [mm]": ta.Limit(lower=0.15, upper=0.25, show=ta.AtYield(0.95))}
    return ta.Study(gap, drawing, limits=limits, name="gap", effort=small_effort(), **own)


class TestFunction(ModelTests):
    def study(self):
        return gap_study(lambda a, b, c: (a**2 - b**2) / 20 + c)


@pytest.mark.slow
@pytest.mark.parametrize("family", [RV, CENTRE_GEAR, SINGLE_STAGE], ids=lambda own: own.name)
class TestFamilies(FamilyTests):
    @pytest.fixture(autouse=True)
    def _own(self, family):
        self.own = family

    def family(self):
        return self.own


def reducer_study(preset: str) -> ta.Study:
    """Return a study of a preset at its drawing, with an output of the kernel and one beside it."""
    limits = {name: ta.Limit(upper=100.0) for name in (ta.PEAK_TO_PEAK, ta.RADIAL_CLEARANCE)}
    return ta.Study(ta.reducer(preset), ta.drawing(f"{preset}_drawing"), limits=limits)


@pytest.mark.slow
class TestReducer(ModelTests):
    def study(self):
        return reducer_study("rv20e")


@pytest.mark.slow
class TestCentreGear(ModelTests):
    def study(self):
        return reducer_study("rv27c")


class TestRanking(QuestionTests):
    def study(self):
        return gap_study(questions=[ta.Ranking()])


class TestAllocation(QuestionTests):
    def study(self):
        return gap_study(questions=[ta.Allocation(front=False, what_if=False)])


class TestDifference(QuestionTests):
    def study(self):
        return gap_study(questions=[ta.Difference(zones={"a": 20})])


def of_the_chunk(a, b, c):
    """Return a gap that depends on what stands beside a sample."""
    return a - b + c + 1e-9 * np.mean(a)


def blind(a, b, c):
    """Return a gap that is a number whatever it is asked for."""
    return np.nan_to_num(a - b + c)


@pytest.mark.parametrize(
    ("function", "name"),
    [
        (of_the_chunk, "test_same_bits_for_any_chunk"),
        (blind, "test_what_is_no_number_fails_its_sample_alone"),
        (lambda a, b, c: np.where(a > 10.0, np.nan, a - b + c), "test_values_have_their_shape_and_are_finite"),
    ],
)
def test_a_wrong_model_is_noticed(function, name):
    class Wrong(ModelTests):
        def study(self):
            return gap_study(function)

    with pytest.raises(AssertionError):
        getattr(Wrong(), name)()


def test_wrong_derivatives_are_noticed():
    class Wrong(ModelTests):
        def study(self):
            own = gap_study()
            return replace(own, model=replace(own.model, jacobian=lambda a, b, c: [[1.0, 1.0]]))  # b widens no gap

    with pytest.raises(AssertionError, match=r"gap \[mm\]"):
        Wrong().test_derivatives_agree_with_differences()


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"name": "other"}, "test_it_is_known_and_has_names_of_its_own"),
        ({"new": replace(RV.new, presets=("cd29",))}, "test_presets_are_of_it_and_every_column_is_declared"),
        ({"contact_sources": RV.contact_sources * 2}, "test_a_source_is_one_kind_in_all_families"),
    ],
)
def test_a_wrong_family_is_noticed(changed, name):
    class Wrong(FamilyTests):
        def family(self):
            return replace(RV, **changed)

    with pytest.raises((AssertionError, KeyError)):
        getattr(Wrong(), name)()


class RestlessTeller(ta.Teller, kind="restless"):
    """Says another number each time, in words without an end, and no JSON."""

    title, sections = "Restless", ()
    sentences = property(lambda self: (f"It is {self.result}",))
    summary = property(lambda self: {"it": np.float32(self.result)})


@dataclass(frozen=True, kw_only=True)
class Restless(ta.Question):
    """A question without one answer."""

    kind = "restless"

    def answer(self, prepared, record):
        return ta.Answer(kind=self.kind, header=prepared.header, result=np.random.default_rng().random())


@pytest.mark.parametrize(
    "name", ["test_people_can_read_it", "test_it_is_answered_the_same_again_and_a_program_can_read_it"]
)
def test_a_wrong_question_is_noticed(name):
    class Wrong(QuestionTests):
        def study(self):
            return gap_study(questions=[Restless()])

    with pytest.raises((AssertionError, TypeError)):
        getattr(Wrong(), name)()

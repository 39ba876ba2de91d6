"""Tests that a model, a family of reducers or a question of one's own inherits, to be run by pytest.

A subclass whose name begins with ``Test`` says in one method what is tested, such as ``study`` of `ModelTests`.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tolalloc.cli.start import new
from tolalloc.models.model import DifferencedResponse, Evaluation, Samples
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.families.family import ReducerFamily
from tolalloc.reducers.families.known import FAMILIES, SOURCES, family_of
from tolalloc.reducers.families.records import records
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.study.answer import Answer
from tolalloc.study.prepared import Prepared
from tolalloc.study.script import load_study
from tolalloc.study.study import Study

_SMOOTH = 0.02  # Largest error of exact parts without modification, over their mean twist [-]


def _are_different(names: Iterable[str]) -> bool:
    found = list(names)
    return len(found) == len({*found})


class ModelTests(ABC):
    """Tests of a model: names, shapes, the same bits in any chunk, failed samples, settings, derivatives."""

    units = 40
    """Random samples of each test [-]."""

    @abstractmethod
    def study(self) -> Study:
        """Return a study of the model at a drawing; its limited outputs are asked."""

    @classmethod
    @cache
    def _asked(cls) -> tuple[Prepared, tuple[str, ...], Samples]:
        prepared = Prepared(study=cls().study())
        return prepared, tuple(prepared.study.limits), prepared.random_units(cls.units)

    def _answered(self, x: Samples) -> Evaluation:
        prepared, outputs, _ = self._asked()
        return prepared.model.reading(outputs)(x)

    def test_columns_and_outputs_are_named(self) -> None:
        """Columns are those of the drawing; the name of an output ends with its unit in brackets."""
        model = self._asked()[0].model
        assert model.columns == self._asked()[0].errors.columns
        assert model.outputs and _are_different(model.outputs)
        assert not [name for name in model.outputs if not (" [" in name and name.endswith("]"))]

    def test_values_have_their_shape_and_are_finite(self) -> None:
        """There is a value for each sample and output, and no more samples fail than a study allows."""
        prepared, outputs, x = self._asked()
        found = self._answered(x)
        assert found.values.shape == (*found.status.shape, len(outputs)) == (len(x), len(outputs))
        assert found.good.mean() >= 1.0 - prepared.study.largest_failed_share

    def test_same_bits_for_any_chunk(self) -> None:
        """A sample has the same bits whatever stands beside it, and when it is asked again."""
        x = self._asked()[-1]
        whole = self._answered(x)
        for parts in (np.split(x, [1, 8]), np.split(x, len(x)), [x]):
            found = Evaluation.joined([self._answered(part) for part in parts])
            np.testing.assert_array_equal(found.values, whole.values)
            np.testing.assert_array_equal(found.status, whole.status)

    def test_an_output_alone_is_what_it_is_beside_others(self) -> None:
        """Asked alone, an output has the same value."""
        prepared, outputs, x = self._asked()
        for name, beside in zip(outputs, self._answered(x).known.T, strict=True):
            alone = prepared.model.reading((name,))(x).known[:, 0]
            np.testing.assert_allclose(alone, beside, rtol=1e-9, atol=prepared.model.accuracy.get(name, 0.0))

    def test_what_is_no_number_fails_its_sample_alone(self) -> None:
        """A sample that is not a number raises nothing, fails, and changes no other."""
        x = self._asked()[-1].copy()
        before, others = self._answered(x), np.arange(len(x)) != 1
        x[1] = np.nan
        found = self._answered(x)
        assert not found.good[1]
        np.testing.assert_array_equal(found.values[others], before.values[others])

    def test_at_its_present_settings_it_is_itself(self) -> None:
        """Settings have names of their own and lie in their ranges."""
        prepared, outputs, x = self._asked()
        settings = prepared.model.settings
        assert _are_different(own.name for own in settings)
        assert all(own.lower <= own.value <= own.upper for own in settings)
        found = prepared.model.at(np.array([own.value for own in settings])).reading(outputs)(x)
        np.testing.assert_allclose(found.known, self._answered(x).known, rtol=1e-6)

    def test_derivatives_agree_with_differences(self) -> None:
        """The derivatives that it offers are central differences, for half the samples at least: there may be kinks."""
        prepared, outputs, x = self._asked()
        model, spread = prepared.model, x.std(axis=0)
        for output in {*outputs}.intersection((*model.exact, *model.differentiable)):
            found = model.derivatives(output, x[:8])
            differenced = DifferencedResponse(response=model.reading((output,)), output=output, steps=0.03 * spread)
            other = differenced.with_derivatives(x[:8]).by_column
            apart, size = (np.linalg.norm(own * spread, axis=1) for own in (found.by_column - other, other))
            assert np.nanmedian(apart / size) < 0.05, output
            assert found.by_setting.shape == (8, len(model.settings))


class FamilyTests(ABC):
    """Tests of a family of reducers: names, sources, presets, a new folder, exact parts, whole turns."""

    @abstractmethod
    def family(self) -> ReducerFamily:
        """Return the family, which must be installed or shipped."""

    def _models(self, **changed: Any) -> Iterable[tuple[Reducer, EquivalentModel]]:
        for preset in self.family().new.presets:
            reducer = replace(load_reducer(preset), **changed)
            yield reducer, EquivalentModel(reducer)

    def test_it_is_known_and_has_names_of_its_own(self) -> None:
        """No other family has its name, preset, kind of file or table."""
        own, known = self.family(), FAMILIES.values()
        assert FAMILIES[own.record.design.family] is own
        assert _are_different(other.word for other in known)
        assert _are_different(preset for other in known for preset in other.new.presets)
        assert _are_different(other.new.schema for other in known)
        assert _are_different(record.table for record in records())

    def test_a_source_is_one_kind_in_all_families(self) -> None:
        """A source that other families have too is the same there."""
        kinds = self.family().sources.kinds
        assert _are_different(kind.name for kind in kinds)
        assert not [kind.name for kind in kinds if SOURCES.of(kind.name.format(i=1, j=1)) != kind]

    def test_presets_are_of_it_and_every_column_is_declared(self) -> None:
        """A file of the family is read as one, and what moves its springs is declared."""
        for reducer, model in self._models():
            assert family_of(reducer) is self.family()
            assert all(self.family().sources.of_column(name) for name in model.columns)

    def test_a_new_folder_of_it_can_be_asked(self) -> None:
        """Names, units and bounds of the study of ``tolalloc new`` are in order, and its random units have answers."""
        for preset in self.family().new.presets:
            with TemporaryDirectory() as place:
                prepared = Prepared(study=load_study(new(Path(place) / "mine", like=preset) / "study.py"))
                assert prepared.requirements
                assert prepared.model.reading((PEAK_TO_PEAK,))(prepared.random_units(16)).good.all()

    def test_exact_parts_without_modification_have_no_error(self) -> None:
        """All that is left at the test torque is a ripple of the twist."""
        for reducer, model in self._models(modification=Modification(equidistant=0.0, shift=0.0), form=None):
            found = model.equilibria(np.zeros((1, len(model.columns))), reducer.load.test_torque)
            assert not found.status.any()
            assert np.ptp(found.transmission_error) < _SMOOTH * np.abs(found.transmission_error).mean()

    def test_it_turns_and_closes(self) -> None:
        """Errors of parts are felt, and after the turns that it states every part is where it was."""
        angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        for reducer, model in self._models():
            errors, torque = (
                np.random.default_rng(1).normal(0.0, 1e-6, (1, len(model.columns))),
                reducer.load.test_torque,
            )
            first, closed = (
                model.equilibria(errors, torque, angle + turned).transmission_error
                for turned in (0.0, 2.0 * np.pi * reducer.closing_turns)
            )
            assert np.allclose(closed, first, rtol=0.0, atol=1e-4 * np.ptp(first)) and np.ptp(first) > 0.0


class QuestionTests(ABC):
    """Tests of a question with its teller: a record of its own kind, an answer that people and programs can read."""

    @abstractmethod
    def study(self) -> Study:
        """Return a study that asks the question first, small enough to be answered twice."""

    @classmethod
    @cache
    def _answer(cls) -> Answer[Any]:
        study = cls().study()
        return study.ask(study.questions[0])

    def test_it_is_a_record_that_says_what_it_reads(self) -> None:
        """A question is a dataclass, and reads fields of a study."""
        question = self.study().questions[0]
        assert is_dataclass(question)
        assert question.reads <= {own.name for own in fields(Study)}
        assert (self._answer().kind, self._answer().header.name) == (question.kind, self.study().name)

    def test_people_can_read_it(self) -> None:
        """It has a title, whole sentences, and tables whose heads differ."""
        teller = self._answer().teller
        assert teller.title and teller.sentences
        assert not [said for said in (*teller.sentences, *teller.warnings) if said.rstrip()[-1] not in ".:?!"]
        assert all(_are_different(map(str, table.columns)) for own in teller.sections for _, table in own.tables)

    def test_it_is_answered_the_same_again_and_a_program_can_read_it(self) -> None:
        """The same study gives the same sentences, and the same numbers in JSON."""
        study, first = self.study(), self._answer()
        second = study.ask(study.questions[0])
        assert (second.sentences, json.dumps(second.summary)) == (first.sentences, json.dumps(first.summary))

    def test_it_is_written(self) -> None:
        """Its report has all its files."""
        with TemporaryDirectory() as place:
            written = {path.name for path in self._answer().save(Path(place) / "report").iterdir()}
        assert written >= {"report.html", "results.xlsx", "summary.json", "manifest.json"}

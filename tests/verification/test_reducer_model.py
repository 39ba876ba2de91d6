"""The reducer as a model: what it answers is what its kernel, readings and changed stiffnesses answer."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import baseline_errors, kernel_of
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.design import Modification
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import StiffnessResponse
from tolalloc.reducers.response.outputs import OutputsResponse, orders_reading, requirements_of
from tolalloc.reports.portrait import portrait_of
from tolalloc.study.prepared import Prepared

LOST_MOTION, RADIAL = "lost motion [arcmin]", "radial clearance at tip and root [µm]"
WAVE = "order 1 cosine [arcsec]"


@pytest.fixture(scope="module")
def model(rv20e: EquivalentModel) -> ReducerModel:
    errors = baseline_errors("disc1.bore1.position", "pin.diameter")
    own = rv20e.reducer.stiffness
    names = ("crank_disc_bearing", "pin_contact", "sun_support")
    known = IdentifiedStiffness(
        source="a test",
        values={name: getattr(own, name) for name in names},
        standard_uncertainty={
            name: part * getattr(own, name) for name, part in zip(names, (0.1, 0.2, 0.0), strict=True)
        },
    )
    kernel = kernel_of(rv20e, errors, -167.0)
    return ReducerModel(kernel=kernel, ranges=(None, (1e-6, 5e-6), (5e-6, 20e-6)), identified=known)


@pytest.fixture(scope="module")
def x(model) -> np.ndarray:
    return 5e-6 * (next(SeedTree(1).uniform_chunks(6, len(model.columns))) - 0.5)


def test_readings_are_those_of_kernel_and_outputs_in_the_order_asked_for(model, x):
    assert model.reading((PEAK_TO_PEAK,)) is model.kernel
    every = OutputsResponse(kernel=model.kernel, readings=(*requirements_of(model.reducer), orders_reading((1,))))
    asked = (RADIAL, WAVE, LOST_MOTION)
    found = model.reading(asked)
    assert found.outputs == asked
    columns = [every.outputs.index(name) for name in asked]
    np.testing.assert_array_equal(found(x).values, every(x).values[:, columns])
    assert model.reading(model.outputs) == OutputsResponse(kernel=model.kernel, readings=requirements_of(model.reducer))
    with pytest.raises(UnknownNameError, match="lost motoin"):
        model.reading(("lost motoin [arcmin]",))


def test_settings_are_the_clearances_of_the_modification(model, x):
    own, stage = model.reducer.modification, model.reducer.cycloid_stage
    flank, radial = model.settings
    assert (flank.value, radial.value) == (own.flank_clearance(stage) / 1e-6, own.radial_clearance / 1e-6)
    assert (flank.lower, flank.upper, radial.lower, radial.upper) == pytest.approx((1, 5, 5, 20))
    moved = model.at(np.array([3.0, 12.0]))
    assert [setting.value for setting in moved.settings] == [3.0, 12.0]
    other = model.kernel.with_modification(Modification.from_clearances(3.0 * 1e-6, 12.0 * 1e-6, stage))
    np.testing.assert_array_equal(moved.reading((PEAK_TO_PEAK,))(x).values, other(x).values)
    assert portrait_of(moved).amounts(np.array([3.0, 12.0]))[flank.name] == 3.0
    locked = replace(model, ranges=(None, None, (5e-6, 20e-6))).settings[0]
    assert locked.lower == locked.upper == locked.value


def test_derivatives_by_the_settings_are_those_by_the_amounts_that_they_mean(model, x):
    middle = np.array([3.0, 12.0])
    found, own = model.at(middle).derivatives(PEAK_TO_PEAK, x), model.at(middle).kernel.with_derivatives(x)
    np.testing.assert_array_equal(found.by_column, own.by_column)
    for at, step in enumerate(np.eye(2)):
        amounts = [[*model.modification(middle + side * step).deviations.values()] for side in (1, -1)]
        expected = own.by_modification @ (np.subtract(*amounts) / 2)
        np.testing.assert_allclose(found.by_setting[:, at], expected, rtol=1e-9, atol=1e-12)
    with pytest.raises(UnknownNameError):
        model.derivatives("peak pressure, rated torque [MPa]", x)


@pytest.mark.slow
def test_one_standard_uncertainty_of_a_stiffness_does_to_other_outputs_what_the_kernel_says(model, x):
    (source,) = model.uncertain
    assert source.columns == tuple(f"stiffness.{name}" for name in model.identified.values)
    outputs = (PEAK_TO_PEAK, LOST_MOTION, WAVE)
    response, deviation = model.with_uncertain(outputs), np.sqrt(np.diag(source.covariance))
    assert response.columns == (*model.columns, *source.columns)
    first = StiffnessResponse(kernel=model.kernel, stiffnesses=tuple(model.identified.values))
    for at, step in enumerate(deviation):
        change = step * np.eye(3)[at]
        units = np.concatenate([x, np.tile(change, (len(x), 1))], axis=1)
        found, exact = response(units), model.changed(change).reading(outputs)(x)
        assert found.good.all()
        # The wave is none, and is rounding on the curve of a peak-to-peak as on one of its own [arcsec].
        np.testing.assert_allclose(found.values[:, 1:], exact.values[:, 1:], rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(found.values[:, :1], first(units).values)
    known = np.concatenate([x, np.zeros((len(x), 3))], axis=1)
    expected = model.reading(outputs)(x).values
    np.testing.assert_array_equal(response(known).values[:, :2], expected[:, :2])
    np.testing.assert_allclose(response(known).values[:, 2], expected[:, 2], rtol=0, atol=1e-13)
    assert isinstance(model.with_uncertain((PEAK_TO_PEAK,)), StiffnessResponse)


@pytest.mark.slow
def test_a_change_of_half_and_two_of_them_at_once_is_to_first_order(model, x):
    steps = np.sqrt(np.diag(model.uncertain[0].covariance))
    response = model.with_uncertain((LOST_MOTION, RADIAL))

    def at(*parts: float) -> np.ndarray:
        return response(np.concatenate([x, np.tile(steps * parts, (len(x), 1))], axis=1)).values

    base, one, two = at(0, 0, 0), at(1, 0, 0), at(0, 1, 0)
    np.testing.assert_allclose(at(0.5, -0.3, 0), base + 0.5 * (one - base) - 0.3 * (two - base), rtol=1e-12)
    # A stiffness that is known exactly moves nothing, and none moves a gap.
    np.testing.assert_array_equal(at(0, 0, 7), base)
    np.testing.assert_array_equal(at(2, 2, 0)[:, 1], base[:, 1])


def test_waves_and_stand_ins(model):
    assert model.spectra[1] == ("order 1 cosine [arcsec]", "order 1 sine [arcsec]")
    stage = model.reducer.cycloid_stage
    assert {1, 2, stage.pin_count, 4 * stage.disc_teeth} <= {*model.spectra}
    names = [candidate.name for candidate in model.stand_ins()]
    assert names[:2] == ["contact at 468 angles", "contact at 936 angles"]
    assert len(names) == 3


def test_waves_of_an_open_turn_are_those_of_its_gears_and_none_that_the_contact_folds_onto():
    """2,652 = 52·51 waves of exact parts fold onto 156 at 936 angles; 10 µm of the pinion are one wave of 1.3335″."""
    model = ta.reducer("rv27c").bound(ta.drawing("rv27c_drawing").errors, "test")
    assert {35.579, 36.579, 71.158, 109.737} == {order for order in model.spectra if order % 1}
    assert 156 not in model.spectra
    assert {1, 2, 51, 52, 153, 204, 208} <= {*model.spectra}
    x = np.zeros((2, len(model.columns)))
    x[1, model.columns.index("pinion.eccentricity.x")] = 10e-6
    found = model.reading(tuple(name for pair in model.spectra.values() for name in pair))(x).values
    added = np.linalg.norm((found[1] - found[0]).reshape(-1, 2), axis=1)
    by_order = dict(zip(model.spectra, added, strict=True))
    assert by_order.pop(109.737) == pytest.approx(1.3335, rel=2e-3)
    assert max(by_order.values()) < 2e-3  # whole orders of a turn that is cut would have up to 0.06″ of it


@pytest.mark.parametrize(
    ("reducer", "column", "shown", "folded"),
    [("cd29", "", {}, (24, 66)), ("rv27c", "pinion.eccentricity.x", {109.737: 1.3335}, (108, 109, 110, 111))],
)
def test_the_picture_of_orders_shows_none_that_others_fold_onto(reducer, column, shown, folded):
    model = ta.reducer(reducer).bound(ta.drawing(f"{reducer}_drawing").errors, "test")
    x = 10e-6 * (np.array(model.columns) == column)
    _, figure = portrait_of(model).pictured({"unit": (np.array([own.value for own in model.settings]), x)})
    found = dict(zip(figure.series[0].x, figure.series[0].y, strict=True))
    assert {order: size for order, size in found.items() if size > 1e-3} == pytest.approx(shown, rel=1e-3)
    assert not any(found[order] for order in folded)


def test_crowning_is_part_of_what_tells_a_study_from_another(model):
    def content(crowning):
        reducer = replace(model.reducer, cycloid_stage=replace(model.reducer.cycloid_stage, crowning=crowning))
        return repr(replace(model, kernel=replace(model.kernel, model=EquivalentModel(reducer))).content)

    assert content(0.0) == repr(model.content)
    assert len({content(crowning) for crowning in (0.0, 2e-6, 3e-6)}) == 3


def bound(changed: dict[str, dict[str, object]]) -> ReducerModel:
    """Return the RV-20E at a table of all its sources, some of them changed."""
    drawing = ta.drawing("rv20e_all_sources")
    changes = [replace(own, **changed[own.name]) for own in drawing.sources if own.name in changed]
    return Prepared(
        study=ta.Study(
            ta.reducer("rv20e"), drawing.with_sources(changes, "zones.csv"), limits={PEAK_TO_PEAK: ta.Limit(upper=60)}
        )
    ).model


def test_rows_of_single_pins_and_teeth_that_do_not_follow_the_reducer_are_refused_together():
    wrong = {"each_pin.position": 52, "each_pin.groove": 52, "disc2.each_tooth.pitch": 38, "pin.diameter": 2}
    sentence = (
        "study study, tolerance table zones.csv: each is 2 in pin.diameter; allowed is 1; each is 52 in "
        "each_pin.position, each_pin.groove; allowed is 40, one for each pin; each is 38 in disc2.each_tooth.pitch; "
        "allowed is 39, one for each tooth."
    )
    with pytest.raises(InputError, match=f"^{re.escape(sentence)}$"):
        bound({name: {"each": each} for name, each in wrong.items()})


def test_another_fault_of_a_row_is_not_said_to_be_one_of_its_count():
    with pytest.raises(UnknownNameError, match=r"pin\.diameter\.x"):
        bound({"pin.diameter": {"feature": Feature.POSITION}})
    with pytest.raises(UnknownNameError, match=r"disc1\.pitch"):
        bound({"disc1.pitch": {"feature": Feature.SIZE, "spectrum": ()}})


def test_a_check_remarks_a_nominal_size_that_is_not_the_reducers():
    other = bound({"pin.diameter": {"nominal": 8e-3}, "housing.groove.radius": {"nominal": 2.019e-3}})
    (said,) = other.mismatches
    assert said.startswith(
        "The table and the reducer differ: nominal of pin.diameter is 8 mm in zones.csv, and twice its pin radius is "
        "4 mm in reducer "
    )
    assert portrait_of(other).examination(other.examined(np.zeros((1, len(other.columns))))).sentences[0] == said
    assert bound({"housing.groove.radius": {"nominal": 2.05e-3}}).mismatches[0].count("groove.radius is 2.05 mm") == 1
    for single, size in (("each_pin.diameter", "4 mm"), ("each_pin.groove", "2 mm")):
        (said,) = bound({single: {"nominal": 2e-2}}).mismatches
        assert f"nominal of {single} is 20 mm" in said
        assert f"is {size} in reducer" in said
    assert bound({"pin.diameter": {"nominal": 0.0}}).mismatches == ()

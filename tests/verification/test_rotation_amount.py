"""The rotation amount δ of the tooth modification: gaps, settings, derivatives, and what a drawing says of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from studies.benchmarks.plain_rows import dense_rows
from tests.builders import few_sources, unit_with, units_at_random
from tests.random_cases import random_cycloid_stage, seeds
from tests.verification.test_clearance import second_order
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCSECOND, MICROMETRE
from tolalloc.reducers.cycloid.clearance import exact_clearance
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import radial_clearance
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.reducer.design import Modification
from tolalloc.reducers.reducer.files import load_reducer, write_modified
from tolalloc.reports.portrait import portrait_of
from tolalloc.study.prepared import Prepared

RANGES = {"flank_clearance": (1.0, 8.0), "radial_clearance": (3.0, 30.0)}
TURNED, FLANK, RADIAL = "rotation clearance [µm]", "flank clearance [µm]", "radial clearance [µm]"


def prepared(drawing="rv20e_drawing", **reducer):
    """Return a study of an RV-20E whose flanks may be turned."""
    given = {"rotation_clearance": (-3.0, 6.0), **RANGES, **reducer}
    table = ta.drawing(drawing) if isinstance(drawing, str) else drawing
    return Prepared(study=ta.Study(ta.reducer("rv20e", **given), table, limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}))


@pytest.mark.slow
def test_an_allocation_with_turned_flanks_is_not_dearer_than_without(tmp_path):
    """Four sources of the RV-20E of liu2020 on few units; both answers are verified on units of their own."""
    effort = ta.Effort(
        allocation=ta.AllocationEffort(
            verification_units=512, confirmation_units=2048, shared_units=16, search=ta.SearchEffort(steps=4)
        )
    )

    def found(low, high):
        reducer = ta.reducer(
            "rv20e_liu2020",
            neglected=("*",),
            flank_clearance=(1.0, 5.0),
            radial_clearance=(5.0, 20.0),
            rotation_clearance=(low, high),
        )
        limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=50.0, show=ta.AtYield(target=0.95))}
        questions = (ta.Allocation(front=False, what_if=False),)
        drawing = ta.drawing(few_sources(tmp_path))
        return ta.Study(reducer, drawing, limits=limits, questions=questions, effort=effort).allocate().result

    fixed, free = found(0.0, 0.0), found(-4.0, 4.0)
    assert fixed.met
    assert free.met
    assert fixed.chosen.settings[0] == 0.0
    assert -4.0 <= free.chosen.settings[0] <= 4.0
    assert free.chosen.cost < fixed.chosen.cost


def units(study, count):
    """Return random units of a study's drawing."""
    return units_at_random(study.errors, count, 7)


@pytest.mark.parametrize("seed", seeds(20))
def test_pin_rows_leave_the_gap_of_exact_teeth_to_second_order(seed):
    """Of every pin of both discs, on either flank; half the amounts leave a quarter of the error away from the root."""
    generator = np.random.default_rng([35, seed])
    stage = random_cycloid_stage(generator)
    reducer = replace(load_reducer("rv20e_liu2020"), cycloid_stage=stage)
    share, place = generator.uniform(-1, 1, 2), Positions(reducer, generator.uniform(0, 2 * np.pi, 1))
    rows, pins = dense_rows(place), stage.pin_count
    angle = np.concatenate([place.pin_direction - place.disc_direction(disc) for disc in range(2)]).ravel()
    assert angle.size == 2 * pins

    def off(size):
        amounts = Modification(equidistant=share[0] * size, shift=share[1] * size, rotation=size / lever)
        errors = np.array([amounts.deviations.get(name, 0.0) for name in rows.columns])
        exact = exact_clearance([ToothProfile(stage=stage, modification=amounts)], angle)[0]
        return amounts, exact + rows.error[0] @ errors  # compression is minus the gap

    lever = stage.disc_pitch_radius
    (amounts, whole), (_, half) = off(10 * MICROMETRE), off(5 * MICROMETRE)
    assert (np.abs(whole) <= second_order(stage, amounts, 0.0, angle)).all()
    flanks = np.abs(np.abs(np.remainder(angle + np.pi, 2 * np.pi) - np.pi) - np.radians(117)) < np.radians(57)
    assert np.abs(whole[flanks]).max() > 1e-12, "the error would be rounding"
    assert np.abs(whole - 4 * half)[flanks].max() < 0.05 * np.abs(whole[flanks]).max()


def test_turned_flanks_let_both_discs_turn_by_their_angle_and_take_no_radial_clearance():
    """All pins of the pressed flank touch again where the discs have turned by δ against them, next to no torque.

    Against the discs' δ the carrier turns by as much less as the pins' moment is less than its torque: 1 − 1/i of that
    is left by the sun, and zc/zp of it acts about the discs' centres, as all pin forces pass through the pole.
    """
    reducer, turned = load_reducer("rv20e_liu2020"), 30e-6
    own = replace(reducer, modification=Modification(equidistant=0.0, shift=0.0, rotation=turned))
    exact = replace(reducer, modification=Modification(equidistant=0.0, shift=0.0))
    angle, torque = np.linspace(0, 0.16, 5), -1e-3
    found = []
    for design in (own, exact):
        model = EquivalentModel(design)
        errors = unit_with(model)
        found.append(model.equilibria(errors, torque, angle).transmission_error[0])
        assert radial_clearance(model, errors)[0] == pytest.approx(0.0, abs=1e-18)
    np.testing.assert_allclose(found[0] - found[1], -turned * (1 - 1 / reducer.ratio) * 39 / 40, rtol=1e-9)


@pytest.mark.slow
def test_angles_between_the_tabulated_ones_feel_the_kink_of_turned_flanks_at_root_and_tip():
    """Without radial clearance pins press at the root; a cubic through |S| at the nodes misses 0.4 µm of 5 there.

    The search looks between nodes; its extremes are solved again with tables of just their angles. Single teeth are
    exact, as a run-out steps where a pin leaves one tooth for the next.
    """
    study = prepared()
    x = units(study, 16)
    x[:, ["each_tooth" in name for name in study.errors.columns]] = 0.0
    kernel = study.model.at(np.array([5.0, 5.0, 0.0])).kernel
    for own in kernel.errors(x):
        found, exact = (ask(own[np.newaxis], -167.0) for ask in (kernel.model.extremes, kernel.model.exact_extremes))
        assert exact.peak_to_peak[0] - found.peak_to_peak[0] == pytest.approx(0.0, abs=0.03 * ARCSECOND)


def test_amounts_follow_from_the_clearances_and_back():
    stage = load_reducer("rv20e").cycloid_stage
    wanted = (2.0 * MICROMETRE, 5.0 * MICROMETRE, 9.0 * MICROMETRE)  # rotation, flank, radial
    amounts = Modification.from_clearances(wanted[1], wanted[2], stage, wanted[0])
    assert amounts.clearances(stage) == pytest.approx(wanted, abs=1e-18)
    assert amounts.rotation == pytest.approx(2.0 * MICROMETRE / (39 * 0.9e-3), rel=1e-12)
    assert Modification.from_clearances(5e-6, 9e-6, stage).rotation == 0.0


@pytest.mark.parametrize("output", [ta.LOST_MOTION, ta.FRICTION_TORQUE, ta.RADIAL_CLEARANCE, ta.PEAK_TO_PEAK])
def test_derivatives_by_the_settings_are_those_of_differences(output):
    study = prepared()
    model, x, middle = study.model, units(study, 40), np.array([2.0, 4.0, 9.0])
    found = model.at(middle).derivatives(output, x).by_setting
    for at, step in enumerate(1e-2 * np.eye(3)):
        ends = [model.at(middle + side * step).reading((output,))(x).values[:, 0] for side in (1, -1)]
        difference = (ends[0] - ends[1]) / 2e-2
        # An extreme of the curve is found to some nanometres, and a step crosses a kink of some units.
        off = np.median(np.abs(found[:, at] - difference))
        assert off < (0.03 if output == ta.PEAK_TO_PEAK else 1e-6), (output, at)
    assert np.abs(found[:, 0]).max() > 1e-3 or output == ta.RADIAL_CLEARANCE


def test_without_a_rotation_there_are_two_settings_and_amounts_as_before():
    plain = prepared(rotation_clearance=None).model
    assert [own.name for own in plain.settings] == [FLANK, RADIAL]
    assert len(plain.drawn_amounts.names) == 2
    still, x = prepared(rotation_clearance=(0.0, 0.0)), units(prepared(), 12)
    outputs = (ta.PEAK_TO_PEAK, ta.LOST_MOTION, ta.RADIAL_CLEARANCE)
    values = [
        own.at(np.array(settings)).reading(outputs)(x).values
        for own, settings in ((plain, (4.0, 9.0)), (still.model, (0.0, 4.0, 9.0)))
    ]
    np.testing.assert_array_equal(*values)


def test_a_drawing_says_the_amount_as_an_arc_and_the_summary_as_an_angle():
    model, settings = prepared().model, np.array([2.0, 4.0, 9.0])
    own, drawn = model.modification(settings), model.drawn_amounts
    assert drawn.names[-1] == "rotation δ·r_d [µm]"
    amounts = np.array([own.equidistant, own.shift, own.rotation * 35.1e-3]) / MICROMETRE
    np.testing.assert_allclose(drawn.by_setting @ settings, amounts, rtol=1e-9)
    assert "r_d = 35.1 mm" in drawn.convention
    said = portrait_of(model).amounts(settings)
    assert said["rotation δ [µrad]"] == pytest.approx(2.0 / 35.1e-3)
    assert [said[name] for name in (TURNED, FLANK, RADIAL)] == [2.0, 4.0, 9.0]
    assert portrait_of(model).effects(settings)["rotation δ·r_d [µm]"] == "tooth narrower: removes material"


def test_a_locked_rotation_stays_whatever_the_steps_of_the_others(tmp_path):
    """1.404 µm, what 40 µrad are at 35.1 mm, is no whole step; the others are rounded around it."""
    turned = replace(load_reducer("rv20e").modification, rotation=40e-6)
    write_modified("rv20e", turned, tmp_path / "own.reducer.toml")
    assert load_reducer(tmp_path / "own.reducer.toml").modification.rotation == pytest.approx(40e-6, rel=1e-12)
    reducer = ta.reducer(tmp_path / "own.reducer.toml", **RANGES)
    drawing = ta.drawing("rv20e_drawing")
    study = Prepared(study=ta.Study(reducer, drawing, limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}))
    space, drawn = study.space, study.model.drawn_amounts
    rotation = space.settings[0]
    assert (rotation.name, rotation.lower, rotation.upper) == (TURNED, rotation.value, rotation.value)
    design = np.append(np.ones(len(space.groups)), [rotation.value, 4.123, 9.234])
    _, stated = space.rounded_down(design, drawn)
    amounts = drawn.by_setting @ space.settings_of(stated)
    np.testing.assert_allclose(amounts[:2] * 10, np.round(amounts[:2] * 10), atol=1e-6)
    assert amounts[2] == pytest.approx(40e-6 * 35.1e-3 / MICROMETRE)


def test_a_row_of_the_table_turns_the_flanks_of_every_unit():
    """±1 µm over 35.1 mm; what a row deviates by is what the setting says of the same angle."""
    row = {"id": "modification.rotation", "part": "discs", "feature": "size", "unit": "µm", "plus": 1.0, "minus": -1.0}
    row |= {"min": 0.1, "max": 20, "cost": 1, "over": 35.1, "group": "grinding"}
    study = prepared(ta.Drawing.of_rows([row]), neglected=("*",))
    assert study.errors.columns == ("modification.rotation",)
    model, deviation = study.model.at(np.array([2.0, 4.0, 9.0])), 1.5e-6 / 35.1e-3
    outputs = (ta.PEAK_TO_PEAK, ta.LOST_MOTION, ta.RADIAL_CLEARANCE)
    found = model.reading(outputs)(np.array([[deviation]])).values
    moved = study.model.at(np.array([3.5, 5.5, 9.0])).reading(outputs)(np.zeros((1, 1))).values
    np.testing.assert_allclose(found, moved, rtol=1e-9, atol=1e-9)
    spread = units(study, 4000)[:, 0] * 35.1e-3
    assert spread.std() == pytest.approx(1e-6 / 3, rel=0.05)


def test_a_table_may_state_the_rotation_clearance():
    def at(**settings):
        return ta.reducer("rv20e", **RANGES).set_to(settings).reducer.modification

    own, stage = load_reducer("rv20e").modification, load_reducer("rv20e").cycloid_stage
    only = at(**{TURNED: 2.0})
    kept = own.flank_clearance(stage), own.radial_clearance
    assert only.clearances(stage) == pytest.approx((2.0 * MICROMETRE, *kept), abs=1e-15)
    assert at(**{TURNED: 2.0, FLANK: 4.0, RADIAL: 9.0}).clearances(stage) == pytest.approx(
        (2e-6, 4e-6, 9e-6), abs=1e-15
    )


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        (lambda: ta.reducer("rv20e", rotation_clearance=(0.0, 60.0)), InputError, "two numbers from -50 to 50 µm"),
        (lambda: ta.reducer("rv20e", rotation_clearance=3), InputError, "rotation_clearance is 3; allowed is two"),
        (
            lambda: ta.reducer("rv20e", rotation_clearance=(0.0, 2.0)).set_to({TURNED: 3.0}),
            InputError,
            r"rotation clearance \[µm\] is 3.0?; allowed is 0 to 2, the bounds of this setting",
        ),
        (
            lambda: ta.reducer("rv20e").set_to({"rotation clearance [arcsec]": 3.0}),
            UnknownNameError,
            r"rotation clearance \[µm\]",
        ),
    ],
    ids=["out of range", "no range", "table beyond the study", "another unit"],
)
def test_what_cannot_be_meant_is_refused_in_one_sentence(asked, error, words):
    with pytest.raises(error, match=words) as caught:
        asked()
    assert "\n" not in str(caught.value)


def test_a_row_needs_the_radius_at_which_its_zone_holds():
    row = {"id": "modification.rotation", "part": "discs", "feature": "size", "unit": "µm", "plus": 1.0, "minus": -1.0}
    with pytest.raises(InputError, match=r"modification\.rotation is an angle and needs over"):
        ta.Drawing.of_rows([{**row, "min": 0.1, "max": 20, "cost": 1}])

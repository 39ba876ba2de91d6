"""What is said of exact parts follows the modification in force; one that exceeds the catalogue is said."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.builders import prepared, says
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers.cycloid.clearance import clearance_of
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.perfect import exact_loop
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.modification import ModificationRequest, choose, wanted_clearances
from tolalloc.reducers.reducer.design import Modification
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.portrait import portrait_of
from tolalloc.study.inquiries.modify import Modify, answer_of


@pytest.fixture(scope="module")
def model() -> ReducerModel:
    ranges = {"flank_clearance": (1.0, 8.0), "radial_clearance": (3.0, 30.0)}
    return prepared(reducer={"name": "rv20e", **ranges}).model


def lost_motion(sentences: tuple[str, ...]) -> float:
    (found,) = (
        re.search(r"lost motion is (\S+)′, the catalogue allows", own) for own in sentences if "lost motion" in own
    )
    assert found is not None
    return float(found[1])


@pytest.mark.parametrize("clearances", [(1.04, 8.0), (3.5, 6.6), (4.0, 9.0), (6.0, 12.0), (8.0, 20.0)])
def test_remarks_speak_of_the_modification_in_force(model, clearances):
    there = model.at(np.array(clearances))
    modified = replace(model.reducer, modification=there.modification(np.array(clearances)))
    expected = float(exact_loop(modified).lost_motion[-1]) / ARCMINUTE
    assert lost_motion(portrait_of(there).remarks) == float(f"{expected:.2g}")
    assert there.kernel.fixed["modification.equidistant"] == modified.modification.equidistant


def test_a_modification_beyond_the_catalogue_is_a_caution_of_its_settings_alone(model):
    inside, beyond = (portrait_of(model).cautions(np.array(own)) for own in ((1.04, 8.0), (8.0, 20.0)))
    assert not any("lost motion" in own for own in inside)
    assert any("lost motion" in own and " 1.8′" in own for own in beyond)


def test_a_check_of_a_design_speaks_of_its_clearances(model):
    x = np.zeros((4, len(model.columns)))
    for flank, radial in ((2.0, 9.0), (5.0, 15.0)):
        there = model.at(np.array((flank, radial)))
        sentences = portrait_of(there).examination(there.examined(x)).sentences
        assert any(re.search(rf" {flank:g} µm .* {radial:g} µm ", own) for own in sentences)
        assert any(f" has {radial:g} µm of radial clearance" in own for own in sentences)


@pytest.mark.parametrize(("radial", "warned"), [(15.0, True), (10.0, True), (5.0, True), (3.0, True), (1.5, False)])
def test_a_proposed_modification_beyond_the_catalogue_is_said(radial, warned):
    """Amounts that li2018 chooses for an RV-20E leave 0.34′ of backlash a micrometre of radial clearance."""
    found = choose(
        ModificationRequest(method="li2018", radial_clearance=radial * MICROMETRE), load_reducer("rv20e"), -167.0
    )
    assert found.allowed_lost_motion == pytest.approx(ARCMINUTE)
    assert found.exceeds_catalogue == warned
    assert says(answer_of(found).warnings, "modification.exceeds_catalogue") == warned


def test_a_reducer_without_a_catalogue_has_nothing_to_exceed():
    found = choose(ModificationRequest(method="li2018"), load_reducer("rv20e_liu2020"), -167.0)
    assert not found.exceeds_catalogue


@pytest.mark.parametrize(("flank", "radial"), [(3.5, 8.0), (1.0, 10.0), (8.0, 6.0)])
@pytest.mark.parametrize("name", ["rv40e", "rv160e"])
def test_wanted_clearances_are_delivered_by_exact_distances(name, flank, radial):
    """Amounts of both signs, on two and on three cranks: the wrong sign would be interference, which is refused."""
    reducer = load_reducer(name)
    request = ModificationRequest(flank_clearance=flank * MICROMETRE, radial_clearance=radial * MICROMETRE)
    found = choose(request, reducer, -reducer.load.rated_torque)
    stage = reducer.cycloid_stage
    assert np.sign(found.best.amounts[1]) == np.sign(flank - radial)
    exact = clearance_of(ToothProfile(stage=stage, modification=found.best.modification), exact=True)
    assert exact.rotation * stage.disc_pitch_radius == pytest.approx(flank * MICROMETRE, abs=0.02 * MICROMETRE)
    assert exact.before[[0, -1]] == pytest.approx(radial * MICROMETRE, abs=0.02 * MICROMETRE)
    assert found.delivered_flank == exact.rotation * stage.disc_pitch_radius
    assert exact.after.min() > -1e-9


def test_default_amounts_can_be_built():
    """The shipped reducers keep their catalogues' lost motion with the clearances that are wanted by default."""
    for name in ("rv20e", "rv40e", "rv80e", "rv110e", "rv160e"):
        found = choose(*Modify(reducer=name).prepare())
        assert found.contact.loop.lost_motion[0] < found.allowed_lost_motion, name
        assert not found.exceeds_catalogue


def test_wanted_clearances_beyond_the_catalogue_are_said():
    wanted = ModificationRequest(flank_clearance=12 * MICROMETRE, radial_clearance=20 * MICROMETRE)
    found = choose(wanted, load_reducer("rv20e"), -167.0)
    assert found.exceeds_catalogue
    assert says(answer_of(found).warnings, "modification.wanted_exceeds_catalogue")
    assert not says(answer_of(found).sentences, "modification.play")


def test_no_amounts_leave_a_flank_clearance_that_another_pin_closes_first():
    """Beyond (1 + q)·J the pin at φ0 is not the first one: the exact flank clearance stays behind the formula's."""
    stage = load_reducer("rv40e").cycloid_stage
    ratio, radial = stage.flank_ratio, 5 * MICROMETRE
    most = (1 + ratio) * radial
    wanted_clearances(stage, most, radial)
    with pytest.raises(InputError, match="another pin touches first"):
        wanted_clearances(stage, 1.01 * most, radial)
    delivered = []
    for flank in (most, 1.2 * most):
        amounts = Modification.from_clearances(flank, radial, stage)
        exact = clearance_of(ToothProfile(stage=stage, modification=amounts), exact=True)
        delivered.append(exact.rotation * stage.disc_pitch_radius / flank)
    assert delivered[0] == pytest.approx(1.0, abs=0.002)
    assert delivered[1] < 0.99

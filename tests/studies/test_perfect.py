"""Units that press themselves: a requirement of every believable reducer, said in a check, lifted by name."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says, units_at_random, wording
from tests.studies.command import answer_of, tolalloc
from tests.studies.scripts import study_script
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.capability.indices import Limits
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reducers.choice import ReducerChoice
from tolalloc.reducers.equivalent.perfect import preload, rated_pin_force
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.idle_torque import IdleTorque
from tolalloc.reports.portrait import Examination, portrait_of
from tolalloc.reports.wording import number
from tolalloc.study.prepared import Prepared

LIMITS = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}


def prepared(reducer: str, **changes: object) -> Prepared:
    return Prepared(study=ta.Study(ta.reducer(reducer), ta.drawing("rv20e_table4"), **{"limits": LIMITS, **changes}))


def test_no_pin_may_press_harder_without_torque_than_the_rated_torque_makes_it():
    asked = prepared("rv20e")
    peak, preloaded = asked.requirements
    assert (peak.output, preloaded.output) == (ta.PEAK_TO_PEAK, ta.PRELOAD)
    assert preloaded.limits.upper == rated_pin_force(asked.model.reducer)
    # Printed stiffnesses are fifty times a catalogue's; what presses with them means nothing.
    assert [own.output for own in prepared("rv20e_liu2020").requirements] == [ta.PEAK_TO_PEAK]


@pytest.mark.slow
def test_every_design_is_held_to_the_pin_force_at_its_own_modification():
    """And its model says how the distance from the limit changes with the clearances."""
    reducer = ta.reducer("rv20e", flank_clearance=(1.0, 8.0), radial_clearance=(3.0, 30.0))
    asked = Prepared(study=ta.Study(reducer, ta.drawing("rv20e_drawing"), limits=LIMITS, joint=None))
    model, space, settings = asked.model, asked.space, np.array([1.5, 5.0])
    shown = tuple(replace(own, guarantee=ta.AtYield(0.9)) for own in asked.requirements)
    verifier = Verifier(space=space, model=model, requirements=shown, seeds=SeedTree(1), units=64, confidence=0.5)
    design = verifier.verify(np.append(np.ones(len(space.groups)), settings), "other teeth")
    (limited,) = design.checks[-1].constraints
    force = rated_pin_force(model.at(settings).reducer_in_force)
    assert limited.limit == force
    assert force < model.own_limits[ta.PRELOAD] - 40.0
    fixed = Requirement(output=ta.PRELOAD, limits=Limits(upper=force), guarantee=ta.AtYield(0.9))
    other = replace(verifier, requirements=(shown[0], fixed)).verify(design.design, "other teeth")
    (stated,) = other.checks[-1].constraints
    step = space.setting_steps[1]
    ends = [rated_pin_force(model.at(settings + np.array([0.0, way * step])).reducer_in_force) for way in (-1, 1)]
    slopes = [own.stack.slopes[1] for own in (limited, stated)]
    assert slopes[0] - slopes[1] == pytest.approx(-(ends[1] - ends[0]) / (2 * step))


def test_a_study_may_say_otherwise():
    own = prepared("rv20e", limits={**LIMITS, ta.PRELOAD: ta.Limit(upper=2000.0)}).requirements
    assert [(limit.output, limit.limits.upper) for limit in own] == [(ta.PEAK_TO_PEAK, 60.0), (ta.PRELOAD, 2000.0)]
    assert [limit.output for limit in prepared("rv20e", limits={**LIMITS, ta.PRELOAD: None}).requirements] == [
        ta.PEAK_TO_PEAK
    ]
    with pytest.raises(InputError, match="the model has no limit of its own to lift there"):
        _ = prepared("rv20e", limits={**LIMITS, ta.LOST_MOTION: None}).requirements
    with pytest.raises(InputError, match="every limit is None"):
        _ = prepared("rv20e", limits={ta.PRELOAD: None}).requirements


@pytest.mark.slow
def test_a_check_counts_the_preloaded_among_random_units(tmp_path):
    script = study_script(tmp_path, reducer={"name": "rv20e"})
    result = tolalloc("check", script)
    assert result.returncode == 0, result.stderr
    for shown in ("1.04 µm", "8 µm", "N·m/arcmin", " 49 ("):
        assert shown in result.stdout
    counted = ta.check(script).result.examined
    said = counted["share preloaded [-]"]
    assert counted["units [-]"] == 1000
    # The same share of other random units, within four standard errors of the difference.
    asked = prepared("rv20e")
    found = preload(asked.model.kernel.model, asked.model.kernel.errors(units_at_random(asked.errors, 500, 77)))
    share = (found.pin_force > rated_pin_force(asked.model.reducer)).mean()
    pooled = (said * 1000 + share * 500) / 1500
    assert abs(said - share) <= 4 * np.sqrt(pooled * (1 - pooled) * (1 / 1000 + 1 / 500))


def test_a_check_for_a_program_says_the_same(tmp_path):
    script = study_script(tmp_path, reducer={"name": "rv20e"})
    said = answer_of("check", script)
    assert list(said["limits"]) == [ta.PEAK_TO_PEAK, ta.PRELOAD]
    assert any("are preloaded" in sentence for sentence in said["examined"])
    assert re.search(r"preloaded \(.* N of rated torque\).*: a tooth modification", said["but"])


def test_the_last_sentence_of_a_check_says_that_units_are_preloaded_and_what_frees_them(tmp_path):
    *_, said, last = tolalloc("check", study_script(tmp_path, reducer={"name": "rv20e"})).stdout.splitlines()
    assert says(said, "check.program")
    assert "preloaded" in last and "in order" not in last
    assert "`tolalloc modify`" in last and "flank_clearance" in last


def test_a_verdict_says_that_units_are_preloaded_by_printed_stiffnesses_too():
    def verdict(reducer: ReducerChoice, scale: float) -> str:
        asked = Prepared(study=ta.Study(reducer, ta.drawing("rv20e_table4"), limits=LIMITS))
        counted = asked.model.examined(units_at_random(asked.errors, 200, 5, scale))
        return portrait_of(asked.model).examination(counted).but

    assert "preloaded" in verdict(ta.reducer("rv20e"), 1.0)
    assert verdict(ta.reducer("rv20e"), 1e-3) == ""
    assert "stiffnesses" in verdict(ta.reducer("rv20e_liu2020"), 1.0)
    opened = verdict(ta.reducer("rv20e", flank_clearance=(1.0, 12.0)), 1.0)
    assert opened.endswith(" 1 to 12 µm")


def test_no_load_torque_is_said_at_output_and_motor_beside_the_one_that_the_catalogue_allows():
    def examined(allowed: float | None, scale: float) -> tuple[ReducerModel, np.ndarray, Examination]:
        choice = ta.reducer("rv20e")
        assert choice.reducer.catalogue is not None
        stated = replace(choice.reducer.catalogue, no_load_torque=allowed)
        choice = replace(choice, reducer=replace(choice.reducer, catalogue=stated))
        asked = Prepared(study=ta.Study(choice, ta.drawing("rv20e_table4"), limits=LIMITS))
        x = units_at_random(asked.errors, 200, 6, scale)
        return asked.model, x, portrait_of(asked.model).examination(asked.model.examined(x))

    model, x, said = examined(2.75, 1.0)
    idle = IdleTorque.of(model.reducer).together
    torque = preload(model.kernel.model, model.kernel.errors(x)).friction_torque
    half, most = np.median(torque), np.quantile(torque, 0.9973)
    for value in (half, most, most / 105, idle, 100 * most / 167):
        assert number(float(value), ".2g") in said.fault
    assert "(assumed)" in said.fault
    assert number(2.75, ".3g") in said.but
    # A drawing whose pins press little is held to the catalogue's torque, too, and to nothing where it states none.
    _, _, little = examined(idle + 5e-4, 1e-3)
    assert number(idle + 5e-4, ".3g") in little.but and little.fault
    assert examined(None, 1e-3)[2].but == ""
    assert model.own_limits == {ta.PRELOAD: model.rated_pin_force, ta.FRICTION_TORQUE: 2.75 - idle}


def test_a_model_of_a_user_is_in_order_without_a_but():
    last = tolalloc("check", "studies/choi2000_clutch.py").stdout.splitlines()[-1]
    assert says(last, "check.verdict", state=wording("check.in_order"))


def test_teeth_that_rated_torque_presses_harder_may_press_harder_without_it():
    reducer = ta.reducer("rv20e", flank_clearance=(1.0, 8.0), radial_clearance=(3.0, 30.0))
    asked = Prepared(study=ta.Study(reducer, ta.drawing("rv20e_drawing"), limits=LIMITS, joint=None))
    own, model = asked.requirements[-1], asked.model.at(np.array([2.0, 30.0]))
    moved = own.in_force(model)
    assert moved.limits.upper > own.limits.upper + 200.0
    assert moved.limits.upper == rated_pin_force(model.reducer_in_force)


@pytest.mark.parametrize(("preset", "limited"), [("cd29", True), ("rv20e", True), ("rv20e_liu2020", False)])
def test_a_reducer_limits_preload_unless_its_stiffness_is_printed_and_far_too_large(preset, limited):
    source = ta.reducer(preset, neglected=("*",))
    row = {"id": "pin.diameter", "plus": 1, "minus": -1, "unit": "µm", "min": 0.5, "max": 2, "cost": 1}
    model = source.bound(ta.Drawing.of_rows([row]).errors, "test")
    assert (ta.PRELOAD in model.own_limits) == limited

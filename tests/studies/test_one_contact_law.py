"""Commands that state a force state the same one: the reducer without errors, steel line contact, bearings yielding."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import reducer_file
from tests.studies.command import answer_of
from tolalloc.reducers.cycloid.loaded_contact import assess
from tolalloc.reducers.equivalent.perfect import perfect_reducer

TORQUE = 572.0


@pytest.fixture(scope="module")
def overloaded(tmp_path_factory) -> Path:
    """An RV-40E whose rated torque is the 572 N·m at which the commands are compared."""
    path = tmp_path_factory.mktemp("own") / "rv40e.reducer.toml"
    return reducer_file(path, "rv40e", ("rated_torque_nm = 412", f"rated_torque_nm = {TORQUE:g}"))


@pytest.fixture(scope="module")
def contact(overloaded) -> dict:
    return answer_of("contact", "--reducer", overloaded, "--torque", -TORQUE)


@pytest.mark.slow
def test_contact_says_what_te_says(overloaded, contact):
    found = answer_of("te", "--reducer", overloaded, "--unit", "exact", "--torque", -TORQUE)
    outputs = {own["name"]: own["value"] for own in found["outputs"]}
    yielding = contact["bearings yielding"]
    assert yielding["largest pin force [N]"] == pytest.approx(outputs["largest pin force"], rel=0.01)
    on_a_disc = [outputs[f"pins in contact on a disc, {which}"] for which in ("least", "most")]
    assert yielding["pins in contact on a disc [-]"] == on_a_disc


@pytest.mark.slow
def test_modify_says_what_contact_says_of_the_reducer_that_it_writes(overloaded, tmp_path):
    written = tmp_path / "modified.toml"
    chosen = answer_of("modify", "song2019", "--reducer", overloaded, "--torque", -TORQUE, "--rotation", 0.0005,
                       "--write", written)  # fmt: skip
    again = answer_of("contact", "--reducer", written, "--torque", -TORQUE)
    promised, found = chosen["contact"]["bearings yielding"], again["bearings yielding"]
    assert found["largest pin force [N]"] == pytest.approx(promised["largest pin force [N]"], rel=1e-4)
    assert found["pins in contact on a disc [-]"] == promised["pins in contact on a disc [-]"]


def test_run_limits_the_force_that_contact_says(overloaded, contact):
    model = ta.reducer(overloaded).bound(ta.drawing("rv20e_table4").errors, "test")
    output = "largest pin force, rated torque [N]"
    found = model.reading((output,))(np.zeros((1, len(model.columns))))
    assert found.values[0, 0] == pytest.approx(contact["bearings yielding"]["largest pin force [N]"], rel=0.01)


@pytest.mark.slow
def test_simulate_settles_at_the_force_that_contact_says(overloaded, contact):
    found = answer_of("simulate", "--reducer", overloaded, "--torque", -TORQUE, "--duration", 0.4, "--ramp", 0.1)
    yielding = contact["bearings yielding"]
    least, most = yielding["pins in contact on a disc [-]"]
    for own in (found["in motion"], found["at rest"]):
        assert own["largest pin force [N]"] == pytest.approx(yielding["largest pin force [N]"], rel=0.01)
        for disc in (1, 2):
            assert own[f"pins in contact, disc {disc} [-]"] == f"{least}…{most}"


def test_rigid_bearings_give_the_force_of_the_pins_alone(overloaded):
    """With bearings that hardly yield the elastic model is the single tooth's law, torque by torque."""
    reducer = ta.reducer(overloaded).reducer
    rigid = replace(
        reducer,
        parts=(),
        stiffness=replace(reducer.stiffness, crank_disc_bearing=1e14, crank_carrier_bearing=1e14, carrier_bearing=1e14),
    )
    found = perfect_reducer(rigid, -TORQUE).forces.pins
    expected = assess(rigid, TORQUE).together
    assert found.max() == pytest.approx(expected.force.max(), rel=1e-4)

"""Limits that a model has of its own: one number for one drawing, whichever command is asked."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import verifier_of
from tolalloc.allocation.space.requirement import OwnLimit
from tolalloc.cli.live.session import LiveDesign, Session
from tolalloc.study.prepared import Prepared

ROW = {"plus": 2.5, "minus": -2.5, "unit": "µm", "min": 1, "max": 30, "cost": 3}
REDUCERS = ("rv20e", "rv40e", "rv80e", "rv110e", "rv160e", "rv27c")
LIMITED = {ta.RADIAL_CLEARANCE: ta.Limit(lower=1.0)}


def study_of(reducer: str) -> ta.Study:
    """Return a study of a reducer whose pins vary and whose modification may move."""
    return ta.Study(
        ta.reducer(reducer, flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
        ta.Drawing.of_rows([{"id": "pin.diameter", **ROW}]),
        limits=LIMITED,
        neglected=["*"],
    )


@pytest.mark.parametrize("reducer", REDUCERS)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_drawing_has_one_limit_in_every_command(reducer, seed):
    study = study_of(reducer)
    before, rng = Prepared(study=study), np.random.default_rng(seed)
    chosen = {own.name: round(float(rng.uniform(own.lower, own.upper)), 1) for own in before.model.settings}
    after = Prepared(study=study.changed(study.drawing, chosen))
    stated = {own.output: own.limits.upper for own in after.requirements if isinstance(own, OwnLimit)}
    assert ta.PRELOAD in stated
    # what an allocation holds the design to, what `check` tells of its units, and what the live page does
    design = np.array([1.0, *chosen.values()])
    model = before.model.at(before.space.settings_of(design))
    held = {own.output: own.in_force(model).limits.upper for own in before.requirements if isinstance(own, OwnLimit)}
    assert held == pytest.approx(stated, rel=1e-9)
    examined = after.model.examined(after.random_units(20))
    assert examined["pin force of the rated torque [N]"] == pytest.approx(stated[ta.PRELOAD], rel=1e-9)
    live = Session(prepared=before).units(LiveDesign(zones=(), settings=tuple(chosen.values())), 20, lambda: True)
    shown = {own["name"]: own["upper"] for own in live["outputs"]}
    assert any(upper == pytest.approx(stated[ta.PRELOAD], rel=1e-9) for upper in shown.values() if upper)


def test_the_excess_moves_with_the_limit():
    prepared = Prepared(study=study_of("rv80e"))
    preload = next(own for own in prepared.requirements if own.output == ta.PRELOAD)
    verifier = verifier_of(prepared, preload)
    found = verifier.verify(np.array([1.0, *(own.lower + 0.5 for own in prepared.space.settings)]), "pressed")
    (slopes,), step = found.furthest[ta.PRELOAD], prepared.space.setting_steps
    assert (found.outputs[ta.PRELOAD] > 0).mean() > 0.9
    limit = found.checks[-1].requirement.limits.upper
    assert limit == pytest.approx(prepared.model.at(found.settings).own_limits[ta.PRELOAD], rel=1e-12)
    for at, size in enumerate(step.tolist()):
        moved = size * np.eye(len(step))[at]
        ends = [prepared.model.at(found.settings + side * moved).own_limits[ta.PRELOAD] for side in (1, -1)]
        sample = [
            prepared.model.at(found.settings + side * moved).reading((ta.PRELOAD,))(
                found.sample.redraw()[slopes.rows[:3]]
            )
            for side in (1, -1)
        ]
        excess = [own.values[:, 0] - end for own, end in zip(sample, ends, strict=True)]
        difference = (excess[0] - excess[1]) / (2 * size) / slopes.deviation
        np.testing.assert_allclose(slopes.slopes[:3, 1 + at], difference, rtol=0.02, atol=1e-3)

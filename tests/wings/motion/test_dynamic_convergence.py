"""How the answer in time converges as the time step is halved."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation_manual import shown
from tests.wings.motion.test_motion import input_of, run
from tolalloc.wings.motion.motion import Damping, SpeedProfile, generalised_alpha, motion_of, newmark

INTEGRATORS = {"newmark": newmark(), "alpha 0": generalised_alpha(0.0), "alpha 0.8": generalised_alpha(0.8)}
STEPS = 160 * 2 ** np.arange(5)


def differences(model, errors, integrator, angle: float) -> tuple[np.ndarray, bool]:
    """Change of rotation and speed at common times with each halving, and whether a contact changed."""
    end = 4e-4
    speed, torque = SpeedProfile((0.0, end), (0.0, 3.0), "step"), SpeedProfile((0.0, end), (-1000.0, -1050.0), "step")
    rotations, changed = [], False
    for steps in STEPS.tolist():
        motion = motion_of(model.reducer, input_of(model.reducer, speed), torque, end, steps, angle)
        found = run(model, errors, motion, Damping(stiffness_proportional=2e-7), integrator)
        every = slice(None, None, steps // 20)
        rotations.append(np.stack([found.transmission_error[0, every], found.output_speed[0, every]]))
        changed |= bool((found.pins_in_contact != found.pins_in_contact[:, :1]).any())
    return np.abs(np.diff(rotations, axis=0)).max(axis=2), changed


@pytest.mark.parametrize("contacts", ["the same all the time", "opening and closing"])
@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_order_is_two(rv20e, table4, name, contacts):
    """A contact that opens or closes is a corner of a force, which leaves the order as it is once steps are fine."""
    angle = {"the same all the time": 0.31, "opening and closing": 0.3}[contacts]
    apart, changed = differences(rv20e, table4, INTEGRATORS[name], angle)
    assert changed == (contacts == "opening and closing")
    orders = np.log2(apart[:-1] / apart[1:])
    np.testing.assert_allclose(orders[-2:], 2.0, rtol=0, atol=0.1)
    if changed:
        shown("S3", float(orders[-2:].mean()))

"""The reducer without part errors, its bearings yielding: the one answer on forces that every command gives."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES, HysteresisLoop, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.series import at_torque

PHASES = 72
"""Phases of one pin pitch at which a reducer without errors is solved, for forces over the turn [-]."""


def exact_unit(model: EquivalentModel) -> Float[np.ndarray, "1 column"]:
    """Return the errors of a unit whose parts are exact and whose teeth are modified as drawn [m, angles rad]."""
    deviations: Mapping[str, float] = model.reducer.modification.deviations
    return np.array([[deviations.get(name, 0.0) for name in model.columns]])


def exact_loop(reducer: Reducer) -> HysteresisLoop:
    """Return torque against twist of the unit whose parts are exact."""
    model = EquivalentModel(reducer)
    return hysteresis_loop(model, exact_unit(model), TURN_ANGLES)


def perfect_reducer(reducer: Reducer, torque: float) -> Solved:
    """Return equilibria and forces of the reducer without part errors over one pin pitch of the crank.

    Its modification and the stiffness of its parts under the torque are in force. While the carrier turns by a pin
    pitch over the teeth of a disc, the crank direction meets every phase of the pins, and all else repeats.

    Parameters
    ----------
    reducer
        The reducer.
    torque
        Torque on the carrier, negative where it resists the rotation [N·m].
    """
    model, stage = EquivalentModel(at_torque(reducer, torque)), reducer.cycloid_stage
    span = 2.0 * pi / (stage.pin_count * stage.disc_teeth)
    return Solved.of(model.equilibria(exact_unit(model), torque, span * np.arange(PHASES) / PHASES))

"""Exact derivatives of what is read off torque against twist: lost motion, backlash, torsional stiffness."""

from __future__ import annotations

from functools import partial

import numpy as np
from jaxtyping import Float, UInt8

from tolalloc.models.model import Evaluation
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers import BACKLASH, LOST_MOTION, TORSIONAL_STIFFNESS
from tolalloc.reducers.equivalent import hysteresis
from tolalloc.reducers.equivalent.answers import Status
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.chunks import map_chunks

DIFFERENTIABLE = (LOST_MOTION, BACKLASH, TORSIONAL_STIFFNESS)
"""Outputs that `loop_derivatives` takes."""

Width = tuple[Float[np.ndarray, " chunk"], Float[np.ndarray, "chunk all_columns"]]
"""Twist between both directions of a torque, mean over the turn, and its derivatives [rad, rad/m]."""


def loop_derivatives(
    kernel: KernelResponse, output: str, x: Float[np.ndarray, "sample column"]
) -> tuple[Evaluation, Float[np.ndarray, "sample all_columns"]]:
    """Return one of `DIFFERENTIABLE` of every sample, and its derivatives by all error columns of the model.

    They take two to four times as long as the output alone: the adjoint of the equilibrium at every angle and torque.
    """
    values, slopes, status = np.empty((len(x), 1)), np.empty((len(x), len(kernel.model.columns))), np.empty(len(x))
    for rows, ((value, slope), worst) in map_chunks(partial(_derived, kernel.alone, output), x, kernel.mapper):
        values[rows, 0], slopes[rows], status[rows] = value, slope, worst
        kernel.observe(worst)
    return Evaluation(values=values, status=status.astype(np.uint8)), slopes


def _derived(
    kernel: KernelResponse, output: str, x: Float[np.ndarray, "chunk column"]
) -> tuple[Width, UInt8[np.ndarray, " chunk"]]:
    model, errors = kernel.model, kernel.errors(x)
    if output != TORSIONAL_STIFFNESS:
        share = hysteresis.LOST_MOTION if output == LOST_MOTION else hysteresis.BACKLASH
        (width, slope), status = _width(model, errors, share)
        return (width / ARCMINUTE, slope / ARCMINUTE), status
    (low, by_low), first = _width(model, errors, hysteresis.LOST_MOTION)
    (high, by_high), second = _width(model, errors, 1.0)
    rated = model.reducer.load.rated_torque
    stiffness = 2.0 * (1.0 - hysteresis.LOST_MOTION) * rated / (high - low) * ARCMINUTE
    return (stiffness, -(stiffness / (high - low))[:, np.newaxis] * (by_high - by_low)), np.maximum(first, second)


def _width(
    model: EquivalentModel, errors: Float[np.ndarray, "chunk all_columns"], share: float
) -> tuple[Width, UInt8[np.ndarray, " chunk"]]:
    """Return the width of the loop at a share of the rated torque."""
    torque = share * model.reducer.load.rated_torque
    width, slope = np.zeros(len(errors)), np.zeros(errors.shape)
    status = np.full(len(errors), Status.CONVERGED, np.uint8)
    for side in (1, -1):
        twist, found = model.at_torque(side * torque).rotation_derivatives(
            errors, side * torque, hysteresis.TURN_ANGLES
        )
        width += side * twist.mean(axis=1)
        slope += side * found.by_error.reshape(*twist.shape, -1).mean(axis=1)
        np.maximum(status, found.status.reshape(twist.shape).max(axis=1), out=status)
    return (width, slope), status

"""Assemblies step by step: the state as mounted, what is turned, and the state as adjusted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.wings.assembly.control import KalmanFilter, Regulator
from tolalloc.wings.assembly.steps import StateSpace

State = Float[np.ndarray, "*samples state"]


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """Assemblies step by step."""

    # z(k), state with the part of step k, before anything is turned [rad]
    mounted: Float[np.ndarray, "*samples step state"]
    adjustments: Float[np.ndarray, "*samples step adjustment"]  # u(k), what is turned, in the parts' own axes [rad]
    adjusted: Float[np.ndarray, "*samples step state"]  # x(k), state after that [rad]


def foreseen(space: StateSpace, regulator: Regulator, errors: Float[np.ndarray, "*samples error"]) -> Trajectory:
    """Return assemblies of parts that are all measured before the first is mounted, errors in their own axes [rad]."""

    def estimate(step: int, mounted: State) -> State:
        return np.asarray(mounted + errors @ space.entering[step + 1 :].sum(axis=0).T)

    return _march(space, regulator, errors, np.zeros((*errors.shape[:-1], *space.effort.shape)), estimate)


def simulated(
    space: StateSpace,
    regulator: Regulator,
    kalman: KalmanFilter,
    errors: Float[np.ndarray, "*samples error"],
    reading_noise: Float[np.ndarray, "*samples reading"],
    adjustment_noise: Float[np.ndarray, "*samples step adjustment"],
) -> Trajectory:
    """Return assemblies in which the state is estimated from readings.

    Given is what every reading adds, the readings of all steps in a row, and what every adjustment misses [rad].
    """
    ends = np.cumsum([len(observing) for observing in space.observing])
    noise = np.split(reading_noise, ends[:-1], axis=-1)
    expected: State = np.zeros((*errors.shape[:-1], space.states))

    def estimate(step: int, mounted: State) -> State:
        nonlocal expected
        surprise = (mounted - expected) @ space.observing[step].T + noise[step]
        state: State = expected + surprise @ kalman.gains[step].T
        expected = state - state @ (space.adjusting[step] @ regulator.gains[step]).T
        return state

    return _march(space, regulator, errors, adjustment_noise, estimate)


def random_numbers(space: StateSpace) -> int:
    """Return how many random numbers an assembly has: part errors, readings of all steps, adjustments of all steps."""
    readings = sum(len(observing) for observing in space.observing)
    return int(space.entering.shape[2] + readings + space.effort.size)


def drawn(
    space: StateSpace,
    regulator: Regulator,
    kalman: KalmanFilter,
    deviations: tuple[Float[np.ndarray, " error"], float, float],
    standard: Float[np.ndarray, "*samples number"],
) -> Trajectory:
    """Return simulated assemblies from standard normal numbers.

    Deviations are the standard ones of every part error, of a reading, and of what an adjustment misses [rad]; of the
    numbers, `random_numbers` per assembly, those of the part errors come first, then of the readings [-].
    """
    of_parts, of_reading, of_adjustment = deviations
    parts = space.entering.shape[2]
    errors, readings, missed = np.split(standard, [parts, standard.shape[-1] - space.effort.size], axis=-1)
    missed = of_adjustment * missed.reshape(*standard.shape[:-1], *space.effort.shape)
    return simulated(space, regulator, kalman, of_parts * errors, of_reading * readings, missed)


def _march(
    space: StateSpace,
    regulator: Regulator,
    errors: Float[np.ndarray, "*samples error"],
    missed: Float[np.ndarray, "*samples step adjustment"],
    estimate: Callable[[int, State], State],
) -> Trajectory:
    """Return assemblies whose state before each adjustment is taken to be what an estimate makes of the true one."""
    steps = list[tuple[State, Float[np.ndarray, "*samples adjustment"], State]]()
    adjusted: State = np.zeros((*errors.shape[:-1], space.states))
    for step in range(space.steps):
        mounted = adjusted + errors @ space.entering[step].T
        adjustment = -estimate(step, mounted) @ regulator.gains[step].T
        adjusted = mounted + (adjustment + missed[..., step, :]) @ space.adjusting[step].T
        steps.append((mounted, adjustment, adjusted))
    of_mounted, of_adjustments, of_adjusted = (np.stack(each, axis=-2) for each in zip(*steps, strict=True))
    return Trajectory(mounted=of_mounted, adjustments=of_adjustments, adjusted=of_adjusted)

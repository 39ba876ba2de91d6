"""Steps from one mounting of several units to a better one; each asks for the peak-to-peaks of units that it tries."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from itertools import combinations, permutations, product
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from tolalloc.assembly.mounting.stock import Mountings, PartStock

_Answer = TypeVar("_Answer")

_FAILED = 1e9
"""What a unit without an answer counts in an assignment, beyond every sum of good ones [arcsec]."""

Peaks = Float[np.ndarray, " _unit"]
Trial = tuple[Mountings, Peaks]
Asking = Generator[Mountings, Peaks, _Answer]
"""A search that asks for the peak-to-peaks of units, so that those of all starts are computed at once."""
MountingStep = Callable[[PartStock, Mountings, Peaks], Asking[Trial]]


def units_from(stock: PartStock, parts: Sequence[int], turns: Sequence[Sequence[int]] | None = None) -> Mountings:
    """Return every unit that can be mounted from some of the parts; from those of one unit, all its mountings.

    Parameters
    ----------
    parts
        Numbers of the parts to choose from [-].
    turns
        Turns to choose from at every place; all unless given [-].
    """
    fitting = [[part for part in parts if part in stock.fitting(stock.places[slots[0]])] for slots in stock.slots]
    choices = product(*(permutations(own, len(slots)) for own, slots in zip(fitting, stock.slots, strict=True)))
    chosen = np.array([[part for own in choice for part in own] for choice in choices])
    stands = np.array(list(product(*(turns or map(range, stock.turns)))))
    units = np.empty((len(chosen), len(stands), len(stock.places), 2), int)
    units[:, :, [at for slots in stock.slots for at in slots], 0] = chosen[:, np.newaxis]
    units[..., 1] = stands
    return units.reshape(-1, len(stock.places), 2)


def assigned(at: int) -> MountingStep:
    """Return the step that assigns the parts at one place now to the units anew, each in its best turn."""

    def step(stock: PartStock, mountings: Mountings, _peaks: Peaks) -> Asking[Trial]:
        units, turns = len(mountings), stock.turns[at]
        trials = np.broadcast_to(mountings[:, np.newaxis, np.newaxis], (units, units, turns, *mountings.shape[1:]))
        trials = trials.copy()
        trials[..., at, 0] = mountings[:, at, 0][:, np.newaxis]
        trials[..., at, 1] = np.arange(turns)
        values = (yield trials.reshape(-1, *mountings.shape[1:])).reshape(units, units, turns)
        unit, part = linear_sum_assignment(np.minimum(values.min(axis=2), _FAILED))
        turn = values.argmin(axis=2)[unit, part]
        return trials[unit, part, turn], values[unit, part, turn]

    return step


def turned(stock: PartStock, mountings: Mountings, _peaks: Peaks) -> Asking[Trial]:
    """Return every unit in the best of all mountings of the parts that it has, its sun meshed as it is.

    Notes
    -----
    A sun's teeth are tried by `assigned` alone: they would multiply all else.
    """
    ways = np.array([units_from(stock, unit[:, 0].tolist(), _turns_but_the_suns(stock, unit)) for unit in mountings])
    values = (yield ways.reshape(-1, *mountings.shape[1:])).reshape(len(mountings), -1)
    best = np.arange(len(mountings)), values.argmin(axis=1)
    return ways[best], values[best]


def _turns_but_the_suns(stock: PartStock, unit: Int[np.ndarray, "place 2"]) -> list[Sequence[int]]:
    """Return the turns to choose from at every place of a unit, at the sun's the present one alone [-]."""
    counted = zip(stock.places, stock.turns, unit[:, 1].tolist(), strict=True)
    return [[now] if place.kind == "sun" else range(count) for place, count, now in counted]


def exchanged(stock: PartStock, mountings: Mountings, peaks: Peaks) -> Asking[Trial]:
    """Return the best exchange of two parts of one kind between two units, each then in its best turn."""
    trials, pairs = [], []
    for one, other in combinations(range(len(mountings)), 2):
        for slots in stock.slots:
            for here, there in product(slots, slots):
                pairs.append((one, other))
                trials.append(_with(stock, mountings[one], here, int(mountings[other, there, 0])))
                trials.append(_with(stock, mountings[other], there, int(mountings[one, here, 0])))
    ends = np.cumsum([len(trial) for trial in trials])[:-1]
    values = np.split((yield np.concatenate(trials)), ends)
    least = np.minimum([own.min() for own in values], _FAILED).reshape(-1, 2)
    best = int(np.argmin(least.sum(axis=1) - np.minimum(peaks, _FAILED)[np.array(pairs)].sum(axis=1)))
    found, after = mountings.copy(), peaks.copy()
    for unit, at in zip(pairs[best], (2 * best, 2 * best + 1), strict=True):
        found[unit], after[unit] = trials[at][int(values[at].argmin())], values[at].min()
    return found, after


def _with(stock: PartStock, unit: Int[np.ndarray, "place 2"], at: int, part: int) -> Mountings:
    """Return a unit with another part at a place, in all turns."""
    turns = stock.turns[at]
    trials = np.repeat(unit[np.newaxis], turns, axis=0)
    trials[:, at, 0], trials[:, at, 1] = part, np.arange(turns)
    return trials

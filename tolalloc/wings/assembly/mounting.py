"""Which part goes where: all mountings of one unit, or exact assignments and swaps between several.

Parts of one place are assigned to the units exactly, all else fixed, as the sum over the units needs no more than one
value per unit and part. Then every unit is turned anew with the parts that it has, and what stands at different places
of different units is exchanged. A step is taken only if it lowers the mean over the units.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations, permutations, product

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Response
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.progress import RunRecord
from tolalloc.wings.assembly.stock import Mountings, PartStock

_FAILED = 1e9
"""What a unit without an answer counts in an assignment, beyond every sum of good ones [arcsec]."""

Peaks = Float[np.ndarray, " _unit"]
Trial = tuple[Mountings, Peaks]
Step = Callable[["EvaluatedUnits", Mountings, Peaks], Trial]

_GAIN = 1e-9
"""Gain in the mean from which a step counts, above the rounding of a sum [arcsec]."""


@dataclass(frozen=True, kw_only=True)
class FoundMounting:
    """The mounting that was found."""

    stock: PartStock  # The parts
    mountings: Mountings  # Part and turn at every place of every unit
    # Peak-to-peak of every unit with its parts as they come, infinite where it failed, and as found [arcsec]
    before: Float[np.ndarray, " unit"]
    after: Float[np.ndarray, " unit"]
    # Units evaluated, and those of them without an answer [-]
    evaluations: int
    failures: int


@dataclass(frozen=True, kw_only=True)
class RandomMountings:
    """What the same parts do when nobody chooses."""

    # Peak-to-peak of every unit of every mounting, infinite where it failed [arcsec]
    peak_to_peaks: Float[np.ndarray, "mounting unit"]
    failures: int  # Units without an answer [-]
    every: bool  # Whether these are all mountings there are, each once

    @property
    def means(self) -> Float[np.ndarray, " mounting"]:
        """Mean over the units of each mounting without failures [arcsec]."""
        means = self.peak_to_peaks.mean(axis=1)
        return np.asarray(means[np.isfinite(means)])


@dataclass(frozen=True, kw_only=True)
class MountingResult:
    """Mounted parts."""

    torque: float  # Torque on the carrier [N·m]
    found: FoundMounting  # The mounting
    chance: RandomMountings  # What the same parts do when nobody chooses


def units_from(stock: PartStock, parts: Sequence[int], turns: Sequence[Sequence[int]] | None = None) -> Mountings:
    """Return every unit that can be mounted from some of the parts; from those of one unit, all its mountings.

    Parts are given by their numbers; the turns to choose from at every place are all of them unless given [-].
    """
    fitting = [[part for part in parts if part in stock.fitting(stock.places[slots[0]])] for slots in stock.slots]
    choices = product(*(permutations(own, len(slots)) for own, slots in zip(fitting, stock.slots, strict=True)))
    chosen = np.array([[part for own in choice for part in own] for choice in choices])
    stands = np.array(list(product(*(turns or map(range, stock.turns)))))
    units = np.empty((len(chosen), len(stands), len(stock.places), 2), int)
    units[:, :, [at for slots in stock.slots for at in slots], 0] = chosen[:, np.newaxis]
    units[..., 1] = stands
    return units.reshape(-1, len(stock.places), 2)


def assigned(at: int, memory: EvaluatedUnits, mountings: Mountings, _peaks: Peaks) -> Trial:
    """Return the parts at one place assigned to the units anew, each in its best turn."""
    units, turns = len(mountings), memory.stock.turns[at]
    trials = np.broadcast_to(mountings[:, np.newaxis, np.newaxis], (units, units, turns, *mountings.shape[1:]))
    trials = trials.copy()
    trials[..., at, 0] = mountings[:, at, 0][:, np.newaxis]
    trials[..., at, 1] = np.arange(turns)
    values = memory(trials.reshape(-1, *mountings.shape[1:])).reshape(units, units, turns)
    unit, part = linear_sum_assignment(np.minimum(values.min(axis=2), _FAILED))
    turn = values.argmin(axis=2)[unit, part]
    return trials[unit, part, turn], values[unit, part, turn]


def turned(memory: EvaluatedUnits, mountings: Mountings, _peaks: Peaks) -> Trial:
    """Return every unit in the best of all mountings of the parts that it has, its sun meshed as it is.

    A sun's teeth are tried by `assigned` alone: they would multiply all else.
    """
    stock = memory.stock
    ways = np.array([units_from(stock, unit[:, 0].tolist(), _turns_but_the_suns(stock, unit)) for unit in mountings])
    values = memory(ways.reshape(-1, *mountings.shape[1:])).reshape(len(mountings), -1)
    best = np.arange(len(mountings)), values.argmin(axis=1)
    return ways[best], values[best]


def _turns_but_the_suns(stock: PartStock, unit: Int[np.ndarray, "place 2"]) -> list[Sequence[int]]:
    """Return the turns to choose from at every place of a unit, at the sun's the present one alone [-]."""
    counted = zip(stock.places, stock.turns, unit[:, 1].tolist(), strict=True)
    return [[now] if place.kind == "sun" else range(count) for place, count, now in counted]


def exchanged(memory: EvaluatedUnits, mountings: Mountings, peaks: Peaks) -> Trial:
    """Return the best exchange of two parts of one kind between two units, each then in its best turn."""
    stock, trials, pairs = memory.stock, [], []
    for one, other in combinations(range(len(mountings)), 2):
        for slots in stock.slots:
            for here, there in product(slots, slots):
                pairs.append((one, other))
                trials.append(_with(stock, mountings[one], here, int(mountings[other, there, 0])))
                trials.append(_with(stock, mountings[other], there, int(mountings[one, here, 0])))
    ends = np.cumsum([len(trial) for trial in trials])[:-1]
    values = np.split(memory(np.concatenate(trials)), ends)
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


@dataclass(kw_only=True)
class EvaluatedUnits:
    """Units that were evaluated, and how many failed."""

    stock: PartStock  # The parts
    response: Response  # What is to be small, first output, such as `tolalloc.reducers.response.kernel.KernelResponse`
    # Units evaluated, and those of them without an answer [-]
    evaluations: int = 0
    failures: int = 0
    _known: dict[bytes, float] = field(default_factory=dict)

    def __call__(self, mountings: Mountings) -> Float[np.ndarray, " unit"]:
        """Return the first output of every unit, infinite where it failed, so that nothing chooses it [arcsec]."""
        keys = [unit.tobytes() for unit in mountings]
        new = {key: at for at, key in enumerate(keys) if key not in self._known}
        if new:
            evaluation = self.response(self.stock.errors(mountings[list(new.values())]))
            values = np.where(evaluation.good, evaluation.values[:, 0], np.inf)
            self._known.update(zip(new, values.tolist(), strict=True))
            self.evaluations += len(new)
            self.failures += int(np.count_nonzero(~evaluation.good))
        return np.array([self._known[key] for key in keys])

    def require_few_failures(self, largest_failed_share: float) -> None:
        """Raise a `SolveError` if more than a share of the units has no answer."""
        if self.failures > largest_failed_share * self.evaluations:
            raise SolveError(
                f"Mounting: {self.failures} of {self.evaluations} units have no equilibrium that can be trusted; "
                f"allowed is a share of {largest_failed_share:g}."
            )


def best_mounting(
    stock: PartStock,
    response: Response,
    seeds: SeedTree,
    starts: int = 4,
    largest_failed_share: float = LARGEST_FAILED_SHARE,
) -> FoundMounting:
    """Return the mounting with the least mean peak-to-peak that was found; of equals, the one with the least largest.

    For one unit all mountings are tried; for several the first start takes the parts as they come, and the seeds are
    those of all others.
    """
    if starts < 1:
        raise InputError.at("mounting", "number of starts", starts, "1 or more")
    memory = EvaluatedUnits(stock=stock, response=response)
    first = stock.as_they_come
    before = memory(first)
    if stock.units == 1:
        every = units_from(stock, range(len(stock.parts)))
        best = every[[int(np.argmin(memory(every)))]]
        found: list[Trial] = [(best, memory(best))]
    else:
        others = (stock.random_mountings(seeds.generator(number)) for number in range(1, starts))
        found = [_improved(memory, mountings) for mountings in (first, *others)]
    mountings, after = min(found, key=lambda own: (float(own[1].mean()), float(own[1].max())))
    memory.require_few_failures(largest_failed_share)
    if not np.isfinite(after).all():
        raise SolveError("Mounting: a unit has no equilibrium that can be trusted in any mounting met.")
    return FoundMounting(
        stock=stock,
        mountings=mountings,
        before=before,
        after=after,
        evaluations=memory.evaluations,
        failures=memory.failures,
    )


def random_mounting(stock: PartStock, response: Response, count: int, seeds: SeedTree) -> RandomMountings:
    """Return what random mountings of the same parts do; for one unit, all mountings, each once."""
    if count < 1:
        raise InputError.at("random mounting", "number of mountings", count, "1 or more")
    one, generator = stock.units == 1, seeds.generator()
    if one:
        mountings = units_from(stock, range(len(stock.parts)))
    else:
        mountings = np.concatenate([stock.random_mountings(generator) for _ in range(count)])
    memory = EvaluatedUnits(stock=stock, response=response)
    values = memory(mountings)
    memory.require_few_failures(LARGEST_FAILED_SHARE)
    return RandomMountings(
        peak_to_peaks=values.reshape(-1, stock.units), failures=int(np.count_nonzero(np.isinf(values))), every=one
    )


def _improved(memory: EvaluatedUnits, mountings: Mountings) -> Trial:
    """Return a mounting that no step improves."""
    steps: list[Step] = [*(partial(assigned, at) for at in range(len(memory.stock.places))), turned, exchanged]
    peaks, gained = memory(mountings), True
    while gained:
        gained = False
        for step in steps:
            if step is exchanged and gained:  # the dearest step waits until nothing else helps
                break
            trial, values = step(memory, mountings, peaks)
            if values.mean() < peaks.mean() - _GAIN:
                mountings, peaks, gained = trial, values, True
    return mountings, peaks


@dataclass(frozen=True, kw_only=True)
class MountingRequest:
    """Which parts are to be mounted."""

    name: str  # Where the parts come from
    stock: PartStock  # The parts
    kernel: KernelResponse  # What is to be small
    starts: int  # Mountings from which several units are improved [-]
    seed: int  # Seed of every random number [-]


def mount(request: MountingRequest, record: RunRecord) -> MountingResult:
    """Return who goes where, how it is turned there, and what that is worth beside chance."""
    seeds = SeedTree(request.seed).child("mounting")
    kernel, stock = replace(request.kernel, observe=record.observe), request.stock
    with record.stage("search"):
        found = best_mounting(stock, kernel, seeds.child("search"), request.starts)
    with record.stage("chance"):
        chance = random_mounting(stock, kernel, max(found.evaluations // stock.units, 1), seeds.child("chance"))
    return MountingResult(torque=kernel.torque, found=found, chance=chance)

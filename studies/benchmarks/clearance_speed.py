"""How fast exact clearances are: against the same distances in NumPy, and against what the machine can do at all.

    python studies/benchmarks/clearance_speed.py

One run measures in turn, round after round, the distances per second of 40 pins at 360 phases of an RV-40E from the
teeth of random modifications, on all cores:

* (a) the package, `tolalloc.reducers.cycloid.clearance.exact_clearance`;
* (b) NumPy, Newton's method on all distances of a design at once, laid on the cores in the way that a trial finds
  fastest: threads, which share the memory (NumPy works without the interpreter's lock), or processes;
* (c) the machine's bound, below.

(a) starts next to the pin's own angle where the pin is so close to its path that no other place can be as near, and
scans a tooth and parts of its neighbours elsewhere, at the root above all. (b) knows that amounts of micrometres leave
the foot next to the pin's own angle and starts there always; it stops when no foot of a block moves by more than
1e-6 rad, after which the distance changes by 1e-19 m. It needs no scan, which is an advantage that it is given: the
answers are the same, and they are compared.

**The least flops of a distance.** However the foot is found, it is verified once: there (P − w)·w′ = 0, with P the pin
and w the path of the grinding pin's centre, and the same numbers give the distance. In the frame that turns with the
grinding pin, with a multiply-add as two flops, roots and divisions as one and signs as none:

* sine and cosine of the parameter t: 37. Reduction to a quarter turn 8, square 1, an odd polynomial of degree 13 takes
  13, an even one of degree 14 15, which is what 53 bits need;
* sine and cosine of t/zc, which is small: 21. No reduction, degrees 9 and 10;
* P turned: 6; less w: 5; w′: 3; the product: 3;
* the normal (K1·cos t − 1, −K1·sin t)/√s: 8; the distance along it: 4.

The bound is the rate of a large matrix product over their sum: finding the foot is free, and so is memory. Nothing
reaches it; beside it stands (d), what two pairs of sine and cosine alone would take at NumPy's own rate.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numba
import numpy as np
from jaxtyping import Float
from kernel_speed import SEED, figures, product_rate, progress, run_benchmark
from numpy_cores import CORES, timed

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.cycloid.clearance import exact_clearance
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile, require_sound
from tolalloc.reducers.reducer.design import CycloidStage, Modification
from tolalloc.reducers.reducer.files import load_reducer

PHASES = 360
PAIRS = 2
LEAST_FLOPS = {
    "sine_and_cosine_of_parameter": 37,
    "sine_and_cosine_of_small_angle": 21,
    "pin_from_path": 11,
    "perpendicular": 6,
    "normal": 8,
    "distance": 4,
}
ALLOWED_DIFFERENCE = 1e-12  # m
SETTLED = 1e-6  # rad; Newton's method squares it, and the distance depends on its square
BLOCKS = (1800, 3600, 14400)
TRIAL_DESIGNS = 64
SINES, SINE_TURNS = 8192, 300  # numbers that stay in the fastest memory, and how often they are gone through

Distances = Float[np.ndarray, "design pin"]


class Arrangement(NamedTuple):
    """How NumPy is laid on the cores."""

    workers: str
    count: int
    block: int


@dataclass(frozen=True)
class Task:
    """Pins and designs; a design is circle and radius of the grinding pin [m]."""

    stage: CycloidStage
    pin_angle: Float[np.ndarray, " pin"]
    designs: Float[np.ndarray, "design 2"]


def newton(stage: CycloidStage, design: Float[np.ndarray, " 2"], angle: Float[np.ndarray, " pin"], out: Any) -> None:
    """Fill the clearances of pins from one design's teeth, all at once, by Newton's method on their feet."""
    circle, pin = design
    e, teeth = stage.eccentricity, stage.disc_teeth
    turns, shortening = (teeth + 1) / teeth, e * (teeth + 1) / circle
    px, py, t = stage.pin_circle_radius - e * np.cos(angle), e * np.sin(angle), angle.copy()
    for _ in range(50):
        cosine, sine, small = np.cos(t), np.sin(t), (t - angle) / teeth
        cs, ss = np.cos(small), np.sin(small)
        u, v = px * cs - py * ss + e * cosine - circle, px * ss + py * cs - e * sine
        du, dv = (e * turns) * sine, (e * turns) * cosine - circle / teeth
        slope = u * (turns * dv + circle / teeth) - v * (turns * du) - du * du - dv * dv
        change = (u * du + v * dv) / slope
        t -= change
        if max(change.max(), -change.min()) < SETTLED:
            break
    else:
        raise ArithmeticError("Newton's method does not settle from the pins' own angles.")
    root = np.sqrt(1 + shortening**2 - 2 * shortening * cosine)
    out[:] = (u * (1 - shortening * cosine) + v * (shortening * sine)) / root + (pin - stage.pin_radius)


def share(task: Task, block: int, clearance: Distances, first: int, last: int) -> None:
    """Fill the rows of some designs, block by block of pins."""
    for row in range(first, last):
        for start in range(0, task.pin_angle.size, block):
            part = slice(start, start + block)
            newton(task.stage, task.designs[row], task.pin_angle[part], clearance[row, part])


_common: dict[str, Any] = {}  # of a process: its task and the memory that all of them fill


def _join(task: Task, name: str) -> None:
    memory = SharedMemory(name)
    shape = (len(task.designs), task.pin_angle.size)
    _common.update(task=task, memory=memory, clearance=np.ndarray(shape, buffer=memory.buf))


def _share_of_process(block: int, first: int, last: int) -> None:
    share(_common["task"], block, _common["clearance"], first, last)


@dataclass(frozen=True)
class Workers:
    """Threads and processes, ready to work on one task in one piece of memory."""

    task: Task
    clearance: Distances
    pools: dict[str, Executor]

    def fill(self, arrangement: Arrangement, designs: int) -> None:
        """Fill the clearances of the first designs."""
        ends = np.linspace(0, designs, min(4 * arrangement.count, designs) + 1).astype(int)
        if arrangement.workers == "processes":
            work: Callable[..., None] = partial(_share_of_process, arrangement.block)
        else:
            work = partial(share, self.task, arrangement.block, self.clearance)
        if arrangement.count == 1:
            work(0, designs)
            return
        list(self.pools[arrangement.workers].map(work, ends[:-1], ends[1:]))


@contextmanager
def workers(task: Task) -> Iterator[Workers]:
    """Give a thread and a process per core; the processes are at work once before anything is measured."""
    shape = (len(task.designs), task.pin_angle.size)
    memory = SharedMemory(create=True, size=8 * shape[0] * shape[1])
    spawn = get_context("spawn")  # the threads of numba and the BLAS do not outlive a fork
    try:
        with (
            ProcessPoolExecutor(CORES, spawn, _join, (task, memory.name)) as processes,
            ThreadPoolExecutor(CORES) as threads,
        ):
            clearance: Distances = np.ndarray(shape, buffer=memory.buf)
            own = Workers(task, clearance, {"processes": processes, "threads": threads})
            for kind in own.pools:
                own.fill(Arrangement(kind, CORES, BLOCKS[0]), min(4 * CORES, len(task.designs)))
            yield own
            del clearance, own
    finally:
        memory.close()
        memory.unlink()


def trial(own: Workers) -> dict[Arrangement, float]:
    """Return the distances per second of every arrangement, tried on a few designs [1/s]."""
    some, rates = min(TRIAL_DESIGNS, len(own.task.designs)), {}
    kinds = (("threads", 1), ("threads", CORES), ("processes", CORES))
    for arrangement in (Arrangement(*kind, block) for kind in kinds for block in BLOCKS):
        seconds = min(timed(partial(own.fill, arrangement, some))[0] for _ in range(3))
        rates[arrangement] = some * own.task.pin_angle.size / seconds
        progress(f"trial of NumPy, {arrangement}: {rates[arrangement]:.4g} distances/s")
    return rates


def _sines(numbers: Float[np.ndarray, " number"]) -> None:
    out = np.empty_like(numbers)
    for _ in range(SINE_TURNS):
        np.sin(numbers, out=out)
        np.cos(numbers, out=out)


def pair_rate(threads: Executor) -> float:
    """Return the best rate of NumPy's sines and cosines on all cores, in pairs [1/s]."""
    numbers = np.random.default_rng(SEED).uniform(-np.pi, np.pi, (CORES, SINES))
    seconds = min(timed(lambda: list(threads.map(_sines, numbers)))[0] for _ in range(4))
    return CORES * SINES * SINE_TURNS / seconds


def random_profiles(stage: CycloidStage, count: int) -> list[ToothProfile]:
    """Return teeth with 1–20 µm of clearance on the flank and at tip and root."""
    amounts = np.random.default_rng(SEED).uniform(1, 20, (count, 2)) * MICROMETRE
    profiles = [
        ToothProfile(stage=stage, modification=Modification.from_clearances(flank, radial, stage))
        for flank, radial in amounts.tolist()
    ]
    for profile in profiles:
        require_sound(profile, "random")
    return profiles


def measured_rounds(own: Workers, profiles: list[ToothProfile], rounds: int) -> dict[str, Any]:
    """Return seconds and rates by round, those of the trial, and the largest difference of the distances [m]."""
    tried = trial(own)
    best = max(tried, key=lambda arrangement: tried[arrangement])
    found: dict[str, list[float]] = {"compiled": [], "numpy": [], "pairs": [], "product": []}
    difference = 0.0
    for number in range(rounds):
        seconds, ours = timed(partial(exact_clearance, profiles, own.task.pin_angle))
        found["compiled"].append(seconds)
        own.clearance.fill(np.nan)
        seconds, _ = timed(partial(own.fill, best, len(profiles)))
        found["numpy"].append(seconds)
        found["pairs"].append(pair_rate(own.pools["threads"]))
        found["product"].append(product_rate())
        difference = float(np.maximum(difference, np.abs(ours - own.clearance).max()))  # NaN stays NaN
        here = ", ".join(f"{name} {values[-1]:.4g}" for name, values in found.items())
        progress(f"round {number + 1} of {rounds}: {here} (seconds, seconds, 1/s, 1/s)")
    return {"found": found, "tried": tried, "best": best, "difference": difference}


def answer(designs: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    stage = load_reducer("rv40e_xi2015").cycloid_stage
    pins, phases = stage.pin_count, np.arange(PHASES) / PHASES
    pin_angle = (2 * np.pi / pins * (np.arange(pins)[:, np.newaxis] + phases)).ravel() - np.pi
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    progress(f"{load:.1f} other processes at work; compiling ...")
    profiles = random_profiles(stage, designs)
    exact_clearance(profiles[:1], pin_angle[:1])
    ground = [(one.ground.pin_circle_radius, one.ground.pin_radius) for one in profiles]
    with workers(Task(stage, pin_angle, np.array(ground))) as own:
        measured = measured_rounds(own, profiles, rounds)
    seconds = {name: np.array(measured["found"][name]) for name in ("compiled", "numpy")}
    pairs, product = (np.array(measured["found"][name]) for name in ("pairs", "product"))
    distances = designs * pin_angle.size
    rates = {name: distances / own for name, own in seconds.items()}
    flops = sum(LEAST_FLOPS.values())
    rates |= {"bound": product / flops, "sines": pairs / PAIRS}
    return {
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__},
        "cores": CORES,
        "load_average_before": load,
        "pins": pins,
        "phases": PHASES,
        "designs": designs,
        "distances": distances,
        "rounds": rounds,
        "seconds": {name: figures(own) for name, own in seconds.items()},
        "distances_per_second": {name: figures(own) for name, own in rates.items()},
        "ratios": {
            "compiled_over_numpy": figures(rates["compiled"] / rates["numpy"]),
            "compiled_over_bound": figures(rates["compiled"] / rates["bound"]),
            "numpy_over_bound": figures(rates["numpy"] / rates["bound"]),
        },
        "sine_cosine_pairs_per_second": figures(pairs),
        "product_flops_per_second": figures(product),
        "least_flops_per_distance": {**LEAST_FLOPS, "total": flops},
        "numpy_arrangement": measured["best"]._asdict(),
        "numpy_trial": [{**way._asdict(), "distances_per_second": rate} for way, rate in measured["tried"].items()],
        "difference_metres": measured["difference"],
        "difference_allowed_metres": ALLOWED_DIFFERENCE,
        "agrees": measured["difference"] <= ALLOWED_DIFFERENCE,
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    versions = ", ".join(f"{name} {version}" for name, version in found["versions"].items())
    lines = [
        f"RV-40E, {found['pins']} pins, {PHASES} phases, {found['designs']} designs: {found['distances']:,} distances; "
        f"{found['rounds']} rounds, {CORES} cores, load before {found['load_average_before']:.1f}",
        versions,
        "",
        f"{'million distances/s':34}{'median':>12}{'least':>12}{'most':>12}{'seconds':>12}",
    ]
    rows = {
        "(a) package": "compiled",
        "(b) NumPy": "numpy",
        "(c) bound of the machine": "bound",
        "(d) NumPy's sines alone": "sines",
    }
    for title, name in rows.items():
        own = found["distances_per_second"][name]
        numbers = "".join(f"{own[which] / 1e6:12.2f}" for which in ("median", "least", "most"))
        lines.append(f"{title:34}{numbers}{found['distances'] / own['median']:12.3f}")
    lines += ["", f"{'ratio':34}{'median':>12}{'least':>12}{'most':>12}"]
    for title, name in {
        "(a)/(b)": "compiled_over_numpy",
        "(a)/(c)": "compiled_over_bound",
        "(b)/(c)": "numpy_over_bound",
    }.items():
        own = found["ratios"][name]
        lines.append(f"{title:34}" + "".join(f"{own[which]:12.4f}" for which in ("median", "least", "most")))
    product, flops = found["product_flops_per_second"]["median"] / 1e9, found["least_flops_per_distance"]["total"]
    difference, allowed = found["difference_metres"], found["difference_allowed_metres"]
    return "\n".join(
        [
            *lines,
            "",
            f"matrix product: {product:.0f} Gflop/s; least flops of a distance: {flops}",
            f"NumPy's best arrangement: {found['numpy_arrangement']}",
            f"largest difference of (a) and (b): {difference:.1e} m, allowed {allowed:.0e} m",
        ]
    )


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of exact clearances against NumPy and the machine's bound.",
            ("designs", 1000, "random modifications per measurement"),
            answer,
            table,
        )
    )

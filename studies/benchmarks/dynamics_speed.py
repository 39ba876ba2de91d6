"""How fast the model runs in time: against the same steps in NumPy.

    python studies/benchmarks/dynamics_speed.py

One run measures in turn, round after round and on one core, the seconds per unit of one output turn of an RV-20E at
1 rpm in 1,404 steps of the generalised-α method:

* (a) `tolalloc.wings.motion.stepping.simulate` of one unit, tables and all;
* (b) the tables alone, which all units of a batch share;
* (c) the steps alone: a batch of units less the tables, per unit;
* (d) the same steps in NumPy, all coordinates at once: Newton's method with a line search, its rows made beforehand.

(c) and (d) solve the same equations to the same accuracy, so (d)/(c) is the gain. (d) takes the first steps only.
"""

from __future__ import annotations

import os
import platform
import sys
from functools import partial
from typing import Any, NamedTuple

import numba
import numpy as np
from kernel_speed import SEED, figures, progress, run_benchmark
from numpy_cores import timed
from plain_rows import spring_groups
from scipy.optimize import brentq

from tests.random_cases import random_units
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.springs import Coordinates, Positions
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.running.chunks import one_blas_thread
from tolalloc.running.compiled import use_threads
from tolalloc.wings.motion.motion import (
    Damping,
    SpeedProfile,
    generalised_alpha,
    inertia_of,
    motion_of,
    nominal_acceleration,
)
from tolalloc.wings.motion.stepping import Steps, simulate

STEPS, FIRST_STEPS, TORQUE, TURN = 1404, 100, -10.0, 60.0
DELAY = 1e-5  # damping per stiffness, s
TARGET_SECONDS = 0.2
ALLOWED_DIFFERENCE = 1e-6  # arcsec


class Rows(NamedTuple):
    """Springs of one unit at one step: bilateral stiffness and load, and the pins' rows."""

    stiffness: np.ndarray
    load: np.ndarray
    pins: np.ndarray
    undisturbed: np.ndarray
    contact: np.ndarray


def rows_of(steps: Steps, errors: dict[str, float]) -> list[Rows]:
    """Return the springs at the first steps; few angles at a time, because the pins' rows are large."""
    found = []
    for angle in steps.motion.carrier_angle[: FIRST_STEPS + 1]:
        *others, pins = spring_groups(steps.reducer, np.array([angle]), steps.model.orders)
        stiffness, load = np.zeros((pins.displacement.shape[2],) * 2), np.zeros(pins.displacement.shape[2])
        for group in others:
            weighted = group.displacement[0].T * group.stiffness[0]
            stiffness += weighted @ group.displacement[0]
            load -= weighted @ (group.error[0] @ [errors[name] for name in group.columns])
        load[-1] += TORQUE
        undisturbed = pins.error[0] @ [errors.get(name, 0.0) for name in pins.columns]
        found.append(Rows(stiffness, load, pins.displacement[0], undisturbed, pins.stiffness[0]))
    return found


def equilibrium(stiffness: np.ndarray, load: np.ndarray, rows: Rows, x: np.ndarray) -> np.ndarray:
    """Return the minimum of the step's energy by Newton's method with a line search where contacts change."""

    def slope(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        force = rows.contact * np.maximum(rows.pins @ x + rows.undisturbed, 0.0)
        return stiffness @ x - load + rows.pins.T @ force, force

    gradient, force = slope(x)
    for _ in range(100):
        touching = force > 0.0
        own = rows.pins[touching]
        step = np.linalg.solve(stiffness + own.T @ (rows.contact[touching, np.newaxis] * own), -gradient)
        length = 1.0
        if step @ slope(x + step)[0] > 0.1 * abs(step @ gradient):
            length = brentq(lambda at, x=x, step=step: step @ slope(x + at * step)[0], 0.0, 1.0)
        x = x + length * step
        gradient, force = slope(x)
        if length == 1.0 and ((force > 0.0) == touching).all():
            return x
    raise ArithmeticError("no equilibrium")


def numpy_steps(steps: Steps, rows: list[Rows], accelerations: np.ndarray) -> np.ndarray:
    """Return the transmission error of one unit at the first steps."""
    mass, how, h = steps.inertia.diagonal(steps.coordinates), steps.integrator, steps.motion.step
    by_algorithmic, by_velocity, by_acceleration = how.rates(h)
    x = equilibrium(rows[0].stiffness, rows[0].load, rows[0], np.zeros(mass.size))
    velocity, algorithmic = np.zeros(mass.size), -accelerations[0]
    acceleration, rotation = algorithmic, [x[-1]]
    for own, nominal in zip(rows[1:], accelerations[1:], strict=True):
        predicted = x + h * velocity + h * h * (0.5 - how.beta) * algorithmic
        velocity = velocity + h * (1 - how.gamma) * algorithmic
        acceleration = (how.alpha_m * algorithmic - how.alpha_f * acceleration) / (1 - how.alpha_f)
        damping = DELAY * own.stiffness
        added = by_acceleration * np.diag(mass) + by_velocity * damping
        load = own.load + added @ predicted - mass * (acceleration + nominal) - damping @ velocity
        x = equilibrium(own.stiffness + added, load, own, x)
        change = x - predicted
        algorithmic = by_algorithmic * change
        velocity, acceleration = velocity + by_velocity * change, acceleration + by_acceleration * change
        rotation.append(x[-1])
    return np.array(rotation)


def answer(units: int, rounds: int) -> dict[str, Any]:
    """Return everything that the run measured."""
    model = EquivalentModel(load_reducer("rv20e_liu2020"))
    unit, reducer = load_unit("table4").errors(model.columns), model.reducer
    errors = random_units(unit, model.columns, np.random.default_rng(SEED), units)
    speed = SpeedProfile.constant(2 * np.pi / TURN * reducer.ratio)
    given = (
        motion_of(reducer, speed, SpeedProfile.constant(TORQUE), TURN, STEPS),
        inertia_of(reducer),
        Damping(stiffness_proportional=DELAY),
        generalised_alpha(0.8),
    )
    steps = Steps(**dict(zip(("motion", "inertia", "damping", "integrator"), given, strict=True)), model=model)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")  # what others take away
    progress(f"{load:.1f} other processes at work; compiling and making rows ...")
    use_threads(1)
    simulate(model, errors[:1], *given)
    rows = rows_of(steps, dict(zip(model.columns, errors[0].tolist(), strict=True)))
    accelerations = nominal_acceleration(Positions(reducer, given[0].carrier_angle), given[0])[: FIRST_STEPS + 1]
    seconds: dict[str, list[float]] = {"one": [], "tables": [], "steps": [], "numpy": []}
    with one_blas_thread():
        for number in range(rounds):
            one, ours = timed(partial(simulate, model, errors[:1], *given))
            tables, _ = timed(lambda: [None for _ in steps.parts()])
            batch, _ = timed(partial(simulate, model, errors, *given))
            plain, theirs = timed(partial(numpy_steps, steps, rows, accelerations))
            own = (one, tables, (batch - tables) / units, plain * STEPS / FIRST_STEPS)
            for name, value in zip(seconds, own, strict=True):
                seconds[name].append(value)
            here = ", ".join(f"{name} {values[-1]:.4g} s" for name, values in seconds.items())
            progress(f"round {number + 1} of {rounds}: {here}")
    difference = np.abs(ours.transmission_error[0, : FIRST_STEPS + 1] - theirs).max() / ARCSECOND
    found = {f"{name}_seconds": figures(np.array(values)) for name, values in seconds.items()}
    return {
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "numba": numba.__version__},
        "load_average_before": load,
        "units": units,
        "rounds": rounds,
        "steps": STEPS,
        "coordinates": Coordinates(reducer.crank_count, reducer.disc_count).count,
        **found,
        "numpy_over_steps": figures(np.array(seconds["numpy"]) / np.array(seconds["steps"])),
        "target_seconds": TARGET_SECONDS,
        "met": found["one_seconds"]["median"] <= TARGET_SECONDS,
        "difference_arcsec": float(difference),
        "agrees": bool(difference <= ALLOWED_DIFFERENCE),
    }


def table(found: dict[str, Any]) -> str:
    """Return the answer for people."""
    titles = {
        "(a) one unit, tables and steps, s": "one_seconds",
        "(b) tables, s": "tables_seconds",
        "(c) steps, s/unit": "steps_seconds",
        "(d) NumPy, s/unit": "numpy_seconds",
        "(d)/(c)": "numpy_over_steps",
    }
    lines = [
        f"RV-20E, one output turn in {found['steps']} steps, batches of {found['units']} units, "
        f"{found['rounds']} rounds, one core, load before {found['load_average_before']:.1f}",
        "",
        f"{'':36}{'median':>12}{'least':>12}{'most':>12}",
    ]
    for title, name in titles.items():
        own = found[name]
        lines.append(f"{title:36}" + "".join(f"{own[which]:12.4g}" for which in ("median", "least", "most")))
    verdict = "met" if found["met"] else "missed"
    lines += [
        "",
        f"(a) at most {found['target_seconds']} s: {verdict}",
        f"largest difference of (a) and (d): {found['difference_arcsec']:.1e}″, allowed {ALLOWED_DIFFERENCE:.0e}″",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(
        run_benchmark(
            "Speed of the model in time against the same steps in NumPy.",
            ("units", 64, "units of a batch"),
            answer,
            table,
        )
    )

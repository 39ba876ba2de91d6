"""Compile the kernel before many workers start, each of which would compile all of it: a part in each of two processes.

    python -m tests.compiled_first lanes
    python -m tests.compiled_first care

``lanes`` is what solves eight samples at a time, for two discs and for three; ``care`` is what solves one, what stands
on it (forces, extremes, derivatives, motion), and the lanes of a single disc.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np

from tolalloc.compiled import is_kept
from tolalloc.rv.dynamics.motion import SpeedProfile, motion_of
from tolalloc.rv.dynamics.properties import Damping, inertia_of, newmark
from tolalloc.rv.dynamics.simulation import simulate
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import forces
from tolalloc.rv.equivalent.solvers.records import AngleSearch
from tolalloc.rv.reducer.design import Clearances
from tolalloc.rv.reducer.files import load_reducer

FEW = AngleSearch(coarse=8)


def lanes(*counts: int) -> None:
    """Compile the solver of eight samples at a time, for numbers of discs."""
    reducer = load_reducer("rv20e_liu2020")
    for discs in counts:
        model = EquivalentModel(replace(reducer, disc_count=discs), FEW)
        model.equilibria(np.zeros((1, len(model.columns))), -1.0, np.zeros(1))


def care() -> None:
    """Compile what solves one sample at a time, and what stands on it."""
    # With play no sample goes in lanes.
    model = EquivalentModel(replace(load_reducer("rv20e_liu2020"), clearances=Clearances(gear_mesh=1e-9)), FEW)
    nothing = np.zeros((1, len(model.columns)))
    model.peak_to_peak_derivatives(nothing, -1.0)
    model.rotation_derivatives(nothing, -1.0, np.zeros(1))
    forces(model.equilibria(nothing, -1.0, np.zeros(1)))
    rest = motion_of(model.reducer, SpeedProfile.constant(0.0), SpeedProfile.constant(-1.0), 1e-3, 2)
    simulate(model, nothing, rest, inertia_of(model.reducer), Damping(), newmark(), None)


def compile_in_two_processes() -> None:
    """Compile both parts unless they are kept."""
    if not is_kept("turn"):
        parts = [subprocess.Popen([sys.executable, "-m", "tests.compiled_first", part]) for part in ("lanes", "care")]
        for part in parts:
            part.wait()


if __name__ == "__main__":
    if sys.argv[1] == "lanes":
        lanes(2, 3)
    else:
        care()
        lanes(1)

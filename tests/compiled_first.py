"""Compile the kernel before many workers start, each of which would compile all of it: a part in each of two processes.

python -m tests.compiled_first lanes
python -m tests.compiled_first care
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.reducer.design import Clearances
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.running.compiled import is_kept
from tolalloc.wings.motion.motion import Damping, SpeedProfile, inertia_of, motion_of, newmark
from tolalloc.wings.motion.stepping import simulate

FEW = AngleSearch(coarse=8)


def model_of(discs: int = 2, play: float = 0.0) -> EquivalentModel:
    """Return a model of few angles; with play no sample goes in lanes."""
    reducer = replace(load_reducer("rv20e_liu2020"), disc_count=discs, clearances=Clearances(gear_mesh=play))
    return EquivalentModel(reducer, FEW)


def lanes() -> None:
    """Compile what solves eight samples at a time, for every number of discs, and motion."""
    for discs in (2, 3, 1):
        model = model_of(discs)
        model.equilibria(np.zeros((1, len(model.columns))), -1.0, np.zeros(1))
    model = model_of()
    rest = motion_of(model.reducer, SpeedProfile.constant(0.0), SpeedProfile.constant(-1.0), 1e-3, 2)
    nothing = np.zeros((1, len(model.columns)))
    simulate(model, nothing, rest, inertia_of(model.reducer), Damping(), newmark(), None)


def care() -> None:
    """Compile what solves one sample at a time, and what stands on it: extremes, derivatives and forces."""
    model = model_of(play=1e-9)
    nothing = np.zeros((1, len(model.columns)))
    model.peak_to_peak_derivatives(nothing, -1.0)
    model.rotation_derivatives(nothing, -1.0, np.zeros(1))
    forces(model.equilibria(nothing, -1.0, np.zeros(1)))


def compile_in_two_processes() -> None:
    """Compile both parts unless they are kept."""
    if not is_kept("turn"):
        parts = [subprocess.Popen([sys.executable, "-m", "tests.compiled_first", part]) for part in ("lanes", "care")]
        for part in parts:
            part.wait()


if __name__ == "__main__":
    {"lanes": lanes, "care": care}[sys.argv[1]]()

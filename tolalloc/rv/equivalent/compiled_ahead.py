"""The search of extremes, compiled by a second process while the first one compiles the turn: they share little.

python -m tolalloc.rv.equivalent.compiled_ahead 2
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from tolalloc.compiled import compile_elsewhere, is_kept
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.solvers.records import AngleSearch
from tolalloc.rv.reducer.design import Clearances
from tolalloc.rv.reducer.files import load_reducer

_FILES = ("extremes", "interpolation", "refinement", "searches")


def compile_ahead(discs: int) -> None:
    """Let a second process compile the search for a number of discs, unless it is kept."""
    if not is_kept("refinement"):
        modules = {f"tolalloc.rv.equivalent.solvers.{name}" for name in _FILES}
        compile_elsewhere(modules, "tolalloc.rv.equivalent.compiled_ahead", str(discs))


def _search(discs: int) -> None:
    play = Clearances(gear_mesh=1e-9)  # with it no sample goes in lanes, which the first process compiles
    model = EquivalentModel(replace(load_reducer("rv20e"), disc_count=discs, clearances=play), AngleSearch(coarse=8))
    model.extremes(np.zeros((1, len(model.columns))), -1.0)


if __name__ == "__main__":
    _search(int(sys.argv[1]))

"""The search of extremes, compiled by a second process while the first one compiles the turn: they share little.

python -m tolalloc.reducers.equivalent.compiled_ahead 2
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.running.compiled import compile_elsewhere, is_kept

_FILES = ("extremes", "workspace")


def compile_ahead(discs: int) -> None:
    """Let a second process compile the search for a number of discs, unless it is kept."""
    if not is_kept("extremes"):
        modules = {f"tolalloc.reducers.equivalent.solvers.{name}" for name in _FILES}
        compile_elsewhere(modules, "tolalloc.reducers.equivalent.compiled_ahead", str(discs))


def _search(discs: int) -> None:
    """Search a turn that nobody has solved: solving it is what the first process compiles."""
    from tolalloc.reducers.equivalent.solvers.extremes import make_extremes, refine
    from tolalloc.reducers.equivalent.solvers.turn import make_turn

    model = EquivalentModel(replace(load_reducer("rv20e"), disc_count=discs), AngleSearch(coarse=8))
    columns, angles = model.error_columns, model.search.coarse + 2
    turn, found = make_turn(1, angles, 3 * discs), make_extremes(1, 0)
    for own in (*turn, *found):
        own[:] = 0  # converged
    tables, errors = model.tables_at(model.search.node_angle), np.zeros((1, len(model.columns)))
    given = (columns.layout, columns.map, model.design, errors, -1.0)
    refine((0,) * discs, tables, given, model.search, turn, found)


if __name__ == "__main__":
    _search(int(sys.argv[1]))

"""The search of extremes, compiled by a second process while the first one compiles the turn: they share little.

python -m tolalloc.reducers.equivalent.compiled_ahead 2
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, AngleSearch, SolvedExtremes, SolvedTurn
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
    from tolalloc.reducers.equivalent.solvers.extremes import refine

    model = EquivalentModel(replace(load_reducer("rv20e"), disc_count=discs), AngleSearch(coarse=8))
    columns, angles = model.error_columns, model.search.coarse + 2
    turn = SolvedTurn(
        np.zeros((1, angles)),
        np.zeros((1, angles, 3 * discs)),
        np.full((1, angles), CONVERGED, np.uint8),
        np.zeros((1, angles)),
        np.zeros((1, angles), np.uint16),
    )
    extreme, position, left_over, residual = np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1), np.zeros(1)
    solves, status, curve = np.zeros(1, np.int64), np.zeros(1, np.uint8), np.zeros((1, 0))
    found = SolvedExtremes(extreme, position, left_over, solves, status, residual, curve)
    tables, errors = model.tables_at(model.search.node_angle), np.zeros((1, len(model.columns)))
    given = (columns.layout, columns.map, model.design, errors, -1.0)
    refine((0,) * discs, tables, given, model.search, turn, found)


if __name__ == "__main__":
    _search(int(sys.argv[1]))

"""Forces in every interface at given equilibria."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from tolalloc.compiled import jit, parallel_jit, prange
from tolalloc.rv.cycloid.solvers.contact_law import pin_force
from tolalloc.rv.equivalent.solvers.contact_solver import CONVERGED
from tolalloc.rv.equivalent.solvers.energy import compress, play_force
from tolalloc.rv.equivalent.solvers.interpolation import make_memory
from tolalloc.rv.equivalent.solvers.problem import problem_at_node, values_of


class Forced(NamedTuple):
    """Forces, filled in by `solve_forces`, as in `tolalloc.rv.equivalent.forces.Forces` [N]."""

    pins: Float[np.ndarray, "sample angle disc pin"]
    rows: Float[np.ndarray, "sample angle row"]
    elements: Float[np.ndarray, "sample angle element 2"]


@jit
def _of_sample(s, tables, layout, mapped, design, errors, torque, turn_status, turn_kept, out):
    status, kept = turn_status[s], turn_kept[s]
    pins, rows, elements = out.pins[s], out.rows[s], out.elements[s]
    own = np.empty((1, layout.end))
    values_of(errors[s : s + 1], torque, layout, mapped, own)
    values = own[0]
    memory = make_memory(design.law, tables)
    problem_memory, work = memory[0], memory[1]
    discs, count = pins.shape[1:]
    for at in range(status.size):
        if status[at] != CONVERGED:
            pins[at], rows[at], elements[at] = np.nan, np.nan, np.nan
            continue
        _, problem = problem_at_node(at, tables, layout, design.face_width, values, problem_memory)
        compress(problem, kept[at], work.compression, work.play)
        for d in range(discs):
            for k in range(count):
                c = d * count + k
                pins[at, d, k], _ = pin_force(
                    problem.law, problem.contact[c], problem.log_length[c], problem.half_tilt[c], work.compression[c]
                )
        for e in range(elements.shape[1]):
            elements[at, e, 0], elements[at, e, 1], _, _, _ = play_force(
                problem.play_stiffness[e], problem.clearance[e], work.play[e, 0], work.play[e, 1]
            )
        for row in range(rows.shape[1]):
            compression = 0.0
            for i in range(kept.shape[1]):
                compression += tables.row_by_kept[at, row, i] * kept[at, i]
            for m in range(layout.torque + 1):
                compression += tables.row_by_load[at, row, m] * values[m]
            rows[at, row] = tables.row_stiffness[at, row] * compression


@parallel_jit
def solve_forces(tables, layout, mapped, design, errors, torque, status, kept, out):
    """Fill the forces of all samples at all nodes of the tables."""
    for s in prange(errors.shape[0]):
        _of_sample(np.int64(s), tables, layout, mapped, design, errors, torque, status, kept, out)

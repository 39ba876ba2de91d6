"""All samples over a turn: batches of samples in parallel, each from its own last angle's equilibrium; their forces.

Samples go side by side in registers; whatever needs more care, and every tilted disc, goes one by one. Which way
a sample goes depends on itself alone, so its bits do not depend on the batch that it is in.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.reducers.equivalent.solvers.batch import (
    BATCH,
    FOUR,
    ROW,
    make_batch,
    make_history,
    present,
    solve_batch_at,
    start_next,
)
from tolalloc.reducers.equivalent.solvers.contact_solver import (
    compress,
    contact_force,
    play_force,
    problem_at_node,
    solve_at_node,
    values_of,
)
from tolalloc.reducers.equivalent.solvers.play import make_play
from tolalloc.reducers.equivalent.solvers.records import CONVERGED, NOT_FINITE, Given, SolvedTurn
from tolalloc.reducers.equivalent.solvers.workspace import make_memory
from tolalloc.running.compiled import in_threads, jit, jit_in_place, thread_count

_AT_ONCE = 8  # samples whose forces a thread takes together


def make_turn(samples: Any, angles: Any, retained: Any) -> SolvedTurn:
    """Return an empty turn."""
    return SolvedTurn(
        np.empty((samples, angles)),
        np.empty((samples, angles, retained)),
        np.empty((samples, angles), np.uint8),
        np.empty((samples, angles)),
        np.empty((samples, angles), np.uint16),
    )


@jit
def _give_up(turn, s):
    turn.rotation[s], turn.residual[s], turn.status[s], turn.touching[s] = np.nan, np.inf, NOT_FINITE, 0
    turn.retained[s] = np.nan


@jit
def _alone(s, angle, at, tables, layout, design, values, start, memory, turn):
    """Solve one sample at one node from the start, which becomes the next one: the equilibrium, or zero without one."""
    rotation, status, ratio, touching = solve_at_node(
        at, tables, layout, design.face_width, values[s], start, memory[0], memory[1]
    )
    turn.rotation[s, angle], turn.status[s, angle] = rotation, status
    turn.residual[s, angle], turn.touching[s, angle] = ratio, touching
    turn.retained[s, angle] = start
    if status != CONVERGED:
        start[:] = 0.0


def batch_size(samples: int) -> int:
    """Return how many samples go into a batch: whole fours of registers up to `BATCH`.

    Own derivation: 32·⌈n/(32·threads)⌉, 256 at most.

    Examples
    --------
    >>> batch_size(1) == FOUR, batch_size(10**6) == BATCH
    (True, True)
    """
    share = FOUR * thread_count()
    return int(min(FOUR * max((samples + share - 1) // share, 1), BATCH))


@jit
def _fill_batch(layout, values, finite, used, batch, tilted):
    """Set the values of a batch, its last sample filling the room that is left; set which samples have tilted discs."""
    for s in range(used):
        own = min(s, values.shape[0] - 1)
        for m in range(layout.end):
            batch.values[m, s] = values[own, m] if finite[own] else 0.0
        tilted[s] = np.any(batch.values[layout.tilt :, s] != 0.0)


@jit_in_place
def _take_over(samples, angle, batch, turn):
    """Put a batch's equilibria at an angle into the turn."""
    for s in range(samples):
        turn.rotation[s, angle], turn.status[s, angle] = batch.rotation[s], CONVERGED
        turn.residual[s, angle], turn.touching[s, angle] = batch.ratio[s], batch.touching[s]
        for i in range(batch.q.shape[0]):
            turn.retained[s, angle, i] = batch.q[i, s]


@jit
def _side_by_side(
    discs, elements, first, stride, turn_of_crank, tables, layout, mapped, design, errors, torque, turn
):  # fmt: skip
    """Solve up to a batch of samples at every ``stride``-th node, side by side; no ``elements`` without play."""
    values = np.empty((errors.shape[0], layout.end))
    finite, memory = values_of(errors, torque, layout, mapped, values), make_memory(design.law, tables)
    samples, size, contacts = values.shape[0], turn.retained.shape[2], tables.contact_stiffness.shape[1]
    used = (samples + FOUR - 1) // FOUR * FOUR
    batch, careful, tilted = (
        make_batch(layout, size, contacts, ROW),
        np.empty(BATCH, np.bool_),
        np.zeros(BATCH, np.bool_),
    )
    play = None if elements is None else make_play(size, elements, ROW)
    _fill_batch(layout, values, finite, used, batch, tilted)
    loads = layout.torque + 1
    rows = present(batch.values, 0, loads, loads)
    waves = present(batch.values, layout.wave, layout.tooth, layout.waves)
    teeth_deviate = np.any(batch.values[layout.tooth : layout.tilt] != 0.0)
    flanks_turned = np.any(batch.values[layout.flank] != 0.0)
    start, history = np.empty(size), make_history(turn_of_crank, size)
    for angle in range(turn.rotation.shape[1]):
        at = first + angle * stride
        given = (tables, layout, rows, waves, teeth_deviate, flanks_turned)
        solve_batch_at(design.law, discs, at, *given, samples, batch, play, careful)
        _take_over(samples, angle, batch, turn)
        for s in range(samples):
            if finite[s] and (careful[s] or tilted[s]):
                start[:] = history[(angle - 1) % history.shape[0], :, s]
                _alone(s, angle, at, tables, layout, design, values, start, memory, turn)
                batch.q[:, s] = start
        start_next(angle, turn_of_crank, used, batch.q, history)
    for s in range(samples):
        if not finite[s]:
            _give_up(turn, s)


def part_of(given: Given, part: slice) -> Given:
    """Return the same of some samples."""
    return *given[:3], given[3][part], given[4]


def solve_batch(discs: Any, first: Any, stride: Any, turn_of_crank: Any, tables: Any, given: Given, turn: Any) -> None:
    """Solve up to a batch of samples at every ``stride``-th node of the tables, from node ``first`` on.

    A crank turns once in ``turn_of_crank`` of these nodes; 0 where that is no whole number, or they are not equally far
    apart.
    """
    elements = tables.play_stiffness.shape[1] or None
    _side_by_side(discs, elements, first, stride, turn_of_crank, tables, *given, turn)


def solve_curves(discs: Any, turn_of_crank: Any, tables: Any, given: Given, turn: Any) -> None:
    """Fill the equilibria of every sample at every node of the tables, of which a crank's turn has so many.

    ``discs`` has one entry per disc: its length is part of its type, so loops over coordinates become straight code.
    """

    def solve(part: slice) -> None:
        own = SolvedTurn(*(values[part] for values in turn))
        solve_batch(discs, 0, 1, turn_of_crank, tables, part_of(given, part), own)

    in_threads(solve, len(given[3]), batch_size(len(given[3])))


@jit
def _forces(first, last, tables, layout, mapped, design, errors, torque, status, retained, pins, rows, elements):
    memory, own = make_memory(design.law, tables), np.empty((1, layout.end))
    for s in range(first, last):
        values_of(errors[s : s + 1], torque, layout, mapped, own)
        given = (tables, layout, design, own[0], memory[0], memory[1])
        _forces_of_sample(*given, status[s], retained[s], pins[s], rows[s], elements[s])


@jit
def _forces_of_sample(
    tables, layout, design, values, problem_memory, work, status, retained, pins, rows, elements
):  # fmt: skip
    discs, count = pins.shape[1:]
    for at in range(status.size):
        if status[at] != CONVERGED:
            pins[at], rows[at], elements[at] = np.nan, np.nan, np.nan
            continue
        _, problem = problem_at_node(at, tables, layout, design.face_width, values, problem_memory)
        compress(problem, retained[at], work.compression, work.play)
        for d in range(discs):
            for k in range(count):
                c = d * count + k
                pins[at, d, k], _ = contact_force(problem, c, work.compression[c])
        for e in range(elements.shape[1]):
            elements[at, e, 0], elements[at, e, 1], _, _, _ = play_force(
                problem.play_stiffness[e], problem.clearance[e], work.play[e, 0], work.play[e, 1]
            )
        for row in range(rows.shape[1]):
            compression = 0.0
            for i in range(retained.shape[1]):
                compression += tables.row_by_retained[at, row, i] * retained[at, i]
            for m in range(layout.torque + 1):
                compression += tables.row_by_load[at, row, m] * values[m]
            rows[at, row] = tables.row_stiffness[at, row] * compression


def solve_forces(tables: Any, given: Given, status: Any, retained: Any, pins: Any, rows: Any, elements: Any) -> None:
    """Fill the `Forces` of all samples at all nodes of the tables."""

    def fill(part: slice) -> None:
        _forces(part.start, part.stop, tables, *given, status, retained, pins, rows, elements)

    in_threads(fill, len(given[3]), _AT_ONCE)

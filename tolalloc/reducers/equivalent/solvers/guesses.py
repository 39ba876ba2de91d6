"""Where the discs of a tile will stand at the next angle, from where they stood at those before it.

After a turn of its crank a disc meets the pins again, each a tooth further, and only the errors of single pins and
teeth make the difference. So an equilibrium is that of a crank's turn before, and has changed by nearly what it had
changed by in the turn before that. A straight line through the last two angles is five times as far off: there are 24
angles to a crank's turn, and at each of them a pin begins or ceases to touch.
"""

from __future__ import annotations

from tolalloc.reducers.equivalent.solvers.lanes import WIDTH, aligned, fma, load, multiply, spread, store
from tolalloc.reducers.equivalent.solvers.tile import ROW
from tolalloc.running.compiled import jit, jit_in_place

_LAST, _AHEAD, _HERE, _BEHIND = 0.3, 0.5, 0.35, -0.15
"""Weights, 1 together, of what changed within a turn of the crank, near the best for random units of four reducers.

At the last angle; a turn before the angle after the next one, the next one, and the last.
"""


@jit
def make_history(turn, size):
    """Return room for the equilibria at two turns of a crank, so many angles each, or at two angles if it is 0."""
    return aligned((2 * turn + 2) * size, ROW).reshape(2 * turn + 2, size, ROW)


@jit_in_place
def guess_next(angle, turn, used, q, history):
    """Keep the equilibria at an angle, counted from 0, and put the guesses for the next one in their place.

    A crank turns once in ``turn`` angles; 0 where that is no whole number.
    """
    size, kept = q.shape[0], history.shape[0]
    for i in range(size):
        for v in range(0, used, WIDTH):
            store(history, (angle % kept * size + i) * ROW + v, load(q, i * ROW + v))
    if turn == 0 or angle < 2 * turn:
        _add(2.0, -1.0, max(angle - 1, 0) % kept, used, q, history)
        return
    following = angle + 1
    _add(_LAST, _AHEAD, (following - turn + 1) % kept, used, q, history)
    for weight, back in (
        (1.0 + _HERE, turn),
        (_BEHIND - _LAST, turn + 1),
        (-_AHEAD, 2 * turn - 1),
        (-_HERE, 2 * turn),
        (-_BEHIND, 2 * turn + 1),
    ):
        _add(1.0, weight, (following - back) % kept, used, q, history)


@jit_in_place
def _add(own, weight, kept, used, q, history):
    """Put so many times the coordinates, and so many times those kept in a place of the history, in their place."""
    for i in range(q.shape[0]):
        for v in range(0, used, WIDTH):
            place = i * ROW + v
            own_part = multiply(spread(own), load(q, place))
            store(q, place, fma(spread(weight), load(history, kept * q.shape[0] * ROW + place), own_part))

"""Where the searches look, solved side by side, a search to a lane.

Searches go through the turn side by side, so that what the lanes read of the tables is still in the cache.
"""

from __future__ import annotations

from tolalloc.reducers.equivalent.solvers.interpolation import solve_anywhere
from tolalloc.reducers.equivalent.solvers.lane_solver import ALL, most_steps, settle
from tolalloc.reducers.equivalent.solvers.lanes import WIDTH
from tolalloc.reducers.equivalent.solvers.lending import lend, look_at_all_taken, moved_too_far
from tolalloc.reducers.equivalent.solvers.records import CONVERGED
from tolalloc.reducers.equivalent.solvers.searches import begin, look_closer, take
from tolalloc.running.compiled import jit_in_place


@jit_in_place
def _lend_all(alone, law, tables, layout, values, peaks, own, lent):
    """Put the problems where the lanes look into them; return one bit per lane that is solved so, or alone."""
    together, apart = 0, 0
    for lane in range(WIDTH):
        if own.peak[lane] < 0:
            continue
        sample, half = peaks.sample[own.peak[lane]], own.half[lane]
        guess, side = own.new_q[lane, half], own.q[lane, 2 * half]
        own.looks_at[lane] = own.at[lane] + (2 * half - 1) * own.step[lane]
        for i in range(guess.size):
            guess[i] = 0.5 * (own.q[lane, 1, i] + side[i])
        if alone[sample]:
            apart |= 1 << lane
            continue
        together |= 1 << lane
        for i in range(lent.tile.q.shape[0]):
            lent.tile.q[i, lane] = guess[i]
        lend(lane, own.looks_at[lane], guess, side, law, tables, layout, values[sample], lent)
    look_at_all_taken(lent)
    return together, apart


@jit_in_place
def search_peaks(discs, alone, tables, layout, design, values, search, turn, best, peaks, own, memory, lent, found):
    """Search around all peaks, the lanes taking one after another.

    Samples that are to be ``alone``, and lanes that do not settle, go to the solver for one sample.
    """
    waiting, tile, face_width = 0, lent.tile, design.face_width
    while True:
        for lane in range(WIDTH):
            while own.peak[lane] < 0 and waiting < peaks.coarse.size:
                begin(lane, waiting, search, turn, peaks, own)
                lent.node[lane, :] = -1
                look_closer(lane, search, best, peaks, own)
                waiting += 1
        together, careful = _lend_all(alone, design.law, tables, layout, values, peaks, own, lent)
        if not together | careful:
            return
        if together:
            left, _ = settle(design.law, discs, lent.tables, 0, tile, ALL ^ together, most_steps(design.law))
            careful |= left
        for lane in range(WIDTH):
            q = own.new_q[lane, own.half[lane]]
            if (together >> lane) & 1 and moved_too_far(lane, q, lent):
                careful |= 1 << lane
            if (careful >> lane) & 1:
                sample, position = peaks.sample[own.peak[lane]], own.looks_at[lane]
                memory[2].first[0], memory[2].first[1] = -1, -1
                rotation, status, ratio, _ = solve_anywhere(
                    position, tables, layout, face_width, values[sample], q, memory
                )
                take(lane, rotation, status, ratio, search, best, peaks, own, found)
            elif (together >> lane) & 1:
                rotation = lent.base[lane]
                for i in range(tile.q.shape[0]):
                    q[i] = tile.q[i, lane]
                    rotation += lent.by_coordinate[i, lane] * q[i]
                take(lane, rotation, CONVERGED, tile.ratio[lane], search, best, peaks, own, found)

"""Features that are alike: who of them takes which process makes no difference."""

from __future__ import annotations

import pickle
from collections import defaultdict

import numpy as np
from jaxtyping import Bool

from tolalloc.allocation.program.problem import AllocationProblem


class AlikeFeatures:
    """Groups of features with the same processes, loss and place in every stack.

    Parameters
    ----------
    problem
        The allocation.

    Notes
    -----
    Costs are alike if all their parameters are, bit by bit.
    """

    def __init__(self, problem: AllocationProblem) -> None:
        groups: dict[bytes, list[slice]] = defaultdict(list)
        start = 0
        for at, feature in enumerate(problem.features):
            made = [(own.cost, own.minimum, own.maximum, own.change) for own in feature.processes]
            loads = [(float(stack.worst_case[at]), float(stack.root_sum_square[at])) for stack in problem.stacks]
            groups[pickle.dumps((made, loads, feature.loss))].append(slice(start, start + len(made)))
            start += len(made)
        self._groups = [group for group in groups.values() if len(group) > 1]

    def ordered(self, allowed: Bool[np.ndarray, " process"]) -> Bool[np.ndarray, " process"]:
        """Return the allowed processes less those that no choice in ascending order within the groups contains.

        Parameters
        ----------
        allowed
            Whether each of all processes of all features may be taken.
        """
        left = allowed.copy()
        for group in self._groups:
            first = 0
            for own in group:
                left[own][:first] = False
                first = int(np.argmax(left[own]))
            last = left[group[-1]].size
            for own in reversed(group):
                left[own][last:] = False
                last = left[own].size - int(np.argmax(left[own][::-1]))
        return left

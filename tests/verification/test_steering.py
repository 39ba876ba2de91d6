"""One step of a search: it goes on where a convex program is not solved."""

from __future__ import annotations

import numpy as np
import pytest

from tests.builders import verifier_of_sum
from tolalloc.allocation.search.steering import Programs, steering
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.exceptions import SolveError


@pytest.mark.parametrize("failing", [1, 4])
def test_a_step_whose_programs_are_not_all_solved_ends_with_the_best_of_the_others(monkeypatch, failing):
    verifier = verifier_of_sum(6.0, 8.0, limit=5.0, guarantee=AtYield(0.99))
    start = verifier.verify(verifier.space.uniform(0.8), "start")
    programs, goal = Programs(verifier.space), steering(start, [start])
    processes = verifier.space.process_positions(start.design)
    best = verifier.space.cost(programs.step(goal, processes, start.design, 2.0))
    solved, asked = Programs.cheapest, []

    def at_times(self, *given):
        asked.append(given)
        if len(asked) <= failing:
            raise SolveError("The solver failed.")
        return solved(self, *given)

    monkeypatch.setattr(Programs, "cheapest", at_times)
    found = programs.step(goal, processes, start.design, 2.0)
    assert verifier.space.cost(found) == pytest.approx(best, rel=2e-3)


def test_a_step_of_which_no_program_is_solved_stays_where_it_is(monkeypatch):
    verifier = verifier_of_sum(6.0, 8.0, limit=5.0, guarantee=AtYield(0.99))
    start = verifier.verify(verifier.space.uniform(0.5), "start")

    def never(self, *given):
        raise SolveError("The solver failed.")

    monkeypatch.setattr(Programs, "cheapest", never)
    programs, processes = Programs(verifier.space), verifier.space.process_positions(start.design)
    found = programs.step(steering(start, [start]), processes, start.design, 2.0)
    assert np.array_equal(found, start.design)

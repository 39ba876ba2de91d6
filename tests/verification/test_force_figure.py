"""The forces over a turn that a report draws are those that the answer names."""

from __future__ import annotations

import pytest

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import Solved, outputs_of
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.tellers.transmission_error import force_figure


def test_the_highest_points_of_the_force_figure_are_the_largest_forces():
    reducer, unit = load_reducer("rv20e_liu2020"), load_unit("table4")
    model = EquivalentModel(reducer, orders=unit.orders)
    found = model.equilibria(unit.errors(model.columns, reducer.modification.deviations), -1.0)
    drawn = {series.label: max(series.y) for series in force_figure(found).series}
    solved = Solved.of(found)
    for name, highest in drawn.items():
        _, largest = outputs_of(reducer)[f"largest {name} force"]
        assert highest == pytest.approx(float(largest(solved)[0]))

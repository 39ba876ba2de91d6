"""An output that no deviation moves: of zones that cost less the wider they are the widest are the plain answer."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import tolalloc as ta
from tests.golden.cases import small_effort

GAP, OTHER = "gap [mm]", "other [mm]"
ROW = {"unit": "mm", "min": 0.01, "max": 0.4, "cost": 1, "nominal": 1.0, "plus": 0.05, "minus": -0.05}
SHOWN = ta.AtYield(0.95)
WIDEST = 2 * 0.1 / 0.4  # two zones that cost 1 at 0.1 mm, in proportion to 1/zone


def allocated(function, limits, outputs=(GAP,), **changed):
    """Return the allocation of two sizes, any warning an error."""
    own = ta.Study(
        ta.model(function, inputs=("a", "b"), outputs=outputs),
        ta.Drawing.of_rows([{"id": "a", **ROW}, {"id": "b", **ROW}]),
        limits=limits,
        questions=[ta.Allocation(front=False, what_if=False)],
        name="constant",
        effort=small_effort(),
        **changed,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return own.allocate()


@pytest.mark.parametrize(
    ("function", "limit"),
    [
        (lambda a, b: 5.0 + 0 * a, ta.Limit(upper=6.0, show=SHOWN)),
        (lambda a, b: 0 * a, ta.Limit(upper=1.0, show=SHOWN)),
        (lambda a, b: 5.0 + 0 * a, ta.Limit(lower=4.0, upper=6.0, show=SHOWN)),
        (lambda a, b: 5.0 + 0 * a, ta.Limit(lower=4.0, show=SHOWN)),
        (lambda a, b: 0.1 + 0 * a, ta.Limit(upper=6.0, show=ta.AtCpk(1.33))),
        (lambda a, b: 5.0 + 0 * a, ta.Limit(upper=6.0, show=ta.WorstCase())),
        (lambda a, b: 5.0 + 0 * a, ta.Limit(upper=6.0, show=ta.RootSumSquare())),
        (lambda a, b: np.round(5.0 + 0.01 * a), ta.Limit(upper=6.0, show=SHOWN)),
        (lambda a, b: 5.0, ta.Limit(upper=5.0, show=SHOWN)),
    ],
    ids=["above", "zero", "two sides", "below", "Cpk", "worst case", "root sum square", "rounded", "at its limit"],
)
def test_the_widest_zones_are_the_answer(function, limit):
    answer = allocated(function, {GAP: limit})
    found = answer.result
    assert found.met
    assert found.cost == pytest.approx(WIDEST, rel=1e-3)
    assert found.chosen.scales == pytest.approx([4.0, 4.0], rel=1e-3)
    assert found.shares is None
    assert found.free.proportional.cost >= WIDEST * (1 - 1e-9), "one factor of all zones keeps their ranges too"


def test_a_limit_that_a_constant_misses_is_missed_by_every_drawing():
    found = allocated(lambda a, b: 5.0 + 0 * a, {GAP: ta.Limit(upper=4.0, show=SHOWN)})
    assert not found.result.met
    assert found.sentences[0].startswith("NOT met: 0.00 %")
    assert found.result.chosen.blocking.tightest.excess == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("outputs", [(GAP, OTHER), (OTHER, GAP)])
def test_a_constant_beside_another_output_moves_nothing(outputs):
    """What a + b ≤ 2.05 costs, it costs alone."""
    limits = {GAP: ta.Limit(upper=6.0, show=SHOWN), OTHER: ta.Limit(upper=2.05, show=SHOWN)}
    values = {GAP: lambda a, b: 5.0 + 0 * a, OTHER: lambda a, b: a + b}
    made = allocated(
        lambda a, b: tuple(values[name](a, b) for name in outputs), {name: limits[name] for name in outputs}, outputs
    )
    alone = allocated(values[OTHER], {OTHER: limits[OTHER]}, (OTHER,))
    assert made.result.cost == pytest.approx(alone.result.cost, rel=0.05)

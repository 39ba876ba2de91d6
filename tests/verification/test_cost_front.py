"""Cost over the limit of the leading output: verified, never rising, and the drawing on it only where it was shown."""

import numpy as np
import pytest

import tolalloc as ta

GAP, SUM = "gap [mm]", "sum [mm]"
EFFORT = ta.Effort(
    allocation=ta.AllocationEffort(
        verification_units=2048,
        confirmation_units=4096,
        front_limits=(1.1, 0.9, 1.0, 0.9),
        front_units=2048,
        front_steps=2,
        share_blocks=8,
    ),
    is_quick=True,
)


def front_of(widest_sum):
    row = {"nominal": 0.0, "plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.01, "max": 0.2}
    study = ta.Study(
        ta.model(lambda a, b: {GAP: a - b + 3 * a * b, SUM: np.abs(a + b)}, inputs=("a", "b"), outputs=(GAP, SUM)),
        ta.Drawing.of_rows([{"id": "a", "cost": 1, **row}, {"id": "b", "cost": 3, **row}]),
        limits={GAP: ta.Limit(upper=0.02, show=ta.AtYield(0.95)), SUM: ta.Limit(upper=widest_sum)},
        questions=[ta.Allocation(what_if=False)],
        name="lever",
        effort=EFFORT,
    )
    answer = study.allocate()
    return answer, answer.result.front


def test_a_front_is_verified_never_rises_and_has_the_drawing_on_it_once():
    answer, front = front_of(widest_sum=1.0)
    assert answer.result.met
    limits, costs = np.array([(own.limit, own.design.cost) for own in front.points]).T
    np.testing.assert_allclose(limits, [0.018, 0.02, 0.022])
    assert (np.diff(costs) <= 0).all() and costs[0] > costs[-1]
    assert front.points[1].design is answer.result.chosen and front.drawn.limit == pytest.approx(0.02)
    # Costs are 1/zone and the gap is nearly linear in the zones, so cost times limit is nearly the same.
    assert costs[0] / costs[1] == pytest.approx(1 / 0.9, rel=0.05)
    assert all(own.design.met and own.design.checks[0].requirement.limits.upper <= own.limit for own in front.points)


def test_a_drawing_that_misses_another_limit_is_no_point_of_a_front():
    answer, front = front_of(widest_sum=0.0005)
    assert not answer.result.met
    assert front.drawn is None and front.points == () and len(front.missed) == 2
    (told,) = [own for own in answer.sections if own.heading.startswith("What another limit")]
    assert told.figures == () and told.tables == () and len(told.paragraphs) == 1

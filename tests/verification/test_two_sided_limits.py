"""Limits on two sides: together they decide, and each is told its own quantile, share of units, slack and price."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import tolalloc as ta
from tolalloc.allocation.result import unit_quantile
from tolalloc.allocation.search.zone_allocation import limit_parts
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.capability.monte_carlo import proportion
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reports.tellers.allocation_sentences import headline
from tolalloc.reports.tellers.allocation_tables import requirements_table, today_frame, tried_table
from tolalloc.study.prepared import Prepared

TARGET = 0.9973
SHARE = 1 - TARGET
GAP = "gap [mm]"
ROW = {"unit": "mm", "min": 0.01, "max": 0.4, "cost": 1}
STACK = [
    {"id": "housing", "nominal": 50, "plus": 0.1, "minus": -0.1, **ROW},
    {"id": "bearing", "nominal": 15, "plus": 0, "minus": -0.12, **ROW},
    {"id": "spacer", "nominal": 33, "plus": 0.1, "minus": -0.1, **ROW},
    {"id": "ring", "nominal": 1.5, "plus": 0.05, "minus": -0.05, **ROW},
]
MEAN = 50 - 15 + 0.06 - 33 - 1.5  # the bearing lies in the middle of +0/−0.12
DEVIATION = np.sqrt(0.1**2 + 0.06**2 + 0.1**2 + 0.05**2) / 3


def gap(housing, bearing, spacer, ring):
    return housing - bearing - spacer - ring


def study(function=gap, rows=STACK, outputs=(GAP,), limits=None, **changed) -> ta.Study:
    """Return a study of own sizes, normal ones inside ±3σ unless their rows say otherwise."""
    inputs = tuple(row["id"] for row in rows)
    return ta.Study(
        ta.model(function, inputs=inputs, outputs=outputs),
        ta.Drawing.of_rows(rows),
        limits=limits or {GAP: ta.Limit(lower=0.3, upper=0.7)},
        **{"questions": [ta.Allocation(front=False, what_if=False)], "name": "two sides", **changed},
    )


def as_drawn(made: ta.Study, units: int = 2**18, confidence: float = 0.5) -> VerifiedDesign:
    """Return the drawing as it is, with what units say of it."""
    own = Prepared(study=made)
    verifier = Verifier(
        space=own.space,
        model=own.model,
        requirements=own.requirements,
        seeds=SeedTree(1),
        units=units,
        confidence=confidence,
    )
    return verifier.verify(own.space.uniform(1.0), "table")


def told(design: VerifiedDesign) -> dict[str, dict[int, float]]:
    """Return output → side → what is told beside the limit, which the units' own quantile is too."""
    found: dict[str, dict[int, float]] = {}
    for check, side in design.limited_sides:
        found.setdefault(check.requirement.output, {})[side.sign] = side.value
        spread = np.ptp(np.quantile(design.outputs[check.requirement.output], [0.001, 0.999]))
        assert unit_quantile(design, check, side) == pytest.approx(side.value, abs=0.02 * spread)
    return found


def joint_excess(distribution, lower: float, upper: float) -> float:
    """Return how far just 0.27 % of a distribution lie beyond one of two limits, by its own root."""
    return brentq(lambda by: distribution.sf(upper + by) + distribution.cdf(lower - by) - SHARE, -upper, upper)


def test_the_side_that_nearly_no_unit_reaches_is_told_its_own_quantile():
    """0.135 % of the units lie below 0.398 mm; 0.2901 is the mirror of what the upper side reaches."""
    distribution = norm(MEAN, DEVIATION)
    design = as_drawn(study())
    found = told(design)[GAP]
    assert found[-1] == pytest.approx(distribution.ppf(SHARE / 2), abs=1e-4)
    assert found[-1] == pytest.approx(0.398, abs=5e-4)
    assert found[1] == pytest.approx(0.7 + joint_excess(distribution, 0.3, 0.7), abs=1e-4)
    [check] = design.checks
    assert not check.met, "both sides together decide, as one of them misses its limit"
    assert check.slack == pytest.approx(0.7 - found[1])


def test_each_side_has_the_share_of_units_that_keep_it():
    design = as_drawn(study())
    [check] = design.checks
    beyond = norm.sf(0.7, MEAN, DEVIATION)
    assert design.yield_of(check.requirement, 1).estimate == pytest.approx(1 - beyond, abs=4e-4)
    assert design.yield_of(check.requirement, -1).estimate == pytest.approx(1.0, abs=1e-5)
    assert design.yield_of(check.requirement).estimate == pytest.approx(1 - beyond, abs=4e-4)


def test_turned_over_the_sides_change_places():
    turned = study(lambda *sizes: -gap(*sizes), limits={GAP: ta.Limit(lower=-0.7, upper=-0.3)})
    assert told(as_drawn(turned))[GAP][1] == pytest.approx(-norm.ppf(SHARE / 2, MEAN, DEVIATION), abs=1e-4)


def test_limits_about_the_mean_leave_half_of_the_failures_to_each():
    found = told(as_drawn(study(limits={GAP: ta.Limit(lower=MEAN - 0.2, upper=MEAN + 0.2)})))[GAP]
    for sign in (1, -1):
        assert found[sign] == pytest.approx(MEAN - sign * norm.ppf(SHARE / 2) * DEVIATION, abs=1e-4)


def test_the_side_with_more_than_half_of_the_failures_decides_and_the_other_has_half():
    """Beyond the upper limit lie some three times as many as beyond the lower one."""
    distribution, lower, upper = norm(MEAN, DEVIATION), MEAN - 0.17, MEAN + 0.15
    found = told(as_drawn(study(limits={GAP: ta.Limit(lower=lower, upper=upper)})))[GAP]
    assert found[1] == pytest.approx(upper + joint_excess(distribution, lower, upper), abs=1e-4)
    assert found[-1] == pytest.approx(distribution.ppf(SHARE / 2), abs=1e-4)


@pytest.mark.parametrize(("limits", "sign"), [(ta.Limit(lower=0.4), -1), (ta.Limit(upper=0.7), 1)])
def test_one_side_alone_has_all_failures(limits, sign):
    found = told(as_drawn(study(limits={GAP: limits})))[GAP]
    assert found == {sign: pytest.approx(MEAN - sign * norm.ppf(SHARE) * DEVIATION, abs=1e-4)}


def test_a_uniform_size_beside_its_nominal():
    """+0.3/−0.1 in one size: 0.27 % and 0.135 % of a width of 0.4."""
    rows = [{"id": "ring", "nominal": 1.0, "plus": 0.3, "minus": -0.1, "distribution": "uniform", **ROW}]
    made = study(lambda ring: 1.0 * ring, rows, limits={GAP: ta.Limit(lower=0.5, upper=1.2)})
    found = told(as_drawn(made))[GAP]
    assert found[1] == pytest.approx(1.3 - 0.4 * SHARE, abs=2e-4)
    assert found[-1] == pytest.approx(0.9 + 0.4 * SHARE / 2, abs=2e-4)


def test_a_skewed_output_of_no_law():
    """y = exp(x), x ± 0.9: σ = 0.3, lognormal quantiles; units tell them."""
    rows = [{"id": "x", "nominal": 1.0, "plus": 0.9, "minus": -0.9, **ROW, "max": 2.0}]
    made = study(lambda x: np.exp(x - 1.0), rows, limits={GAP: ta.Limit(lower=0.2, upper=2.1)})
    design = as_drawn(made)
    found = told(design)[GAP]
    assert found[1] == pytest.approx(np.exp(-0.3 * norm.ppf(SHARE)), rel=0.01)
    assert found[-1] == pytest.approx(np.exp(0.3 * norm.ppf(SHARE / 2)), rel=0.01)
    # Turned, the lower side is what misses.
    turned = study(lambda x: 3 - np.exp(x - 1.0), rows, limits={GAP: ta.Limit(lower=0.9, upper=2.8)})
    found = told(as_drawn(turned))[GAP]
    assert found[-1] == pytest.approx(3 - np.exp(-0.3 * norm.ppf(SHARE)), rel=0.01)
    assert found[1] == pytest.approx(3 - np.exp(0.3 * norm.ppf(SHARE / 2)), rel=0.01)


def test_of_two_outputs_each_side_is_told_its_own():
    outputs = (GAP, "reach [mm]")
    limits = {GAP: ta.Limit(lower=0.3, upper=0.7), "reach [mm]": ta.Limit(lower=50.0 - 0.1, upper=51.0)}
    made = study(lambda a, b, c, d: (a - b - c - d, 1.0 * a), STACK, outputs, limits)
    found = told(as_drawn(made))
    assert found[GAP][-1] == pytest.approx(norm.ppf(SHARE / 2, MEAN, DEVIATION), abs=1e-4)
    assert found["reach [mm]"][1] == pytest.approx(norm.ppf(1 - SHARE / 2, 50.0, 0.1 / 3), abs=1e-4)
    assert found["reach [mm]"][-1] == pytest.approx(norm.ppf(SHARE, 50.0, 0.1 / 3), abs=1e-4)


def test_an_index_is_that_of_each_side():
    """Mean ± 3·1.33·σ, whatever the other limit is."""
    limit = ta.Limit(lower=0.3, upper=0.7, show=ta.AtCpk(1.33))
    [check] = as_drawn(study(limits={GAP: limit})).checks
    for side in check.constraints:
        assert side.value == pytest.approx(MEAN + side.sign * 3 * 1.33 * DEVIATION, abs=2e-3)
        # No other limit's units: the slope by a common scale of all zones is 3·1.33·σ.
        scale = side.stack.zone_slopes(np.ones(4)) @ np.ones(4)
        assert scale == pytest.approx(3 * 1.33 * DEVIATION, rel=0.02)


@pytest.fixture(scope="module")
def answer() -> ta.Answer:
    return study(effort="quick").allocate()


@pytest.mark.slow
def test_the_first_page_tells_each_side(answer):
    rows = today_frame(answer.result, "cost units").set_index("limit")
    upper, lower = rows.loc["≤ 0.7"], rows.loc["≥ 0.3"]
    assert lower["as it is"] == pytest.approx(0.398, abs=1e-3)
    assert 0.4 < lower["as drawn"] < 0.42, "the zones of the gap became smaller"
    assert (upper["binds"], lower["binds"]) == ("yes", "")
    assert lower["yield [%]"] == lower["yield as drawn [%]"] == 100
    assert upper["yield [%]"] < 99.73
    assert rows.loc["≥ 99.73 %", "yield [%]"] == upper["yield [%]"]
    table = requirements_table(answer.result).frame().set_index("limit")
    low, high = table.loc["at least 0.3 mm"], table.loc["at most 0.7 mm"]
    assert low["slack [mm]"] == pytest.approx(low["kept: tolerances [mm]"] - 0.3)
    assert low["quantile of the units [mm]"] == pytest.approx(low["kept: tolerances [mm]"], abs=0.01)
    price = "marginal price of the limit [cost units]"
    assert low[price] < 1e-3
    assert high[price] > 0.2


@pytest.mark.slow
def test_the_price_of_a_limit_is_what_moving_that_limit_alone_costs():
    def found(lower: float, upper: float):
        limits = {GAP: ta.Limit(lower=lower, upper=upper)}
        return study(limits=limits, effort="quick").allocate().result

    lower, upper, step = MEAN - 0.16, MEAN + 0.15, 0.004
    prices = found(lower, upper).free.prices
    for name, moves in (("lower", (step, 0.0)), ("upper", (0.0, step))):
        tight, wide = (found(lower + by * moves[0], upper - by * moves[1]).cost for by in (1, -1))
        [price] = [own for side, own in prices.items() if name in side]
        assert price == pytest.approx((tight - wide) / (2 * step), rel=0.15)


def told_first(answer: ta.Answer, rejected: int, *, error: float, law: bool, accepted: bool = True) -> str:
    """Return the first sentence of an answer of which so many of 10,000 units miss a limit."""
    result, chosen = answer.result, answer.result.chosen
    checks = chosen.checks
    if not law:
        [check] = checks
        checks = (replace(check, constraints=tuple(replace(own, law=None) for own in check.constraints)),)
    changed = replace(chosen, achieved=proportion(10_000, rejected), checks=checks, accepted=accepted)
    free = replace(result.free, chosen=changed, tried=(changed,))
    return headline(replace(result, error=error, free=free), "cost units")[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rejected", "error", "law", "begins"),
    [
        (26, 0.05, True, "Met: 99.74 %"),
        (27, 0.05, True, "Met: 99.73 %"),
        (
            28,
            0.05,
            True,
            "Met by the exact distribution of the outputs, while the simulated units alone leave it open: 99.72 %",
        ),
        (
            28,
            0.05,
            False,
            "Met by the exact distribution of the outputs, while the simulated units alone leave it open: 99.72 %",
        ),
        (26, 0.5, False, "Met, by a quick run: 99.74 %"),
        (28, 0.5, False, "Not decided by a quick run: 99.72 %"),
        (
            28,
            0.5,
            True,
            "Met by the exact distribution of the outputs, while the simulated units alone leave it open: 99.72 %",
        ),
    ],
)
def test_met_is_not_the_first_word_where_fewer_units_than_required_keep_the_limits(
    answer, rejected, error, law, begins
):
    sentence = told_first(answer, rejected, error=error, law=law)
    assert sentence.startswith(begins)
    assert "99.73 % was required and lies inside this interval. This holds for parts with" in sentence


@pytest.mark.slow
def test_what_is_not_accepted_is_not_met(answer):
    assert told_first(answer, 20, error=0.05, law=True, accepted=False).startswith("NOT met: ")


@pytest.mark.slow
def test_every_design_tried_says_which_units_judged_it(answer):
    """A design that its search alone judged is not called verified by one page and not verified by another."""
    table = tried_table(answer.result).frame()
    last = table.iloc[-1]
    assert last["judged on"] == "independent sample"
    assert last["cost [cost units]"] == answer.result.cost
    of_search = table[table["judged on"] == "units of its search"]
    assert len(of_search) == len(table) - 1 > 0


def centred(start: float, limits: ta.Limit, others: dict[str, ta.Limit] | None = None, **changed):
    """Return the quick allocation of two sizes and a setting that moves their difference."""
    row = {"unit": "mm", "min": 0.001, "max": 2.0, "cost": 1, "plus": 0.1, "minus": -0.1}
    setting = ta.Setting(name="press [mm]", value=start, lower=-1.0, upper=1.0, step=0.001)
    outputs = (GAP, *(others or {}))
    made = ta.Study(
        ta.model(
            (lambda a, b, press: (a - b + press, 1.0 * a)) if others else (lambda a, b, press: a - b + press),
            inputs=("a", "b"),
            outputs=outputs,
            settings=(setting,),
        ),
        ta.Drawing.of_rows([{"id": "a", "nominal": 10.56, **row}, {"id": "b", "nominal": 10.0, **row}]),
        limits={GAP: limits, **(others or {})},
        questions=[ta.Allocation(front=False, what_if=False)],
        name="centred",
        **changed,
    )
    return made.allocate("quick").result


@pytest.mark.slow
@pytest.mark.parametrize(
    ("start", "lower", "upper"), [(0.0, 0.3, 0.7), (0.1, 0.3, 0.7), (0.0, 0.2, 1.4), (-0.1, 0.3, 0.7)]
)
def test_a_setting_moves_the_mean_to_the_middle_of_the_limits(start, lower, upper):
    """There σ = z·√2/6 has 3.00 times its size to either side, and two zones of z cost 0.4/z.

    A hundredth of the half width beside the middle is 0.03·σ, which costs (0.03)²/2 = 0.05 % at most.
    """
    half = (upper - lower) / 2
    zone = 6 * half / -norm.ppf(SHARE / 2) / np.sqrt(2)
    found = centred(start, ta.Limit(lower=lower, upper=upper))
    assert found.met
    assert found.chosen.unrounded_cost == pytest.approx(0.4 / zone, rel=3e-3)
    assert found.chosen.settings[0] == pytest.approx((lower + upper) / 2 - 0.56, abs=half / 100)
    assert found.bound <= 0.4 / zone


@pytest.mark.slow
def test_so_it_does_beside_another_limit():
    """a ≤ 11 is missed by no unit, so that the gap may fail as often as both together."""
    zone = 6 * 0.2 / -norm.ppf(SHARE / 2) / np.sqrt(2)
    found = centred(0.0, ta.Limit(lower=0.3, upper=0.7), {"a [mm]": ta.Limit(upper=14.0)})
    assert found.met
    assert found.cost == pytest.approx(0.4 / zone, rel=0.02)
    rows = today_frame(found, "cost units").set_index("limit")
    assert rows.loc["≥ 0.3", "as it is"] == pytest.approx(norm.ppf(SHARE / 2, 0.56, 0.1 * np.sqrt(2) / 3), abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("start", [0.0, -0.1])
def test_so_it_does_where_the_output_bends(start):
    """y = (a − b + press)³ keeps 1.3³ and 1.7³ just where its root keeps 1.3 and 1.7."""
    row = {"unit": "mm", "min": 0.001, "max": 2.0, "cost": 1, "plus": 0.1, "minus": -0.1}
    made = ta.Study(
        ta.model(
            lambda a, b, press: (a - b + press) ** 3,
            inputs=("a", "b"),
            outputs=(GAP,),
            settings=(ta.Setting(name="press [mm]", value=start, lower=-1.0, upper=1.0, step=0.001),),
        ),
        ta.Drawing.of_rows([{"id": "a", "nominal": 11.56, **row}, {"id": "b", "nominal": 10.0, **row}]),
        limits={GAP: ta.Limit(lower=1.3**3, upper=1.7**3)},
        questions=[ta.Allocation(front=False, what_if=False)],
        name="bent",
    )
    found = made.allocate("quick").result
    zone = 6 * 0.2 / -norm.ppf(SHARE / 2) / np.sqrt(2)
    assert found.met
    assert found.cost == pytest.approx(0.4 / zone, rel=0.02)


@pytest.mark.parametrize(("lower", "upper"), [(-3.0, 3.0), (-2.8, 3.3)])
def test_two_limits_share_their_price_as_moving_each_alone_changes_the_spread(lower, upper):
    """Where zones fall as 1/σ, 1/σ of the spread that keeps 99.73 % of normal units between both, by differences."""

    def spread(low: float, high: float) -> float:
        return brentq(lambda own: norm.cdf(high / own) - norm.cdf(low / own) - (1 - SHARE), 0.5, 2.0, xtol=1e-14)

    sigma, step = spread(lower, upper), 1e-4
    values = norm.ppf((np.arange(200_001) + 0.5) / 200_001) * sigma
    true = [
        (
            1 / spread(lower + step * (not up), upper - step * up)
            - 1 / spread(lower - step * (not up), upper + step * up)
        )
        / (2 * step)
        for up in (True, False)
    ]
    alone = np.array([1 / sigma / upper, 0.0])  # all on the one side, kept at the share that it has
    assert limit_parts(values, np.array([upper, lower]), alone) == pytest.approx(true, rel=2e-3)

"""What the report of an allocation says: every sentence and number is what was computed, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

import tolalloc as ta
from tests.builders import few_sources, headed, says, telling, wording
from tolalloc import LOST_MOTION
from tolalloc import RADIAL_CLEARANCE as RADIAL
from tolalloc.allocation.cost.unit_price import YieldLadder
from tolalloc.allocation.front.uncertain_region import UncertainRange, UncertainRegion
from tolalloc.allocation.result import AllocationResult, limit_price, solver_noise
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.effort import QUICK_ALLOCATION
from tolalloc.capability.indices import Limits
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header
from tolalloc.reports.tellers import allocation_tables as tables
from tolalloc.study.answer import Answer

pytestmark = pytest.mark.slow  # one allocation of all limits, in a minute or two, is what all read

TARGET = 0.95
SMALL = replace(
    QUICK_ALLOCATION,
    verification_units=512,
    shared_units=16,
    front_limits=(0.95, 1.1),
    front_units=512,
    front_steps=1,
    graded_steps=4,
    setting_steps=(1, 2),
    price_nodes=4,
    share_blocks=8,
    yields=(0.8, 0.95, 0.9999),
    confirmation_units=1024,
    error=0.05,
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    shown = ta.AtYield(target=TARGET)
    study = ta.Study(
        ta.reducer("rv20e_liu2020", flank_clearance=(1.0, 5.0), radial_clearance=(5.0, 20.0), neglected=("*",)),
        ta.drawing(few_sources(tmp_path_factory.mktemp("said"))),
        limits={
            ta.PEAK_TO_PEAK: ta.Limit(upper=50.0, show=shown),
            LOST_MOTION: ta.Limit(upper=0.5, show=ta.AtCpk(target=1.33)),
            RADIAL: ta.Limit(lower=-8.0, show=shown),
        },
        questions=(ta.Allocation(grades=True, unit_price=ta.UnitPrice(scrap=5.0)),),
        name="said",
        effort=ta.Effort(allocation=SMALL, is_quick=True),
    )
    found = study.allocate().result
    assert found.chosen.met
    assert found.fixed.chosen.met
    return found


def answer_of(results: AllocationResult, **changes) -> Answer[AllocationResult]:
    """Return the answer that a result is."""
    header = Header(name="said", model=results.model.name, seed=1, quick=True)
    return Answer(kind="allocation", header=replace(header, **changes), result=results)


def said(results, sentence: str, **gaps: object) -> str:
    """Return the one sentence of the answer with a key."""
    return telling(answer_of(results).sentences, f"allocation.{sentence}", **gaps)


def section(results, heading: str, **gaps: object) -> Section:
    """Return the one section of the report whose heading has a key."""
    return headed(answer_of(results).sections, f"allocation.heading_{heading}", **gaps)


def costing(allocation: ZoneAllocation, cost: float) -> ZoneAllocation:
    return replace(allocation, chosen=replace(allocation.chosen, cost=cost))


def missing(allocation: ZoneAllocation, beyond: float = 3.0) -> ZoneAllocation:
    """Return an allocation whose design keeps so much more than its limit."""
    first, *others = allocation.chosen.checks
    side = replace(first.constraints[0], value=first.constraints[0].limit + beyond)
    chosen = replace(allocation.chosen, checks=(replace(first, constraints=(side,)), *others), accepted=False)
    return replace(allocation, chosen=chosen)


def test_the_certificate_says_for_which_drawings_it_holds(results):
    joint = results.free
    assert joint.bound < joint.chosen.cost
    below = 1 - joint.bound / joint.chosen.cost
    assert said(results, "bound_local", bound=joint.bound, below=below, confidence=0.95)
    assert said(results, "graded_bound", bound=results.graded.bound)


def test_nothing_is_certified_of_a_miss(results):
    graded = missing(results.graded)
    lost = replace(results, fixed=missing(results.fixed), free=missing(results.free), graded=graded)
    sentences = answer_of(lost).sentences
    assert answer_of(lost).summary["lower bound [cost units]"] is None
    for bound in ("bound_certified", "bound_local", "graded_bound", "price"):
        assert not says(sentences, f"allocation.{bound}")
    assert says(said(lost, "graded", cost=results.graded.chosen.cost), "allocation.graded_missed")


def test_the_certificate_table_has_bound_and_models(results):
    table = tables.certificate_frame(results, "cost units").set_index("search")
    row, joint = table.loc["tolerances and modification"], results.free
    assert row["lower bound, 95 % [cost units]"] == joint.bound
    assert row["verified cost above the lower bound [%]"] == pytest.approx(100 * joint.gap)
    assert row["lower bound holds for"] == "drawings near by"
    inside, at_limits = (
        row[f"cheapest by the local model, {where} [cost units]"] for where in ("inside", "at the limits")
    )
    assert row["verified cost [cost units]"] >= inside > at_limits
    assert table.loc["grades", "lower bound holds for"] == "choices near by"


def test_the_modification_saves_only_what_the_searches_can_tell(results):
    joint = costing(results.free, 10.0 * results.free.bound)
    cost = joint.chosen.cost
    plain = replace(results, free=costing(results.free, results.free.bound), fixed=costing(results.fixed, 1e3 * cost))
    vars(plain.fixed)["lower_bound"] = replace(plain.fixed.lower_bound, cost=1e3 * cost)
    assert says(answer_of(plain).sentences, "allocation.saves")
    assert not says(answer_of(plain).sentences, "allocation.saves_doubt")
    small = replace(results, free=joint, fixed=costing(results.fixed, 1.1 * cost))
    assert says(answer_of(small).sentences, "allocation.saves", saved=0.1 * cost, share=1 - 1 / 1.1)
    assert says(answer_of(small).sentences, "allocation.saves_doubt")
    for factor in (1.0, 0.9):
        same = replace(results, free=joint, fixed=costing(results.fixed, factor * cost))
        assert says(answer_of(same).sentences, "allocation.nothing_cheaper")
        assert not says(answer_of(same).sentences, "allocation.saves")


def test_a_modification_that_was_not_confirmed_saves_nothing(results):
    joint = costing(results.free, 10.0)
    joint = replace(joint, chosen=replace(joint.chosen, accepted=False))
    alone = costing(results.fixed, 11.0)
    alone = replace(alone, chosen=replace(alone.chosen, accepted=True))
    found = answer_of(replace(results, free=joint, fixed=alone, graded=None)).sentences
    assert says(found, "allocation.not_confirmed", cost=10.0, alone=11.0)
    assert not says(found, "allocation.saves")


def test_a_search_that_missed_says_what(results):
    alone = answer_of(replace(results, fixed=missing(results.fixed))).sentences
    assert says(alone, "allocation.alone_missed")
    assert says(alone, "allocation.missed", limit="50″", value="53″", excess="3″")
    joint = replace(results, free=missing(results.free, 7.0))
    (sentence,) = (own for own in answer_of(joint).sentences if says(own, "allocation.none_free"))
    assert says(sentence, "allocation.missed", value="57″")
    assert not says(answer_of(joint).sentences, "allocation.saves")
    both = replace(joint, fixed=missing(results.fixed))
    (sentence,) = (own for own in answer_of(both).sentences if says(own, "allocation.none_alone"))
    assert says(sentence, "allocation.missed", value="53″")
    unknown = replace(results, fixed=missing(results.fixed, np.inf))
    assert says(answer_of(unknown).sentences, "allocation.missed_unanswered")


def test_uniform_scaling_is_granted_the_limit_to_its_last_arcsecond(results):
    joint, chosen = results.free, results.chosen
    hand = joint.proportional
    least = hand.cost * min(1.0, hand.quantile_bound / joint.limit)
    assert results.least_saving == pytest.approx(1 - chosen.cost / least)
    sentence = said(results, "cost", before=results.free.baseline.cost, cost=chosen.cost)
    assert says(sentence, "allocation.cost_tighter", alike=hand.cost)
    assert answer_of(results).summary["saving at least [-]"] == pytest.approx(1 - chosen.cost / least)


def ladder(prices) -> YieldLadder:
    targets = np.array([0.8, 0.9, 0.9973])
    return YieldLadder(targets=targets, manufacturing=np.array(prices), prices=np.array(prices))


@pytest.mark.parametrize(
    ("prices", "where", "target", "price"),
    [
        ([1.0, 2.0, 3.0], "below", 80.0, 1.0),
        ([3.0, 2.0, 1.0], "above", 99.73, 1.0),
        ([3.0, 2.0, np.nan], "above", 90.0, 2.0),
        ([3.0, 2.0, 4.0], "inside", 90.0, 2.0),
        ([np.nan, 2.0, np.nan], "only", 90.0, 2.0),
    ],
)
def test_the_cheapest_good_unit_at_the_end_of_the_ladder_is_no_optimum(results, prices, where, target, price):
    good = wording(f"allocation.good_{where}", target=target)
    gaps = {"yield_": good, "price": price, "cost_unit": "cost units", "output": "peak-to-peak"}
    assert said(replace(results, prices=ladder(prices)), "good", **gaps)


def test_where_no_yield_has_a_price_one_sentence_says_so(results):
    nothing = replace(results, prices=ladder([np.nan] * 3))
    assert says(answer_of(nothing).sentences, "allocation.good_none")
    assert not says((own.heading for own in answer_of(nothing).sections), "allocation.heading_good_unit")
    assert "nan" not in " ".join(answer_of(nothing).sentences)
    unasked = answer_of(replace(results, prices=None)).sentences
    assert not says(unasked, "allocation.good_none") and not says(unasked, "allocation.good")


def test_a_yield_that_the_units_cannot_show_has_no_price(results):
    assert np.isnan(results.prices.prices[-1])
    assert np.isfinite(results.prices.prices[:-1]).all()


def test_it_is_said_what_wrong_prices_cost_at_most_and_which_zone_depends_on_its_own(results):
    sentences, found = answer_of(results).sentences, results.robustness
    worst, cost = found.worst, results.free.chosen.cost
    gaps = {"change": 0.2, "most": worst.most, "share": worst.most / cost, "lost": worst.lost}
    assert says(sentences, "allocation.worst_prices", **gaps)
    nearest = min(range(len(found.groups)), key=lambda at: found.prices[at].nearest)
    own = found.prices[nearest]
    assert says(sentences, "allocation.price_range", group=found.groups[nearest], same=0.1, low=own.low, high=own.high)
    assert "free zones cost more by [%]" in tables.variants_frame(found, "cost units").columns


def test_the_quantile_of_the_units_is_what_they_show_at_even_odds(results):
    table = tables.requirements_table(results).frame()
    at = next(header for header in table if header.startswith("quantile of the units ["))
    sample, radial = results.chosen.sample, results.chosen.outputs[RADIAL]
    value, count = table[at][0], sample.evaluation.status.size
    at_most = binom(count, 1 - TARGET).cdf  # if the share beyond were just that allowed
    for beyond in (count - np.count_nonzero(sample.values <= value), np.count_nonzero(radial < table[at][2])):
        assert at_most(beyond) <= 0.5 < at_most(beyond + 1)
    assert value <= results.chosen.quantile_bound
    assert np.isnan(table[at][1])  # a Cpk
    first = section(results, "requirements").paragraphs[0]
    shown = results.chosen.quantile_bound
    assert says(first, "allocation.quantile_upper", target=0.95, kept=f"{value:.4g}″", value=f"{shown:.4g}″")


def test_prices_are_marginal_and_per_what_the_limit_is_large_of(results):
    side = results.free.chosen.constraints[0]
    for limit, priced, step in ((60.0, 0.9, ""), (1.0, 0.009, "0.01 "), (0.13, 0.0009, "0.001 "), (542.9, 9.0, "10 ")):
        one = limit_price(replace(side, limit=limit), Limits(upper=limit), 0.9)
        assert one == (pytest.approx(priced), f"{step}arcsec")
    for limit in (49.95, 50.05):  # of two limits each by what they leave between them
        two = limit_price(replace(side, limit=limit), Limits(lower=49.95, upper=50.05), 0.9)
        assert two == (pytest.approx(0.0009), "0.001 arcsec")
    price = results.free.prices[side.stack.name]
    gaps = {"output": "peak-to-peak transmission error", "limit": "50″", "step": "1″"}
    assert said(results, "price", price=price, cost_unit="cost units", **gaps)


def test_prices_below_the_noise_of_the_solver_are_nothing(results):
    optimum = results.free.optimum
    noise = solver_noise(optimum)
    assert noise >= max(optimum.gap, 0.0) * optimum.cost
    quiet = replace(optimum, bound_prices=np.full_like(optimum.bound_prices, 0.1 * noise / optimum.zones.max()))
    found = tables.bounds_frame(replace(results, free=replace(results.free, optimum=quiet)), "cost units")
    for end in ("smallest", "largest"):
        assert (found[f"marginal price of the {end} [cost units/µm]"] == 0.0).all()
    loud = replace(optimum, bound_prices=np.full_like(optimum.bound_prices, 10 * noise / optimum.zones.min()))
    found = tables.bounds_frame(replace(results, free=replace(results.free, optimum=loud)), "cost units")
    assert (found["marginal price of the smallest [cost units/µm]"] > 0.0).all()


def test_failed_units_are_counted_by_a_yield_alone(results):
    statuses = {"equilibrium found": 9, "no equilibrium": 2}
    assert telling(answer_of(results, statuses=statuses).warnings, "allocation.failed_many", count=2)


def region(same=(-0.7, 0.7), first=("", ""), kept=(-0.7, 0.7), worst=None):
    own = UncertainRange(column="stiffness.a", tried=(-0.7, 0.7), same=same, first=first, kept=kept)
    still = UncertainRange(column="stiffness.b", tried=(-0.7, 0.7), same=(-0.7, 0.7), first=("", ""), kept=(-0.7, 0.7))
    return UncertainRegion(name="stiffness", ranges=(own, still), ratios=np.ones((4, 1)), least_favourable=worst)


def told_with(results, found):
    of_all = replace(found, ratios=np.ones((4, len(results.robustness.groups))))
    answer = answer_of(replace(results, robustness=replace(results.robustness, uncertain=of_all)))
    assert "nan" not in " ".join(answer.sentences)
    return answer


def test_a_stiffness_that_breaks_the_free_zones_is_said_of_them(results):
    worst = replace(results.robustness.at_worst, kept=False, regret=np.nan)
    assert says(told_with(results, region(worst=worst)).warnings, "allocation.uncertain", what="stiffness")
    kept = told_with(results, region(worst=replace(worst, kept=True, regret=0.0)))
    assert not says(kept.warnings, "allocation.uncertain")


def test_the_region_of_stiffness_is_said_as_factors(results):
    holds = told_with(results, region())
    assert says(holds.sentences, "allocation.region_holds", what="stiffness", low=np.exp(-0.7), high=np.exp(0.7))
    moved = told_with(results, region(same=(-0.3, 0.4), first=("bores", "pins"), kept=(-0.7, 0.1)))
    said = {"column": "stiffness.a", "low": np.exp(-0.3), "high": np.exp(0.4), "group": "bores"}
    assert says(moved.sentences, "allocation.region_moves", **said)
    assert says(moved.sentences, "allocation.region_breaks", column="stiffness.a", low=np.exp(-0.7), high=np.exp(0.1))
    assert not says(moved.sentences, "allocation.region_holds")
    unanswered = replace(region().ranges[0], tried=(-0.7, 0.0), same=(-0.7, 0.0), kept=(-0.7, 0.0))
    told = told_with(results, replace(region(), ranges=(unanswered,)))
    assert says(told.sentences, "allocation.region_unanswered", columns="stiffness.a")
    assert not says(told.sentences, "allocation.region_holds")
    frame = tables.region_frame(region(same=(-0.3, 0.4), first=("bores", "")), met=True)
    missed = tables.region_frame(region(), met=False)
    assert "zones same to times [-]" in missed and "limits kept to times [-]" not in missed
    assert frame.loc[0, "first zone to change above"] == "none"
    assert frame.loc[0, "zones same to times [-]"] == pytest.approx(np.exp(0.4))


def test_a_trade_without_any_cost_is_said_in_words(results):
    trade = replace(results.trade, cost=np.full_like(results.trade.cost, np.nan), error=np.nan)
    nothing = replace(results, trade=trade)
    told = section(nothing, "trade", word="Modification")
    assert len(told.paragraphs) == 1 and says(told.paragraphs, "allocation.trade_none")
    assert told.figures == ()
    assert len(section(results, "trade", word="Modification").figures) == 2
    for own in answer_of(nothing).sections:
        assert "nan" not in " ".join(own.paragraphs)


def test_a_section_that_fails_is_a_card_and_the_rest_stands(results, monkeypatch, capsys):
    def fails(*_):
        raise ValueError("no such zone")

    monkeypatch.setattr(tables, "certificate_frame", fails)
    whole = answer_of(results)
    headings = [own.heading for own in whole.sections]
    (card,) = [own for own in whole.sections if own.heading == "A part of this report failed"]
    assert "ValueError('no such zone')" in card.paragraphs[0] and card.first
    assert headings[headings.index(card.heading) + 1 :]  # what follows stands
    assert "no such zone" in capsys.readouterr().err


def test_the_front_is_verified_never_rises_and_has_the_drawing_on_it(results):
    front = results.front
    limits, cost = np.array([(own.limit, own.design.cost) for own in front.points]).T
    assert (np.diff(limits) > 0).all() and (np.diff(cost) <= 0).all()
    assert [own.design for own in front.points if own.limit == front.drawn.limit] == [results.chosen]
    assert front.drawn.limit == results.requirements[0].limits.upper
    assert all(own.design.met for own in front.points)
    told = section(results, "front", output="peak-to-peak")
    assert says(told.paragraphs, "allocation.front", units=SMALL.front_units)
    assert says(told.paragraphs, "allocation.front_drawn")
    assert list(told.figures[0].series[0].y) == cost.tolist()
    table = dict(told.tables)["front"]
    assert table["drawing"].tolist() == ["this drawing" if own == front.drawn.limit else "" for own in limits]


def test_amounts_that_are_not_those_of_today_are_said_with_the_zones_on_the_first_page(results):
    drawn = results.model.drawn_amounts
    sentence = said(results, "amounts_one", word="modification")
    for amount, was in zip(
        drawn.by_setting @ results.chosen.settings, drawn.by_setting @ results.free.baseline.settings, strict=True
    ):
        assert f"{amount:.2f} µm (was {was:.2f})".replace("-", "−") in sentence
    assert answer_of(results).sentences.index(sentence) < 4, "the first page has four sentences of the answer"
    (first, *_) = section(results, "dimensions").paragraphs
    assert says(first, "allocation.convention", convention=results.model.drawn_amounts.convention)


@pytest.mark.parametrize(("middle", "names"), [(0.0, ()), (-3e-6, ("pin diameter",))])
def test_a_grade_off_the_nominal_size_is_said_to_be_no_letter(results, middle, names):
    """Zones climb grades about the middle of the table: 0/−6 becomes −1.75/−4.25, which is IT3 wide but no h3."""
    graded = on_grades(results, middle)
    drawn = {own.dimension for own in graded.drawn_sources if own.grade and own.middle}
    assert drawn == set(names)
    sentences = answer_of(graded).sentences
    assert says(sentences, "allocation.graded_letters") == bool(names)
    assert all(any(name in own and "no letter" in own.replace("\n", " ") for own in sentences) for name in names)


def on_grades(results: AllocationResult, middle: float) -> AllocationResult:
    """Return the answer on grades, with the pins' zone of the table wider and about another middle [m]."""
    sources = (
        replace(own, middle=middle, zone=1.5 * own.zone) if own.name == "pin.diameter" else own
        for own in results.space.errors.sources
    )
    space = replace(results.space, errors=replace(results.space.errors, sources=tuple(sources)))
    graded = replace(results.free, chosen=results.graded.chosen)
    return replace(results, space=space, free=graded)

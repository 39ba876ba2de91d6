"""Allocation on the kernel: requirements, local models, verified steps, and what blocks where nothing is met."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kurtosis, norm, skew

from tests import builders
from tolalloc import LOST_MOTION, PEAK_TO_PEAK
from tolalloc import RADIAL_CLEARANCE as RADIAL
from tolalloc.allocation.cost.model import Process, Reciprocal
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.steering import Programs
from tolalloc.allocation.search.zone_allocation import aimed, allocate, kept_stacks, scale_in_proportion
from tolalloc.allocation.space.effort import SearchEffort
from tolalloc.allocation.space.output_sample import OutputSample
from tolalloc.allocation.space.problem import root_sum_square_stack, worst_case_stack
from tolalloc.allocation.space.requirement import AtCpk, AtYield, Requirement, WorstCase
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import proportion
from tolalloc.exceptions import InputError

verifier_of = partial(builders.verifier_of, slope_units=64)


class KnownSample(OutputSample):
    """A trial whose values are known."""

    design, groups, confidence = np.array([1.0, 2.0, 3.0, 4.0]), 2, 0.95
    law = near = uncertainty = None

    def __init__(self, values, failed=0, confidence=0.95):
        every = np.append(values, np.full(failed, np.nan))
        units = SimpleNamespace(standard=np.zeros((every.size, 0)), exact=(), values=lambda _: every)
        vars(self).update(values=values, units=units, output="x [mm]", confidence=confidence)

    def derived(self):
        return self.values, np.outer(self.values, [1.0, 0.0, 0.0, 0.0]) / self.design[0]

    def slopes_at(self, rows):
        return np.outer(self.values[rows], [1.0, 0.0, 0.0, 0.0]) / self.design[0]

    def worst(self, sense):
        return sense * 7.0, 0.0, sense * np.array([2.0, 1.5, 0.5, -0.25])

    def linear(self):
        return 0.0, 0.0, np.array([2.0, 1.5]), np.array([0.5, -0.25])


def test_clearances_and_amounts_map_one_to_one(prepared):
    space, modification = prepared.space, prepared.model.reducer.modification
    again = prepared.model.modification(space.settings_of(space.uniform(1.0)))
    assert again.equidistant == pytest.approx(modification.equidistant, abs=1e-15)
    assert again.shift == pytest.approx(modification.shift, abs=1e-15)
    assert modification.radial_clearance == pytest.approx(8e-6)
    assert modification.flank_clearance(prepared.model.reducer.cycloid_stage) == pytest.approx(1.04e-6, abs=5e-9)


@pytest.mark.parametrize("build", [root_sum_square_stack, worst_case_stack])
def test_local_model_has_the_given_value_and_gradient(generator, build):
    design = np.append(generator.uniform(0.3, 2, 6), [1.0, 8.0])
    gradient = np.append(generator.uniform(0.5, 20, 6), [4.0, -1.0])
    stack = build("x", design, 2.5, gradient, groups=6)

    def excess(at):
        return stack.load(at[..., :-2], at[..., -2:]) - stack.budget

    assert excess(design) == pytest.approx(2.5)
    step = 1e-6
    differences = (excess(design + step * np.eye(8)) - excess(design - step * np.eye(8))) / (2 * step)
    np.testing.assert_allclose(differences, gradient, rtol=1e-6)


def test_a_group_whose_larger_zone_relieves_a_limit_has_no_weight():
    stack = root_sum_square_stack("x", np.array([1.0, 1.0, 2.0, 8.0]), 0.0, np.array([3.0, -2.0, 1.0, 1.0]), groups=2)
    assert stack.root_sum_square[0] > 0
    assert stack.root_sum_square[1] == 0


@pytest.mark.parametrize("limits", [Limits(upper=2.9), Limits(lower=-2.9), Limits(lower=-3.1, upper=2.95)])
def test_at_a_yield_met_is_what_clopper_and_pearson_say(limits):
    guarantee, seen = AtYield(target=0.995), set()
    for seed in range(60):
        values = np.random.default_rng(seed).standard_normal(1500)
        check = Requirement(output="x [mm]", limits=limits, guarantee=guarantee).check(
            KnownSample(values, failed=seed % 3)
        )
        rejected = limits.outside(values) + seed % 3
        assert check.met == (proportion(1500 + seed % 3, rejected).bound >= 0.995)
        assert check.met == (check.slack >= 0)
        seen.add(check.met)
    assert seen == {True, False}


def test_too_many_failed_units_never_show_a_yield():
    check = Requirement(output="x [mm]", limits=Limits(upper=1e9), guarantee=AtYield(target=0.995)).check(
        KnownSample(np.arange(1500.0), failed=12)
    )
    assert not check.met
    assert np.isfinite(check.constraints[0].stack.budget)


def test_too_few_units_for_a_yield_are_refused(prepared):
    strict = replace(prepared.requirements[0], guarantee=AtYield(target=0.9999))
    with pytest.raises(InputError, match="29956 or more"):
        replace(verifier_of(prepared), requirements=(strict,))


def test_the_error_of_an_order_statistic_is_that_of_many_samples():
    """5,000 samples of 400: their standard deviation is known to 1 %, the bootstrap's mean to about 2 %."""
    samples = np.random.default_rng(1).standard_normal((5000, 400))
    requirement = Requirement(output="x [mm]", limits=Limits(upper=3.0), guarantee=AtYield(target=0.95))
    sides = [requirement.check(KnownSample(values)).constraints[0] for values in samples[:300]]
    rank = int(np.sum(samples[0] <= sides[0].value))
    true = np.sort(samples, axis=1)[:, rank - 1].std()
    assert np.mean([side.standard_error for side in sides]) == pytest.approx(true, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("lean", [0.0, 0.25])
def test_a_cpk_just_at_its_target_is_shown_in_five_percent_of_samples(lean):
    """2,000 samples of 800 units: the share has a standard error of 0.5 %; four of them, and 1 % for the expansion."""
    generator, target = np.random.default_rng(3), 1.2
    raw = generator.standard_normal((2000, 800))
    values = np.expm1(lean * raw) if lean else raw
    mean, deviation = (np.exp(lean**2 / 2) - 1, np.sqrt(np.expm1(lean**2) * np.exp(lean**2))) if lean else (0.0, 1.0)
    assert not lean or kurtosis(values, axis=None) > 0.5
    limits = Limits(upper=float(mean + 3 * target * deviation))
    requirement = Requirement(output="x [mm]", limits=limits, guarantee=AtCpk(target=target))
    shown = np.mean([requirement.check(KnownSample(sample)).met for sample in values])
    assert shown == pytest.approx(0.05, abs=4 * 0.005 + 0.01)


def test_a_cpk_of_a_normal_sample_has_bissells_bound():
    """z·√(1/9n + Cpk²/2n) at 100,000 units, where skewness and kurtosis are uncertain by less than 2 % of it."""
    values = np.random.default_rng(5).standard_normal(100_000)
    limits = Limits(lower=-4.0, upper=4.5)
    sides = AtCpk(target=1.0).constraints(KnownSample(values), limits)
    for side in sides:
        needed = (side.sign * (side.value - values.mean())) / (3 * values.std(ddof=1))
        assert needed - 1 == pytest.approx(norm.ppf(0.95) * np.sqrt((1 / 9 + needed**2 / 2) / values.size), rel=0.05)


def test_the_bound_of_a_cpk_knows_which_way_a_sample_leans():
    """(c − target)²·n = z²·(1/9 + c·γ/3 + c²·(κ − 1)/4) with the skewness towards each limit."""
    values, target = np.random.default_rng(6).gumbel(size=3000), 1.1
    for side in AtCpk(target=target).constraints(KnownSample(values), Limits(lower=-40.0, upper=40.0)):
        turned = side.sign * values
        needed = (side.sign * side.value - turned.mean()) / (3 * values.std(ddof=1))
        variance = 1 / 9 + needed * skew(turned) / 3 + needed**2 * (kurtosis(values, fisher=False) - 1) / 4
        assert (needed - target) * np.sqrt(values.size / variance) == pytest.approx(norm.ppf(0.95), rel=1e-9)


def test_at_even_odds_a_guarantee_is_that_of_the_sample_itself():
    values, target = np.random.default_rng(7).standard_normal(1152), 0.9973
    (shown,) = AtYield(target=target).constraints(KnownSample(values, confidence=0.95), Limits(upper=3.0))
    (even,) = AtYield(target=target).constraints(KnownSample(values, confidence=0.5), Limits(upper=3.0))
    assert shown.value == values.max()  # none of 1,152 may lie beyond
    assert even.value == np.sort(values)[-3]  # 3.1 of 1,152 do so on average
    (cpk,) = AtCpk(target=1.2).constraints(KnownSample(values, confidence=0.5), Limits(upper=3.0))
    assert cpk.value == pytest.approx(values.mean() + 3.6 * values.std(ddof=1), rel=1e-12)
    assert cpk.standard_error > 0


def test_a_worst_case_adds_and_a_lower_limit_turns_it():
    requirement = Requirement(output="x [mm]", limits=Limits(lower=-5.0, upper=9.0), guarantee=WorstCase())
    check = requirement.check(KnownSample(np.zeros(3)))
    upper, lower = check.constraints
    assert (upper.excess, lower.excess) == (-2.0, 2.0)
    assert check.slack == -2.0
    for side in check.constraints:
        assert side.predicted(KnownSample(np.zeros(3)).design) == pytest.approx(side.excess)
        np.testing.assert_allclose(side.stack.worst_case, [2.0, 1.5])
        np.testing.assert_allclose(side.stack.slopes, [0.5, -0.25])


def test_cost_is_reciprocal_where_the_table_alone_prices(prepared):
    space, scale = prepared.space, 0.7
    design = space.uniform(scale)
    assert space.cost(design) == pytest.approx(sum(source.cost for source in space.errors.active) / scale)


def alternatives(source, factor: float) -> tuple[Process, ...]:
    zone = source.zone
    coarse = Process(name="turned", cost=Reciprocal(factor=source.cost * zone), minimum=zone / 2, maximum=2 * zone)
    fine = Process(name="ground", cost=Reciprocal(factor=factor * zone), minimum=zone / 10, maximum=zone, change=1.0)
    return coarse, fine


def with_alternatives(prepared, group: str, factor: float):
    members = [source for source in prepared.space.errors.active if source.group == group]
    return replace(prepared.space, processes={source.name: alternatives(source, factor) for source in members}), members


def test_a_group_is_made_by_the_cheapest_process_that_all_its_members_have(prepared):
    space, members = with_alternatives(prepared, "disc bores", 0.1)
    at, cost = space.groups.index("disc bores"), sum(member.cost for member in members)
    assert [made.name for made in space.features[at].processes] == ["turned", "ground"]
    designs = np.tile(space.uniform(1.0), (4, 1))
    designs[:, at] = [0.2, 0.5 - 1e-12, 0.9, 1.9]  # the second is turned but for rounding, and that is cheaper
    ground = len(members) * (1 + 0.1 / designs[:, at])
    own = np.array([ground[0], min(ground[1], cost / 0.5), min(ground[2], cost / 0.9), cost / 1.9])
    assert space.process_names(designs[0])[at] == "ground"
    assert space.process_names(designs[3])[at] == "turned"
    np.testing.assert_allclose(space.cost(designs) - space.cost(designs)[0], own - own[0], atol=1e-9)


def test_members_without_a_common_process_are_refused(prepared):
    first, second, *_ = [source for source in prepared.space.errors.active if source.group == "disc bores"]
    coarse, fine = alternatives(first, 0.5)
    bores = [source for source in prepared.space.errors.active if source.group == "disc bores"]
    known = {source.name: (fine,) for source in bores}
    with pytest.raises(InputError, match=rf"no process in common \({first.name} turned; {second.name} ground; "):
        replace(prepared.space, processes={**known, first.name: (coarse,)})
    del known[second.name]
    with pytest.raises(InputError, match=rf"group disc bores: .* has no row for {second.name}, .* for all members or"):
        replace(prepared.space, processes=known)


@pytest.mark.slow
def test_gradient_of_the_quantile_agrees_with_common_random_numbers(prepared):
    """Mean + κσ of the same 1,152 units at zones and clearances moved by 2 %, against the exact gradient.

    Second order and switching contacts leave up to 6 % of the largest component.
    """
    space, verifier = prepared.space, verifier_of(prepared)
    verifier = replace(verifier, requirements=(replace(verifier.requirements[0], guarantee=AtYield(target=0.95)),))
    design = space.uniform(0.6)
    here = verifier.verify(design, "gradient")
    stack = here.constraints[0].stack
    gradient = np.append(stack.root_sum_square**2 * design[:-2], stack.slopes)
    gradient[:-2] /= np.sqrt((stack.root_sum_square**2 * design[:-2] ** 2).sum())
    checked, differences = np.r_[0 : design.size - 2 : 3, design.size - 2, design.size - 1], []
    for at in checked:
        values = []
        for sign in (1, -1):
            moved = design.copy()
            moved[at] *= 1 + 0.02 * sign
            sample = verifier.verify(moved, "gradient").sample.values
            values.append(sample.mean() + here.spread * sample.std(ddof=1))
        differences.append((values[0] - values[1]) / (0.04 * design[at]))
    scale = np.abs(gradient[:-2]).max()
    np.testing.assert_allclose(gradient[checked[:-2]], np.maximum(differences[:-2], 0), atol=0.06 * scale)
    np.testing.assert_allclose(gradient[-2:], differences[-2:], atol=0.06 * np.abs(gradient[-2:]).max())


@pytest.fixture(scope="module")
def three(prepared):
    """A design verified against three requirements, and who judged it."""
    verifier = verifier_of(
        prepared,
        Requirement(output=LOST_MOTION, limits=Limits(upper=0.45), guarantee=AtYield(target=0.99)),
        Requirement(output=RADIAL, limits=Limits(lower=2.0, upper=30.0), guarantee=AtCpk(target=1.0)),
    )
    return verifier, verifier.verify(prepared.space.uniform(0.5), "three")


@pytest.mark.slow
def test_the_joint_yield_is_that_of_all_limits(three):
    _, found = three
    kept = (found.outputs[PEAK_TO_PEAK] <= 60) & (found.outputs[LOST_MOTION] <= 0.45)
    kept &= (found.outputs[RADIAL] >= 2) & (found.outputs[RADIAL] <= 30)
    assert found.joint.rejected == np.count_nonzero(~kept)
    assert found.joint.estimate <= found.achieved.estimate
    assert [side.sign for side in found.constraints] == [1, 1, 1, -1]


@pytest.mark.slow
def test_a_clearance_moves_the_radial_clearance_one_to_one(three):
    _, found = three
    upper, lower = found.constraints[2:]
    np.testing.assert_allclose(upper.stack.slopes, [0.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(lower.stack.slopes, [0.0, -1.0], atol=1e-6)


@pytest.mark.slow
def test_a_requirement_more_changes_no_number_of_the_peak_to_peak(three, prepared):
    verifier, found = three
    alone = replace(verifier, requirements=verifier.requirements[:1]).verify(found.design, "three")
    np.testing.assert_array_equal(alone.sample.values, found.sample.values)
    assert alone.constraints[0].value == found.constraints[0].value


@pytest.mark.slow
def test_a_step_keeps_every_local_model_and_the_region(three):
    verifier, found = three
    stacks = aimed(found, [found])
    processes = verifier.space.process_positions(found.design)
    programs = Programs(verifier.space)
    step = programs.cheapest(stacks, processes, programs.box(processes, found.design, 2.5))
    assert max(stack.load(step[:-2], step[-2:]) - stack.budget for stack in stacks) < 1e-6
    assert (step <= found.design * 2.5 * (1 + 1e-9)).all()
    assert step[-1] > found.design[-1]  # 8 µm are too few for a radial clearance above 2 µm


@pytest.mark.slow
def test_processes_change_only_where_that_clearly_pays(three, prepared):
    _, found = three
    stacks = aimed(found, [found])
    for factor, change in ((0.01, True), (10.0, False)):
        space, _ = with_alternatives(prepared, "housing pitch", factor)
        programs, present = Programs(space), np.zeros(len(space.groups), dtype=int)
        chosen = programs.choose(stacks, present)
        assert bool((chosen != present).any()) == change
        kept = programs.of(present, 4).solve(stacks)
        assert programs.of(chosen, 4).solve(stacks).cost <= kept.cost


@pytest.mark.slow
def test_locked_clearances_stay(three, prepared):
    _, found = three
    settings = zip(prepared.space.settings, found.settings, strict=True)
    locked = replace(prepared.space, settings=tuple(replace(own, lower=at, upper=at) for own, at in settings))
    stacks = aimed(found, [found])
    programs, processes = Programs(locked), locked.process_positions(found.design)
    step = programs.cheapest(stacks, processes, programs.box(processes, found.design, 2.5))
    np.testing.assert_allclose(step[-2:], found.design[-2:], rtol=1e-12)


@pytest.mark.slow
def test_no_random_unit_is_worse_than_the_worst_case(prepared):
    requirement = Requirement(output=RADIAL, limits=Limits(lower=-20.0), guarantee=WorstCase())
    verifier = verifier_of(prepared, requirement)
    verifier = replace(verifier, requirements=(replace(verifier.requirements[0], guarantee=WorstCase()), requirement))
    found = verifier.verify(prepared.space.uniform(0.5), "worst")
    assert found.constraints[0].value > found.outputs[PEAK_TO_PEAK].max()
    assert found.constraints[1].value < found.outputs[RADIAL].min()
    for side in found.constraints:
        assert side.predicted(found.design) == pytest.approx(side.excess)
        assert (side.stack.root_sum_square == 0).all()
        assert (side.stack.worst_case > 0).any()


@pytest.mark.slow
def test_an_unreachable_limit_is_a_result_that_says_what_blocks(prepared):
    verifier = verifier_of(prepared, limit=8.0)
    by_hand = scale_in_proportion(verifier, 2)
    found = allocate(verifier, by_hand, SearchEffort(steps=2))
    assert not found.chosen.met
    assert found.chosen.blocking.requirement.output == PEAK_TO_PEAK
    assert found.chosen.blocking.slack == pytest.approx(8.0 - found.chosen.quantile_bound)
    assert found.chosen.quantile_bound < found.baseline.quantile_bound
    assert found.gap >= -1e-9


@pytest.mark.slow
def test_the_bound_and_the_price_are_those_of_the_chosen_models(prepared):
    verifier = verifier_of(prepared)
    found = allocate(verifier, scale_in_proportion(verifier, 2), SearchEffort(steps=2))
    assert found.chosen.met
    # The errors of so few units leave the bound below the cheapest design of the models themselves.
    assert found.bound < found.optimum.bound
    assert found.gap < 0.5
    name, price = next(iter(found.prices.items()))
    assert name == f"{PEAK_TO_PEAK}, upper limit"
    assert 0.1 < price < 10
    assert found.optimum.bound_prices.min() >= -1e-6
    assert found.optimum.cost <= found.inside.cost
    first, *others = kept_stacks(found.chosen, found.tried, margin=0.0)
    change = 0.001 * found.limit
    tight, asked, wide = (
        process_choice.allocate(verifier.space.problem((replace(first, budget=first.budget + by), *others)))
        for by in (-change, 0.0, change)
    )
    assert asked.cost == pytest.approx(found.optimum.cost, rel=1e-6)
    assert asked.bound == pytest.approx(asked.cost, rel=1e-6)
    assert price == pytest.approx((tight.cost - wide.cost) / (2 * change), rel=0.01)

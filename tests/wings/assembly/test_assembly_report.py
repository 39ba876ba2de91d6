"""Sentences, tables and figures of the report on an assembly: a real run without a reducer, and made-up curves."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tests.builders import headed, says, telling, wording, written
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import OUTCOMES
from tolalloc.reducers.equivalent.outputs import ContactPattern
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.columns import of_positions
from tolalloc.reports.figure import chart
from tolalloc.reports.header import Header
from tolalloc.running.progress import RunRecord, Silent
from tolalloc.study.answer import Answer
from tolalloc.wings.assembly.adjustment import AssemblyRequest, AssemblyResult, assemble
from tolalloc.wings.assembly.files import load_plan
from tolalloc.wings.assembly.gains import assembled, tuned_gains
from tolalloc.wings.assembly.orientations import TRANSMISSION, TransmissionCurves, TransmissionEffect
from tolalloc.wings.assembly.steps import Efforts, steps_in_order
from tolalloc.wings.assembly.telling import tables, transmission
from tolalloc.wings.assembly.telling import tolerances as tolerance_tables
from tolalloc.wings.assembly.telling.assembly import AssemblyTeller, plan_record
from tolalloc.wings.assembly.telling.tables import characteristic_table, larger
from tolalloc.wings.assembly.trajectory import random_numbers

pytestmark = pytest.mark.slow  # an assembly with all of its efforts is made first, and read by all

CHAIN = """
name = "pump"
source = "own"
datum = "base"
precision = 5
adjust = "mounted"
measure = "current"
assumptions = ["the base is rigid"]

[noise]
measurement_arcsec = 2
adjustment_arcsec = 1

[[part]]
name = "bracket"
on = "base"
tolerance_arcsec = [60, 60, 60]
tilt_limit_arcsec = 25
cost = { form = "reciprocal", factor = [100, 100, 50] }

[[part]]
name = "rotor"
on = "bracket"
turned_deg = [0, 0, 90]
tolerance_arcsec = [40, 40, 40]
rotation_limit_arcsec = 15
cost = { form = "reciprocal", factor = [70, 70, 90] }

[[part]]
name = "cover"
on = "base"
tolerance_arcsec = [30, 30, 30]
cost = { form = "reciprocal", factor = [10, 10, 10] }

[tolerances]
smallest_arcsec = 3
largest_arcsec = 120
effort_price = 0.02
"""
ERRORS = ARCSECOND * np.array([[70.0, -20, 10], [-30, 15, 0], [5, 25, -12]])


def run(plan, errors=None) -> AssemblyResult:
    request = AssemblyRequest(plan=plan, name="seven", errors=errors, assemblies=2000)
    return assemble(request, RunRecord(Silent(), OUTCOMES))


def answer(results: AssemblyResult) -> Answer[AssemblyResult]:
    header = Header(name=results.plan.name, model="", seed=1, assumptions=results.plan.assumptions)
    return Answer(kind="assembly", header=header, result=results, told_by=AssemblyTeller)


def warnings(results: AssemblyResult) -> tuple[str, ...]:
    return answer(results).warnings


def assumptions(results: AssemblyResult) -> tuple[str, ...]:
    return answer(results).assumptions


def summary(results: AssemblyResult) -> dict:
    return answer(results).summary


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    return load_plan(written(tmp_path_factory.mktemp("chain") / "pump.chain.toml", CHAIN))


@pytest.fixture(scope="module")
def expected(plan) -> AssemblyResult:
    return run(plan)


@pytest.fixture(scope="module")
def measured(plan) -> AssemblyResult:
    return run(plan, ERRORS)


def curves(samples: int) -> TransmissionCurves:
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    wave = np.tile(np.sin(40 * angle), (samples, 1))
    return TransmissionCurves(
        carrier_angle=angle,
        transmission_error=wave * ARCSECOND,
        pin_force=2 + wave,
        disc_force=2 + wave,
        line_load=2 + wave,
        pressure=2 + wave,
        pins_in_contact=2 + wave,
        status=np.zeros((samples, 200), dtype=np.uint8),
    )


def pattern(largest: float) -> ContactPattern:
    force = largest * np.array([0.0, 0.4, 1.0, 0.0])
    along = force[:, np.newaxis] * np.ones(41)
    return ContactPattern(
        disc=2,
        carrier_angle=1.0,
        position=np.linspace(-6e-3, 6e-3, 41),
        force=force,
        deformation=1e-9 * force,
        line_load=1e3 * along,
        pressure=1e6 * along,
    )


def effect(samples: int) -> TransmissionEffect:
    """Return made-up answers at Q = 0 and 5: the line load halves, both peak-to-peaks rise, one not in the last."""
    outputs = tuple(name for reading in TRANSMISSION for name in reading.outputs)
    values = np.ones((2, samples, len(outputs)))
    values[0, :, outputs.index(transmission.LINE_LOAD)] = 400.0
    values[1, :, outputs.index(transmission.LINE_LOAD)] = 200.0
    values[1, :, outputs.index(transmission.PEAK_TO_PEAK)] = 3.0
    values[1, -1, outputs.index(transmission.PEAK_TO_PEAK)] = 3.0 if samples == 1 else 0.5
    values[1, :, outputs.index(transmission.RATED_PEAK_TO_PEAK)] = 2.0
    return TransmissionEffect(
        reducer=load_reducer("bx40e"),
        test_torque=-1.0,
        state_weights=np.array([0.0, 5.0]),
        outputs=outputs,
        perfect=np.full(len(outputs), 0.8),
        values=values,
        good=np.ones(samples, dtype=bool),
        perfect_curves=curves(1),
        curves=curves(2),
        patterns=(pattern(400.0), pattern(200.0)),
    )


def said(results: AssemblyResult) -> str:
    return " ".join(answer(results).sentences)


@pytest.mark.slow
def test_the_norm_of_measured_parts_is_said_before_and_after(measured):
    before, after = measured.measured.norms[[0, tables.at_state_weight(measured)]] / ARCSECOND
    assert np.linalg.norm(measured.measured.unadjusted) / ARCSECOND == pytest.approx(before)
    assert np.linalg.norm(measured.measured.adjusted) / ARCSECOND == pytest.approx(after)
    assert says(said(measured), "assembly.norm", before=before, after=after)


@pytest.mark.slow
def test_a_weighted_norm_is_called_so(plan):
    assert "weighted norm" in said(run(replace(plan, weights=np.array([1.0, 2.0, 1.0])), ERRORS))


@pytest.mark.slow
def test_what_is_to_be_expected_is_said_with_the_noise(expected):
    sweep, at = expected.sweep, tables.at_state_weight(expected)
    before, after, floor = (value / ARCSECOND for value in (sweep.total[0], sweep.total[at], sweep.noise_floor))
    sentence = answer(expected).sentences[0]
    assert says(sentence, "assembly.expected", before=before, after=after, precision=5.0, floor=floor)
    assert "noise" not in sentence


def text(results: AssemblyResult, heading: str) -> str:
    return " ".join(headed(answer(results).document.sections, f"assembly.{heading}_heading").paragraphs)


def test_where_another_unit_of_precision_buys_little_is_said(expected):
    found = expected.sweep.diminished()
    assert says(said(expected), "assembly.diminished", found=found, little=0.01)


def test_a_sweep_that_does_not_reach_diminishing_returns_says_so(expected):
    sweep = replace(expected.sweep, next_unit=np.full_like(expected.sweep.next_unit, 0.25))
    assert says(said(replace(expected, sweep=sweep)), "assembly.not_diminished", share=0.25)


@pytest.mark.slow
def test_the_line_load_is_said_with_perfect_parts(measured):
    sentences = said(replace(measured, transmission=effect(1)))
    change = wording("assembly.change", before=400.0, after=200.0, unit="N/mm", perfect=0.8)
    assert says(sentences, "assembly.line_load", change=change)
    test, rated = (
        wording("assembly.change", before=1.0, after=value, unit="arcsec", perfect=0.8) for value in (3.0, 2.0)
    )
    assert says(sentences, "assembly.transmission", torque=-1.0, test=test, rated=rated)


def test_random_assemblies_are_counted(expected):
    sentences = said(replace(expected, transmission=effect(10)))
    of_all = {"perfect": 0.8, "many": 10}
    loads = wording("assembly.change_of_many", before=400.0, after=200.0, unit="N/mm", smaller=10, **of_all)
    assert says(sentences, "assembly.line_load_of_many", many=10, change=loads)
    assert says(sentences, "assembly.change_of_many", before=1.0, after=3.0, unit="arcsec", smaller=1, **of_all)


def test_costs_are_said_with_and_without_adjusting(expected):
    tolerances = expected.tolerances
    without = wording("assembly.cost_unadjusted", total=tolerances.unadjusted.total)
    gaps = {"total": tolerances.adjusted.total, "precision": 5.0, "without": without}
    assert says(said(expected), "assembly.cost_adjusted", **gaps)


def test_limits_out_of_reach_without_adjusting_are_said_and_warned_of(expected):
    without = replace(expected, tolerances=replace(expected.tolerances, unadjusted="pump: too wide."))
    assert says(said(without), "assembly.no_tolerances_unadjusted")
    assert wording("assembly.warn_unadjusted", why="pump: too wide.") in warnings(without)
    assert "unadjusted, ± [arcsec]" not in tolerance_tables.tolerance_table(without.plan, without.tolerances)


def test_the_gain_of_a_tuned_filter_is_said_with_the_reach_of_its_proof(expected):
    tolerances = expected.tolerances
    saving = 1 - tolerances.retuned.best.total / tolerances.adjusted.total
    assert saving > 0
    assert says(said(expected), "assembly.cost_retuned", total=tolerances.retuned.best.total, less=saving)
    assert says(warnings(expected), "assembly.warn_retuned")


def test_the_share_of_random_assemblies_within_all_limits_is_said(expected):
    share = expected.tolerances.verification.share
    best = expected.tolerances.verified.gains.state_weight
    which = wording("assembly.of_best", precision=best)
    assert expected.tolerances.verified is expected.tolerances.by_state_weight.best
    assert says(said(expected), "assembly.verified", assemblies=2000, which=which, share=share.estimate)


@pytest.mark.slow
def test_the_tolerances_of_the_tuned_filter_are_verified_where_effort_has_no_price(plan):
    free = run(replace(plan, requirements=replace(plan.requirements, effort_price=0.0)))
    assert says(said(free), "assembly.verified", which=wording("assembly.of_retuned", precision=5.0))
    assert "verified, re-tuned, 3σ [arcsec]" in tolerance_tables.limit_table(free.plan, free.tolerances)
    assert says(text(free, "tolerances"), "assembly.section_verified", which="re-tuned")


def test_a_filter_that_gains_nothing_when_tuned_has_no_row_and_no_column(expected):
    first = replace(expected.tolerances.retuned, allocations=(expected.tolerances.adjusted,))
    same = replace(expected, tolerances=replace(expected.tolerances, retuned=first, verified=first.best))
    assert says(said(same), "assembly.nothing_retuned")
    assert says(said(same), "assembly.verified", which=wording("assembly.of_adjusted", precision=5.0))
    document = answer(same).document
    assert "re-tuned" not in " ".join([*document.warnings, *document.answer])
    for _, frame in document.sections[-1].tables:
        assert not any("re-tuned" in column for column in frame.columns)
        assert "re-tuned" not in frame.get("allocation", pd.Series(dtype=object)).tolist()


def test_steps_that_turn_parts_that_are_not_there_are_warned_of(expected, plan):
    everything = steps_in_order(plan.chain, "all", "current", Efforts())
    warned = wording("assembly.warn_not_there", steps="1, 2")
    assert warned in warnings(run(replace(plan, steps=everything, requirements=None)))
    assert warned not in warnings(expected)


@pytest.mark.slow
def test_the_best_precision_is_said_only_where_effort_has_a_price(expected, plan):
    best = expected.tolerances.by_state_weight.best
    assert f"Q = {best.gains.state_weight:.4g}" in said(expected)
    assert "best precision" in set(tolerance_tables.certificate_table(plan, expected.tolerances)["allocation"])
    free = run(replace(plan, requirements=replace(plan.requirements, effort_price=0.0)))
    assert not says(said(free), "assembly.cost_best")
    assert "best precision" not in set(tolerance_tables.certificate_table(free.plan, free.tolerances)["allocation"])


@pytest.mark.slow
def test_parts_beyond_their_tolerance_are_named_and_no_others(measured):
    beyond = wording("assembly.beyond", part="bracket", axis="x", error=70.0, tolerance=60.0)
    assert wording("assembly.warn_beyond", parts=beyond) in warnings(measured)


@pytest.mark.slow
def test_a_part_at_its_tolerance_is_not_beyond_it(plan):
    assert not says(warnings(run(plan, plan.tolerances)), "assembly.warn_beyond")


def test_missed_limits_are_named(expected):
    tight = replace(expected.plan.requirements, tilt_limit=ARCSECOND * np.array([1.0, np.inf, np.inf]))
    warned = warnings(replace(expected, plan=replace(expected.plan, requirements=tight)))
    missed = telling(warned, "assembly.warn_missed")
    assert says(missed, "assembly.limited", angle="tilt", part="bracket", limit=1.0)
    assert not says(warnings(expected), "assembly.warn_missed")


@pytest.mark.slow
def test_a_characteristic_that_rises_is_named(measured):
    assert not larger(measured)
    swapped = replace(measured.measured, unadjusted=measured.measured.adjusted / 2)
    warned = warnings(replace(measured, measured=swapped))
    assert "tilt of bracket (" in telling(warned, "assembly.warn_larger")


def test_assemblies_without_equilibrium_are_counted(expected):
    made = effect(10)
    lost = replace(made, good=np.arange(10) > 0)
    assert wording("assembly.warn_failed", failed=1) in warnings(replace(expected, transmission=lost))
    assert transmission.answers(lost, transmission.LINE_LOAD).shape == (2, 9)


@pytest.mark.slow
def test_turning_as_listed_gives_what_is_said_to_be_left(measured):
    frame, plan = tables.step_table(measured), measured.plan
    state = np.zeros(9)
    for number, step in enumerate(plan.steps):
        state = state + plan.space.entering[number] @ ERRORS.ravel() / ARCSECOND
        rows = frame[frame["step [-]"] == number + 1]
        assert set(rows["mount"]) == {step.mount}
        for part, *turn in rows[["turn", "x [arcsec]", "y [arcsec]", "z [arcsec]"]].itertuples(index=False):
            first = 3 * plan.chain.names.index(part)
            state = state + plan.chain.transform[:, first : first + 3] @ np.array(turn)
        for part, tilt, rotation in rows[["turn", "tilt left [arcsec]", "rotation left [arcsec]"]].itertuples(
            index=False
        ):
            x, y, z = state.reshape(-1, 3)[plan.chain.names.index(part)]
            # Every turn is rounded to 0.005″, and up to nine of them add up.
            assert (tilt, rotation) == pytest.approx((np.hypot(x, y), z), abs=0.1)


def test_expected_turns_have_the_effort_that_is_expected(expected):
    turned = tables.turns(expected).reshape(3, -1) / 3
    effort = (expected.plan.space.effort * turned**2).sum()
    assert effort == pytest.approx(expected.sweep.effort[tables.at_state_weight(expected)])


def test_the_last_step_leaves_what_the_sweep_says(expected):
    tilt, rotation = tables.tilt_and_rotation(expected.expected[-1, 1])
    at = tables.at_state_weight(expected)
    np.testing.assert_allclose(tilt, expected.sweep.tilt[at])
    np.testing.assert_allclose(rotation, expected.sweep.rotation[at])


def test_noise_alone_is_what_perfect_parts_are_left_with(expected, plan):
    noise = characteristic_table(expected)["noise, 3σ [arcsec]"].to_numpy()
    # A filter that expects the stated tolerances, on parts that have none.
    drawn = assembled(
        plan, tuned_gains(plan, 5.0, plan.tolerances), 0 * plan.tolerances, np.eye(random_numbers(plan.space))
    )
    tilt, rotation = tables.tilt_and_rotation(3 * np.sqrt((drawn.adjusted[:, -1] ** 2).sum(axis=0)) / ARCSECOND)
    np.testing.assert_allclose(noise, [*tilt, *rotation])
    assert (noise < characteristic_table(expected)["after, 3σ [arcsec]"]).all()


def test_costs_of_single_tolerances_add_up(expected):
    frame = tolerance_tables.tolerance_table(expected.plan, expected.tolerances)
    assert frame["cost adjusted [cost units]"].sum() == pytest.approx(expected.tolerances.adjusted.cost)


def test_a_part_without_a_limit_is_neither_kept_nor_missed(expected):
    frame = characteristic_table(expected)
    free = frame["limit [arcsec]"].isna()
    assert free.sum() == 4
    assert set(frame.loc[free, "OK"]) == {""} and set(frame.loc[~free, "OK"]) == {"yes"}


def limited(results: AssemblyResult, limit: float) -> AssemblyResult:
    """Return measured parts of which only the tilt of the bracket is limited [arcsec]."""
    free = np.full(3, np.inf)
    asked = replace(
        results.plan.requirements, tilt_limit=np.array([limit * ARCSECOND, np.inf, np.inf]), rotation_limit=free
    )
    return replace(results, plan=replace(results.plan, requirements=asked))


@pytest.mark.slow
def test_a_limit_is_in_doubt_where_what_the_turns_miss_reaches_beyond_it(measured):
    missed = replace(measured.measured, missed=ARCSECOND * np.array([[1.0, 2.0, 0.5], [0, 0, 0], [0, 0, 0]]))
    known = replace(measured, measured=missed)
    after = np.hypot(*missed.adjusted[0, :2]) / ARCSECOND
    for limit, word in ((after + 6.001, "yes"), (after + 5.999, "in doubt"), (after - 0.001, "no")):
        asked = limited(known, float(limit))
        row = characteristic_table(asked).iloc[0]
        assert (row["OK"], row["turns miss, 3σ [arcsec]"]) == (word, 6.0)
        told = {"angle": "tilt", "part": "bracket", "after": after, "missed": 6.0}
        assert says(warnings(asked), "assembly.limited_measured", **told) == (word != "yes")
        assert says(warnings(asked), "assembly.warn_doubted") == (word == "in doubt")


@pytest.mark.slow
def test_measured_parts_that_miss_limits_are_told_what_keeps_them(measured):
    asked = limited(measured, 0.01)
    keeping = replace(asked, measured=replace(asked.measured, keeping=446.68))
    assert says(warnings(keeping), "assembly.keeping", precision=446.68)
    never = replace(asked, measured=replace(asked.measured, keeping=None))
    assert says(warnings(never), "assembly.never_keeping")
    assert summary(keeping)["measured"]["smallest precision tried that keeps all limits [-]"] == 446.68


@pytest.mark.slow
def test_an_output_that_rises_is_warned_of_with_a_reason(measured):
    (warning,) = [each for each in warnings(replace(measured, transmission=effect(1))) if "N·m" in each]
    risen = (
        "peak-to-peak transmission error at -1 N·m (1 → 3 arcsec)",
        "peak-to-peak transmission error, rated torque (1 → 2 arcsec)",
    )
    why = wording("assembly.why_larger")
    assert warning == wording("assembly.warn_risen", outputs=", ".join(risen), why=why)
    assert why in text(replace(measured, transmission=effect(1)), "transmission")


@pytest.mark.slow
def test_an_output_that_falls_is_not_warned_of(measured):
    fallen = replace(effect(1), values=effect(1).values[[1, 0]])
    found = warnings(replace(measured, transmission=fallen))
    assert any("largest line load, rated torque (200 → 400 N/mm)" in warning for warning in found)
    assert not any("peak-to-peak" in warning for warning in found)


def test_turning_fewer_parts_is_advised_only_where_it_leaves_less(expected):
    total = expected.sweep.total[tables.at_state_weight(expected)]
    better, worse = (warnings(replace(expected, fewer=float(factor * total))) for factor in (0.5, 1.5))
    gaps = {"fewer": total / 2 / ARCSECOND, "total": total / ARCSECOND, "noise": 1.0}
    assert wording("assembly.warn_fewer_noise", **gaps) in better
    for key in ("assembly.warn_fewer", "assembly.warn_fewer_noise"):
        assert not says(worse + warnings(replace(expected, fewer=None)), key)


def test_what_a_larger_precision_buys_is_said_of_the_sweep_itself(expected):
    def told(results: AssemblyResult, key: str, **gaps: object) -> bool:
        return says(text(results, "sweep"), f"assembly.{key}", **gaps)

    sweep = replace(
        expected.sweep,
        total=np.linspace(3, 2, expected.sweep.total.size) * ARCSECOND,
        next_unit=np.linspace(0.5, 0.001, expected.sweep.total.size),
    )
    falling = replace(expected, sweep=sweep)
    assert told(falling, "bought") and told(falling, "each_less")
    uneven = replace(falling, sweep=replace(sweep, next_unit=sweep.next_unit[::-1]))
    assert told(uneven, "bought") and not told(uneven, "each_less")
    total = sweep.total.copy()
    total[3] = ARCSECOND
    rising = replace(expected, sweep=replace(sweep, total=total))
    assert not told(rising, "bought")
    assert told(rising, "bought_least", precision=sweep.state_weights[3], least=1.0)
    assert told(expected, "section_sweep", precision=5.0, rose="none", all=6, are="are")


def test_a_unit_of_precision_that_adds_is_not_said_to_take_off(expected):
    sweep = replace(expected.sweep, next_unit=np.full_like(expected.sweep.next_unit, -0.2))
    added = said(replace(expected, sweep=sweep))
    assert says(added, "assembly.diminished", found=0.0, little=0.01)
    assert says(added, "assembly.adds", precision=0.0)
    slowly = replace(sweep, next_unit=-sweep.next_unit * 0.01)
    assert not says(said(replace(expected, sweep=slowly)), "assembly.adds")


@pytest.mark.slow
def test_of_weighted_angles_only_the_weighted_norm_is_said_to_fall(plan):
    errors = ARCSECOND * np.array([[50.0, 0, 10], [0, 50, 0], [5, 25, -12]])
    weighted = run(replace(plan, weights=np.array([1.0, 2.0, 1.0])), errors)
    paragraphs = answer(weighted).document.sections[0].paragraphs
    assert says(paragraphs, "assembly.section_larger", norm="weighted norm")


@pytest.mark.slow
def test_turns_of_measured_parts_come_from_the_file(measured, expected):
    assert "measure" not in tables.step_table(measured) and "measure" in tables.step_table(expected)
    for results, read in ((measured, ""), (expected, "then measured, ")):
        assert says(text(results, "steps"), "assembly.section_steps", measured=read)


def test_the_summary_holds_all_that_was_asked(expected):
    asked = summary(expected)["plan"]
    assert asked["measurement noise, σ [arcsec]"] == 2 and asked["adjustment noise, σ [arcsec]"] == 1
    assert asked["precision [-]"] == 5 and asked["datum"] == "base" and asked["reducer"] is None
    assert asked["parts"][1] == {
        "part": "rotor",
        "on": "bracket",
        "turned [deg]": [0, 0, 90],
        "position [mm]": [0, 0, 0],
        "tilts": [],
        "rotates": [],
        "tolerance, ± [arcsec]": [40, 40, 40],
        "weight [-]": 1,
        "tilt limit, 3σ [arcsec]": None,
        "rotation limit, 3σ [arcsec]": 15,
        "cost factor [cost units·arcsec]": [70, 70, 90],
        "cost fixed [cost units]": [0, 0, 0],
    }
    assert asked["steps"][1] == {
        "step [-]": 2,
        "mount": "rotor",
        "effort of what may be turned [-]": {"bracket": 10, "rotor": 1},
        "measure": ["rotor"],
    }
    assert asked["tolerances"] == {
        "smallest [arcsec]": 3,
        "largest [arcsec]": 120,
        "cost form": "reciprocal",
        "effort price [cost units/arcsec²]": 0.02,
    }
    assert asked["assumptions"] == ["the base is rigid"]


def test_costs_that_are_no_reciprocals_keep_their_scale(plan):
    scale = ARCSECOND * np.full((3, 3), 20.0)
    asked = replace(plan.requirements, form="exponential", factor=np.full((3, 3), 7.0), scale=scale)
    part = plan_record(replace(plan, requirements=asked))["parts"][0]
    assert part["cost factor [cost units]"] == [7, 7, 7] and part["cost scale [arcsec]"] == [20, 20, 20]


@pytest.mark.slow
def test_digits_that_mean_nothing_are_cut(measured, expected):
    columns = {"name": ["a"] * 4, "x": [-4.4e-17, -0.0, 13.999999999999998, 1.5e-12]}
    frame = tables.rounded(of_positions("digits", columns, range(4)))
    assert list(map(repr, frame["x"].tolist())) == ["0.0", "0.0", "14.0", "0.0"]
    for results, samples in ((measured, 1), (expected, 10)):
        for section in answer(replace(results, transmission=effect(samples))).document.sections:
            for name, table in section.tables:
                for column in table.select_dtypes("float"):
                    values = table[column].dropna().to_numpy()
                    assert (values == np.round(values, 6)).all(), (name, column)
                    assert not (np.signbit(values) & (values == 0)).any(), (name, column)


def test_without_limits_nothing_is_said_of_tolerances(expected):
    free = np.full(3, np.inf)
    asked = replace(expected.plan.requirements, tilt_limit=free, rotation_limit=free)
    unlimited = replace(expected, plan=replace(expected.plan, requirements=asked))
    document = answer(unlimited).document
    assert not says((section.heading for section in document.sections), "assembly.tolerances_heading")
    assert "cost units" not in " ".join(document.answer)
    assert document.summary["tolerances"] is None
    assert wording("assembly.warn_unlimited") in document.warnings
    assert "OK" not in characteristic_table(unlimited)


@pytest.mark.parametrize("errors", [None, ERRORS])
def test_limits_that_no_tolerances_keep_leave_everything_else(plan, errors):
    tight = replace(plan.requirements, tilt_limit=ARCSECOND * np.array([0.2, np.inf, np.inf]))
    document = answer(run(replace(plan, requirements=tight), errors)).document
    assert says(document.warnings, "assembly.warn_unreachable", why="pump: ")
    assert not says((section.heading for section in document.sections), "assembly.tolerances_heading")
    json.dumps(document.summary, allow_nan=False)


def test_what_is_drawn_over_the_precision_is_computed():
    outputs = {name for reading in TRANSMISSION for name in reading.outputs}
    assert set(transmission.DRAWN.values()) <= outputs


def test_differences_from_exact_parts_are_in_percent():
    frame = transmission.difference_table(effect(1))
    assert frame["largest line load, rated torque, above exact parts [%]"].tolist() == pytest.approx(
        [100 * (400 / 0.8 - 1), 100 * (200 / 0.8 - 1)]
    )


@pytest.mark.slow
@pytest.mark.parametrize("samples", [1, 10])
def test_every_number_has_its_unit_and_every_figure_is_drawn(expected, measured, samples):
    document = answer(replace(measured if samples == 1 else expected, transmission=effect(samples))).document
    for section in document.sections:
        for name, frame in section.tables:
            for column in frame.columns:
                if pd.api.types.is_numeric_dtype(frame[column]):
                    assert column.endswith("]"), (name, column)
        for figure in section.figures:
            assert chart(figure)["title"]
    json.dumps(document.summary, allow_nan=False)


@pytest.mark.slow
def test_only_pins_that_carry_are_shown(measured):
    figure = transmission.pressure_map(effect(1), 5.0)
    assert list(figure.rows) == ["Q = 0, pin 2", "Q = 0, pin 3", "Q = 5, pin 2", "Q = 5, pin 3"]
    assert figure.largest == pytest.approx(400.0)


def test_a_report_without_reducer_and_limits_leaves_their_sections_out(plan):
    document = answer(run(replace(plan, requirements=None))).document
    headings = [wording(f"assembly.{key}_heading") for key in ("steps", "sweep")]
    assert [section.heading for section in document.sections] == headings
    assert "the base is rigid" in document.assumptions


@pytest.mark.slow
def test_what_is_assumed_of_parts_is_said_of_those_that_are_measured(measured, expected):
    exactly = wording("assembly.assume_measured")
    assert exactly in assumptions(measured)
    assert exactly not in assumptions(expected)


@pytest.mark.slow
def test_a_single_angle_that_rises_is_counted(plan):
    # The rotor's own error, about axes turned by 90°, cancels what the bracket hands on about x.
    results = run(plan, ARCSECOND * np.array([[50.0, 0, 10], [0, 50, 0], [5, 25, -12]]))
    paragraphs = " ".join(answer(results).document.sections[0].paragraphs)
    found = results.measured
    rose = int((np.abs(found.adjusted) > np.abs(found.unadjusted)).sum())
    assert rose > 0
    assert says(paragraphs, "assembly.section_larger", rose=rose, angles=9)


@pytest.mark.slow
def test_finite_rotations_are_compared(measured):
    apart = summary(measured)["measured"]["largest difference by finite rotations [arcsec]"]
    assert 0 < apart < 0.1  # products of angles of some 70″

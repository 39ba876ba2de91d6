"""What few measured parts leave open: tolerance limits from tables, coverage of what is promised, and sentences."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.special import ndtr

import tolalloc as ta
from tests.builders import measured_size, says, verifier_of_sum
from tolalloc.allocation.space.requirement import AtCpk, AtYield
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import ProcessUncertainty, proportion
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.zones import Feature

TARGET, LIMIT = 0.9973, Limits(upper=4.0)
NORMAL = np.random.default_rng(1).standard_normal((30_000, 2))


def uncertainty_of_size(parts):
    """Return the uncertainty of an output that is one measured size of σ = 1."""
    return ProcessUncertainty.of(measured_size(parts), NORMAL[:, :1], NORMAL[:, 0])


def tolerance_limit(parts):
    """Return by how many s a normal sample's limit for a share lies above its mean, with 95 % confidence."""
    return float(stats.nct.ppf(0.95, parts - 1, stats.norm.ppf(TARGET) * np.sqrt(parts)) / np.sqrt(parts))


@pytest.mark.parametrize("parts", [20, 50, 200])
def test_margin_is_that_of_one_sided_tolerance_limits(parts):
    quantile = float(np.quantile(NORMAL[:, 0], TARGET))
    found = quantile + uncertainty_of_size(parts).margin(LIMIT, 1 - TARGET)
    # The quantile of 30,000 units has a standard error of 0.036.
    assert found == pytest.approx(tolerance_limit(parts), abs=0.08)
    assert uncertainty_of_size(20).with_parts(parts).margin(LIMIT, 1 - TARGET) == uncertainty_of_size(parts).margin(
        LIMIT, 1 - TARGET
    )


def test_margin_falls_as_one_over_the_root_of_the_parts():
    exact = [tolerance_limit(parts) - stats.norm.ppf(TARGET) for parts in (200, 3200)]
    assert exact[0] / exact[1] == pytest.approx(4.0, rel=0.08)  # what is of order 1/n makes it 4.27
    for margin in (
        lambda own: own.margin(LIMIT, 1 - TARGET),
        lambda own: own.margin_of_spread(1, stats.norm.ppf(TARGET)),
    ):
        found = [margin(uncertainty_of_size(parts)) for parts in (200, 3200)]
        assert found[0] / found[1] == pytest.approx(exact[0] / exact[1], rel=0.03)


def test_margin_with_two_limits_keeps_both_ends():
    one, both = uncertainty_of_size(50), Limits(lower=-4.0, upper=4.0)
    centred = one.margin(both, 1 - TARGET)
    moved, wider = one._moments
    exact = []
    for centre, spread in zip(moved[:500], wider[:500], strict=True):
        lengths = np.linspace(2.0, 7.0, 4000)
        beyond = stats.norm.sf((lengths - centre) / spread) + stats.norm.cdf((-lengths - centre) / spread)
        exact.append(float(lengths[np.argmax(beyond <= 1 - TARGET)]))
    found = one._excess(both, 1 - TARGET, (moved[:500], wider[:500])) + 4.0
    assert np.median(np.abs(found - exact)) < 0.08
    assert centred == pytest.approx(np.quantile(exact, 0.95) - 3.0, abs=0.12)


def test_radii_leave_their_spread_open_with_twice_as_many_degrees_and_no_mean():
    radii = np.hypot(*np.random.default_rng(4).normal(0.0, 1.0, (2, 30)))
    made = MeasuredParts(path=Path("p.csv"), values=tuple(radii), are_radii=True, zone=8.0, middle=0.0)
    source = replace(
        measured_size(30).sources[0], feature=Feature.POSITION, zone=8.0, minimum=0.8, maximum=80.0, measured=made
    )
    found = ProcessUncertainty.of(ErrorModel((source,)), NORMAL, NORMAL[:, 0]).margin(LIMIT, 1 - TARGET)
    wider = np.sqrt(60 / stats.chi2.ppf(0.05, 60))
    assert found == pytest.approx(np.quantile(NORMAL[:, 0], TARGET) * (wider - 1), rel=0.06)


BENT = {
    "range of twelve like sizes": lambda x: np.ptp(x[:, 2:], axis=1),
    "length of a position": lambda x: np.hypot(x[:, 0], x[:, 1]),
    "product": lambda x: (5.0 + x[:, 2]) * (5.0 + x[:, 3:].mean(axis=1)),
}


@pytest.mark.parametrize("name", BENT)
def test_margin_of_bent_outputs_is_near_that_of_processes_that_are_drawn_again(name):
    generator, parts = np.random.default_rng(12), 20
    radii = np.hypot(*generator.normal(size=(2, parts)))
    radii /= np.sqrt((radii**2).mean() / 2)
    made = MeasuredParts(path=Path("p"), values=tuple(radii), are_radii=True, zone=6.0, middle=0.0)
    size = measured_size(parts).sources[0]
    place = replace(size, name="place", feature=Feature.POSITION, measured=made)
    errors = ErrorModel((place, replace(size, name="size", each=12)))
    x, output = generator.standard_normal((8000, 14)), BENT[name]
    quantile = float(np.quantile(output(x), TARGET))
    margin = ProcessUncertainty.of(errors, x, output(x)).margin(Limits(upper=quantile), 1 - TARGET)
    found = []
    for _ in range(200):
        wider = np.sqrt(2 * parts / generator.chisquare(2 * parts)), np.sqrt(19 / generator.chisquare(19))
        shift = wider[1] * generator.normal() / np.sqrt(parts)
        again = np.concatenate([x[:, :2] * wider[0], x[:, 2:] * wider[1] + shift], axis=1)
        found.append(float(np.quantile(output(again), TARGET)))
    held = np.mean(np.array(found) <= quantile + margin)
    assert 0.95 - 2 * np.sqrt(0.95 * 0.05 / 200) <= held < 1.0


def test_interval_of_a_yield_holds_units_and_processes():
    counted = proportion(30_000, 81)
    found = counted.widened_by(uncertainty_of_size(20), Limits(upper=2.78))
    assert (found.estimate, found.units, found.rejected) == (counted.estimate, counted.units, counted.rejected)
    assert found.low < counted.low < counted.high < found.high
    # Lower end: the share beyond that 97.5 % of the processes keep.
    s, z = np.sqrt(19 / np.random.default_rng(5).chisquare(19, 40_000)), np.random.default_rng(6).normal(size=40_000)
    beyond = stats.norm.sf((2.78 - s * z / np.sqrt(20)) / s)
    assert 1 - found.low == pytest.approx(np.quantile(beyond, 0.975), rel=0.12)
    more = found.widening.with_parts(100)
    assert found.low < more.low < counted.low
    assert counted.widened_by(None, LIMIT) is counted


def test_nothing_is_doubted_without_measured_parts():
    verifier = verifier_of_sum(6.0, 8.0, limit=9.0, guarantee=AtYield(TARGET))
    design = verifier.verify(verifier.space.uniform(1.0), "drawn")
    assert not design.uncertainties
    assert design.achieved.widening is None and design.joint.widening is None
    assert ProcessUncertainty.about(verifier.space.errors, NORMAL) is None


def made_of(zone, mean, deviation, parts, generator):
    values = generator.normal(mean * zone / 2, deviation * zone / 2, parts)
    return MeasuredParts(path=Path("p.csv"), values=tuple(values), are_radii=False, zone=zone, middle=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("parts", [20, 200])
def test_promised_yield_is_held_for_the_process_behind_the_parts(parts):
    """Three sizes, two of them measured: all zones by one factor until just met, 250 sets of parts, closed form."""
    verifier, sets, generator = verifier_of_sum(6.0, 8.0, 12.0, limit=9.0), 250, np.random.default_rng(8)
    halves, true = np.array([3.0, 4.0, 6.0]), np.array([[0.1, 0.3], [-0.15, 0.4], [0.0, 1 / 3]])
    normal, held, known = np.random.default_rng(9).standard_normal((4000, 3)), 0, 0
    level = stats.norm.ppf(TARGET)
    for _ in range(sets):
        sources, said = list(verifier.space.errors.sources), true.copy()
        for at in range(2):
            made = made_of(sources[at].zone, *true[at], parts, generator)
            sources[at] = replace(sources[at], distribution=Distribution.EMPIRICAL, measured=made)
            said[at] = made.shift, 1 / (3 * made.cp)
        x = (said[:, 0] + said[:, 1] * normal) * halves
        middle = float(said[:, 0] @ halves + level * np.linalg.norm(said[:, 1] * halves))
        margin = ProcessUncertainty.of(ErrorModel(tuple(sources)), x, x.sum(axis=1)).margin(
            Limits(upper=9.0), 1 - TARGET
        )
        for inwards in (0.0, margin):
            scale = 9.0 / (middle + inwards)
            own = ndtr((9.0 / scale - true[:, 0] @ halves) / np.linalg.norm(true[:, 1] * halves))
            if inwards:
                held += own >= TARGET
            else:
                known += own >= TARGET
    error = np.sqrt(0.95 * 0.05 / sets)
    assert held / sets >= 0.95 - 2 * error
    assert held / sets < 1.0  # a margin that always holds would be too large
    assert known / sets < 0.75


@pytest.mark.parametrize("are_radii", [False, True])
def test_normal_parts_are_refuted_with_one_percent(are_radii, generator):
    found = []
    for _ in range(1500):
        values = np.hypot(*generator.normal(size=(2, 20))) if are_radii else generator.normal(size=20)
        own = MeasuredParts(path=Path("p"), values=tuple(values), are_radii=are_radii, zone=6.0, middle=0.0)
        found.append(not own.is_normal)
    assert np.mean(found) == pytest.approx(0.01, abs=4 * np.sqrt(0.01 * 0.99 / 1500))
    skewed = MeasuredParts(
        path=Path("p"), values=tuple(generator.lognormal(0, 1.2, 60)), are_radii=are_radii, zone=6.0, middle=0.0
    )
    assert not skewed.is_normal
    assert "smoothed" in skewed.sentence


@pytest.mark.parametrize("guarantee", [AtYield(TARGET), AtCpk(1.0)])
def test_value_of_a_guarantee_lies_further_out_by_the_margin(guarantee):
    verifier = verifier_of_sum(6.0, 8.0, limit=9.0, guarantee=guarantee)
    sources = list(verifier.space.errors.sources)
    made = made_of(sources[0].zone, 0.0, 1 / 3, 20, np.random.default_rng(3))
    sources[0] = replace(sources[0], distribution=Distribution.EMPIRICAL, measured=made)
    verifier = replace(verifier, space=replace(verifier.space, errors=ErrorModel(tuple(sources))))
    design = verifier.verify(verifier.space.uniform(1.0), "drawn")
    uncertainty = design.uncertainties["y [mm]"]
    margin = uncertainty.margin(Limits(upper=9.0), 1 - TARGET) if isinstance(guarantee, AtYield) else None
    margin = uncertainty.margin_of_spread(1, 3.0) if margin is None else margin
    (side,) = design.checks[0].constraints
    limited = verifier.requirements[0].sample(sample_of(verifier), verifier.confidence).limited(Limits(upper=9.0))
    (counted,) = guarantee.bounds(replace(limited, uncertainty=None), verifier.confidence)
    assert side.value - counted.value == pytest.approx(margin, rel=1e-9)
    assert margin > 0.1


def sample_of(verifier):
    from tolalloc.allocation.space.output_sample import DesignSample

    errors = verifier.space.errors
    uniform = np.concatenate([*verifier.seeds.child("drawn").uniform_chunks(verifier.units, len(errors.columns))])
    return DesignSample(
        space=verifier.space,
        model=verifier.model,
        design=verifier.space.uniform(1.0),
        standard=errors.standard_values(uniform),
        outputs=("y [mm]",),
        slope_units=64,
        derivative_units=64,
        seeds=verifier.seeds,
        tails={"y [mm]": (Limits(upper=9.0), 1 - TARGET)},
    )


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """Return answers of a study of two sizes, one of them measured 20 times."""
    folder = tmp_path_factory.mktemp("few")
    parts = np.random.default_rng(2).normal(1.0, 4.0, 20)
    (folder / "p.csv").write_text("deviation [µm]\n" + "\n".join(f"{own:.3f}" for own in parts), encoding="utf-8")
    rows = [
        {"id": name, "plus": 15, "minus": -15, "unit": "µm", "min": 3, "max": 90, "cost": 5, "measured": measured}
        for name, measured in (("a", "p.csv"), ("b", ""))
    ]
    table = pd.DataFrame(rows)
    table["distribution"] = ["empirical", "normal"]
    table.to_csv(folder / "t.csv", index=False)
    model = ta.model(lambda a, b: a - b, inputs=("a", "b"), outputs=("gap [mm]",))
    return ta.Study(model, ta.drawing(folder / "t.csv"), limits={"gap [mm]": ta.Limit(upper=0.02)})


@pytest.mark.slow
def test_allocation_says_what_few_parts_do_and_what_a_hundred_would(studied):
    answer = studied.allocate(effort="quick")
    said = " ".join(answer.sentences)
    assert says(said, "check.few_parts_one", parts=20)
    assert says(said, "check.more_parts", more=100)
    assert says(said, "allocation.margin")
    assert says(said, "allocation.margin_saves", more=100)
    achieved = answer.result.chosen.achieved
    assert answer.result.met and achieved.low < achieved.widening.counted.low


@pytest.mark.slow
def test_ranking_says_what_few_parts_do(studied):
    answer = studied.rank(effort="quick")
    assert says(" ".join(answer.sentences), "check.few_parts_one", parts=20)
    found = answer.result.capabilities[0].inside
    assert found.widening is not None
    assert answer.result.beyond.interval.low <= found.widening.counted.low

"""Diagnosis of one unit from its curve: the parts on problems with known answers, the whole on simulated units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.builders import seeded_units
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import limited_measure
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.study.prepared import Prepared
from tolalloc.wings.bench.diagnosis import Diagnosis, diagnose
from tolalloc.wings.bench.measurements import MeasuredCurve
from tolalloc.wings.bench.posterior import (
    CurveProblem,
    DiagnosisEffort,
    GaugeReading,
    Neighbourhood,
    Noise,
    bridge,
    climb,
    thinned,
)
from tolalloc.wings.bench.sources import (
    dominant,
    exchanged,
    groups,
    half_turn,
    has_half_turn,
    named_set,
    reductions,
    with_twins,
)

NOISE = Noise()
ANGLES = 2 * np.pi * np.arange(480) / 480
ROOT = np.linalg.cholesky(NOISE.left_out(ANGLES) + NOISE.reading**2 * np.eye(ANGLES.size))
EFFORT = DiagnosisEffort(angles=160, scouts=256, climbers=12, particles=256, judged=48)
LITTLE = DiagnosisEffort(angles=48, scouts=64, climbers=4, attempts=1, nearby=1, particles=72, judged=8)


def curve_of(prepared: Prepared, deviations: np.ndarray, generator: np.random.Generator) -> MeasuredCurve:
    kernel = prepared.model.kernel
    exact = kernel.model.equilibria(kernel.errors(deviations), kernel.torque, ANGLES).transmission_error[0]
    read = exact + ROOT @ generator.standard_normal(ANGLES.size)
    return MeasuredCurve(
        unit=0, torque=kernel.torque, carrier_angle=ANGLES, transmission_error=read - read.mean(), noise=NOISE.reading
    )


def problem_of(prepared: Prepared, curve: MeasuredCurve) -> CurveProblem:
    errors = prepared.errors
    return CurveProblem(
        kernel=prepared.model.kernel, errors=errors, zones=errors.zones, readings=thinned(curve, NOISE, EFFORT.angles)
    )


def drawn(prepared: Prepared, count: int, name: str) -> np.ndarray:
    return seeded_units(prepared.errors, count, SeedTree(5).child(name))


@pytest.fixture(scope="module")
def unit(prepared: Prepared) -> np.ndarray:
    return drawn(prepared, 1, "unit")


@pytest.fixture(scope="module")
def problem(prepared: Prepared, unit: np.ndarray) -> CurveProblem:
    return problem_of(prepared, curve_of(prepared, unit, SeedTree(5).child("readings").generator()))


@pytest.fixture(scope="module")
def diagnosis(prepared: Prepared, unit: np.ndarray) -> Diagnosis:
    curve = curve_of(prepared, unit, SeedTree(5).child("readings").generator())
    errors = prepared.errors
    return diagnose(curve, prepared.model.kernel, errors, errors.zones, NOISE, SeedTree(0), EFFORT)


def test_a_unit_and_its_twin_have_one_curve(prepared: Prepared) -> None:
    kernel, columns = prepared.model.kernel, prepared.errors.columns
    units = drawn(prepared, 4, "twins")
    turn = half_turn(columns, prepared.model.reducer)
    middle = prepared.errors.deviations(np.zeros((1, len(columns))), prepared.errors.zones)
    assert np.all(middle == 0.0)
    curves = [
        kernel.model.equilibria(kernel.errors(np.ascontiguousarray(one)), kernel.torque, ANGLES).transmission_error
        for one in (units, units @ turn.T)
    ]
    assert np.abs(curves[0] - curves[1]).max() < 1e-9 * ARCSECOND
    assert np.abs(units - units @ turn.T).max() > 1e-6


def test_two_half_turns_are_none(prepared: Prepared) -> None:
    turn = half_turn(prepared.errors.columns, prepared.model.reducer)
    assert np.allclose(turn @ turn, np.eye(len(turn)), atol=1e-13)
    assert np.allclose(turn @ turn.T, np.eye(len(turn)), atol=1e-13)
    assert exchanged("disc1.bore2.position.x") == "disc2.bore1.position.x"


def test_a_half_turn_needs_two_cranks_two_discs_and_an_even_number_of_pins() -> None:
    reducer, columns = load_reducer("rv20e_liu2020"), ("disc1.bore1.position.x", "disc2.bore2.position.x")
    assert has_half_turn(reducer, columns)
    assert not has_half_turn(reducer, columns[:1])
    assert not has_half_turn(replace(reducer, crank_count=3), columns)


@pytest.mark.parametrize(
    "kind",
    ["planet", "mesh", "phase", "rotation", "tilt", "each_pin", "each_tooth", "sun", ""],
    ids=lambda kind: kind or "all",
)
def test_every_column_of_the_model_has_its_image_in_the_twin(kind: str) -> None:
    """Whatever a drawing may list, the unit turned by half a turn has the same curve."""
    reducer = load_reducer("rv20e_liu2020")
    model = EquivalentModel(reducer)
    turn = half_turn(model.columns, reducer)
    assert has_half_turn(reducer, model.columns)
    assert np.allclose(turn @ turn, np.eye(len(turn)), atol=1e-12)
    chosen = np.array([kind in name and not name.startswith("modification") for name in model.columns])
    angular = np.array(["tilt" in name or "phase" in name or "rotation" in name for name in model.columns])
    size = np.where(chosen, np.where(angular, 2e-5, 2e-6), 0.0)
    units = size * SeedTree(5).child("image").generator().standard_normal((2, len(model.columns)))
    curves = [
        model.equilibria(np.ascontiguousarray(one), -167.0, ANGLES[::8] + 0.01).transmission_error
        for one in (units, units @ turn.T)
    ]
    assert np.abs(curves[0] - curves[1]).max() < 1e-9 * ARCSECOND
    still = model.equilibria(np.zeros((1, len(model.columns))), -167.0, ANGLES[::8] + 0.01).transmission_error
    assert np.abs(curves[0] - still).max() > 1e-3 * ARCSECOND


def test_a_drawing_that_lists_one_of_two_has_no_twins() -> None:
    reducer = load_reducer("rv20e_liu2020")
    both = ("planet1.eccentricity.x", "planet2.eccentricity.x", "disc1.tilt.x", "disc2.tilt.x")
    assert has_half_turn(reducer, both)
    for name in both:
        assert not has_half_turn(reducer, [one for one in both if one != name])
    assert not has_half_turn(reducer, ["each_pin.diameter.1"])
    assert has_half_turn(reducer, ["each_pin.diameter.1", "each_pin.diameter.21"])
    assert has_half_turn(reducer, ["disc1.each_tooth.pitch.1", "disc2.each_tooth.pitch.21"])


def test_twins_are_as_likely_as_their_drawings_say(problem: CurveProblem, prepared: Prepared) -> None:
    generator = SeedTree(5).child("as likely").generator()
    same = with_twins(problem, np.repeat(drawn(prepared, 1, "one"), 400, axis=0), generator)
    turned = (same != same[0]).any(axis=1)
    tight = replace(
        problem, zones=np.where(np.char.startswith(_names(problem), "disc2.pitch"), 0.2, 1.0) * problem.zones
    )
    wide = tight.deviations(np.full((1, problem.size), 1.5))
    kept = with_twins(tight, np.repeat(wide, 400, axis=0), generator)
    # Equal zones but for the carrier's bores: both twins are found. A disc 2 that is five times as exact is not the
    # one that is off.
    assert 0.2 < turned.mean() < 0.8
    assert (kept == wide).all()


def _names(problem: CurveProblem) -> np.ndarray:
    return np.array([source.name for source in problem.errors.active])


def test_the_bridge_reaches_a_normal_density() -> None:
    generator, size, particles = SeedTree(0).child("bridge").generator(), 12, 2000
    deviation = np.linspace(0.02, 1.0, size)
    sample = bridge(
        Neighbourhood(centre=np.zeros(size), precision=np.eye(size)),
        lambda x: -0.5 * (((x - 0.5) / deviation) ** 2).sum(axis=1),
        particles,
        generator,
        settling=20,
    )
    # Resampled particles are alike: a third of them counts as independent. Four standard errors.
    standard_error = deviation / np.sqrt(particles / 3)
    assert np.all(np.abs(sample.mean(axis=0) - 0.5) < 4 * standard_error)
    assert np.all(np.abs(sample.std(axis=0) / deviation - 1) < 4 / np.sqrt(2 * particles / 3))


def test_the_bridge_keeps_out_of_what_is_forbidden() -> None:
    generator = SeedTree(1).child("bridge").generator()
    sample = bridge(
        Neighbourhood(centre=np.zeros(2), precision=np.eye(2)),
        lambda x: np.where(x[:, 0] > 0.0, -0.5 * (x**2).sum(axis=1), -np.inf),
        1500,
        generator,
        effective=0.3,
        settling=20,
    )
    assert np.all(sample[:, 0] > 0.0)
    # Half-normal mean √(2/π) with deviation 0.60; four standard errors of 500.
    assert abs(sample[:, 0].mean() - np.sqrt(2 / np.pi)) < 4 * 0.603 / np.sqrt(500)


def test_residuals_become_independent_and_blind_to_an_offset(problem: CurveProblem) -> None:
    readings = problem.readings
    spread = readings.whitening @ readings.covariance @ readings.whitening.T
    assert np.allclose(spread @ spread, spread, atol=1e-9)
    assert np.trace(spread) == pytest.approx(readings.freedom)
    assert np.abs(readings.whitening @ np.ones(readings.values.size)).max() < 1e-6 * np.abs(readings.whitening).max()


def test_thinning_keeps_the_nearest_reading_of_each_place() -> None:
    angle = np.array([*(DEGREE * np.arange(0.4, 330.0, 0.9)), 359.95 * DEGREE])
    curve = MeasuredCurve(unit=0, torque=-1.0, carrier_angle=angle, transmission_error=np.arange(angle.size) * 1.0)
    kept = thinned(curve, NOISE, 120)
    place = kept.carrier_angle / (3 * DEGREE)
    assert np.abs(place - np.rint(place)).max() * 3 <= 0.45 + 1e-9
    assert kept.values.size == 111
    assert kept.carrier_angle[-1] == angle[-1]
    with pytest.raises(InputError, match="24 or more"):
        thinned(curve, NOISE, 12)


@pytest.mark.slow
def test_the_true_errors_misfit_by_no_more_than_noise(problem: CurveProblem, prepared: Prepared) -> None:
    numbers = SeedTree(5).child("misfit").generator().standard_normal((24, problem.size))
    generator, square = SeedTree(5).child("noise").generator(), []
    for one in numbers:
        own = problem_of(prepared, curve_of(prepared, problem.deviations(one[np.newaxis]), generator))
        square.append(2 * own.misfit(one[np.newaxis])[0])
    # χ² with 159 degrees of freedom, mean of 24: four standard errors.
    assert abs(np.mean(square) - 159) < 4 * np.sqrt(2 * 159 / 24)


@pytest.mark.slow
def test_derivatives_by_the_numbers_are_those_of_the_residuals(problem: CurveProblem) -> None:
    numbers = SeedTree(5).child("slope").generator().standard_normal((1, problem.size))
    residual, slope = problem.linearised(numbers)
    assert np.isclose(0.5 * (residual**2).sum(), problem.misfit(numbers)[0], rtol=1e-9)
    direction = SeedTree(5).child("direction").generator().standard_normal(problem.size)
    ahead, behind = problem.linearised(np.stack([numbers[0] + 1e-6 * direction, numbers[0] - 1e-6 * direction]))[0]
    found = (ahead - behind) / 2e-6
    assert np.abs(found - slope[0] @ direction).max() < 1e-2 * np.abs(found).max()


def test_what_a_gauge_has_read_counts_as_one_more_reading(problem: CurveProblem) -> None:
    sources = problem.errors.active
    read = tuple(GaugeReading(source=own, value=own.zone / 3, deviation=5e-7) for own in (sources[0], sources[-1]))
    own = replace(problem, gauged=read)
    numbers = SeedTree(5).child("gauged").generator().standard_normal((2, problem.size))
    owner, units = np.array(problem.errors.source_of_column), problem.deviations(numbers)
    shown = np.array([limited_measure(one.source, units[:, owner == one.source.name]) for one in read])
    square = (((shown.T - [one.value for one in read]) / 5e-7) ** 2).sum(axis=1)
    assert own.misfit(numbers) - problem.misfit(numbers) == pytest.approx(0.5 * square)
    assert own.freedom == problem.freedom + 2
    residual, slope = own.linearised(numbers)
    direction = SeedTree(5).child("direction").generator().standard_normal(problem.size)
    ahead, behind = (own._off(own.deviations(numbers + step * direction)) for step in (1e-6, -1e-6))
    assert 0.5 * (residual**2).sum(axis=1) == pytest.approx(own.misfit(numbers))
    assert slope[:, -2:] @ direction == pytest.approx((ahead - behind) / 2e-6, rel=1e-2)


@pytest.mark.slow
def test_steps_never_lead_uphill(problem: CurveProblem) -> None:
    start = SeedTree(5).child("climb").generator().standard_normal((3, problem.size))
    before = problem.misfit(start) + 0.5 * (start**2).sum(axis=1)
    end = climb(problem, start, 1.0, 3)
    assert np.all(problem.misfit(end) + 0.5 * (end**2).sum(axis=1) < 0.5 * before)


@pytest.mark.slow
def test_a_source_that_alone_deviates_is_dominant(problem: CurveProblem) -> None:
    owner = np.array(problem.errors.source_of_column)
    wide = problem.deviations(np.full((1, problem.size), 2.0))
    names = _names(problem)
    for name in ("housing.pitch", "disc2.runout"):
        fall = reductions(problem, np.where(owner == name, wide, 0.0))
        assert names[dominant(fall)[0]] == name
        assert np.count_nonzero(np.abs(fall) > 1e-9) == 1


def test_the_named_set_is_the_smallest_that_reaches_the_level() -> None:
    probability = np.array([0.1, 0.5, 0.0, 0.4])
    assert named_set(probability, 0.5) == (1,)
    assert named_set(probability, 0.9) == (1, 3)
    assert named_set(probability, 0.91) == (1, 3, 0)


def test_columns_that_replace_one_another_form_a_group() -> None:
    generator = SeedTree(5).child("groups").generator()
    free, noise = generator.standard_normal((2000, 1)), 0.1 * generator.standard_normal((2000, 3))
    numbers = np.concatenate([free + noise[:, :1], 0.7 - free + noise[:, 1:2], generator.standard_normal((2000, 2))], 1)
    (found,) = groups(numbers, ("a.x", "b.x", "c.x", "c.y"), ("a", "b", "c", "c"))
    assert found.sources == ("a", "b")
    assert np.allclose(np.abs(found.combination), np.sqrt(0.5), atol=0.01)
    assert found.together == pytest.approx(0.1, rel=4 / np.sqrt(4000))  # four standard errors
    assert abs(found.value) == pytest.approx(0.7 * np.sqrt(0.5), abs=0.02)
    assert np.all(found.alone > 0.9)


def test_nearly_all_gauges_show_less_than_the_zone(prepared: Prepared) -> None:
    units, errors = drawn(prepared, 4000, "gauges"), prepared.errors
    owner = np.array(errors.source_of_column)
    for source in errors.active:
        limit = source.zone / 2 if source.feature == "size" else source.zone
        outside = (np.abs(limited_measure(source, units[:, owner == source.name])) > limit).mean()
        assert abs(outside - 0.0027) < 4 * np.sqrt(0.0027 / 4000), source.name  # four standard errors


@pytest.mark.slow
def test_the_dominant_source_is_named_and_the_set_is_small(
    diagnosis: Diagnosis, problem: CurveProblem, unit: np.ndarray
) -> None:
    truth = diagnosis.sources[dominant(reductions(problem, unit))[0]]
    assert truth in diagnosis.named
    assert len(diagnosis.named) <= 6
    assert diagnosis.dominant_probability.sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_most_true_errors_lie_in_their_intervals(diagnosis: Diagnosis, prepared: Prepared, unit: np.ndarray) -> None:
    low, high = diagnosis.column_interval
    # One unit's 60 columns hang together as about 30 independent ones; 95 % less four standard errors.
    assert ((low <= unit[0]) & (unit[0] <= high)).mean() > 0.95 - 4 * np.sqrt(0.95 * 0.05 / 30)
    before = np.diff(np.quantile(drawn(prepared, 2000, "before"), [0.025, 0.975], axis=0), axis=0)[0]
    assert np.median((high - low) / before) < 0.9  # the curve has told something


@pytest.mark.slow
def test_the_fit_explains_the_curve_and_its_twin_is_known(diagnosis: Diagnosis) -> None:
    fit = diagnosis.fit
    assert fit.explained
    assert np.abs(fit.fitted - fit.measured).max() < 5 * np.hypot(NOISE.reading, NOISE.discrepancy)
    assert ("disc1.pitch", "disc2.pitch") in diagnosis.twins
    assert any({"carrier.assembly", "housing.runout"} <= set(group.sources) for group in diagnosis.groups)
    assert diagnosis.failed == 0


@pytest.mark.slow
def test_a_curve_that_no_errors_make_is_not_diagnosed(prepared: Prepared, unit: np.ndarray) -> None:
    curve = curve_of(prepared, unit, SeedTree(5).child("readings").generator())
    foreign = curve.transmission_error + 10 * ARCSECOND * np.sin(17.0 * ANGLES)
    errors = prepared.errors
    seen: list[int] = []
    found = diagnose(
        replace(curve, transmission_error=foreign),
        replace(prepared.model.kernel, observe=lambda status: seen.append(status.size)),
        errors,
        errors.zones,
        NOISE,
        SeedTree(0),
        LITTLE,
    )
    assert not found.fit.explained
    assert found.named == ()
    assert not found.dominant_probability.any()
    assert sum(seen) == found.evaluations


@pytest.mark.slow
def test_one_seed_gives_one_diagnosis(prepared: Prepared, unit: np.ndarray) -> None:
    curve = curve_of(prepared, unit, SeedTree(5).child("readings").generator())
    errors = prepared.errors
    one, same, other = (
        diagnose(curve, prepared.model.kernel, errors, errors.zones, NOISE, SeedTree(seed), LITTLE)
        for seed in (0, 0, 1)
    )
    assert np.array_equal(one.deviations, same.deviations)
    assert not np.array_equal(one.deviations, other.deviations)


def test_the_tables_at_the_angles_of_a_diagnosis_are_made_once(prepared):
    """A diagnosis asks for them again and again, with three more for derivatives; else it takes half as long again."""
    model = prepared.model.kernel.model
    for angles in (DiagnosisEffort().angles, DiagnosisEffort().angles + 3):
        asked = 2 * np.pi * np.arange(angles) / angles
        assert model.tables_at(asked) is model.tables_at(asked.copy())

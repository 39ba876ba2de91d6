"""Every distribution in every feature: share inside the zone, printed moments, sorting, measured parts, teeth."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tolalloc.drawings.distributions import RAYLEIGH, Batch, Distribution, moments, smoothed_magnitude
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import (
    KNOWN_RANGES,
    Feature,
    harmonic_range_quantile,
    integrated_range_quantile,
    parsed_spectrum,
)

SAMPLES = 100_000
ZONE = 4e-6
ONE, THREE = ((2, 1.5),), ((1, 9.2), (2, 4.3), (4, 1.0))
KINDS = {
    "normal": {},
    "uniform": {"distribution": Distribution.UNIFORM},
    "triangular": {"distribution": Distribution.TRIANGULAR},
    "lognormal": {"distribution": Distribution.LOGNORMAL, "shape": 0.5},
    "weibull": {"distribution": Distribution.WEIBULL, "shape": 1.5},
    "beta": {"distribution": Distribution.BETA, "shape": (2.0, 5.0)},
    "trapezoid": {"distribution": Distribution.TRAPEZOID, "shape": 0.4},
    "rayleigh": {"distribution": Distribution.RAYLEIGH},
    "mixture": {"distribution": Distribution.MIXTURE},
    "empirical": {"distribution": Distribution.EMPIRICAL},
}
BOUNDED = (Distribution.UNIFORM, Distribution.TRIANGULAR, Distribution.BETA, Distribution.TRAPEZOID)
MADE_OF_OTHERS = (Distribution.MIXTURE, Distribution.EMPIRICAL)
SHIFTED = (Batch(weight=7.0, shift=-0.3, spread=0.8), Batch(weight=3.0, shift=0.5, spread=0.6))
CENTRED = (Batch(weight=0.7, shift=0.0, spread=0.6), Batch(weight=0.3, shift=0.0, spread=1.2))
PARTS = 0.5e-6 + 0.6e-6 * stats.weibull_min(2.5).ppf((np.arange(60) + 0.5) / 60)
SPECTRA = {Feature.SIZE: (), Feature.POSITION: (), Feature.PITCH: THREE, Feature.RUNOUT: ONE}
CASES = [
    (kind, feature)
    for kind in KINDS
    for feature in SPECTRA
    if not (kind == "rayleigh" and feature is not Feature.SIZE)
    and not (kind == "empirical" and SPECTRA[feature])
    and not (kind == "mixture" and feature is Feature.PITCH)
]


def source(kind: str, feature: Feature, **more) -> Source:
    parameters = dict(KINDS[kind])
    if kind == "mixture":
        parameters["batches"] = SHIFTED if feature is Feature.SIZE else CENTRED
    if kind == "empirical":
        parameters["measured"] = MeasuredParts(
            path=Path("parts.csv"),
            values=tuple(PARTS.tolist()),
            are_radii=feature is not Feature.SIZE,
            zone=ZONE,
            middle=0.0,
        )
    return Source(
        name="s",
        part="",
        feature=feature,
        zone=ZONE,
        minimum=0.0,
        maximum=1.0,
        cost=1.0,
        **{"spectrum": SPECTRA[feature], **parameters, **more},
    )


def limited(of: Source, columns: np.ndarray) -> np.ndarray:
    """Return what the drawing limits, over the zone: 1 is just inside."""
    if of.feature is Feature.SIZE:
        return 2 * np.abs(columns[:, 0])
    radius = np.hypot(columns[:, 0::2], columns[:, 1::2])
    if len(of.spectrum) < 2:
        return 2 * radius[:, 0]
    turn = 2 * np.pi * np.arange(360) / 360
    waves = np.concatenate([[np.cos(order * turn), np.sin(order * turn)] for order, _ in of.spectrum])
    return np.ptp(columns @ waves, axis=1)


def mixture_share() -> float:
    """Return the share of the shifted batches inside the zone."""
    return sum(
        batch.weight / 10 * np.diff(stats.norm(batch.shift, batch.spread / 3).cdf([-1, 1]))[0] for batch in SHIFTED
    )


def rayleigh_share() -> float:
    """Return the share of the centred batches inside the zone."""
    return sum(batch.weight * (1 - 0.0027 ** (1 / batch.spread**2)) for batch in CENTRED)


def test_every_distribution_is_among_the_cases():
    assert {*KINDS} == {own.value for own in Distribution}


@pytest.mark.parametrize("kind", [own for own in Distribution if own not in MADE_OF_OTHERS])
def test_a_distribution_that_ends_is_bounded_and_fills_its_zone(kind):
    own = source(kind.value, Feature.SIZE)
    ends = own.zone_mapping.base.quantile(np.array([0.0, 1.0]))
    assert kind.form.is_bounded == np.isfinite(ends).all() == (kind in BOUNDED)
    if kind.form.is_bounded:
        np.testing.assert_allclose(np.ptp(own.standard_values(np.array([[0.0], [1.0]]))), 1.0, atol=1e-6)
        shapes = kind.form.to_scipy(own.shapes)
        assert getattr(stats, kind.form.scipy).support(*shapes) == (0.0, 1.0)


@pytest.mark.parametrize("kind", [own for own in Distribution if own not in MADE_OF_OTHERS])
def test_a_distribution_is_symmetric_and_log_concave_where_it_is_said_to_be(kind):
    own = source(kind.value, Feature.SIZE)
    share = np.linspace(0.0, 1.0, 501)[1:-1]
    values = own.zone_mapping.base.quantile(share)
    is_symmetric = np.allclose(values + values[::-1], 2 * values[len(values) // 2], atol=1e-9)
    density = np.diff(share) / np.diff(values)  # its logarithm is concave where it is concave over the share below
    is_log_concave = (np.diff(density, 2) <= 1e-9).all()
    assert kind.form.is_symmetric(own.shapes) == bool(is_symmetric and is_log_concave)


@pytest.mark.parametrize(("kind", "feature"), CASES)
def test_share_inside_the_zone_at_cp_1(kind, feature, generator):
    own = source(kind, feature)
    inside = (limited(own, own.standard_values(generator.random((SAMPLES, len(own.columns))))) <= 1 + 1e-12).mean()
    share = 1.0 if own.distribution in BOUNDED else 0.9973
    if kind == "mixture":
        share = mixture_share() if feature is Feature.SIZE else rayleigh_share()
    if kind == "empirical":
        share = own.zone_mapping.inside
    # Four standard errors; ranges of several orders are integrated over 2¹⁴ points, with four errors of their own.
    integrated = 4 * np.sqrt(0.0027 / 2**14) * (len(own.spectrum) > 1)
    assert inside == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / SAMPLES) + integrated)
    if len(own.spectrum) < 2:
        assert own.zone_mapping.inside == pytest.approx(share, abs=2e-5)


@pytest.mark.parametrize(("kind", "feature"), CASES)
@pytest.mark.parametrize("sorting", [False, True])
def test_printed_mean_and_deviation_are_the_sampled_ones(kind, feature, sorting, generator):
    if sorting and feature is Feature.PITCH:
        return
    spread = {} if kind in ("mixture", "empirical") else {"cp": 0.8}
    shift = {"shift": 0.2} if feature is Feature.SIZE and spread else {}
    own = source(kind, feature, sorted=sorting, **spread, **shift)
    columns = ZONE * 1e6 * own.standard_values(generator.random((SAMPLES, len(own.columns))))
    if feature is Feature.SIZE or (kind == "normal" and not sorting):
        sampled = columns[:, 0]
    else:
        sampled = np.hypot(columns[:, 0], columns[:, 1])
    number = r"([-+]?\d[\d.]*(?:e-?\d+)?)"
    sentence = own.mapping
    deviation = re.search(rf"σ = {number}", sentence)
    mean = re.search(rf"mean {number} µm|shifted by {number}", sentence)
    if waves := re.search(rf"mean ± σ = {number} ± {number}", sentence):
        printed = float(waves[1]), float(waves[2])
    else:
        printed = float(mean[1] or mean[2]) if mean else 0.0, float(deviation[1])
    # Four standard errors, and the rounding to three digits.
    error = sampled.std() / np.sqrt(SAMPLES)
    assert sampled.mean() == pytest.approx(printed[0], abs=4 * error + 5e-3 * abs(printed[0]) + 1e-9)
    variance_error = np.sqrt(stats.kurtosis(sampled, fisher=False) - 1) / 2 * error
    assert sampled.std() == pytest.approx(printed[1], abs=4 * variance_error + 5e-3 * printed[1])


@pytest.mark.parametrize(("kind", "feature"), [case for case in CASES if case[1] is not Feature.PITCH])
def test_sorted_keeps_everything_inside_and_the_distribution_there(kind, feature, generator):
    spread = {} if kind in ("mixture", "empirical") else {"cp": 0.5}
    plain, own = source(kind, feature, **spread), source(kind, feature, sorted=True, **spread)
    uniform = generator.random((20_000, len(own.columns)))
    kept, before = limited(own, own.standard_values(uniform)), limited(plain, plain.standard_values(uniform))
    assert kept.max() <= 1 + 1e-12
    below = before[before <= 1]
    # Rejected parts leave the same distribution; 1e-4 is about four standard errors.
    assert stats.ks_2samp(kept, below).pvalue > 1e-4
    assert own.zone_mapping.inside == pytest.approx(below.size / 20_000, abs=4 * 0.5 / np.sqrt(20_000))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("feature", [Feature.SIZE, Feature.POSITION])
@pytest.mark.parametrize("sorting", [False, True])
def test_quantiles_rise_and_meet_their_probabilities(kind, feature, sorting):
    marginal = source(kind, feature, sorted=sorting).zone_mapping.marginal
    tails = 10.0 ** -np.arange(1, 16)
    probability = np.sort(np.concatenate([[5e-324], tails, np.linspace(0.001, 0.999, 999), 1 - tails, [1 - 2**-53]]))
    values = marginal.quantile(probability)
    assert np.isfinite(values).all()
    assert (np.diff(values) >= 0).all()
    middle = slice(15, -15)
    np.testing.assert_allclose(marginal.probability(values[middle]), probability[middle], atol=1e-9)


@pytest.mark.parametrize(("kind", "feature"), CASES)
def test_samples_do_not_depend_on_what_they_are_computed_with(kind, feature, generator):
    own = source(kind, feature)
    uniform = generator.random((1001, len(own.columns)))
    parts = [own.standard_values(part) for part in np.split(uniform, [1, 4, 517, 1000])]
    np.testing.assert_array_equal(np.concatenate(parts), own.standard_values(uniform))


def test_a_weibull_position_of_shape_2_is_the_normal_one(generator):
    uniform = generator.random((1000, 2))
    weibull = source("weibull", Feature.POSITION, shape=2.0).standard_values(uniform)
    np.testing.assert_allclose(weibull, source("normal", Feature.POSITION).standard_values(uniform), rtol=1e-9)


def test_narrow_batches_far_apart_keep_their_shares():
    batches = (Batch(weight=0.25, shift=-1.5, spread=0.01), Batch(weight=0.75, shift=1.0, spread=2.0))
    own = replace(source("mixture", Feature.SIZE), batches=batches).zone_mapping.marginal
    values = np.linspace(-3, 3, 1001)
    exact = sum(batch.weight * stats.norm(batch.shift, batch.spread / 3).cdf(values) for batch in batches)
    np.testing.assert_allclose(own.probability(values), exact, atol=1e-5)


@pytest.mark.parametrize("feature", [Feature.SIZE, Feature.POSITION])
def test_smoothed_parts_keep_the_mean_square_and_follow_the_parts(feature, generator):
    own = source("empirical", feature)
    columns = own.standard_values(generator.random((SAMPLES, len(own.columns)))) * ZONE
    values = columns[:, 0] if feature is Feature.SIZE else np.hypot(*columns.T)
    square_error = (values**2).std() / np.sqrt(SAMPLES)
    assert (values**2).mean() == pytest.approx((PARTS**2).mean(), abs=4 * square_error)
    assert stats.kstest(PARTS, np.sort(values)).statistic < 0.06
    assert values.max() > PARTS.max()


@pytest.mark.parametrize(
    ("radii", "tolerance"),
    # What is mirrored at 0 moves mean and deviation a little where parts lie near it, as in the second sample.
    [(PARTS, 1e-5), (stats.weibull_min(1.2).ppf((np.arange(60) + 0.5) / 60), 0.03)],
)
def test_smoothed_radii_keep_mean_and_deviation_and_stay_positive(radii, tolerance):
    smooth = smoothed_magnitude(radii)
    mean, deviation = moments(smooth)
    assert mean == pytest.approx(radii.mean(), rel=tolerance)
    assert deviation == pytest.approx(radii.std(), rel=tolerance)
    assert mean**2 + deviation**2 == pytest.approx((radii**2).mean(), rel=1e-5)
    assert smooth.quantile(np.array([1e-12, 0.5])).min() >= 0.0


@pytest.mark.parametrize("more", [{"distribution": Distribution.UNIFORM}, {"sorted": True, "cp": 0.7}])
def test_a_symmetric_size_has_its_mean_in_the_middle(more):
    assert ", mean 0 µm off the middle, " in replace(source("normal", Feature.SIZE), **more).mapping


def test_the_fit_finds_the_distribution_that_the_parts_came_from(generator):
    def measured(values, are_radii=False):
        return MeasuredParts(
            path=Path("parts.csv"),
            values=tuple(values.tolist()),
            are_radii=are_radii,
            zone=12e-6,
            middle=0.0,
        )

    normal = measured(1e-6 * generator.standard_normal(2000) + 1e-6)
    assert normal.fit.best.distribution is Distribution.NORMAL
    # σ and the mean of 2000 parts, four standard errors.
    assert normal.cp == pytest.approx(2.0, abs=4 * 2.0 / np.sqrt(4000))
    assert normal.fit.cpk == pytest.approx(5 / 3, abs=4 * (5 / 3 / np.sqrt(4000) + 1 / 3 / np.sqrt(2000)))
    weibull = measured(2e-6 * generator.weibull(1.5, 2000) - 6e-6)
    assert weibull.fit.best.distribution is Distribution.WEIBULL
    assert weibull.fit.best.shape == pytest.approx(1.5, abs=4 * 0.78 * 1.5 / np.sqrt(2000))
    lognormal = measured(2e-6 * generator.lognormal(0.0, 0.4, 2000) - 6e-6)
    assert lognormal.fit.best.distribution is Distribution.LOGNORMAL
    assert lognormal.fit.best.shape == pytest.approx(0.4, abs=4 * 0.4 / np.sqrt(4000))
    assert lognormal.fit.best.scale == pytest.approx(2e-6, rel=4 * 0.4 / np.sqrt(2000))
    assert [fit.aic for fit in lognormal.fit.fits] == sorted(fit.aic for fit in lognormal.fit.fits)
    assert max(own.fit.best.distance for own in (normal, weibull, lognormal)) < 1.6 / np.sqrt(2000)
    radii = measured(np.hypot(*generator.standard_normal((2, 2000))) * 1e-6, are_radii=True)
    assert {fit.distribution for fit in radii.fit.fits if fit.aic < radii.fit.best.aic + 6} >= {Distribution.NORMAL}
    assert radii.cp == pytest.approx(6 / 3.44, rel=4 / np.sqrt(8000) + 0.001)
    below = measured(np.linspace(-7e-6, 3e-6, 50))
    assert [fit.distribution for fit in below.fit.fits] == [Distribution.NORMAL]


@pytest.mark.parametrize("spectrum", KNOWN_RANGES)
def test_the_known_range_of_a_spectrum_is_the_integrated_one(spectrum):
    assert harmonic_range_quantile(spectrum) == pytest.approx(
        integrated_range_quantile(spectrum, 0, RAYLEIGH), rel=1e-14
    )


def test_the_ranges_of_the_shipped_tables_are_known():
    sources = [*load_tolerance_table("rv20e_table4"), *load_tolerance_table("rv20e_all_sources")]
    assert {own.spectrum for own in sources if len(own.spectrum) > 1} == set(KNOWN_RANGES)


@pytest.mark.parametrize("teeth", [39, 40])
def test_random_teeth_have_the_deviation_and_the_range_of_independent_teeth(teeth, generator):
    spectrum, found = parsed_spectrum(f"random:2.0/{teeth}")
    assert (found, len(spectrum)) == (teeth, teeth // 2)
    turn = 2 * np.pi * (np.arange(teeth) + 0.3) / teeth
    variance = sum(
        amplitude**2 * (np.cos(order * turn) ** 2 + np.sin(order * turn) ** 2) for order, amplitude in spectrum
    )
    np.testing.assert_allclose(variance, 4.0 * (1 - 1 / teeth))  # all but the mean over the teeth
    quantile = harmonic_range_quantile(spectrum, teeth)
    ranges = np.ptp(2.0 * generator.standard_normal((400_000, teeth)), axis=1)
    # Four standard errors of both: 400,000 ranges, and 2¹⁵ points.
    assert (ranges <= quantile).mean() == pytest.approx(0.9973, abs=4 * np.sqrt(0.0027 * (1 / 400_000 + 1 / 2**15)))


def test_random_teeth_add_to_named_orders_in_quadrature():
    alone, _ = parsed_spectrum("random:1.0/40")
    both, teeth = parsed_spectrum("1:9.2 3:0.5 random:1.0/40")
    for (order, amplitude), (_, random) in zip(both, alone, strict=True):
        assert amplitude == pytest.approx(np.hypot({1: 9.2, 3: 0.5}.get(order, 0.0), random))
    own = source("normal", Feature.PITCH, spectrum=both, teeth=teeth)
    filled = own.at_limit(np.random.default_rng(0).random((50, len(own.columns))))
    turn = 2 * np.pi * np.arange(40) / 40
    waves = np.concatenate([[np.cos(order * turn), np.sin(order * turn)] for order, _ in both])
    np.testing.assert_allclose(np.ptp(filled @ waves, axis=1), 1.0)
    assert "taken at 40 teeth" in own.mapping


def test_the_random_part_prints_the_deviation_of_one_tooth(generator):
    text = "1:2.5 random:1.5/40"
    spectrum, teeth = parsed_spectrum(text)
    own = source("normal", Feature.PITCH, spectrum=spectrum, teeth=teeth, written_spectrum=text)
    unit = float(re.search(r"σ = ([\d.]+) µm per unit of the spectrum 1:2.5 random:1.5/40", own.mapping)[1])
    turn = 2 * np.pi * np.arange(40) / 40
    waves = np.concatenate([[np.cos(order * turn), np.sin(order * turn)] for order, _ in spectrum])
    deviation = ZONE * 1e6 * own.standard_values(generator.random((SAMPLES, len(own.columns)))) @ waves
    expected = unit * np.sqrt(2.5**2 + 1.5**2 * (1 - 1 / 40))
    # Four standard errors at one tooth, and the rounding to three digits.
    assert deviation[:, 7].std() == pytest.approx(expected, rel=4 / np.sqrt(2 * SAMPLES) + 5e-3)
    inside = (np.ptp(deviation, axis=1) <= ZONE * 1e6).mean()
    assert inside == pytest.approx(0.9973, abs=4 * np.sqrt(0.0027 * (1 / SAMPLES + 1 / 2**15)))


@pytest.mark.parametrize(
    ("kind", "more", "mean", "deviation"),
    [
        ("beta", {}, 2 * 2 / 7 - 1, 2 * np.sqrt(2 * 5 / (7**2 * 8))),
        ("beta", {"shape": (3.0, 3.0), "cp": 2.0}, 0.0, np.sqrt(1 / 7) / 2),
        ("beta", {"shape": (4.0, 1.5), "shift": -0.1}, 2 * 4 / 5.5 - 1.1, 2 * np.sqrt(4 * 1.5 / (5.5**2 * 6.5))),
        ("trapezoid", {}, 0.0, np.sqrt((1 + 0.4**2) / 6)),
        ("trapezoid", {"shape": 0.8, "cp": 1.25, "shift": 0.3}, 0.3, np.sqrt((1 + 0.8**2) / 6) / 1.25),
        ("rayleigh", {}, -1 + 2 * np.sqrt(np.pi / 2) / RAYLEIGH.reach, 2 * np.sqrt(2 - np.pi / 2) / RAYLEIGH.reach),
        (
            "rayleigh",
            {"cp": 1.6},
            -1 + np.sqrt(np.pi / 2) / 0.8 / RAYLEIGH.reach,
            np.sqrt(2 - np.pi / 2) / 0.8 / RAYLEIGH.reach,
        ),
    ],
)
def test_moments_of_a_size_are_those_of_the_closed_forms(kind, more, mean, deviation):
    """In half zones; of a trapezoid on −1…1 with a plateau p the variance is (1 + p²)/6."""
    own = source(kind, Feature.SIZE, **more).zone_mapping
    assert moments(own.marginal) == pytest.approx((mean, deviation), abs=3e-6)


@pytest.mark.parametrize(
    ("kind", "more", "like", "other"),
    [
        ("beta", {"shape": (1.0, 1.0)}, "uniform", {}),
        ("rayleigh", {}, "weibull", {"shape": 2.0}),
        ("rayleigh", {"cp": 1.4, "sorted": True}, "weibull", {"shape": 2.0, "cp": 1.4, "sorted": True}),
    ],
)
def test_a_distribution_that_is_a_special_case_of_another_gives_its_samples(kind, more, like, other, generator):
    uniform = generator.random((1000, 1))
    one, another = source(kind, Feature.SIZE, **more), source(like, Feature.SIZE, **other)
    np.testing.assert_allclose(one.standard_values(uniform), another.standard_values(uniform), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("plateau", "limit"), [(0.01, "triangular"), (0.99, "uniform")])
def test_a_trapezoid_lies_between_triangular_and_uniform(plateau, limit, generator):
    uniform = generator.random((1000, 1))
    one, another = source("trapezoid", Feature.SIZE, shape=plateau), source(limit, Feature.SIZE)
    np.testing.assert_allclose(one.standard_values(uniform), another.standard_values(uniform), atol=0.01)


@pytest.mark.parametrize("cp", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("kind", ["beta", "trapezoid"])
def test_cp_divides_the_width_of_a_bounded_size(kind, cp):
    ends = source(kind, Feature.SIZE, cp=cp).zone_mapping.marginal.probability(np.array([-1 / cp, 1 / cp]))
    assert ends == pytest.approx([0.0, 1.0])

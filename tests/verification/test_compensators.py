"""Parts chosen at assembly: sorted into classes and mated, or taken in the size that fits, against closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import openpyxl
import pytest
from scipy import optimize, stats
from scipy.optimize import linear_sum_assignment

import tolalloc as ta
from tests.builders import baseline_errors, page_of, says, source, units_at_random, wording
from tolalloc.allocation.result import AllocationResult
from tolalloc.capability.linear_function import LinearFunction, LinearLaw
from tolalloc.drawings.compensators import Compensator, all_choices, assembly_cost, in_force
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError
from tolalloc.reports.tellers.allocation_assembly import assembly_notes, bins_table
from tolalloc.reports.tellers.ranking_tables import measures_table
from tolalloc.study.prepared import Prepared

UNITS = 40_000
SIZES = tuple(source(name, zone=6e-6) for name in ("hole", "shaft", "washer"))
SIGMA = 1e-6  # of each of them, at Cp = 1


def errors_of(*compensators: Compensator, sources=SIZES, **others) -> ErrorModel:
    acting = in_force(compensators, sources, "test")
    return ErrorModel(sources, compensators=acting, **others)


def units_of(errors: ErrorModel, units: int = UNITS, seed: int = 1) -> np.ndarray:
    return units_at_random(errors, units, seed)


def class_means(classes: int) -> np.ndarray:
    """Return the mean of a standard normal number in each class of equal probability, n·(φ(a) − φ(b))."""
    ends = stats.norm.ppf(np.arange(classes + 1) / classes)
    return classes * (stats.norm.pdf(ends[:-1]) - stats.norm.pdf(ends[1:]))


@pytest.mark.parametrize("classes", [2, 3, 5, 8])
@pytest.mark.parametrize("opposite", [False, True])
def test_the_variance_of_a_gap_of_sorted_parts_has_its_closed_form(classes, opposite):
    x = units_of(errors_of(ta.Sorting("shaft", "hole", classes=classes, opposite=opposite)))
    gap = x[:, 0] + x[:, 1] if opposite else x[:, 0] - x[:, 1]
    expected = 2 * SIGMA**2 * (1 - np.mean(class_means(classes) ** 2))
    error = np.sqrt(np.var((gap - gap.mean()) ** 2) / UNITS)
    assert abs(np.var(gap) - expected) < 4 * error
    for column in x.T:  # sorting changes who goes with whom, and no part
        assert stats.kstest(column, stats.norm(scale=SIGMA).cdf).pvalue > 1e-4


@pytest.mark.parametrize(("classes", "batch"), [(2, 50), (4, 100), (6, 60)])
def test_units_have_the_law_of_batches_that_are_assigned_exactly_and_leave_as_many_parts(classes, batch):
    rng, batches = np.random.default_rng(5), 400
    gaps, left = [], []
    for _ in range(batches):
        hole, shaft = rng.normal(size=(2, batch))
        number = [np.floor(classes * stats.norm.cdf(own)) for own in (hole, shaft)]
        one, other = linear_sum_assignment(number[0][:, np.newaxis] != number[1])
        fits = number[0][one] == number[1][other]
        gaps.append((hole[one] - shaft[other])[fits])
        left.append(1 - fits.mean())
    sorting = ta.Sorting("shaft", "hole", classes=classes, batch=batch)
    assert abs(np.mean(left) - sorting.leftover) < 4 * np.std(left) / np.sqrt(batches)
    x = units_of(errors_of(sorting))
    assert stats.ks_2samp(np.concatenate(gaps), (x[:, 0] - x[:, 1]) / SIGMA).pvalue > 1e-4


def test_one_class_and_one_size_choose_nothing():
    plain = ErrorModel(SIZES)
    wide = ta.Sorting("shaft", "hole", classes=1, width=2.0)
    chosen = errors_of(wide, ta.Shim("washer", step=1.0, sizes=1))
    assert chosen == plain
    np.testing.assert_array_equal(units_of(chosen), units_of(plain))
    turned = ta.Indexing("two", positions=1, against={"one": 1.0})
    paired = ta.Sorting("other", "one", by="direction", classes=1)
    sources = (*VECTORS, replace(VECTORS[0], name="two"))
    assert errors_of(turned, paired, sources=sources) == ErrorModel(sources)
    assert wide.leftover_of({own.name: own for own in SIZES}) == pytest.approx(0.0, abs=1e-12)


def test_all_pins_of_a_unit_come_from_the_class_of_its_grooves():
    pins = source("pins", zone=6e-6, each=8)
    sources = (*SIZES, pins)
    errors = errors_of(ta.Sorting("pins", "hole", classes=4), sources=sources)
    x = units_of(errors, 2000)
    own = np.floor(4 * stats.norm.cdf(x[:, 3:] / SIGMA))
    assert (own == own[:, :1]).all()
    assert (own[:, 0] == np.floor(4 * stats.norm.cdf(x[:, 0] / SIGMA))).all()


def test_positions_are_sorted_on_each_axis():
    sources = tuple(source(name, feature=Feature.POSITION, zone=6e-6) for name in ("one", "other"))
    x = units_of(errors_of(ta.Sorting("one", "other", classes=3), sources=sources))
    difference = x[:, :2] - x[:, 2:]
    deviation = x[:, 0].std()
    expected = 2 * deviation**2 * (1 - np.mean(class_means(3) ** 2))
    assert np.var(difference, axis=0) == pytest.approx(expected, rel=0.04)
    sorting = ta.Sorting("one", "other", classes=3)
    assert sorting.leftover_of({own.name: own for own in sources}) > sorting.leftover


@pytest.mark.parametrize("kind", [Distribution.UNIFORM, Distribution.TRIANGULAR])
def test_classes_of_any_distribution_hold_equally_many_parts(kind):
    sources = tuple(source(name, zone=6e-6, distribution=kind) for name in ("hole", "shaft"))
    sorting = ta.Sorting("shaft", "hole", classes=5)
    x, ends = units_of(errors_of(sorting, sources=sources)), sorting.limits(sources[1])
    counts = np.bincount(np.searchsorted(ends, x[:, 1]), minlength=5)
    assert abs(counts - UNITS / 5).max() < 4.5 * np.sqrt(UNITS * 0.16)
    assert (np.searchsorted(ends, x[:, 0]) == np.searchsorted(ends, x[:, 1])).all()


def test_a_shim_leaves_a_gap_within_half_a_step_where_sizes_reach():
    shim = ta.Shim("washer", step=0.5, sizes=41, against={"hole": -1.0, "shaft": 1.0})
    x = units_of(errors_of(shim))
    gap = x[:, 2] - x[:, 0] + x[:, 1]
    assert np.abs(gap).max() <= 0.25e-6 + 1e-15
    assert stats.kstest(gap, stats.uniform(-0.25e-6, 0.5e-6).cdf).pvalue > 1e-4


def test_a_gap_beyond_the_last_size_keeps_what_no_size_takes():
    x = units_of(errors_of(ta.Shim("washer", step=1.0, sizes=3)), 5000)
    plain = units_of(ErrorModel(SIZES), 5000)
    expected = plain[:, 2] - 1e-6 * np.clip(np.rint(plain[:, 2] / 1e-6), -1, 1)
    np.testing.assert_array_equal(x[:, 2], expected)
    np.testing.assert_array_equal(x[:, :2], plain[:, :2])


VECTORS = tuple(source(name, feature=Feature.POSITION, zone=6e-6) for name in ("one", "other"))
RUNOUTS = [own for own in baseline_errors().sources if own.name in ("disc1.runout", "disc2.runout")]


def vectors_of(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vectors of both sources of a sample, those of order 1 where there are waves, as complex numbers."""
    half = x.shape[1] // 2
    return x[:, 0] + 1j * x[:, 1], x[:, half] + 1j * x[:, half + 1]


def classes_of(vectors: np.ndarray, sigma: float, by: str, classes: int) -> np.ndarray:
    """Return the classes in which a shop puts vectors, numbered through."""
    sector = np.floor(classes * (np.angle(vectors) / (2 * np.pi) % 1))
    size = np.floor(classes * -np.expm1(-(np.abs(vectors / sigma) ** 2) / 2))
    return {"direction": sector, "size": size}.get(by, classes * sector + size)


@pytest.mark.parametrize(
    ("by", "classes", "sources"),
    [
        ("direction", 4, VECTORS),
        ("direction", 3, RUNOUTS),
        ("size", 4, VECTORS),
        ("direction and size", 2, RUNOUTS),
    ],
)
def test_vectors_are_paired_as_in_batches_that_are_assigned_exactly(by, classes, sources):
    plain = ErrorModel(tuple(sources))
    one, other = vectors_of(units_of(plain))
    sigma, batch, differences, left = one.real.std(), 100, [], []
    for start in range(0, 20_000, batch):
        lots = [own[start : start + batch] for own in (one, other)]
        number = [classes_of(own, sigma, by, classes) for own in lots]
        rows, columns = linear_sum_assignment(number[0][:, np.newaxis] != number[1])
        fits = number[0][rows] == number[1][columns]
        differences.append(np.abs(lots[0][rows] - lots[1][columns])[fits])
        left.append(1 - fits.mean())
    first, second = (own.name for own in sources)
    sorting = ta.Sorting(second, first, by=by, classes=classes, batch=batch)
    assert abs(np.mean(left) - sorting.leftover_of({own.name: own for own in sources})) < 4.5 * np.std(left) / np.sqrt(
        len(left)
    )
    x, before = units_of(errors_of(sorting, sources=tuple(sources)), seed=2), units_of(plain, seed=2)
    mated = vectors_of(x)
    assert stats.ks_2samp(np.concatenate(differences), np.abs(mated[0] - mated[1])).pvalue > 1e-3
    for column, own in zip(x.T, before.T, strict=True):  # every part keeps its law, and every other order its numbers
        assert stats.kstest(column, stats.norm(scale=own.std()).cdf).pvalue > 1e-4
    np.testing.assert_array_equal(x[:, : x.shape[1] // 2], before[:, : x.shape[1] // 2])
    np.testing.assert_array_equal(x[:, x.shape[1] // 2 + 2 :], before[:, x.shape[1] // 2 + 2 :])


def test_opposite_vectors_lie_in_opposite_sectors_and_the_smallest_with_the_largest():
    for by in ("direction", "size"):
        sorting = ta.Sorting("other", "one", by=by, opposite=True, classes=2)
        one, other = vectors_of(units_of(errors_of(sorting, sources=VECTORS), 4000))
        number = [classes_of(own, one.real.std(), by, 2) for own in (one, other)]
        assert (number[0] + number[1] == 1).mean() > (0.999 if by == "direction" else 0.97)
    np.testing.assert_array_equal(sorting.sectors("one"), [])
    directed = replace(sorting, by="direction")
    np.testing.assert_array_equal(directed.sectors("one"), [-180, 0, 180])
    np.testing.assert_array_equal(directed.sectors("other"), [0, 180, 360])


def test_sizes_of_vectors_end_where_the_quantiles_of_their_radius_lie():
    sorting = ta.Sorting("other", "one", by="size", classes=4)
    one, _ = vectors_of(units_of(errors_of(sorting, sources=VECTORS)))
    counts = np.bincount(np.searchsorted(sorting.limits(VECTORS[0]), np.abs(one)), minlength=4)
    assert abs(counts - UNITS / 4).max() < 4.5 * np.sqrt(UNITS * 3 / 16)


@pytest.mark.parametrize("positions", [2, 3, 8])
def test_a_part_is_turned_to_the_position_that_the_enumeration_of_all_finds(positions):
    indexing = ta.Indexing("other", positions=positions, against={"one": 0.7})
    x, plain = (units_of(own) for own in (errors_of(indexing, sources=VECTORS), ErrorModel(VECTORS)))
    one, other = vectors_of(plain)
    turns = np.exp(2j * np.pi * np.arange(positions) / positions)
    np.testing.assert_allclose(
        np.abs(0.7 * one + vectors_of(x)[1]),
        np.abs(0.7 * one[:, np.newaxis] + other[:, np.newaxis] * turns).min(axis=1),
        rtol=0,
        atol=1e-18,
    )
    np.testing.assert_array_equal(x[:, :2], plain[:, :2])
    np.testing.assert_allclose(np.abs(vectors_of(x)[1]), np.abs(other), rtol=1e-12)


@pytest.mark.parametrize("positions", [2, 5])
def test_the_mean_square_of_a_closed_sum_has_its_closed_form(positions):
    x = units_of(errors_of(ta.Indexing("other", positions=positions, against={"one": 1.0}), sources=VECTORS))
    square = np.abs(sum(vectors_of(x))) ** 2
    sigma2 = np.var(x[:, 0])
    # E|v + s|² = 4σ² − 2·E|v|·E|s|·E cos δ, E|v| = σ√(π/2), δ uniform within ± π/n
    expected = 4 * sigma2 - np.pi * sigma2 * np.sinc(1 / positions)
    assert abs(square.mean() - expected) < 4.5 * square.std() / np.sqrt(UNITS)


def test_a_run_out_turns_its_wave_of_order_one_and_keeps_the_others():
    errors = errors_of(ta.Indexing("disc2.runout", positions=4, against={"disc1.runout": 1.0}), sources=tuple(RUNOUTS))
    x, plain = units_of(errors, 2000), units_of(ErrorModel(tuple(RUNOUTS)), 2000)
    np.testing.assert_array_equal(x[:, [*range(6), 8, 9, 10, 11]], plain[:, [*range(6), 8, 9, 10, 11]])
    assert (x[:, 6:8] != plain[:, 6:8]).any(axis=1).mean() == pytest.approx(0.75, abs=0.05)
    standard = errors.standard_values(np.random.default_rng(1).random((2000, 12)))
    grown = errors.deviations(standard, errors.zones * 1.5)  # both alike, so that every position stays
    np.testing.assert_allclose(errors.by_zone(standard, errors.zones), (grown - x) / (0.5 * errors.zones.repeat(6)))


UNLIKE = (source("hole", zone=9e-6), source("shaft", zone=6e-6, distribution=Distribution.UNIFORM), SIZES[2])


@pytest.mark.parametrize("opposite", [False, True])
@pytest.mark.parametrize(("classes", "batch", "sources"), [(3, 60, SIZES), (4, 50, UNLIKE), (5, 20, UNLIKE)])
def test_classes_of_equal_width_have_the_law_of_batches_that_are_assigned_exactly(classes, batch, sources, opposite):
    sorting = ta.Sorting("shaft", "hole", classes=classes, width=1.5, batch=batch, opposite=opposite)
    plain = units_of(ErrorModel(sources), 30_000)
    ends = [sorting.limits(own) for own in sources[:2]]
    np.testing.assert_allclose(np.diff(ends[0]), 1.5e-6)
    gaps, built, left = [], [], []
    for start in range(0, 30_000, batch):
        hole, shaft = plain[start : start + batch, :2].T
        number = [np.searchsorted(own_ends, own) for own_ends, own in zip(ends, (hole, shaft), strict=True)]
        wanted = classes - 1 - number[0] if opposite else number[0]
        one, other = linear_sum_assignment(wanted[:, np.newaxis] != number[1])
        fits = wanted[one] == number[1][other]
        gaps.append((hole[one] - shaft[other])[fits])
        built.append(hole[one][fits])
        left.append(1 - fits.mean())
    share = sorting.leftover_of({own.name: own for own in sources})
    assert abs(np.mean(left) - share) < 4.5 * np.std(left) / np.sqrt(len(left))
    x = units_of(errors_of(sorting, sources=sources), seed=2)
    assert stats.ks_2samp(np.concatenate(gaps), x[:, 0] - x[:, 1]).pvalue > 1e-3
    assert stats.ks_2samp(np.concatenate(built), x[:, 0]).pvalue > 1e-3
    number = [np.searchsorted(own, x[:, at]) for at, own in enumerate(ends)]
    assert (number[1] == (classes - 1 - number[0] if opposite else number[0])).all()


def test_a_nominal_unit_stays_exact_and_derivatives_are_those_of_classes_that_grow():
    errors = errors_of(ta.Sorting("shaft", "hole", classes=4, width=1.0))
    np.testing.assert_array_equal(errors.deviations(np.zeros((1, 3)), errors.zones), 0.0)
    standard = errors.standard_values(np.random.default_rng(1).random((100, 3)))
    x = errors.deviations(standard, errors.zones)
    np.testing.assert_allclose(errors.by_zone(standard, errors.zones), x / errors.zones)
    plain = ErrorModel(SIZES)
    assert plain.by_zone(standard, plain.zones) is standard


PINS = tuple(source(name, zone=6e-6, each=8) for name in ("pins", "grooves"))


def test_every_like_feature_is_shimmed_on_its_own_as_a_batch_that_is_chosen_exactly_would_be():
    shim = ta.Shim("pins", step=1.5, sizes=5, against={"grooves": -1.0, "hole": 0.5})
    x = units_of(errors_of(shim, sources=(*SIZES, *PINS)), 4000)
    plain = units_of(ErrorModel((*SIZES, *PINS)), 4000)
    gaps = plain[:, 3:11] - plain[:, 11:] + 0.5 * plain[:, :1]
    sizes = 1.5e-6 * np.arange(-2, 3)
    best = np.abs(gaps[..., np.newaxis] + sizes).argmin(axis=2)  # every size tried at every pin
    np.testing.assert_allclose(x[:, 3:11], plain[:, 3:11] + sizes[best], rtol=0, atol=1e-18)
    np.testing.assert_array_equal(x[:, 11:], plain[:, 11:])


def test_sources_of_a_pattern_are_shimmed_each_against_its_own():
    names = ("b2.roller", "b10.roller", "b1.roller", "b10.gap", "b1.gap", "b2.gap")
    sources = tuple(source(name, zone=6e-6) for name in names)
    errors = errors_of(ta.Shim("b*.roller", step=0.5, sizes=41, against={"b*.gap": -1.0}), sources=sources)
    [shim] = errors.compensators
    assert shim.of_each == tuple((f"b{at}.roller", ((f"b{at}.gap", -1.0),)) for at in (1, 2, 10))
    assert shim.label == "41 sizes of b1.roller and 2 more"
    x, at = units_of(errors, 2000), {name: number for number, name in enumerate(names)}
    for number in (1, 2, 10):
        gap = x[:, at[f"b{number}.roller"]] - x[:, at[f"b{number}.gap"]]
        assert np.abs(gap).max() <= 0.25e-6 + 1e-15
    named = ta.Shim(("b1.roller", "b2.roller"), step=0.5, sizes=41, against={("b10.gap", "b1.gap"): -1.0})
    assert named.resolved(sources, "test") == named


def test_costs_are_of_classes_sizes_and_what_is_left_over():
    sorting = ta.Sorting("shaft", "hole", classes=4, batch=100, class_cost=0.2, leftover_cost=3.0)
    shim = ta.Shim("washer", step=1.0, sizes=5, size_cost=0.1)
    lost = sorting.leftover
    assert assembly_cost((sorting, shim), SIZES) == pytest.approx(0.2 * 3 + 3.0 * lost / (1 - lost) + 0.1 * 4)
    assert assembly_cost((), SIZES) == 0.0


def test_sorted_sources_are_one_block_of_a_ranking():
    errors = errors_of(ta.Sorting("shaft", "hole", classes=4))
    assert errors.blocks == (("hole", "shaft"), ("washer",))
    assert not errors.is_correlated


WAVES = replace(source("waves", feature=Feature.RUNOUT, zone=6e-6), spectrum=((2, 1.0),))
GROWN = replace(WAVES, name="grown", spectrum=((1, 1.0),), systematic=((1, 1e-6, 0.0),))
TILT = replace(VECTORS[0], name="tilt", over=0.03)
REFUSED = [
    (lambda: ta.Sorting("shaft", "hole", classes=0), "classes is 0"),
    (lambda: ta.Sorting("shaft", "hole", classes=(2, 2)), "classes is"),
    (lambda: ta.Sorting("shaft", "hole", classes=2.0), "classes is 2.0"),
    (lambda: ta.Sorting("shaft", "shaft"), "mates is 'shaft'"),
    (lambda: ta.Sorting("shaft"), "mates is missing"),
    (lambda: ta.Sorting("shaft", "hole", klasses=3), "klasses"),
    (lambda: ta.Sorting("shaft", "hole", batch=0), "batch is 0"),
    (lambda: ta.Sorting("shaft", "hole", class_cost=-1.0), "class_cost is -1"),
    (lambda: ta.Shim("washer", step=0.0), "step is 0"),
    (lambda: ta.Shim("washer", step=1.0, sizes=4), "sizes is 4"),
    (lambda: ta.Shim("washer", step=1.0, against={"washer": 1.0}), "against is 'washer'"),
    (lambda: ta.Shim("washer", step=1.0, against={"hole": "much"}), "against is"),
    (lambda: errors_of(ta.Sorting("shift", "hole")), "shift"),
    (lambda: errors_of(ta.Sorting("*", "hole")), "one source"),
    (lambda: errors_of(ta.Sorting("shaft", "hole", classes=2), ta.Sorting("shaft", "washer", classes=2)), "2 times"),
    (lambda: errors_of(ta.Sorting("shaft", "hole", classes=2), ta.Sorting("washer", "shaft", classes=2)), "mates"),
    (lambda: errors_of(ta.Shim("washer", step=1.0), ta.Shim("washer", step=2.0)), "2 times"),
    (lambda: errors_of(ta.Shim("s*", step=1.0, against={"[hw]*": 1.0})), "one source for all parts"),
    (lambda: errors_of(ta.Shim("hole", step=1.0, against={"pins": 1.0}), sources=(*SIZES, *PINS)), "like features"),
    (lambda: errors_of(ta.Shim(("hole", "h*"), step=1.0)), "every source once"),
    (lambda: errors_of(ta.Sorting("shaft", "hole", by="direction")), "a position, or a pitch or run-out"),
    (lambda: ta.Sorting("shaft", "hole", by="colour"), "by is 'colour'"),
    (lambda: errors_of(ta.Sorting("one", "waves", by="size"), sources=(*VECTORS, WAVES)), "with a wave of order 1"),
    (lambda: errors_of(ta.Sorting("one", "grown", by="size"), sources=(*VECTORS, GROWN)), "systematic"),
    (lambda: ta.Sorting("one", "other", by="size", width=1.0), "where a width is given"),
    (lambda: ta.Sorting("one", "other", width=0.0), "width is 0"),
    (lambda: errors_of(ta.Sorting("one", "other", width=1.0), sources=VECTORS), "a size where a width"),
    (
        lambda: errors_of(ta.Sorting("shaft", "hole", classes=2, width=1.0), ta.Sorting("washer", "hole", classes=2)),
        "equal width and once more",
    ),
    (lambda: ta.Indexing("one"), "against is 'empty'"),
    (lambda: ta.Indexing("one", positions=0, against={"other": 1.0}), "positions is 0"),
    (lambda: errors_of(ta.Indexing("one", against={"hole": 1.0}), sources=(*VECTORS, *SIZES)), "a position, or a"),
    (lambda: errors_of(ta.Indexing("one", against={"tilt": 1.0}), sources=(*VECTORS, TILT)), "angles with angles"),
    (lambda: errors_of(*2 * [ta.Indexing("one", against={"other": 1.0})], sources=VECTORS), "turned 2 times"),
    (lambda: all_choices((ta.Sorting("a", "b", classes=tuple(range(1, 18))),), "test"), "16 or less"),
]


@pytest.mark.parametrize(("made", "says"), REFUSED)
def test_what_cannot_be_sorted_or_shimmed_is_refused_in_one_sentence(made, says):
    with pytest.raises(TolallocError) as refused:
        made()
    said = str(refused.value)
    assert says in said
    assert said.endswith((".", "?"))
    assert "\n" not in said


def test_waves_and_correlated_parts_are_refused():
    with pytest.raises(InputError, match=r"disc1\.pitch"):
        in_force((ta.Sorting("disc1.pitch", "disc2.pitch", classes=2),), baseline_errors().sources, "test")
    pair = Correlation(pairs=(Pair(one="shaft", other="washer", correlation=0.5),))
    with pytest.raises(InputError, match="correlated with no other"):
        errors_of(ta.Sorting("shaft", "hole", classes=2), correlation=pair)
    with pytest.raises(InputError, match="correlated with no other"):
        errors_of(ta.Sorting("hole", "shaft", classes=2, width=1.0), correlation=pair)
    errors_of(ta.Sorting("hole", "shaft", classes=2), correlation=pair)
    with pytest.raises(UnknownNameError, match="hole"):
        in_force((ta.Sorting("pin.diameter", "hole", classes=2),), baseline_errors().sources, "test")


SMALL = ta.Effort(
    allocation=ta.AllocationEffort(
        verification_units=2**13, confirmation_units=2**16, share_blocks=64, search=ta.SearchEffort(steps=4)
    ),
    ranking=ta.RankingEffort(sobol=ta.SobolEffort(start=64, limit=64)),
)


def gap_study(**changes) -> ta.Study:
    """Return the study of a gap of two sizes."""
    row = {"plus": 10, "minus": -10, "unit": "µm", "min": 2, "max": 60, "cost": 10.0}
    nominal = {"hole": 10.0, "shaft": 10.0}
    model = ta.model(lambda hole, shaft: 1000 * (hole - shaft), inputs=nominal, outputs=("gap [µm]",))
    drawing = ta.Drawing.of_rows([{"id": name, "nominal": size, **row} for name, size in nominal.items()])
    limits = {"gap [µm]": ta.Limit(lower=-8.0, upper=8.0)}
    fields = {"name": "gap", "effort": SMALL, "questions": [ta.Allocation(front=False, what_if=False)], **changes}
    return ta.Study(model, drawing, limits=limits, **fields)


def yield_of_classes(zones: tuple[float, float], limit: float, classes: int) -> float:
    """Return the share of gaps within ± a limit, σ = zone/6 each, integrated class by class [zones and limit alike]."""
    ends = np.clip(stats.norm.ppf(np.arange(classes + 1) / classes), -9, 9)
    (one, other), found = (own / 6 for own in zones), 0.0
    points, weights = np.polynomial.legendre.leggauss(200)
    for low, high in pairwise(ends):
        x = (low + high) / 2 + (high - low) / 2 * points
        inside = [np.clip((one * x + side) / other, low, high) for side in (-limit, limit)]
        share = stats.norm.cdf(inside[1]) - stats.norm.cdf(inside[0])
        found += classes * np.sum(weights * (high - low) / 2 * stats.norm.pdf(x) * share)
    return float(found)


@pytest.fixture(scope="module")
def sorted_gap(tmp_path_factory) -> tuple[AllocationResult, object]:
    sorting = ta.Sorting("shaft", "hole", classes=(1, 2), batch=100, class_cost=0.3, leftover_cost=2.0)
    folder = tmp_path_factory.mktemp("sorted") / "run"
    run = gap_study(compensators=sorting).run(folder)
    return run.answers["allocation"].result, folder


@pytest.mark.slow
def test_the_cheapest_of_all_class_counts_is_drawn_and_keeps_its_yield(sorted_gap):
    result, _ = sorted_gap
    alone, two = result.assembled.choices
    assert result.met
    assert result.assembled.best is two
    assert two.cost < alone.cost
    zones = [1e6 * own.zone for own in result.drawn_sources]
    assert yield_of_classes((zones[0], zones[1]), 8.0, 2) >= 0.9973
    kept = result.assembled.as_they_come.joint
    assert kept.low <= yield_of_classes((zones[0], zones[1]), 8.0, 1) <= kept.high


@pytest.mark.slow
def test_the_cost_of_sorted_parts_lies_near_the_optimum_of_the_closed_form():
    sorting = ta.Sorting("shaft", "hole", classes=(1, 2))
    for own in gap_study(compensators=sorting).allocate(effort="quick").result.assembled.choices:
        classes = own.compensators[0].count if own.compensators else 1
        least = optimize.brentq(lambda zone, n=classes: yield_of_classes((zone, zone), 8.0, n) - 0.9973, 5, 60)
        assert 2 * 10 * 20 / least * 0.999 <= own.zones_cost <= 2 * 10 * 20 / least * 1.01


def test_an_allocation_of_one_class_is_todays_to_the_last_bit(sorted_gap):
    result, _ = sorted_gap
    today = gap_study().allocate().result
    assert result.assembled.choices[0].zones_cost == today.cost
    assert result.assembled.choices[0].joint == today.chosen.joint
    assert today.assembled is None


def test_every_file_that_leaves_says_which_classes_the_zones_hold_with(sorted_gap):
    result, folder = sorted_gap
    said = "Sort shaft into 2 classes"
    assert said in (folder / "allocation.csv").read_text(encoding="utf-8")
    assert said in (folder / "frames.dxf").read_text(encoding="utf-8")
    sheets = openpyxl.load_workbook(folder / "drawing.xlsx")
    assert any(said in str(cell.value) for sheet in sheets for row in sheet.iter_rows() for cell in row)
    page = page_of(folder)
    assert wording("allocation.heading_assembly") in page
    assert says(page, "allocation.assembly_cost", cost=result.assembled.best.cost, cost_unit="cost units")
    again = ta.drawing(folder / "allocation.csv")
    drawn = [own.zone for own in result.drawn_sources]
    assert [own.zone for own in again.sources] == pytest.approx(drawn, rel=1e-6)


@pytest.mark.slow
def test_questions_beside_the_allocation_take_the_first_number_of_classes():
    study = gap_study(compensators=ta.Sorting("shaft", "hole", classes=(4, 1)))
    assert Prepared(study=study).errors.compensators[0].count == 4
    kept = Prepared(study=study).kept_limits(4096).joint.estimate
    plain = Prepared(study=replace(study, compensators=())).kept_limits(4096).joint.estimate
    assert kept > plain
    ranked = study.rank(effort="quick").result
    assert "hole + shaft" in ranked.sobol.sources
    assert ranked.shapley is None
    assert not [header for header in measures_table(ranked).columns if "bound" in header]  # its output jumps


@pytest.mark.slow
def test_a_shim_is_chosen_with_the_zones():
    shim = ta.Shim("hole", step=4.0, sizes=(1, 5), against={"shaft": -1.0}, size_cost=0.1)
    result = gap_study(compensators=shim).allocate().result
    assert result.met
    assert result.assembled.best.label == "5 sizes of hole"
    assert result.assembled.best.assembly_cost == pytest.approx(0.4)
    assert result.assembled.best.cost < 0.6 * result.assembled.choices[0].cost


@pytest.mark.parametrize(
    "compensator",
    [
        ta.Sorting("shaft", "hole", classes=4, width=2.0),
        ta.Shim("shaft", step=1.0, sizes=3, against={"hole": -1.0}),
    ],
)
def test_no_law_of_a_linear_output_and_no_shapley_shares_are_claimed_where_parts_are_chosen(compensator):
    errors = errors_of(compensator)
    function = LinearFunction(offset=0.0, slopes=np.ones(3), rounding=0.0)
    assert LinearLaw.of(function, ErrorModel(SIZES), errors.zones) is not None
    assert LinearLaw.of(function, errors, errors.zones) is None


@pytest.mark.slow
def test_classes_of_equal_width_are_chosen_with_the_zones():
    sorting = ta.Sorting("shaft", "hole", classes=(1, 4), width=2.0, batch=100, class_cost=0.1, leftover_cost=1.0)
    result = gap_study(compensators=sorting).allocate().result
    alone, four = result.assembled.choices
    assert result.met
    assert result.assembled.best is four
    assert four.cost < alone.cost
    [acting], drawn = four.compensators, {own.name: own for own in result.drawn_sources}
    assert four.left_over == acting.leftover_of(drawn) > 0
    assert four.assembly_cost == pytest.approx(0.3 + four.left_over / (1 - four.left_over))
    errors = ErrorModel(tuple(result.drawn_sources), compensators=(acting,))
    gap = units_of(errors, 100_000) @ [1.0, -1.0]
    assert (np.abs(gap) <= 8e-6).mean() > 0.9973 - 4 * np.sqrt(0.0027 / 100_000)


SHOP = [
    (ta.Sorting("other", "one", by="direction", classes=4), "sort both into 4 sectors of 90°", "to [°]"),
    (
        ta.Sorting("other", "one", by="direction", classes=2, opposite=True),
        "each sector with the opposite one",
        "to [°]",
    ),
    (ta.Sorting("other", "one", by="size", classes=2), "classes that end at 1.03 µm of its radius", "to [µm]"),
    (ta.Sorting("other", "one", by="direction and size", classes=2), "sectors of 180° from the x axis", "from [µm]"),
    (ta.Sorting("shaft", "hole", width=2.0, classes=3), "3 classes that end at −1.00/1.00 µm from nominal", "to [µm]"),
    (
        ta.Indexing("other", positions=6, against={"one": -1.0}),
        "mount other at whichever of 6 positions 60° apart",
        "turned",
    ),
    (
        ta.Shim("pins", step=0.5, sizes=3, against={"grooves": -2.0}),
        "the measured pins − 2·grooves comes",
        "off nominal",
    ),
]


@pytest.mark.parametrize(("compensator", "said", "head"), SHOP)
def test_the_shop_is_told_in_one_line_without_commas_what_to_do(compensator, said, head):
    sources = (*VECTORS, *SIZES, *PINS)
    best = SimpleNamespace(compensators=in_force((compensator,), sources, "test"))
    result = SimpleNamespace(assembled=SimpleNamespace(best=best), drawn_sources=sources)
    [note] = assembly_notes(result)
    assert said in note
    assert "," not in note
    assert "\n" not in note
    assert any(column.startswith(head) or head in column for column in bins_table(result).columns)


@pytest.mark.slow
def test_a_ranking_of_one_block_draws_its_index_within_what_is_possible(tmp_path):
    sorting = ta.Sorting("shaft", "hole", classes=4)
    study = gap_study(compensators=sorting, questions=[ta.Ranking()])
    run = study.run(tmp_path / "run", effort="quick")
    [ranking] = [own for section in run.document.sections for own in section.figures if own.name.endswith("ranking")]
    for series in ranking.series[:2]:
        assert 0 <= series.low[0] <= series.y[0] <= series.high[0] <= 1
    assert (tmp_path / "run" / "report.html").exists()


def test_other_questions_say_that_an_allocation_may_sort_what_they_take_as_it_comes():
    row = {"plus": 4, "minus": -4, "unit": "µm", "min": 1, "max": 20, "cost": 1, "nominal": 10.0}
    study = ta.Study(
        ta.model(lambda hole, shaft: hole - shaft, inputs=("hole", "shaft"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows([{"id": name, **row} for name in ("hole", "shaft")]),
        limits={"gap [mm]": ta.Limit(lower=-0.004, upper=0.004)},
        compensators=[ta.Sorting("shaft", "hole", classes=(1, 2))],
    )
    (note,) = Prepared(study=study).notes
    assert (
        note == "Units are judged with parts as they come, but by an allocation, which may choose 2 classes of shaft."
    )

"""A lot against its drawing: false alarms, what is found, exact intervals, printed constants, the lot's own table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import tolalloc as ta
from tests.validation_manual import shown
from tolalloc.capability.indices import c4, control_limits, holm
from tolalloc.drawings.sources import Source
from tolalloc.wings.bench.lots import (
    GaugedColumn,
    LotRequest,
    LotResult,
    _without_gauge,
    drawn_lot,
    judge_lot,
    load_lot,
)
from tolalloc.wings.bench.processes import CONFIDENCE, EXACT, Gauge, GaugeError, Lots, NormalLaw

LEVEL, PARTS = 0.05, 25
ROW = {"plus": 3, "minus": -3, "unit": "µm", "min": 1, "max": 60, "cost": 1.0}
ROUND = ROW | {"plus": 8, "minus": 0, "feature": "position"}
MICROMETRE = 1e-6


def drawing_of(*rows: dict[str, object]) -> ta.Drawing:
    return ta.Drawing.of_rows(rows)


def judged(columns: Sequence[GaugedColumn], drawing: ta.Drawing, lots: Lots | None = None) -> LotResult:
    request = LotRequest(
        path=Path("lot.csv"), drawing=drawing, columns=tuple(columns), level=LEVEL, next_parts=None, seed=1
    )
    return judge_lot(request, lots)


@pytest.fixture(scope="module")
def few() -> ta.Drawing:
    """Twelve sources of the shipped drawing, four of each kind of gauge."""
    drawing = ta.drawing("rv20e_drawing")
    found: dict[Gauge, list[Source]] = {}
    for source in drawing.errors.active:
        found.setdefault(drawn_lot([source], 2, np.random.default_rng(0))[0].gauge, []).append(source)
    errors = replace(drawing.errors, sources=tuple(own for kind in found.values() for own in kind[:4]))
    return replace(drawing, errors=errors)


@pytest.fixture(scope="module")
def lots(few: ta.Drawing) -> Lots:
    return Lots(2 * len(few.sources), LEVEL, 1)


@pytest.mark.slow
def test_unmoved_lots_have_no_more_alarms_than_is_stated(few, lots):
    rng = np.random.default_rng(11)
    alarms = sum(bool(judged(drawn_lot(few.sources, PARTS, rng), few, lots).moved) for _ in range(200))
    # Beyond this count a rate of 5 % is refuted with 99.9 % confidence; far below 10 of 200 the tests would be blunt.
    assert 1 <= alarms <= stats.binom.isf(0.001, 200, LEVEL)


@pytest.mark.slow
def test_a_moved_process_is_named_in_95_of_100_lots(few, lots):
    rng, named = np.random.default_rng(12), 0
    for _ in range(200):
        columns, at = list(drawn_lot(few.sources, PARTS, rng)), int(rng.integers(len(few.sources)))
        own = columns[at]
        is_size = own.gauge is Gauge.DEVIATION
        values = own.values + 1.25 * own.source.zone / 6 if is_size else own.values * 1.8
        columns[at] = replace(own, values=values)
        named += own.source.name in [found.name for found in judged(columns, few, lots).moved]
    assert named >= 190


@cache
def _spread(source: Source, gauge: Gauge) -> float:
    return Lots(2, LEVEL, 1).process(source, gauge, PARTS).deviation


def gauged(column: GaugedColumn, share: float, rng: np.random.Generator) -> GaugedColumn:
    """Return a column read by a gauge whose standard deviation is this share of that of its parts."""
    spread = share * _spread(column.source, column.gauge)
    noise = spread * rng.standard_normal(column.values.size)
    return replace(column, values=column.values + noise, error=GaugeError(deviation=spread))


@pytest.mark.slow
def test_lots_read_by_a_gauge_that_errs_have_no_more_alarms_and_a_shift_is_found():
    drawing = drawing_of(*({"id": f"s{at}", **ROW} for at in range(3)), *({"id": f"p{at}", **ROUND} for at in range(3)))
    lots, rng, alarms, named = Lots(12, LEVEL, 1), np.random.default_rng(21), 0, 0
    held = np.zeros(3)
    for _ in range(200):
        columns = [gauged(own, 0.5, rng) for own in drawn_lot(drawing.sources, PARTS, rng)]
        found = judged(columns, drawing, lots)
        alarms += bool(found.moved)
        for own, capable in zip(found.processes, found.capabilities, strict=True):
            truth = (own.stated.mean, own.stated.deviation, 1.0)
            ends = (own.mean_interval, own.deviation_interval, capable.cp_interval)
            held += [low <= one <= high for one, (low, high) in zip(truth, ends, strict=True)]
        shifted = replace(columns[0], values=columns[0].values + found.detectable * MICROMETRE)
        named += judged([shifted, *columns[1:]], drawing, lots).processes[0].mean_moved
    assert 1 <= alarms <= stats.binom.isf(0.001, 200, LEVEL)
    assert stats.binom.cdf(named, 200, 0.95) > 0.001  # not refuted, and so 95 % or more by Holm's procedure
    # Of 1200 intervals 1140 hold the truth, and with 99.9 % probability no fewer and no more than these.
    assert (held >= stats.binom.ppf(0.0005, 1200, CONFIDENCE)).all(), held
    assert (held <= stats.binom.ppf(0.9995, 1200, CONFIDENCE)).all(), held


def test_a_stated_gauge_is_taken_off_as_a_textbook_has_it():
    drawing = drawing_of({"id": "a", **ROW})
    column = gauged(drawn_lot(drawing.sources, PARTS, np.random.default_rng(7))[0], 0.6, np.random.default_rng(8))
    found = judged([column], drawing)
    (own,), (capable,) = found.processes, found.capabilities
    square, gauge = column.values.var(ddof=1), (0.6 * MICROMETRE) ** 2
    ends = (PARTS - 1) * square / stats.chi2.isf([0.025, 0.975], PARTS - 1) - gauge
    assert own.deviation == pytest.approx(np.sqrt(square - gauge))
    assert own.deviation_interval == pytest.approx(np.sqrt(ends))
    assert capable.cp == pytest.approx(MICROMETRE / own.deviation)
    assert capable.cp_interval == pytest.approx(MICROMETRE / np.sqrt(ends[::-1]))
    assert own.gauge_share == pytest.approx(gauge / square)
    below = stats.chi2.cdf((PARTS - 1) * square / (MICROMETRE**2 + gauge), PARTS - 1)
    assert own.spread_probability == pytest.approx(2 * min(below, 1 - below))
    assert own.next.mean[1] == pytest.approx(3 * np.hypot(1, 0.6) * MICROMETRE / 5)


def test_parts_that_are_read_again_tell_their_gauge_and_its_doubt(tmp_path):
    """Simulated lots with a gauge known from 25 repeat readings: intervals as the generalized ones of Weerahandi."""
    rng, drawing = np.random.default_rng(3), drawing_of({"id": "a", **ROW})
    parts, noise = rng.standard_normal(PARTS), 0.5 * rng.standard_normal((2, PARTS))
    rows = [f"P{at},{parts[at] + noise[time, at]:.9f}" for time in range(2) for at in range(PARTS)]
    (tmp_path / "lot.csv").write_text("part,a [µm]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    (column,) = load_lot(tmp_path / "lot.csv", drawing.sources)
    within = (np.diff(noise, axis=0) ** 2 / 2).mean()
    assert sorted(column.values) == pytest.approx(sorted((parts + noise.mean(axis=0)) * MICROMETRE), abs=1e-14)
    assert column.error.freedom == PARTS
    assert column.error.deviation == pytest.approx(np.sqrt(within / 2) * MICROMETRE, rel=1e-6)
    own = judged([column], drawing).processes[0]
    square = column.values.var(ddof=1) / MICROMETRE**2
    total = (PARTS - 1) * square / rng.chisquare(PARTS - 1, 400_000)
    process = total - PARTS * within / 2 / rng.chisquare(PARTS, 400_000)
    ends = np.sqrt(np.maximum(np.quantile(process, [0.025, 0.975]), 0)) * MICROMETRE
    assert own.deviation_interval == pytest.approx(ends, rel=0.01)
    assert own.deviation == pytest.approx(np.sqrt(square - within / 2) * MICROMETRE, rel=1e-6)


@pytest.mark.slow
def test_lots_whose_gauge_is_known_from_repeats_have_no_more_alarms():
    drawing = drawing_of({"id": "a", **ROW}, {"id": "b", **ROUND})
    rng, alarms, held = np.random.default_rng(23), 0, np.zeros(2)
    names = [str(at // 2) for at in range(2 * PARTS)]
    for _ in range(150):
        columns = []
        for own in drawn_lot(drawing.sources, PARTS, rng):
            read = gauged(replace(own, values=np.repeat(own.values, 2)), 0.5, rng)
            columns.append(_without_gauge(Path("lot.csv"), replace(read, error=EXACT), names, None))
        found = judged(columns, drawing)
        alarms += bool(found.moved)
        for own, capable in zip(found.processes, found.capabilities, strict=True):
            low, high = own.deviation_interval
            held += [low <= own.stated.deviation <= high, capable.cp_interval[0] <= 1.0 <= capable.cp_interval[1]]
    assert 1 <= alarms <= stats.binom.isf(0.001, 150, LEVEL)
    assert (held >= stats.binom.ppf(0.0005, 300, CONFIDENCE)).all(), held


def test_coordinates_of_a_gauge_that_errs_have_the_capability_of_their_place():
    drawing = drawing_of({"id": "a", **ROUND})
    (source,) = drawing.sources
    rng, sigma = np.random.default_rng(4), source.zone_mapping.wave_deviation * source.zone
    points = sigma * rng.standard_normal((2, 500)) + 0.7 * sigma * rng.standard_normal((2, 500))
    columns = [
        GaugedColumn(header=f"a.{axis}", source=source, gauge=axis, values=own, error=GaugeError(deviation=0.7 * sigma))
        for axis, own in zip((Gauge.X, Gauge.Y), points, strict=True)
    ]
    (capable,) = judged(columns, drawing).capabilities
    exact = judged([replace(own, values=own.values / np.hypot(1, 0.7), error=EXACT) for own in columns], drawing)
    # Three standard errors of the scale of 500 points, which the gauge makes half as large again.
    assert capable.cp == pytest.approx(1.0, rel=3 * 1.5 / np.sqrt(4 * 500))
    assert capable.cpk == pytest.approx(exact.capabilities[0].cpk, rel=0.05)
    assert capable.cp_interval[0] < 1.0 < capable.cp_interval[1]


@pytest.mark.slow
def test_what_is_detectable_is_found_as_often_as_it_says():
    drawing = drawing_of(*({"id": f"size{at}", **ROW} for at in range(10)))
    rng, named = np.random.default_rng(3), 0
    shift = judged(drawn_lot(drawing.sources, PARTS, rng), drawing).detectable
    for _ in range(400):
        columns = list(drawn_lot(drawing.sources, PARTS, rng))
        columns[0] = replace(columns[0], values=columns[0].values + shift * MICROMETRE)
        named += judged(columns, drawing).processes[0].mean_moved
    assert shift == pytest.approx((stats.norm.isf(LEVEL / 40) + stats.norm.isf(0.05)) / 5)
    assert stats.binom.cdf(named, 400, 0.95) > 0.001  # not refuted
    assert stats.binom.sf(named - 1, 400, 0.95) > 0.001


def test_a_wider_spread_is_named_as_spread_and_a_shift_as_mean():
    drawing = drawing_of({"id": "a", **ROW}, {"id": "b", **ROW})
    rng = np.random.default_rng(5)
    wide, moved = drawn_lot(drawing.sources, 200, rng)
    wide = replace(wide, values=2.5 * (wide.values - wide.values.mean()) + 0.05 * MICROMETRE)
    found = judged([wide, replace(moved, values=moved.values + 0.6 * MICROMETRE)], drawing).processes
    assert (found[0].named_shift, found[0].spread_moved) == (False, True)
    assert (found[1].named_shift, found[1].spread_moved) == (True, False)
    assert found[1].shift[0] == pytest.approx(0.6, abs=0.2)
    assert found[0].spread[0] == pytest.approx(2.5, rel=0.15)


def test_a_normal_size_has_the_p_values_and_intervals_of_a_textbook():
    drawing = drawing_of({"id": "a", **ROW})
    (column,) = drawn_lot(drawing.sources, PARTS, np.random.default_rng(7))
    own, values = judged([column], drawing).processes[0], column.values
    low, high = stats.t.interval(CONFIDENCE, PARTS - 1, values.mean(), stats.sem(values))
    assert own.mean_interval == pytest.approx((low, high))
    square = (PARTS - 1) * values.var(ddof=1)
    assert own.deviation_interval == pytest.approx(np.sqrt(square / stats.chi2.isf([0.025, 0.975], PARTS - 1)))
    assert own.shift_probability == pytest.approx(2 * stats.norm.sf(abs(values.mean()) * 5 / MICROMETRE))
    below = stats.chi2.cdf(square / MICROMETRE**2, PARTS - 1)
    assert own.spread_probability == pytest.approx(2 * min(below, 1 - below))


def test_simulated_lots_of_a_normal_size_are_those_of_the_closed_form():
    """A mixture of one batch is normal, and is simulated."""
    one = {"id": "a", "distribution": "mixture", "batches": "1:0:1", **ROW}
    (source,) = drawing_of(one).sources
    found, exact = Lots(2, 0.01, 1).process(source, Gauge.DEVIATION, PARTS), NormalLaw(parts=PARTS)
    assert not found.is_normal
    assert (found.mean, found.deviation) == pytest.approx((0.0, MICROMETRE), abs=1e-3 * MICROMETRE)
    assert found.law.t_ends == pytest.approx(exact.t_ends, abs=0.05)
    assert found.law.s_ends == pytest.approx(exact.s_ends, abs=0.01)
    for shift, ratio in ((0.3, 1.2), (-0.5, 0.7)):
        assert found.law.shift_probability(shift) == pytest.approx(exact.shift_probability(shift), rel=0.1)
        assert found.law.spread_probability(ratio) == pytest.approx(exact.spread_probability(ratio), rel=0.1)


def test_capability_of_a_radius_has_the_interval_of_rayleigh_s_scale():
    """The sum of squares of n radii over σ² is χ² with 2n degrees of freedom."""
    drawing = drawing_of({"id": "a", **ROUND})
    (column,) = drawn_lot(drawing.sources, PARTS, np.random.default_rng(2))
    (own,) = judged([column], drawing).capabilities
    low, high = np.sqrt(stats.chi2.ppf([0.025, 0.975], 2 * PARTS) / (2 * PARTS))
    assert own.cp_interval == pytest.approx((own.cp * low, own.cp * high), rel=0.01)
    sigma = np.sqrt((column.values**2).mean() / 2)
    assert own.cp == pytest.approx(4 * MICROMETRE / (np.sqrt(-2 * np.log(0.0027)) * sigma), rel=0.002)


@pytest.mark.parametrize("row", [ROW, ROUND, ROW | {"distribution": "lognormal", "shape": 0.5}])
def test_intervals_hold_the_truth_as_often_as_they_say(row):
    drawing = drawing_of({"id": "a", **row})
    lots, rng, held = Lots(2, LEVEL, 1), np.random.default_rng(4), np.zeros(4)
    for _ in range(600):
        found = judged(drawn_lot(drawing.sources, PARTS, rng), drawing, lots)
        (own,), (capable,) = found.processes, found.capabilities
        truth = (own.stated.mean, own.stated.deviation, 1.0)
        ends = (own.mean_interval, own.deviation_interval, capable.cp_interval)
        held[:3] += [low <= one <= high for one, (low, high) in zip(truth, ends, strict=True)]
    # Of 600 intervals 570 hold it, and with 99.9 % probability no fewer and no more than these.
    assert (held[:3] >= stats.binom.ppf(0.0005, 600, CONFIDENCE)).all(), held
    assert (held[:3] <= stats.binom.ppf(0.9995, 600, CONFIDENCE)).all(), held


def test_cpk_of_normal_sizes_is_in_bissell_s_interval_about_as_often_as_it_says():
    drawing = drawing_of({"id": "a", "Cp": 1.2, "shift": 0.2, **ROW})
    truth, rng = 0.8 * 1.2, np.random.default_rng(9)
    found = [judged(drawn_lot(drawing.sources, 50, rng), drawing).capabilities[0].cpk_interval for _ in range(600)]
    assert 0.92 <= np.mean([low <= truth <= high for low, high in found]) <= 0.98


@pytest.mark.parametrize(
    ("parts", "a", "centre", "b5", "b6"),
    [
        (2, 2.121, 0.7979, 0.0, 2.606),
        (5, 1.342, 0.9400, 0.0, 1.964),
        (10, 0.949, 0.9727, 0.276, 1.669),
        (25, 0.600, 0.9896, 0.559, 1.420),
    ],
)
def test_control_limits_have_the_printed_constants(parts, a, centre, b5, b6):
    """Montgomery 2012, appendix VI, the constants of ISO 7870-2."""
    found = control_limits(0.0, 1.0, parts)
    assert c4(parts) == pytest.approx(centre, abs=5e-5)
    assert found.mean == pytest.approx((-a, a), abs=6e-4)
    assert found.deviation == pytest.approx((b5, b6), abs=6e-4)
    if parts == 5:
        shown("C8", found.deviation[1])


def test_no_control_limit_of_a_radius_is_below_zero():
    drawing = drawing_of({"id": "a", **ROUND}, {"id": "b", **ROW})
    request = LotRequest(
        path=Path("lot.csv"),
        drawing=drawing,
        columns=drawn_lot(drawing.sources, PARTS, np.random.default_rng(1)),
        level=LEVEL,
        next_parts=2,
        seed=1,
    )
    radius, size = judge_lot(request).processes
    assert radius.next.mean[0] == 0.0
    assert radius.next.mean[1] == pytest.approx(radius.stated.mean + 3 * radius.stated.deviation / np.sqrt(2))
    assert size.next.mean == pytest.approx((-3e-6 / np.sqrt(2), 3e-6 / np.sqrt(2)))


def test_holm_rejects_no_less_than_bonferroni_and_nothing_behind_the_first_kept():
    assert holm([0.001, 0.02, 0.011, 0.5], 0.05).tolist() == [True, True, True, False]
    assert holm([0.001, 0.03, 0.03, 0.04], 0.05).tolist() == [True, False, False, False]
    assert holm([0.05], 0.05).tolist() == [True]


@pytest.mark.parametrize(
    "row",
    [
        ROW,
        ROW | {"plus": 5, "minus": 1},
        ROW | {"distribution": "uniform"},
        ROW | {"distribution": "lognormal", "shape": 0.4},
        ROW | {"distribution": "mixture", "batches": "0.5:-0.3:0.5 0.5:0.3:0.5"},
        ROW | {"sorted": True},
    ],
)
def test_the_lot_s_own_row_makes_parts_with_mean_and_spread_of_the_lot(row, tmp_path):
    drawing = drawing_of({"id": "a", **row})
    (column,) = drawn_lot(drawing.sources, 400, np.random.default_rng(1))
    column = replace(column, values=0.8 * column.values + 0.3 * MICROMETRE)
    found = judged([column], drawing)
    (source,) = ta.drawing(found.drawing.to_csv(tmp_path / "lot.csv")).sources
    mean, deviation = source.zone_mapping.moments
    assert source.middle + mean * source.zone == pytest.approx(column.values.mean(), abs=2e-3 * MICROMETRE)
    assert deviation * source.zone == pytest.approx(column.values.std(ddof=1), rel=1e-3)


def test_the_lot_s_row_of_a_total_deviation_makes_as_large_ones(few):
    source = next(own for own in few.sources if own.name == "disc1.pitch")
    rng = np.random.default_rng(1)
    (column,) = drawn_lot([source], 4000, rng)
    (own,) = judged([replace(column, values=1.5 * column.values)], few).capabilities
    (again,) = drawn_lot([own.row], 4000, rng)
    assert own.cp == pytest.approx(1 / 1.5, rel=0.02)
    assert np.sqrt((again.values**2).mean()) == pytest.approx(1.5 * np.sqrt((column.values**2).mean()), rel=0.02)


def test_a_drawing_s_settings_go_with_its_table(tmp_path):
    drawing = ta.drawing("rv20e_drawing")
    assert drawing.settings
    assert dict(ta.drawing(drawing.to_csv(tmp_path / "again.csv")).settings) == dict(drawing.settings)


def test_coordinates_radius_and_diameter_are_read_alike(tmp_path):
    sources = drawing_of({"id": "bore", **ROUND}).sources
    points = np.random.default_rng(6).normal(size=(8, 2))
    radius = np.hypot(*points.T)

    def read(header: str, rows: np.ndarray) -> list[np.ndarray]:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.csv"
        text = "\n".join(",".join(f"{cell:.12g}" for cell in row) for row in rows)
        path.write_text(f"{header}\n{text}\n", encoding="utf-8")
        return [own.taken for own in load_lot(path, sources)]

    both = read("bore.x [µm],bore.y [µm]", points)
    assert np.hypot(*both) == pytest.approx(radius * MICROMETRE)
    assert read("bore.radius [µm]", radius[:, np.newaxis])[0] == pytest.approx(radius * MICROMETRE)
    assert read("bore.diameter [mm]", radius[:, np.newaxis] * 2e-3)[0] == pytest.approx(radius * MICROMETRE)


def test_coordinates_of_which_one_gauge_is_stated_stay_with_their_part(tmp_path):
    """Names of parts out of the alphabet's order, one of them read again."""
    points = np.random.default_rng(6).normal(size=(8, 2))
    points[3] = points[1] + 0.1
    names = ["P9", "P2", "P7", "P2", "", "P1", "P5", ""]
    rows = [f"{name},{x:.12g},{y:.12g}" for name, (x, y) in zip(names, points, strict=True)]
    path = tmp_path / "lot.csv"
    path.write_text("\n".join(["part,bore.x [µm],bore.y [µm]", *rows, "gauge,0.2,"]) + "\n", encoding="utf-8")
    x, y = load_lot(path, drawing_of({"id": "bore", **ROUND}).sources)
    assert x.error.freedom == np.inf and y.error.freedom == 1.0
    together = np.stack([x.taken, y.taken], axis=1) / MICROMETRE
    mean = (points[1] + points[3]) / 2
    assert together == pytest.approx(np.array([points[0], mean, points[2], *points[4:]]))


def test_cells_may_be_missing_and_words_stand_beside(tmp_path):
    path = tmp_path / "lot.csv"
    rows = [f"P{at},{'' if at % 3 else at / 10},{'n/a' if at == 4 else at / 5},ok" for at in range(18)]
    path.write_text("part,a [µm],b [um],note\n" + "\n".join(rows) + "\n", encoding="utf-8")
    one, other = load_lot(path, drawing_of({"id": "a", **ROW}, {"id": "b", **ROW}).sources)
    assert (one.taken.size, other.taken.size, one.values.size) == (6, 17, 18)
    assert one.taken == pytest.approx(np.arange(0, 18, 3) / 10 * MICROMETRE)


def test_an_own_id_heads_a_column(tmp_path):
    path = tmp_path / "lot.csv"
    path.write_text("B7.radius [µm]\n" + "\n".join(map(str, range(1, 7))) + "\n", encoding="utf-8")
    (column,) = load_lot(path, drawing_of({"id": "B7", "source": "bore", **ROUND}).sources)
    assert (column.name, column.gauge) == ("bore", Gauge.RADIUS)

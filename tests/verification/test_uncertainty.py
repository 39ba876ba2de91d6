"""From zones to columns: the mapping is what it says, and random numbers hang on one seed tree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.builders import baseline_errors, deviations_at
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.measured_parts import MeasuredParts
from tolalloc.drawings.seeds import CHUNK, SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table, require_small_zones, table_frame, with_zones
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError
from tolalloc.reducers.unit_file import load_unit

SPECTRUM = ((1, 9.2), (2, 4.3), (4, 1.0))
CASES = [
    (Feature.SIZE, (), 1),
    (Feature.POSITION, (), 2),
    (Feature.PITCH, SPECTRUM, 6),
    (Feature.RUNOUT, ((1, 1.0),), 2),
]


def source(feature: Feature, spectrum, **more) -> Source:
    return Source(
        name="s", part="", feature=feature, zone=4e-6, minimum=0.0, maximum=1.0, cost=1.0, spectrum=spectrum, **more
    )


def measure(feature: Feature, spectrum, columns: np.ndarray) -> np.ndarray:
    """Return what the drawing limits, over the zone: 1 is just inside."""
    if feature is Feature.SIZE:
        return 2 * np.abs(columns[:, 0])
    if feature is Feature.POSITION:
        return 2 * np.hypot(columns[:, 0], columns[:, 1])
    turn = np.linspace(0, 2 * np.pi, 721)
    waves = np.concatenate([[np.cos(order * turn), np.sin(order * turn)] for order, _ in spectrum])
    return np.ptp(columns @ waves, axis=1)


@pytest.mark.parametrize(("feature", "spectrum", "columns"), CASES)
def test_9973_percent_lie_inside_the_zone_at_cp_1(feature, spectrum, columns, generator):
    count = 200_000
    uniform = generator.random((count, columns))
    values = source(feature, spectrum).standard_values(uniform)
    inside = (measure(feature, spectrum, values) <= 1).mean()
    # Three standard errors of the share; the range's quantile itself is integrated to about a tenth of a percent.
    assert inside == pytest.approx(0.9973, abs=3 * np.sqrt(0.0027 / count) + 1e-4 * (len(spectrum) > 1))


@pytest.mark.parametrize(("feature", "spectrum", "columns"), CASES)
def test_uniform_magnitudes_stay_inside_the_zone(feature, spectrum, columns, generator):
    uniform = generator.random((5000, columns))
    values = source(feature, spectrum, distribution=Distribution.UNIFORM).standard_values(uniform)
    inside = measure(feature, spectrum, values)
    assert inside.max() <= 1 + 1e-12
    assert inside.max() > 0.8


@pytest.mark.parametrize(("feature", "spectrum", "columns"), CASES)
def test_errors_at_the_limit_fill_the_zone(feature, spectrum, columns, generator):
    values = source(feature, spectrum).at_limit(generator.random((200, columns)))
    np.testing.assert_allclose(measure(feature, spectrum, values), 1.0, rtol=2e-3)


def test_cp_and_shift(generator):
    uniform = generator.random((100_000, 1))
    values = source(Feature.SIZE, (), cp=2.0, shift=0.5).standard_values(uniform)[:, 0]
    assert values.std() == pytest.approx(1 / 12, rel=0.01)
    assert values.mean() == pytest.approx(0.25, abs=3 / 12 / np.sqrt(values.size))


def test_baseline_zones_are_the_magnitudes_of_table_4():
    """A bore 2 µm off centre is a position of Ø 4 µm; a range over a turn is that of the printed harmonics."""
    unit = load_unit("table4").deviations
    for row in load_tolerance_table("rv20e_table4"):
        if row.zone == 0:
            continue
        errors = np.array([[unit[column] for column in row.columns]])
        printed = measure(row.feature, row.spectrum, errors)[0]
        assert row.zone == pytest.approx(printed, abs=0.06e-6), row.name


def test_like_features_deviate_alone_and_angles_are_taken_over_a_length(generator):
    pins = Source(
        name="each_pin.position",
        part="",
        feature=Feature.POSITION,
        zone=4e-6,
        minimum=0.0,
        maximum=1.0,
        cost=1.0,
        each=40,
    )
    tilt = Source(
        name="crank1.tilt", part="", feature=Feature.POSITION, zone=4e-6, minimum=0.0, maximum=1.0, cost=1.0, over=0.03
    )
    assert pins.columns[:3] == ("each_pin.position.1.x", "each_pin.position.1.y", "each_pin.position.2.x")
    errors = ErrorModel((pins, tilt))
    x = deviations_at(errors, generator.random((20_000, 82)))
    assert np.abs(np.corrcoef(x.T) - np.eye(82)).max() < 5 / np.sqrt(20_000)
    radius = np.hypot(x[:, 0::2], x[:, 1::2])
    share = (radius <= [2e-6] * 40 + [2e-6 / 0.03]).mean(axis=0)
    assert share == pytest.approx(0.9973, abs=4 * np.sqrt(0.0027 / 20_000))
    np.testing.assert_allclose(np.hypot(*tilt.at_limit(generator.random((5, 2))).T) * 4e-6, 2e-6 / 0.03)


def test_columns_are_linear_in_the_zones(generator):
    errors = baseline_errors()
    standard = errors.standard_values(generator.random((10, len(errors.columns))))
    one, two = errors.deviations(standard, errors.zones), errors.deviations(standard, 2 * errors.zones)
    np.testing.assert_allclose(two, 2 * one, rtol=1e-12)


def test_table_survives_writing_and_reading(tmp_path):
    sources = load_tolerance_table("rv20e_table4")
    moved = with_zones(sources, [0.8 * source.zone for source in sources])
    table_frame(moved).to_csv(tmp_path / "moved.csv", index=False)
    table_frame(moved).to_excel(tmp_path / "moved.xlsx", index=False)
    for again in (load_tolerance_table(tmp_path / "moved.csv"), load_tolerance_table(tmp_path / "moved.xlsx")):
        for source, other in zip(moved, again, strict=True):
            assert other.zone == pytest.approx(source.zone, abs=1e-10)
            assert other.cost == pytest.approx(source.cost, abs=1e-6)
            assert (other.name, other.group, other.locked) == (source.name, source.group, source.locked)


def test_zones_take_the_costs_that_they_were_bought_at_and_else_cost_1_over_zone():
    sources = load_tolerance_table("rv20e_table4")[:3]
    moved = with_zones(sources, [0.5 * source.zone for source in sources], {sources[1].name: 7.0})
    assert [source.cost for source in moved] == [2 * sources[0].cost, 7.0, 2 * sources[2].cost]
    bought = with_zones(sources, [source.zone for source in sources], {sources[1].name: 7.0})
    assert bought[0] is sources[0] and bought[1].cost == 7.0 and bought[1].grade == sources[1].grade


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"measured": MeasuredParts(path=Path("p.csv"), values=(3e-3,), are_radii=False, zone=1e-4, middle=0.0)},
            r"mine.csv \(s\): p.csv has a deviation of 3000 µm; allowed is 2000 µm\.",
        ),
        ({"zone": 3e-4}, r"mine.csv \(s\): the zone plus − minus is 300 µm and must be 0 to 200 µm\."),
        ({"maximum": 3e-4}, "between min and max, above 0 and up to 200 µm: min 0, zone 4, max 300 µm"),
    ],
)
def test_a_model_may_refuse_zones_that_a_table_may_have(changes, sentence):
    own = replace(source(Feature.SIZE, ()), maximum=2e-4)
    require_small_zones([own], 200e-6, "mine.csv")
    require_small_zones([replace(own, zone=0.0, maximum=1.0)], 200e-6, "mine.csv")
    with pytest.raises(InputError, match=sentence):
        require_small_zones([replace(own, **changes)], 200e-6, "mine.csv")


def test_seed_tree_gives_the_same_bits_for_any_number_of_samples_and_tells_its_nodes_apart():
    node = SeedTree(0).child("a")
    long = np.concatenate(list(node.uniform_chunks(2 * CHUNK + 5, 3)))
    short = np.concatenate(list(node.uniform_chunks(CHUNK + 7, 3)))
    np.testing.assert_array_equal(long[: CHUNK + 7], short)
    assert not np.array_equal(next(SeedTree(0).child("b").uniform_chunks(5, 3)), long[:5])
    assert not np.array_equal(next(SeedTree(1).child("a").uniform_chunks(5, 3)), long[:5])
    assert SeedTree(0).integer() > 0

"""One line per dimension of a drawing: the index of a group, and the frame of every kind of source."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Evaluation
from tolalloc.reports.feature_frame import SYMBOLS, FeatureFrame, callout, callout_assumptions, svg_of, written
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.sobol import regrouped, sobol_indices

UM = 1e-6


def source(name: str, group: str = "", **changes) -> Source:
    own = Source(name=name, part="part", feature=Feature.SIZE, zone=6 * UM, minimum=UM, maximum=9 * UM, cost=1.0)
    return replace(own, group=group or name, **changes)


TWINS = (source("a1", "a"), source("a2", "a"), source("b"))


class Product:
    """a1·a2 + b, scaled to standard normal numbers: all that the twins do, they do together."""

    columns, outputs = ("a1", "a2", "b"), ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        a1, a2, b = (x / UM).T
        return Evaluation(values=(a1 * a2 + b)[:, np.newaxis], status=np.zeros(len(x), np.uint8))


def test_a_group_is_ranked_together():
    errors = ErrorModel(TWINS)
    experiment, effort = Experiment.of(Product(), errors, SeedTree(1), 0.0), SobolEffort(start=1024, limit=1024)
    alone = sobol_indices(experiment, effort).of(0)
    grouped = sobol_indices(experiment, effort, factor_groups=errors.dimension_of_column).of(0)
    assert grouped.sources == ("a", "b")
    np.testing.assert_allclose(grouped.total, [0.5, 0.5], atol=0.03)
    np.testing.assert_allclose(grouped.first, [0.5, 0.5], atol=0.05)
    # Each twin alone does nothing and has a part in all of it: their indices do not add up to that of the group.
    np.testing.assert_allclose(alone.total, [0.5, 0.5, 0.5], atol=0.04)
    np.testing.assert_allclose(alone.first[:2], 0.0, atol=0.06)


def test_other_groups_of_solved_blocks_have_the_same_indices_and_only_new_samples_are_solved():
    errors, asked = ErrorModel(TWINS), []

    class Counted(Product):
        def __call__(self, x: np.ndarray) -> Evaluation:
            asked.append(len(x))
            return super().__call__(x)

    experiment, effort = Experiment.of(Counted(), errors, SeedTree(1), 0.0), SobolEffort(start=256, limit=256)
    alone, solved = sobol_indices(experiment, effort), sum(asked)
    found = regrouped(experiment, alone, errors.dimension_of_column)
    assert sum(asked) - solved == 256  # both twins exchanged; b is a source of its own
    whole = sobol_indices(experiment, effort, factor_groups=errors.dimension_of_column).of(0)
    for name in ("total", "first", "total_resamples", "first_resamples"):
        np.testing.assert_array_equal(getattr(found, name), getattr(whole, name))
    assert (found.sources, found.blocks, found.samples) == (whole.sources, whole.blocks, whole.samples)
    same = regrouped(experiment, alone, errors.source_of_column)
    np.testing.assert_array_equal(same.total, alone.of(0).total)


def test_correlated_members_of_two_groups_are_one_dimension():
    errors = ErrorModel(TWINS, correlation=Correlation(pairs=(Pair(one="a2", other="b", correlation=0.5),)))
    assert errors.dimension_of_column == ("a + b",) * 3
    assert ErrorModel(TWINS).dimension_of_column == ("a", "a", "b")


@pytest.mark.parametrize(
    ("zone", "text"),
    [(4.757, "0.00475"), (10.0, "0.01"), (9.999999999, "0.01"), (0.3, "0.0003"), (0.005, "0"), (16.6, "0.0166")],
)
def test_a_zone_is_written_in_hundredths_of_a_micrometre_and_never_wider(zone, text):
    assert written(zone * UM) == text
    assert float(text) * 1e3 <= zone + 1e-6


@pytest.mark.parametrize(
    ("changes", "shown"),
    [
        ({"name": "disc1.bore1.position", "feature": Feature.POSITION}, "⌖ ⌀0.006 A"),
        ({"name": "housing.runout", "feature": Feature.RUNOUT, "spectrum": ((1, 1.0),)}, "↗ 0.006 A"),
        ({"name": "housing.pitch", "feature": Feature.PITCH, "spectrum": ((1, 1.0),)}, "Fp 0.006"),
        ({"name": "pin.diameter"}, "±0.003"),
        ({"name": "pin.diameter", "middle": -2.26 * UM}, "+0.00074 / −0.00526"),
        ({"name": "carrier.tilt", "feature": Feature.POSITION, "over": 0.05}, "∥ ⌀0.006/50 A"),
        ({"name": "sun.eccentricity", "feature": Feature.POSITION}, "◎ ⌀0.006 A"),
    ],
)
def test_a_source_has_the_frame_of_its_feature(changes, shown):
    own = source(**changes)
    assert str(callout(own)) == shown
    is_certain = own.name not in ("carrier.tilt", "sun.eccentricity")
    has_datum = shown.endswith(" A")  # no table names one
    assert len(callout_assumptions((own,))) == has_datum + (not is_certain)


def test_every_source_of_the_shipped_tables_has_a_frame():
    sources = load_tolerance_table("rv20e_all_sources")
    frames = [callout(own) for own in sources if own.zone]
    assert {frame.characteristic for frame in frames} == set(SYMBOLS)


@pytest.mark.parametrize("characteristic", SYMBOLS)
def test_a_frame_is_drawn_with_a_box_for_every_cell(characteristic):
    frame = FeatureFrame(characteristic, "0.01", ("A", "B"), "10.04 µm")
    picture = svg_of(frame)
    assert picture.count("<rect") == (0 if characteristic == "size" else len(frame.cells))
    assert ">0.01</text>" in picture and ">B</text>" in picture
    assert 'title="' in frame._repr_html_() and "10.04 µm" in frame._repr_html_()

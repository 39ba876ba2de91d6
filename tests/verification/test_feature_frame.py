"""One line per dimension of a drawing: the index of a group, and the frame of every kind of source."""

from __future__ import annotations

from dataclasses import replace
from operator import mul

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tolalloc.capability.experiment import Experiment
from tolalloc.cli.console import print_table
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Evaluation
from tolalloc.reducers.families.known import SOURCES
from tolalloc.reports.feature_frame import SYMBOLS, FeatureFrame, callout, callout_assumptions, svg_of, written
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.writer import html_table, write_csv
from tolalloc.sensitivity.effort import QUICK_RANKING, SobolEffort
from tolalloc.sensitivity.sobol import sobol_indices

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
    experiment, effort = Experiment.of(Product(), errors, SeedTree(1), 0.0), SobolEffort(start=8192, limit=8192)
    alone = sobol_indices(experiment, effort).of(0)
    grouped = sobol_indices(experiment, effort, factor_groups=errors.dimension_of_column).of(0)
    assert grouped.sources == ("a", "b")
    np.testing.assert_allclose(grouped.total, [0.5, 0.5], atol=0.03)
    np.testing.assert_allclose(grouped.first, [0.5, 0.5], atol=0.05)
    # Each twin alone does nothing and has a part in all of it: their indices do not add up to that of the group.
    np.testing.assert_allclose(alone.total, [0.5, 0.5, 0.5], atol=0.04)
    np.testing.assert_allclose(alone.first[:2], 0.0, atol=0.06)


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
        ({"name": "housing.runout", "feature": Feature.RUNOUT, "spectrum": ((1, 1.0),)}, "Fr 0.006"),
        ({"name": "shaft", "feature": Feature.RUNOUT, "spectrum": ((1, 1.0),)}, "↗ 0.006 A"),
        ({"name": "disc1.each_tooth.pitch"}, "±0.003"),
        ({"name": "housing.pitch", "feature": Feature.PITCH, "spectrum": ((1, 1.0),)}, "Fp 0.006"),
        ({"name": "pin.diameter"}, "±0.003"),
        ({"name": "pin.diameter", "middle": -2.26 * UM}, "+0.00074 / −0.00526"),
        ({"name": "carrier.tilt", "feature": Feature.POSITION, "over": 0.05}, "∥ ⌀0.003/50 A"),
        ({"name": "crank1.journal1.phase", "over": 0.0009}, "⌖ 0.006 A at R 0.9"),
        ({"name": "sun.eccentricity", "feature": Feature.POSITION}, "◎ ⌀0.006 A"),
    ],
)
def test_a_source_has_the_frame_of_its_feature(changes, shown):
    own = source(**changes)
    assert str(callout(own, SOURCES.of(own.name))) == shown
    is_certain = own.name not in (
        "carrier.tilt",
        "sun.eccentricity",
        "housing.runout",
        "housing.pitch",
        "crank1.journal1.phase",
    )
    has_datum = " A" in shown  # no table names one
    assert len(callout_assumptions((own,), lambda one: SOURCES.of(one.name))) == has_datum + (not is_certain)


@pytest.mark.parametrize("name", ["carrier.assembly", "sun.eccentricity", "disc1.bore1.position", "crank1.tip", "a"])
def test_an_own_input_has_the_frame_of_its_feature_whatever_a_reducer_calls_so(name):
    drawing = ta.Drawing.of_rows(
        [{"id": name, "feature": "position", "plus": 6, "minus": 0, "unit": "µm", "min": 1, "max": 9, "cost": 1}]
    )
    inputs = [f"{name}.x", f"{name}.y"]
    bound = ta.model(lambda x, y: x + y, inputs=inputs, outputs=["y [mm]"]).bound(drawing.errors, "")
    assert portrait_of(bound).frame(drawing.errors.sources[0]).characteristic == "position"


def test_every_source_of_the_shipped_tables_has_a_frame():
    sources = load_tolerance_table("rv20e_all_sources")
    frames = [callout(own, SOURCES.of(own.name)) for own in sources if own.zone]
    assert {frame.characteristic for frame in frames} == set(SYMBOLS) - {"circular run-out"}


def test_inspection_data_of_teeth_are_no_frames_of_iso_1101():
    framed = {name for name in SYMBOLS if FeatureFrame(name, "0.01").is_framed}
    assert framed == {"position", "coaxiality", "circular run-out", "parallelism"}


@pytest.mark.parametrize("characteristic", SYMBOLS)
def test_a_frame_is_drawn_with_a_box_for_every_cell(characteristic):
    frame = FeatureFrame(characteristic, "0.01", ("A", "B"), "10.04 µm")
    picture = svg_of(frame)
    assert picture.count("<rect") == (len(frame.cells) if frame.is_framed else 0)
    assert ">0.01</text>" in picture and ">B</text>" in picture
    assert 'title="' in frame._repr_html_() and "10.04 µm" in frame._repr_html_()


@pytest.fixture(scope="module")
def ranked():
    """Three pairs of sizes: one of one weight, one of both signs, and one whose places depend on each other."""
    row = {"plus": 3.0, "minus": -3.0, "unit": "µm", "min": 1.0, "max": 9.0, "cost": 1.0}
    groups = {"a": "pair", "b": "pair", "c": "signs", "d": "signs", "e": "tied", "f": "tied"}
    weights = (-2.0, -2.0, -1.0, 3.0, 1.0, 1.0)
    own = ta.Study(
        ta.model(lambda *x: sum(map(mul, weights, x)), inputs=tuple(groups), outputs=("gap [mm]",)),
        ta.Drawing.of_rows(
            [{"id": name, "group": group, **row} for name, group in groups.items()],
            correlations=Correlation(pairs=(Pair(one="e", other="f", correlation=0.5),)),
        ),
        limits={"gap [mm]": ta.Limit(lower=-0.02, upper=0.02)},
        questions=[ta.Ranking()],
        name="lines",
    )
    sobol = ta.SobolEffort(start=64, limit=64, resamples=50)
    fields = {"derivative_units": 100, "surrogate_units": 96}
    return own.rank(ta.Effort(ranking=replace(QUICK_RANKING, sobol=sobol, level_units=100, **fields)))


@pytest.mark.slow
def test_a_dimension_says_what_a_micrometre_and_the_zones_of_all_its_places_do(ranked):
    table = ranked.tables["dimensions"].set_index("dimension")
    sens = table["Sens [mm/µm]"]
    assert sens["pair"] == pytest.approx(-2e-3)
    assert sens["signs"] == "-0.001…0.003"
    per_micrometre = table["rms change per µm in every place [mm/µm]"]
    assert per_micrometre[["pair", "signs"]].tolist() == pytest.approx([1e-3 * 8**0.5, 1e-3 * 10**0.5], rel=1e-6)
    # A zone of ±3 µm is ±3σ; 100 units place the mean square of a normal number within 14 %, thrice.
    by_zone = table["rms change by its zone [mm]"]
    assert by_zone[["pair", "signs"]].tolist() == pytest.approx([1e-3 * 8**0.5, 1e-3 * 10**0.5], rel=0.21)
    assert table["rank per µm [-]"][["signs", "pair"]].tolist() == [1, 2]


@pytest.mark.slow
def test_nothing_is_added_up_of_places_that_depend_on_each_other(ranked):
    tied = ranked.tables["dimensions"].set_index("dimension").loc["tied"]
    assert tied[["Sens [mm/µm]", "rms change by its zone [mm]", "rank per µm [-]"]].isna().all()
    assert tied["places [-]"] == 2


def test_tables_for_people_have_a_true_minus_and_files_a_hyphen(ranked, tmp_path, capsys):
    frame = ranked.tables["dimensions"]
    page = str(html_table(frame))
    assert ">−0.002<" in page and ">−0.001…0.003<" in page and 'class="number">−0.001' in page
    print_table(frame[["dimension", "Sens [mm/µm]"]], "dimensions")
    printed = capsys.readouterr().out
    assert "−0.002" in printed and "−0.001…0.003" in printed
    assert "-0.00" not in page + printed
    write_csv(frame, tmp_path / "dimensions.csv")
    assert "-0.002" in (text := (tmp_path / "dimensions.csv").read_text(encoding="utf-8"))
    assert "−" not in text


def test_zero_has_no_minus_and_names_keep_their_hyphen():
    page = str(html_table(pd.DataFrame({"name": ["disc-1", "at least -20 µm"], "x [%]": [-0.0, -12.34]})))
    assert "<td>disc-1</td>" in page and "at least −20 µm" in page
    assert ">0.0<" in page and '<td class="number" title="−12.34">−12.3</td>' in page

"""An RV reducer with centre gear and hollow shaft through whole commands: folder, ranking, allocation, picture."""

from __future__ import annotations

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import page_of
from tests.studies.command import refused, tolalloc
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.scene import scene_of
from tolalloc.reports.moving_picture import draw_still
from tolalloc.reports.scene_record import scene_record
from tolalloc.wings.assembly.places import places_of
from tolalloc.wings.bench.sources import has_half_turn

SMALL = ta.Effort(
    ranking=ta.RankingEffort(
        units=1000,
        sobol=ta.SobolEffort(start=8, limit=8, resamples=50),
        derivative_units=10,
        inverse_units=1,
        surrogate_units=96,
        level_units=100,
        level_runs=2,
        widened_units=100,
    ),
    allocation=ta.AllocationEffort(
        verification_units=256,
        confirmation_units=512,
        shared_units=16,
        front_limits=(0.95, 1.1),
        front_units=128,
        setting_steps=(2, 2),
        share_blocks=8,
        error=0.5,
        search=ta.SearchEffort(steps=2),
    ),
    is_quick=True,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("new") / "mine"
    said = tolalloc("new", place, "--family", "rv-centre-gear").stdout
    assert "2 cranks and 2 discs, like rv27c" in said
    return place


@pytest.mark.slow
def test_a_study_is_ranked_allocated_and_drawn(folder, tmp_path):
    study = ta.Study(
        ta.reducer(folder / "reducer.toml", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0)),
        ta.drawing(folder / "zones.csv"),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=40.0, show=ta.AtYield(0.9)), ta.PRELOAD: None},
        questions=[ta.Allocation(front=False, what_if=False), ta.Ranking()],
        name="drive",
        effort=SMALL,
    )
    run = study.run(tmp_path / "run")
    assert run.answers["allocation"].result.met
    ranked = [own.name for members in run.answers["ranking"].result.members.values() for own in members]
    assert {"pinion.eccentricity", "centre.eccentricity", "sun.eccentricity"} <= set(ranked)
    page = page_of(tmp_path / "run")
    assert "outer toothing of the centre gear" in page
    again = ta.drawing(tmp_path / "run" / "allocation.csv")
    assert {own.name for own in again.sources} >= {"pinion.eccentricity", "centre.eccentricity"}


def test_a_picture_shows_the_centre_gear_in_mesh_with_the_pinion():
    model = EquivalentModel(load_reducer("rv27c"))
    scene = scene_of(model, np.zeros(len(model.columns)), -100.0, per_crank_turn=2)
    assert scene.output_turns == 19  # 1390/38 turns of the sun each, three of the pinion per turn of the sun
    record = scene_record(scene)
    titles = [axes.get_title() for axes in draw_still(record, {"centre.mesh": 0.5}).axes]
    assert titles[2:] == ["carrier, planets and sun", "centre gear and input pinion"]
    for angle in (0.0, 0.0123, 2.0):  # where both meet, a tooth of the one stands in a gap of the other
        centre, pinion = (scene.start[part][0] + scene.turns[part] * angle for part in ("centre", "pinion"))
        assert np.cos(-72 * centre + 24 * (np.pi - pinion)) == pytest.approx(-1.0)


def test_half_a_turn_does_not_carry_the_pinion_to_the_other_side():
    for name, carried in (("rv20e", True), ("rv27c", False)):
        model = EquivalentModel(load_reducer(name))
        assert has_half_turn(model.reducer, model.columns) is carried


def test_a_centre_gear_is_mounted_as_one_part_with_the_sun():
    names = {place.name: dict(place.owned) for place in places_of(load_reducer("rv27c"))}
    assert names["sun"]["centre.eccentricity"] == "outer.eccentricity"
    assert (
        "centre.eccentricity"
        not in {place.name: dict(place.owned) for place in places_of(load_reducer("rv20e"))}["sun"]
    )


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--family", "rv-centre-gear", "--like", "rv20e"), "unknown preset of the family rv-centre-gear 'rv20e'"),
        (("--family", "rv", "--like", "rv27c"), "unknown preset of the family rv 'rv27c'"),
    ],
)
def test_what_no_folder_can_be_made_of_is_refused_in_one_sentence(tmp_path, arguments, says):
    refused(tolalloc("new", tmp_path / "other", *arguments), says)
    assert not (tmp_path / "other").exists()


def test_a_command_that_knows_no_centre_gear_says_so(folder):
    done = tolalloc("simulate", "--reducer", folder / "reducer.toml")
    refused(done, "a centre gear is not moved in time")

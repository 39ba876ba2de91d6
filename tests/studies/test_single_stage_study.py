"""A single-stage drive through whole commands: a new folder, its ranking and allocation, report, drawing and page."""

from __future__ import annotations

import numpy as np
import openpyxl
import pytest

import tolalloc as ta
from tests.builders import page_of
from tests.studies.command import refused, tolalloc
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.scene import scene_of
from tolalloc.reports.moving_picture import draw_still
from tolalloc.reports.scene_record import scene_record

SMALL = ta.Effort(
    allocation=ta.AllocationEffort(
        verification_units=2**9, confirmation_units=2**11, share_blocks=8, search=ta.SearchEffort(steps=2)
    ),
    ranking=ta.RankingEffort(sobol=ta.SobolEffort(start=8, limit=8)),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("new") / "mine"
    said = tolalloc("new", place, "--family", "single-stage", "--discs", "1").stdout
    assert "8 output pins and 1 discs, like cd29" in said
    return place


@pytest.fixture(scope="module")
def drive(folder):
    return ta.reducer(folder / "reducer.toml", flank_clearance=(1.0, 12.0), radial_clearance=(5.0, 30.0))


@pytest.mark.slow
def test_a_study_is_ranked_allocated_and_drawn(folder, drive, tmp_path):
    study = ta.Study(
        drive,
        ta.drawing(folder / "zones.csv"),
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=125.0, show=ta.AtYield(0.95))},
        questions=[ta.Allocation(front=False, what_if=False), ta.Ranking()],
        name="drive",
        effort=SMALL,
    )
    run = study.run(tmp_path / "run")
    assert run.answers["allocation"].result.met
    ranked = {own.name for line in run.answers["ranking"].result.members.values() for own in line}
    assert {"output.pin.position", "disc1.hole.position", "shaft.assembly"} <= ranked
    page = page_of(tmp_path / "run")
    for wrong in ("planet", "crankshaft", "sun gear"):
        assert wrong not in page.split("<script")[0]
    sheets = openpyxl.load_workbook(tmp_path / "run" / "drawing.xlsx")
    cells = {str(cell.value) for sheet in sheets for row in sheet.iter_rows() for cell in row}
    assert any("disc1.hole.position" in cell for cell in cells)
    again = ta.drawing(tmp_path / "run" / "allocation.csv")
    assert {own.name for own in again.sources} >= {"output.pin.radius", "disc1.hole.radius"}


@pytest.mark.slow
def test_one_turn_says_its_orders_and_forces(folder, tmp_path):
    found = tolalloc("te", "--reducer", folder / "reducer.toml", "--attribute", "--out", tmp_path / "te").stdout
    assert "largest output pin force" in found
    assert "largest mesh force" not in found
    assert (tmp_path / "te" / "report.html").exists()


def test_a_picture_shows_holes_and_output_pins():
    model = EquivalentModel(load_reducer("cd29"))
    record = scene_record(scene_of(model, np.zeros(len(model.columns)), -20.0, per_crank_turn=2))
    assert record["outline"]["output_pin_count"] == 8
    titles = [axes.get_title() for axes in draw_still(record, {}).axes]
    assert titles == ["disc 1 on the pins", "disc 2 on the pins", "output and input shaft"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--family", "single-stage", "--like", "rv20e"), "unknown preset of the family single-stage 'rv20e'"),
        (("--family", "harmonic"), "unknown family 'harmonic'; known are rv, rv-centre-gear, single-stage"),
        (("--like", "cd29", "--cranks", "2"), "cranks is 2; allowed is nothing: a single stage has none"),
        (("--like", "cd29", "--with", "assembly"), "unknown sample 'assembly'"),
    ],
)
def test_what_no_folder_can_be_made_of_is_refused_in_one_sentence(tmp_path, arguments, says):
    refused(tolalloc("new", tmp_path / "other", *arguments), says)
    assert not (tmp_path / "other").exists()


def test_a_command_that_only_an_rv_reducer_knows_says_so(folder):
    done = tolalloc("simulate", "--reducer", folder / "reducer.toml")
    refused(done, "a single stage has neither sun nor planets; this needs an RV reducer")

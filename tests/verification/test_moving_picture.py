"""The moving picture in a report and in a browser: what a page holds, and that the module draws what the scene says."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html import unescape
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.builders import page_of, prepared
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reading.units import MILLIMETRE
from tolalloc.reducers.equivalent.springs import Positions
from tolalloc.reducers.scene import Scene, scene_of
from tolalloc.reports.document import Document, Section
from tolalloc.reports.moving_picture import MovingPicture
from tolalloc.reports.page import as_json, asset
from tolalloc.reports.plots import drawn, save_png
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.scene_record import Pose, block, coarse_block, scene_record, values_of
from tolalloc.reports.writer import write_document

SOURCES = tuple(source.name for source in load_tolerance_table("rv20e_all_sources"))
LARGEST = 300_000
"""Bytes that the moving picture may add to a report."""


@pytest.fixture(scope="module")
def scene(rv20e, table4) -> Scene:
    return scene_of(rv20e, table4[0], -1.0, unit="table4", sources=SOURCES, per_crank_turn=8)


@pytest.fixture(scope="module")
def picture(scene) -> MovingPicture:
    record = scene_record(scene, coarse=True)
    return MovingPicture(name="reducer", title="RV-20E", record=record, shares={"disc1.teeth": 1.0, "pins": 0.3})


def test_numbers_pass_through_json_blocks():
    values = np.random.default_rng(1).normal(size=(3, 4))
    assert np.array_equal(values_of(json.loads(json.dumps(block(values)))), values)
    assert np.abs(values_of(coarse_block(values)) - values).max() <= np.ptp(values) / 255
    assert np.array_equal(values_of(coarse_block(np.full(3, 2.0))), np.full(3, 2.0))


def test_no_text_ends_the_script_that_it_stands_in():
    text = as_json({"unit": "</script><script>alert(1)</script>", "sign": "\u2028"})
    assert "<" not in text
    assert json.loads(text)["unit"].startswith("</script>")


def test_a_report_holds_the_module_and_stays_small(picture, tmp_path):
    section = Section(heading="The reducer", figures=(picture,))
    document = Document(
        title="A reducer", subtitle="", answer=(), warnings=(), sections=(section,), assumptions=(), summary={}
    )
    write_document(document, tmp_path / "report")
    page = page_of(tmp_path / "report")
    assert len(page.encode()) < LARGEST
    assert page.count("<script") == page.count("</script>") == 3  # the record, the charts' module, the mechanism's
    assert "new Mechanism(" in page
    assert not re.search(r"(src|href)=|import\s*[{(\"']|https?://(?!www\.w3\.org/2000/svg)", page)
    assert (tmp_path / "report" / "figures" / "reducer.png").stat().st_size > 20_000


def test_the_still_picture_shows_every_disc_and_the_first_stage(picture):
    titles = [axes.get_title() for axes in drawn(picture).axes]
    assert titles == ["disc 1 on the pins", "disc 2 on the pins", "carrier, planets and sun"]


def test_a_png_moves_where_pictures_are_asked_for(picture, tmp_path):
    from PIL import Image

    save_png(replace(picture, pictures=3), tmp_path / "moving.png")
    with Image.open(tmp_path / "moving.png") as image:
        assert image.n_frames == 3
        shown = []
        for frame in range(3):
            image.seek(frame)
            shown.append(np.asarray(image.convert("RGB"), float))
    assert all(0.0 < np.abs(before - after).mean() < 30.0 for before, after in pairwise(shown))


def test_the_ranking_of_a_reducer_pictures_its_drivers():
    """Of a place the sources count together, over the place that drives most."""
    baseline = prepared()
    errors, x = baseline.errors, np.zeros(len(baseline.model.columns))
    (section,) = portrait_of(baseline.model).moving(
        errors, x, {"disc1.pitch": 0.4, "disc1.runout": 0.1, "pin.diameter": 0.25}, "unit"
    )
    (figure,) = section.figures
    assert figure.shares == {"disc1.teeth": 1.0, "pins": 0.5}
    assert {source for place in figure.record["places"] for source in place["sources"]} == {
        source.name for source in errors.sources
    }


def test_the_python_on_the_page_about_the_picture_works():
    page = (Path(__file__).parents[2] / "docs" / "picture.md").read_text(encoding="utf-8")
    names: dict[str, object] = {}
    (block_of_code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(compile(block_of_code, "docs/picture.md", "exec"), names)
    assert json.loads(str(names["text"]))["reducer"] == "RV-20E"
    methods = re.findall(r"^mechanism\.(\w+)\(", page, re.MULTILINE)
    assert len(methods) == 6
    assert all(f"  {method}(" in asset("mechanism.js") for method in methods)


# In a browser ---------------------------------------------------------------------------------------------------------

PROBE = """
const said = { errors: [], drawn: [], positions: [] };
addEventListener("error", (event) => said.errors.push(event.message));
const box = document.getElementById("box"), pointed = [], chosen = [];
const scene = JSON.parse(document.getElementById("scene").textContent);
const mechanism = new Mechanism(box, scene, { onPoint: (id) => pointed.push(id), onChoose: (id) => chosen.push(id) });
for (const angle of ANGLES) said.positions.push(positions(scene, angle));
for (const sense of [1, -1]) for (const phase of PHASES) {
  mechanism.direction(sense);
  mechanism.turn(phase);
  const { cranks, journals, bores, carrierBores, contacts, output } = mechanism.pose;
  said.drawn.push({ cranks, journals, bores, carrierBores, output,
    outline: [0, 1].map((disc) => mechanism.teeth.outline(contacts[disc], mechanism.magnification)),
    force: contacts.map((own) => own.map(({ force }) => force)),
    gap: contacts.map((own) => own.map(({ gap }) => gap)) });
}
mechanism.shade({ "disc1.teeth": 1, pins: 0.4 });
mechanism.light(["disc2.bore1"]);
said.lit = [...box.querySelectorAll(".lit")].map((element) => element.dataset.place);
const bore = box.querySelector('[data-place="disc2.bore1"]');
bore.focus();
bore.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter" }));
bore.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
said.next = document.activeElement.dataset.place;
[said.pointed, said.chosen] = [pointed, chosen];
said.places = [...box.querySelectorAll("[data-place]")].map((own) =>
  [own.dataset.place, own.getAttribute("role"), own.getAttribute("aria-label")]);
said.stops = [...box.querySelectorAll("svg")].map((svg) => svg.querySelectorAll('[tabindex="0"]').length);
follow(mechanism);
document.querySelector("td").parentElement.dispatchEvent(new PointerEvent("pointerenter"));
said.followed = [...box.querySelectorAll(".lit")].map((element) => element.dataset.place);
mechanism.update(scene);
mechanism.magnify(500);
mechanism.turn(0.999);
said.stated = box.querySelector(".mechanism-stated").textContent;
document.getElementById("said").textContent = JSON.stringify(said);
"""
ANGLES, PHASES = [0.0, 0.7, 3.1, -4.0], [0.0, 0.1234, 0.77]


@pytest.fixture(scope="module")
def said(scene, tmp_path_factory) -> dict[str, object]:
    """What a page with the module says of itself."""
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("chromium is not installed; it runs the module of the page")
    page = tmp_path_factory.mktemp("page") / "page.html"
    probe = PROBE.replace("ANGLES", json.dumps(ANGLES)).replace("PHASES", json.dumps(PHASES))
    page.write_text(
        f'<!doctype html><meta charset="utf-8"><style>{asset("mechanism.css")}</style><div id="box"></div>'
        "<table><tr><td>disc1.bore2.position</td></tr></table>"
        f'<script type="application/json" id="scene">{as_json(scene_record(scene))}</script><pre id="said"></pre>'
        f'<script type="module">{asset("mechanism.js")}\n{probe}</script>',
        encoding="utf-8",
    )
    words = ["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", f"--user-data-dir={page.parent / 'browser'}"]
    done = subprocess.run([browser, *words, page.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    text = re.search(r'<pre id="said">(.*?)</pre>', done.stdout, re.DOTALL)
    assert text
    assert text[1], "the module stopped"
    return dict(json.loads(unescape(text[1])))


def plane(points: object) -> np.ndarray:
    found = np.asarray(points, float)
    return np.asarray(found[..., 0] + 1j * found[..., 1])


@pytest.mark.slow
def test_the_browser_puts_parts_where_the_kinematics_put_them(said, rv20e):
    reducer = rv20e.reducer
    at = Positions(reducer, np.array(ANGLES))
    for row, found in enumerate(said["positions"]):
        for crank in range(2):
            axis = reducer.crank_circle_radius / MILLIMETRE * np.exp(1j * at.crank_position(crank)[row])
            assert abs(plane(found["cranks"])[crank] - axis) < 1e-9
        for disc in range(2):
            centre = reducer.cycloid_stage.eccentricity / MILLIMETRE * np.exp(1j * at.disc_direction(disc)[row])
            assert abs(plane(found["discs"])[disc] - centre) < 1e-9
        assert abs(np.exp(1j * found["sun"][0]) - np.exp(1j * at.sun_angle[row])) < 1e-9


@pytest.mark.slow
def test_the_browser_draws_what_the_still_picture_draws(said, scene):
    record = scene_record(scene)
    asked = [(sense, phase) for sense in ("forward", "backward") for phase in PHASES]
    for (sense, phase), found in zip(asked, said["drawn"], strict=True):
        pose = Pose(record, 2 * np.pi * phase * scene.output_turns, sense)
        cranks, discs = range(2), range(2)
        assert plane(found["cranks"]) == pytest.approx([pose.crank(crank) for crank in cranks], abs=1e-9)
        own = [[pose.journal(crank, disc) for disc in discs] for crank in cranks]
        assert plane(found["journals"]) == pytest.approx(np.array(own), abs=1e-9)
        own = [[pose.bore(crank, disc) for crank in cranks] for disc in discs]
        assert plane(found["bores"]) == pytest.approx(np.array(own), abs=1e-9)
        assert plane(found["carrierBores"]) == pytest.approx([pose.carrier_bore(crank) for crank in cranks], abs=1e-9)
        assert np.array(found["force"]) == pytest.approx(pose.state("force"), abs=1e-9)
        assert np.array(found["gap"]) == pytest.approx(1e3 * pose.state("gap"), abs=1e-12)
        for disc in discs:
            drawn_at = plane(
                [
                    [float(value) for value in point.split()]
                    for point in re.split("[ML]", found["outline"][disc][:-1])[1:]
                ]
            )
            still = (pose.teeth(disc) - pose.discs[disc]) * np.exp(-1j * pose.at("disc")[disc])
            assert np.abs(drawn_at - still).max() < 1e-3


@pytest.mark.slow
def test_every_place_can_be_pointed_at_named_and_reached_by_keys(said, scene):
    assert said["errors"] == []
    assert {place for place, _, _ in said["places"]} == {place.id for place in scene.places}
    labels = {place.id: place for place in scene.places}
    for place, role, label in said["places"]:
        assert role == "button"
        assert label.startswith(labels[place].label)
        assert all(source in label for source in labels[place].sources)
    assert said["stops"] == [1, 1, 1]
    assert said["lit"] == ["disc2.bore1"]
    assert said["pointed"][0] == "disc2.bore1"
    assert said["chosen"] == ["disc2.bore1"]
    assert said["next"] != "disc2.bore1"
    assert said["followed"] == ["disc1.bore2"]
    assert "500 times larger" in said["stated"]

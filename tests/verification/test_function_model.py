"""Copies of a feature on identical parts share one zone of the drawing, unless the table tells them apart."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_text
from tolalloc.models.function_model import FunctionModel
from tolalloc.reducers.families.rv import RV
from tolalloc.study.prepared import Prepared

GROUPS = {own.name: own.group for own in load_tolerance_table("rv20e_drawing")}


def groups_of(change: Callable[[Source], Source], **costs: object) -> dict[str, str]:
    """Return source → group of the shipped drawing without its groups, its rows changed; nothing is solved."""
    drawing = ta.drawing("rv20e_drawing", **costs)
    drawing = drawing.with_sources(change(replace(own, group="")) for own in drawing.sources)
    study = ta.Study(ta.reducer("rv20e"), drawing, limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60)}, name="lines")
    return {own.name: own.group for own in Prepared(study=study).space.errors.sources}


def test_a_study_says_which_rows_share_a_line():
    row = {"plus": 20.0, "minus": -20.0, "unit": "µm", "min": 5.0, "max": 100.0, "cost": 1.0}
    names = ("disc1.pitch", "disc2.pitch", "sun.pitch")
    model = TwoDiscs(function=lambda *x: sum(x), inputs=names, outputs=("error [mm]",))
    limits = {"error [mm]": ta.Limit(upper=0.03)}
    stated = ({"id": name, **row} for name in names), ({"id": name, "group": name, **row} for name in names)
    alike, apart = (ta.check(ta.Study(model, ta.Drawing.of_rows(own), limits=limits, name="own")) for own in stated)
    assert [note.endswith(": disc.pitch (2).") for note in alike.result.notes] == [True]
    assert alike.result.notes[0] in alike.sentences
    assert apart.result.notes == ()


def only(groups: dict[str, str], end: str) -> set[str]:
    """Return the groups of the sources whose names end so."""
    return {group for name, group in groups.items() if name.endswith(end)}


def test_a_reducer_without_groups_has_one_line_for_the_copies_of_a_feature():
    found = groups_of(lambda own: own)
    assert only(found, ".position") >= {"disc.bore.position", "carrier.bore.position"}
    assert len({*found.values()}) == len({re.sub(r"\d+", "", name) for name in found})
    # All that the shipped table groups stands together; of its "first stage" sun and planets are two features.
    for group in {*GROUPS.values()} - {"", "first stage", "gear pitch"}:
        assert len({found[name] for name, own in GROUPS.items() if own == group}) == 1, group
    assert found["planet1.pitch"] == found["planet2.pitch"] != found["sun.pitch"] == "sun.pitch"


@pytest.mark.parametrize(
    ("end", "change", "lines"),
    [
        ("1.pitch", {"zone": 5e-6}, {"disc1.pitch", "disc2.pitch"}),
        ("1.pitch", {"maximum": 30e-6}, {"disc1.pitch", "disc2.pitch"}),
        ("1.pitch", {"cost": 7.0}, {"disc1.pitch", "disc2.pitch"}),
        ("1.pitch", {"group": "new hobs"}, {"new hobs", "disc2.pitch"}),
        ("1.pitch", {"drawing": "4711-B"}, {"disc1.pitch", "disc2.pitch"}),
        ("1.pitch", {"note": "measured last week"}, {"disc.pitch"}),
    ],
)
def test_copies_that_the_table_tells_apart_have_lines_of_their_own(end, change, lines):
    found = groups_of(lambda own: replace(own, **change) if own.name == f"disc{end}" else own)
    assert {group for name, group in found.items() if name.startswith("disc") and name.endswith("c1.pitch")} <= lines
    assert {found["disc1.pitch"], found["disc2.pitch"]} == lines


def test_bores_of_one_disc_that_are_finer_share_a_line():
    found = groups_of(lambda own: replace(own, zone=2e-6) if own.name.startswith("disc1.bore") else own)
    assert only(found, ".position") >= {"disc1.bore.position", "disc2.bore.position"}


def test_lines_that_one_name_would_say_are_told_by_their_members():
    crossed = {"disc1.bore1.position": 1, "disc2.bore2.position": 1}
    crossed |= {"disc1.bore2.position": 2, "disc2.bore1.position": 2}
    found = RV.sources.shared_lines(crossed)
    assert {*found.values()} == {
        "disc1.bore1.position, disc2.bore2.position",
        "disc1.bore2.position, disc2.bore1.position",
    }


def test_copies_that_process_costs_tell_apart_have_lines_of_their_own():
    ground = [("ground", 0.2, 0.001, 0.0005, 0.02)]
    apart = groups_of(lambda own: own, costs={"disc1.runout": ground})
    alike = groups_of(lambda own: own, costs={"disc1.runout": ground, "disc2.runout": ground})
    assert (apart["disc1.runout"], apart["disc2.runout"]) == ("disc1.runout", "disc2.runout")
    assert alike["disc1.runout"] == alike["disc2.runout"] == "disc.runout"


class TwoDiscs(FunctionModel):
    """Sum of the deviations of two discs of a reducer, one of which counts twice."""

    def shared_lines(self, stated):
        return RV.sources.shared_lines(stated)


def allocated(model: type[FunctionModel], **second: object) -> ta.Answer:
    """Return the cheapest zones of two discs, the second row changed."""
    row = {"plus": 20.0, "minus": -20.0, "unit": "µm", "min": 5.0, "max": 100.0, "cost": 1.0}
    names = ("disc1.pitch", "disc2.pitch")
    return ta.Study(
        model(function=lambda one, two: one + 2.0 * two, inputs=names, outputs=("error [mm]",)),
        ta.Drawing.of_rows([{"id": names[0], **row}, {"id": names[1], **row, **second}]),
        limits={"error [mm]": ta.Limit(lower=-0.03, upper=0.03)},
        questions=[ta.Allocation(front=False, what_if=False)],
        name="discs",
    ).allocate(effort="quick")


def test_an_allocated_table_states_the_shared_zone_in_all_its_rows(tmp_path):
    result = allocated(TwoDiscs).result
    one, two = result.drawn_sources
    assert one.zone == two.zone != 40e-6
    assert [name for name, _ in result.lines] == ["disc.pitch"]
    # To first order the zone counts √5 times at one limit: half of it may be 30 µm·3/(√5·3).
    assert one.zone / 2 == pytest.approx(30e-6 / np.sqrt(5), rel=0.02)
    (tmp_path / "again.csv").write_text(table_text(result.drawn_sources), encoding="utf-8")
    again = load_tolerance_table(tmp_path / "again.csv")
    assert [(own.group, own.zone) for own in again] == [("disc.pitch", pytest.approx(one.zone, rel=1e-6))] * 2


@pytest.mark.parametrize(
    ("model", "second", "line"),
    [(TwoDiscs, {"group": "second disc"}, "second disc"), (FunctionModel, {}, "disc2.pitch")],
)
def test_discs_of_two_groups_and_inputs_of_a_function_are_allocated_apart(model, second, line):
    result = allocated(model, **second).result
    one, two = result.drawn_sources
    assert one.zone > 1.2 * two.zone
    assert [name for name, _ in result.lines] == ["disc1.pitch", line]

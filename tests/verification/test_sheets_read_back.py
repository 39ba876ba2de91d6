"""Every shipped drawing, and one of three cranks, as files for a shop: other readers find what was meant.

Nothing is allocated: the drawing is the table as it stands, verified on a few units. The files are read by `csv`,
openpyxl and ezdxf, and by no reader of tolalloc.
"""

from __future__ import annotations

import csv
import re
from math import floor
from types import SimpleNamespace

import numpy as np
import pytest
from openpyxl import load_workbook

import tolalloc as ta
from tests.builders import says
from tests.sheets import cells, frames, paragraphs
from tolalloc.allocation.result import AllocationResult
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.reducer.design import MODIFICATION_CONVENTION, ROTATION_CONVENTION, Modification
from tolalloc.reports.tellers.allocation_drawing import write_drawing
from tolalloc.study.prepared import Prepared

UM = 1e-6
SIZES = ("rv20e", "rv40e", "rv80e", "rv110e")
OWN, TURNED = "three cranks", "turned flanks"
TOLERANCES = {"equidistant Δr_rp": "modification.equidistant", "shift Δr_p": "modification.shift"}
"""Amount → source whose zone is its tolerance."""


def prepared(case, folder):
    """Return the study of a shipped drawing, or of a new folder of three cranks."""
    if case == OWN:
        ta.new(folder / "mine", like="rv40e", cranks=3)
        reducer, drawing = ta.reducer(folder / "mine" / "reducer.toml"), ta.drawing(folder / "mine" / "zones.xlsx")
    elif case == TURNED:
        turned = ta.reducer("rv20e", rotation_clearance=(0.0, 4.0)).set_to({"rotation clearance [µm]": 2.0})
        reducer, drawing = turned, ta.drawing("rv20e_drawing")
    else:
        reducer, drawing = ta.reducer(case), ta.drawing(f"{case}_drawing")
    limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=90.0, show=ta.AtYield(target=0.5))}
    return Prepared(study=ta.Study(reducer, drawing, limits=limits, name="shop", title_block={"revision": "B"}))


def as_it_stands(study):
    """Return an allocation whose drawing is the tolerance table, verified on a few units."""
    verifier = Verifier(
        space=study.space, model=study.model, requirements=study.requirements[:1], seeds=SeedTree(1), units=64
    )
    design = verifier.verify(study.space.uniform(1.0), "as it stands")
    found = ZoneAllocation(
        limit=90.0,
        chosen=design,
        tried=(design,),
        proportional_tried=(design,),
        optimum=None,
        inside=None,
        locked_cost=study.space.locked_cost,
    )
    names = list({own.dimension: 1 for own in study.errors.active})
    nothing = dict.fromkeys(("trade", "front", "robustness", "prices", "loss", "fixed", "graded"))
    return AllocationResult(
        name="shop",
        model=study.model,
        requirements=study.requirements[:1],
        space=study.space,
        free=found,
        shares=SimpleNamespace(sources=names, total=np.ones(len(names))),
        error=0.05,
        examination=study.model.at(design.settings).examined(study.space.units(design.design, SeedTree(2), 16)),
        **nothing,
    )


@pytest.fixture(scope="module", params=[*SIZES, OWN, TURNED])
def drawn(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("shop")
    study = prepared(request.param, folder)
    result = as_it_stands(study)
    write_drawing(result, study.header, folder)
    return result, folder


def amounts(result):
    """Return the amounts and clearances of the drawing by their names on it [µm]."""
    modification, stage = result.model.modification(result.chosen.settings), result.model.reducer.cycloid_stage
    turned = modification.rotation * stage.disc_pitch_radius / UM
    return {
        "equidistant Δr_rp": modification.equidistant / UM,
        "shift Δr_p": modification.shift / UM,
        **({"rotation δ·r_d": turned, "rotation clearance": turned} if turned else {}),
        "flank clearance": modification.flank_clearance(stage) / UM,
        "radial clearance": modification.radial_clearance / UM,
    }


def convention(result):
    """Return what the signs of the amounts mean, in the words that the drawing has for it."""
    if len(result.space.settings) == 2:
        return MODIFICATION_CONVENTION
    radius = result.model.reducer.cycloid_stage.disc_pitch_radius * 1e3
    return f"{MODIFICATION_CONVENTION}; {ROTATION_CONVENTION.format(radius=radius)}"


def tolerances(result):
    """Return half of the zone of every amount, which all of these drawings state [µm]."""
    zones = {own.name: own.zone / UM for own in result.space.errors.sources}
    return {name: zones[source] / 2 for name, source in TOLERANCES.items()}


def number(text):
    """Return a number as people write it."""
    return float(text.replace("−", "-"))


@pytest.mark.slow
def test_the_table_has_zones_and_amounts(drawn):
    result, folder = drawn
    lines = (folder / "allocation.csv").read_text("utf-8").splitlines()
    rows = {row["id"]: row for row in csv.DictReader(line for line in lines if not line.startswith("# "))}
    assert rows.keys() == {own.name for own in result.space.errors.sources}
    for own in result.space.errors.sources:
        row = rows[own.name]
        assert row["unit"] == "µm"
        assert float(row["plus [unit]"]) - float(row["minus [unit]"]) == pytest.approx(own.zone / UM, abs=2e-5)
        assert float(row["plus [unit]"]) + float(row["minus [unit]"]) == pytest.approx(
            2 * own.middle / UM, abs=2e-5
        ) or (own.feature is not Feature.SIZE)
    comments = [line.removeprefix("# ") for line in lines if line.startswith("# ")]
    stated = dict(line.removeprefix("setting: ").split(" = ") for line in comments if line.startswith("setting: "))
    meant = amounts(result)
    for name in (own for own in meant if own.endswith("clearance")):
        assert float(stated[f"{name} [µm]"]) == pytest.approx(meant[name], abs=1e-6)
    said = " ".join(comments)
    for name in (own for own in meant if not own.endswith("clearance")):
        found = re.search(rf"{name} ([−\d.]+) µm", said)
        assert number(found[1]) == pytest.approx(meant[name], abs=0.0051)
    assert says(comments, "allocation.convention", convention=convention(result).replace(";", " -"))
    assert says(comments, "allocation.table_block", fields="revision B")


@pytest.mark.slow
def test_the_workbook_has_zones_and_amounts(drawn):
    result, folder = drawn
    book = load_workbook(folder / "drawing.xlsx", data_only=True)
    head, *rows = book["tolerances"].iter_rows(values_only=True)
    found = {row[0]: dict(zip(head, row, strict=True)) for row in rows}
    for own in result.space.errors.sources:
        row = found[own.name]
        assert row["plus [unit]"] - row["minus [unit]"] == pytest.approx(own.zone / UM, abs=2e-5)
    meant, half = amounts(result), tolerances(result)
    for sheet in ("modification", "answer"):
        table = {row[0]: row[1:] for row in book[sheet].iter_rows(values_only=True)}
        for name, value in meant.items():
            assert table[name][0] == pytest.approx(value, abs=1e-6)
            assert table[name][3] == (pytest.approx(half[name]) if name in half else None)
        assert says([str(name) for name in table], "allocation.convention", convention=convention(result))
    written = {row[0]: row for row in book["drawing"].iter_rows(min_row=2, values_only=True)}
    for line in result.lines:
        name = result.line_name(line)
        own = line[1][0]
        assert written[name][1] == pytest.approx(own.zone / UM, rel=1e-9)
        parts = 2 if halved(own) else 1
        assert written[name][10] * 1e3 == pytest.approx(floor(own.zone / UM / parts * 100 + 1e-4) / 100, abs=1e-9), name


def halved(own: Source) -> bool:
    """Return whether a drawing writes half a zone: deviations of a size, or the parallelism of a tilt."""
    return own.name.endswith(".tilt") or (own.feature is Feature.SIZE and not own.over)


@pytest.mark.slow
def test_the_sheet_has_zones_amounts_and_signs(drawn):
    result, folder = drawn
    table = cells(folder / "frames.dxf", "TABLE")
    shown = frames(folder / "frames.dxf")
    inspected = {row[1]: row[2:] for row in table if len(row) == 6 and row[2].split(" ")[0] in ("Fp", "Fr", "single")}
    meant, half, beside = amounts(result), tolerances(result), 0
    for line in result.lines:
        own, name = line[1][0], result.line_name(line)
        if own.name in TOLERANCES.values():
            beside += 1
            continue
        turns = own.name.endswith((".phase", ".rotation"))
        named = f"{name}, at R {own.over * 1e3:g}" if turns else name
        text = shown[named].split()[0] if named in shown else inspected[name][1]
        if own.middle:
            continue
        parts = 2 if halved(own) else 1
        assert text.startswith("±") == (own.feature is Feature.SIZE and not own.over)
        assert text.startswith("⌀") == (own.feature is Feature.POSITION)
        size = float(text.lstrip("±⌀").split("/")[0]) * 1e3
        assert size == pytest.approx(floor(own.zone / UM / parts * 100 + 1e-4) / 100, abs=1e-9), name
        if name in inspected:
            kind = {Feature.PITCH: "Fp cumulative pitch", Feature.RUNOUT: "Fr tooth run-out"}.get(own.feature)
            assert (inspected[name][0], inspected[name][2]) == (kind or "single tooth", "A" if kind else "")
    assert len(shown) + len(inspected) + beside == len(result.lines)
    stated = {row[1]: row[1:] for row in table if len(row) > 1 and row[1] in meant}
    stage = result.model.reducer.cycloid_stage
    for name, value in meant.items():
        assert number(stated[name][1]) == pytest.approx(value, abs=0.0051)
        assert stated[name][2] == (f"{half[name]:.3g}" if name in half else "")
    for name, alone in (
        ("equidistant Δr_rp", Modification(equidistant=meant["equidistant Δr_rp"] * UM, shift=0.0)),
        ("shift Δr_p", Modification(equidistant=0.0, shift=meant["shift Δr_p"] * UM)),
    ):
        # Less material is left where the root lies nearer to the middle of the disc.
        deeper = ToothProfile(stage=stage).root_radius - ToothProfile(stage=stage, modification=alone).root_radius
        assert stated[name][4].endswith("removes material" if deeper > 0 else "leaves material")
    assert says(paragraphs(folder / "frames.dxf"), "allocation.convention", convention=convention(result))
    block = {text for row in cells(folder / "frames.dxf", "TITLE_BLOCK") for text in row}
    assert {"revision B", "author", "material", "drawing number"} <= block

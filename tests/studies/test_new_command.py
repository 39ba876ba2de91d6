"""``tolalloc new``: folders that run at once, for all counts of cranks and discs, and samples of other files."""

from __future__ import annotations

import json
import re
import shlex
from types import SimpleNamespace

import pytest
from openpyxl import load_workbook

import tolalloc as ta
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.allocation.cost.process_costs import load_process_costs
from tolalloc.cli.main import EXAMPLES, app
from tolalloc.cli.start import modification_of
from tolalloc.drawings.drawing import load_drawing
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.assembly.files import load_errors, load_plan
from tolalloc.wings.bench.measurements import load_measurements
from tolalloc.wings.bench.samples import FACTOR


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "cranks", "discs"), [("rv20e", 2, 1), ("rv40e", 3, 2), ("rv160e", 4, 3)])
def test_a_new_folder_is_in_order_and_has_every_source(tmp_path, preset, cranks, discs):
    place = tmp_path / "mine"
    made = tolalloc("new", place, "--like", preset, "--cranks", cranks, "--discs", discs)
    assert made.returncode == 0, made.stderr
    reducer = load_reducer(place / "reducer.toml")
    assert (reducer.name, reducer.crank_count, reducer.disc_count) == ("mine", cranks, discs)
    drawing = load_drawing(place / "zones.xlsx")
    assert drawing.sources == load_drawing(place / "zones.csv").sources
    columns = {source_name(name) for name in EquivalentModel(reducer).columns}
    # A clearance has the nominal value of the reducer file without a row, and flanks are not turned unless it says so.
    unlisted = {name for name in columns if name.endswith(".clearance")} | {"modification.rotation"}
    assert {own.name for own in drawing.sources} == columns - unlisted
    assert not any(own.nominal for own in drawing.sources if own.name.startswith("modification"))
    for own in drawing.sources:
        first_stage = own.name.startswith(("sun.", "planet", "mesh"))
        assert own.locked == (first_stage or own.zone == 0.0)
    found = answer_of("check", place / "study.py")
    assert found["sources"] == len(drawing.sources)
    assert found["neglected"] == [own.name for own in drawing.sources if own.zone == 0.0]
    assert {"crank1.tilt", "each_pin.position"} <= {*found["neglected"]}


def test_three_cells_may_be_changed_in_excel(tmp_path):
    tolalloc("new", tmp_path / "mine")
    book = load_workbook(tmp_path / "mine" / "zones.xlsx")
    sheet = book.active
    head = {cell.value: cell.column for cell in sheet[1]}
    rows = {sheet.cell(row=row, column=head["id"]).value: row for row in range(2, sheet.max_row + 1)}
    for name, column, value in (
        ("pin.diameter", "cost [cost units]", 7.5),
        ("disc1.pitch", "plus [unit]", 11),
        ("housing.runout", "locked", "yes"),
    ):
        sheet.cell(row=rows[name], column=head[column]).value = value
    choices = {own.errorTitle: own for own in sheet.data_validations.dataValidation}
    assert set(choices) == {"feature", "distribution", "unit", "locked", "sorted", "grade"}
    assert choices["distribution"].showErrorMessage
    assert not choices["grade"].showErrorMessage  # any text is carried through
    assert all(cell.comment and cell.comment.text for cell in sheet[1])
    book.save(tmp_path / "mine" / "zones.xlsx")
    known = {own.name: own for own in load_drawing(tmp_path / "mine" / "zones.xlsx").sources}
    assert known["pin.diameter"].cost == 7.5
    assert known["disc1.pitch"].zone == pytest.approx(11e-6)
    assert known["housing.runout"].locked


@pytest.mark.slow
@pytest.mark.parametrize(("cranks", "discs"), [(2, 1), (3, 2), (4, 3)])
def test_samples_fit_every_reducer(tmp_path, cranks, discs):
    place = tmp_path / "mine"
    made = tolalloc("new", place, "--cranks", cranks, "--discs", discs, "--with", "all")
    assert made.returncode == 0, made.stderr
    page = (place / "README.md").read_text(encoding="utf-8")
    for path in place.iterdir():
        assert path.name == "README.md" or f"`{path.name}`" in page or path.name.startswith("bench_")
    measured = load_measurements(place / "bench.toml")
    assert (len(measured.curves), len(measured.loops), measured.repairs) == (2, 2, ())
    plan = load_plan(place / "chain.toml")
    assert len(load_errors(place / "angles.csv", plan)) == len(plan.chain.names)
    drawing = load_drawing("zones.csv", processes="processes.csv", costs="process_costs.csv", folder=place)
    ways = load_process_costs(place / "process_costs.csv", drawing.sources)
    assert {len(ways[name]) for name in ("pin.diameter", "crank2.journal1.eccentricity")} == {3}
    assert tolalloc("check", place / "with_processes.py").returncode == 0


CLEARANCES = ("rotation clearance", "flank clearance", "radial clearance")


def mean_twist(reducer) -> float:
    """Return the mean transmission error of exact parts that the command prints [arcsec]."""
    outputs = answer_of("te", "--reducer", reducer)["outputs"]
    (mean,) = (own for own in outputs if own["name"] == "mean transmission error")
    return mean["value"]


@pytest.mark.slow
def test_a_reducer_of_three_cranks_with_turned_flanks_is_asked_and_checked(tmp_path):
    """40 µrad of rotation leave 2.03 µm more on the flank, which the carrier turns through, and no radial clearance."""
    made = ta.new(tmp_path / "mine", like="rv40e", cranks=3)
    path = made / "reducer.toml"
    plain, text = mean_twist(path), path.read_text("utf-8")
    path.write_text(re.sub(r"^(shift_um = .*)$", r"\1\nrotation_urad = 40", text, flags=re.MULTILINE), "utf-8")
    turned, reducer = mean_twist(path), load_reducer(path)
    angle = 40e-6 * (1 - 1 / reducer.ratio) * 39 / 40 / ARCSECOND
    assert turned - plain == pytest.approx(-angle, rel=0.01)
    checked = tolalloc("check", made / "study.py")
    assert checked.returncode == 0, checked.stderr
    clearances = {name: float(re.search(rf"{name}: ([\d.]+) µm", checked.stdout)[1]) for name in CLEARANCES}
    arc = 40 * reducer.cycloid_stage.disc_pitch_radius
    assert clearances["rotation clearance"] == pytest.approx(arc, abs=0.01)
    assert clearances["flank clearance"] == pytest.approx(3.8 + clearances["rotation clearance"], abs=0.02)
    assert clearances["radial clearance"] == pytest.approx(8.6)
    for field, value, words in (
        ("rotation_um", 2, ("unknown field 'modification.rotation_um'", "rotation_urad")),
        ("rotation_urad", 9000, ("modification.rotation_urad is 9000", "5000")),
    ):
        path.write_text(re.sub(r"^(shift_um = .*)$", rf"\1\n{field} = {value}", text, flags=re.MULTILINE), "utf-8")
        refused(tolalloc("te", "--reducer", path), *words)


@pytest.mark.slow
def test_the_simulated_bench_gives_back_what_it_was_simulated_with(tmp_path):
    tolalloc("new", tmp_path / "mine", "--with", "bench")
    words = ("identify", tmp_path / "mine" / "bench.toml", "--reducer", tmp_path / "mine" / "reducer.toml", "--json")
    found = tolalloc(*words)
    assert found.returncode == 0, found.stderr
    given = load_reducer(tmp_path / "mine" / "reducer.toml").stiffness.crank_disc_bearing
    identified = json.loads(found.stdout)["parameters"][0]
    least, most = identified["interval"]
    assert identified["name"] == RV.new.stiffer
    assert given < least < FACTOR * given < most


@pytest.mark.slow
def test_every_sample_is_read_by_its_command(tmp_path):
    place = tmp_path / "mine"
    assert tolalloc("new", place, "--like", "rv40e", "--cranks", "3", "--with", "all").returncode == 0
    assert tolalloc("costs", place / "shop.csv").returncode == 0
    mounted = tolalloc("mount", place / "parts.csv", "--reducer", place / "reducer.toml", "--starts", "1")
    assert mounted.returncode == 0, mounted.stderr
    table = (place / "zones.csv").read_text(encoding="utf-8").splitlines()
    head, pins = table[0].split(","), next(at for at, row in enumerate(table) if row.startswith("pin.diameter,"))
    cells = table[pins].split(",")
    cells[head.index("distribution")], cells[head.index("measured")] = "empirical", "pin_diameters.csv"
    table[pins] = ",".join(cells)
    (place / "zones.csv").write_text("\n".join(table) + "\n", encoding="utf-8")
    measured = {own.name: own for own in load_drawing(place / "zones.csv").sources}["pin.diameter"].measured
    assert measured is not None
    curve = tolalloc("te", "--reducer", place / "reducer.toml", "--unit", "exact", "--json")
    assert curve.returncode == 0, curve.stderr


@pytest.mark.slow
@pytest.mark.parametrize("cranks", [2, 3, 4])
def test_a_newcomer_asks_what_a_zone_does(tmp_path, cranks):
    place = tmp_path / "mine"
    tolalloc("new", place, "--cranks", cranks)
    result = tolalloc("whatif", place / "study.py", "disc*.pitch=10", "--units", "256", "--out", tmp_path / "report")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "report" / "report.html").is_file()


def test_nothing_is_overwritten_and_wrong_words_are_sentences(tmp_path):
    tolalloc("new", tmp_path / "mine")
    before = {path: path.read_bytes() for path in (tmp_path / "mine").rglob("*") if path.is_file()}
    refused(tolalloc("new", tmp_path / "mine"), "is there already", "nothing is overwritten")
    assert before == {path: path.read_bytes() for path in (tmp_path / "mine").rglob("*") if path.is_file()}
    refused(tolalloc("new", tmp_path / "b", "--like", "rv21e"), "rv20e")
    refused(tolalloc("new", tmp_path / "b", "--cranks", "5"), "--cranks", "2 to 4")
    refused(tolalloc("new", tmp_path / "b", "--with", "cost"), "costs")
    refused(tolalloc("new", tmp_path / "1 b"), "name is", "a letter first")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine"]


def test_what_is_missing_is_asked_on_a_terminal_alone(tmp_path, monkeypatch):
    refused(tolalloc("new"), "NAME is missing")
    answers = iter([str(tmp_path / "mine"), "rv80e", 4, 3, "none"])
    asked = []
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr(
        "typer.prompt", lambda question, **own: asked.append((question, own["default"])) or next(answers)
    )
    made = tolalloc("new")
    assert made.returncode == 0, made.stderr
    assert [default for _, default in asked] == ["mine", "rv20e", 3, 2, "none"]
    reducer = load_reducer(tmp_path / "mine" / "reducer.toml")
    assert (reducer.crank_count, reducer.disc_count) == (4, 3)


@pytest.mark.parametrize("preset", RV.new.presets)
def test_a_preset_that_is_not_changed_is_the_preset_with_the_modification_of_the_drawing(tmp_path, preset):
    from dataclasses import replace

    tolalloc("new", tmp_path / "mine", "--like", preset)
    made, own = load_reducer(tmp_path / "mine" / "reducer.toml"), load_reducer(preset)
    drawn = modification_of(own)
    assert (made.modification.equidistant, made.modification.shift) == pytest.approx((drawn.equidistant, drawn.shift))
    like = replace(made, name=own.name, modification=own.modification, assumptions=own.assumptions)
    assert like == own
    assert set(own.assumptions) < set(made.assumptions)


@pytest.mark.slow
def test_the_example_in_the_help_of_every_command_is_accepted(tmp_path):
    """Those that take minutes are asked for their help instead, with the words of the example before it."""
    assert set(EXAMPLES) == {str(own.name) for own in app.registered_commands}
    assert tolalloc("new", tmp_path / "mine", "--with", "all").returncode == 0
    long = {"run", "rank", "allocate", "series", "open", "diagnose", "simulate", "assemble", "compare"}
    for name, example in EXAMPLES.items():
        words = [word.replace("mine/", f"{tmp_path}/mine/") for word in shlex.split(example)[1:]]
        if name == "new":
            words[1] = str(tmp_path / "other")
        result = tolalloc(*words, *(["--help"] if name in long else []))
        assert result.returncode == 0, (example, result.stderr)

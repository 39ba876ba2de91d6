"""A drawing of any model: from files beside a study or from rows in Python, written and read again."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import deviations_at, seeded_units
from tolalloc.cli.start import clearances_of, modification_of, sources_of
from tolalloc.drawings.correlation import Correlation, Pair
from tolalloc.drawings.drawing import Drawing, load_drawing
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_frame, table_text
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.study.script import load_study

ZONE = {"plus": 0.1, "minus": -0.1, "unit": "mm", "min": 0.02, "max": 0.5, "cost": 3}
HUB = {"id": "hub", "nominal": 55.29, **ZONE}
CAGE = {"id": "cage", "part": "outer race", "nominal": 101.6, **ZONE, "locked": True, "grade": "own"}


def test_a_row_of_an_own_model_is_one_column_in_metres(generator):
    drawing = Drawing.of_rows([HUB, CAGE])
    hub, cage = drawing.sources
    assert drawing.errors.columns == ("hub", "cage")
    assert (hub.part, hub.dimension, hub.feature, hub.cost) == ("hub", "hub", Feature.SIZE, 3.0)
    assert (hub.zone, hub.minimum, hub.maximum) == pytest.approx((2e-4, 2e-5, 5e-4))
    assert hub.nominal == pytest.approx(0.05529)
    assert (cage.part, cage.locked, cage.grade) == ("outer race", True, "own")
    x = deviations_at(drawing.errors, generator.random((20_000, 2)))
    # The standard error of a deviation of n normal numbers is 1/√(2n) of it; four of them.
    np.testing.assert_allclose(x.std(axis=0), 2e-4 / 6, rtol=4 / np.sqrt(40_000))


def test_rows_in_python_and_in_a_file_are_the_same_drawing(tmp_path):
    drawing = Drawing.of_rows([HUB, CAGE])
    assert drawing.to_csv(tmp_path / "own.csv") == tmp_path / "own.csv"
    again = load_drawing("own.csv", folder=tmp_path)
    assert again.name == "own.csv"
    for own, other in zip(drawing.sources, again.sources, strict=True):
        assert (other.zone, other.minimum, other.maximum) == pytest.approx((own.zone, own.minimum, own.maximum))
        assert (other.name, other.part, other.locked, other.grade) == (own.name, own.part, own.locked, own.grade)
    assert table_text(again.sources) == table_text(drawing.sources) == (tmp_path / "own.csv").read_text()
    with pytest.raises(InputError, match="the file exists; name a new one"):
        drawing.to_csv(tmp_path / "own.csv")


@pytest.mark.parametrize("name", ["rv20e_table4", "rv20e_all_sources"])
def test_a_table_is_written_as_pandas_writes_it(name, tmp_path):
    sources = [replace(own, zone=0.83 * own.zone, cost=own.cost / 3) for own in load_tolerance_table(name)]
    table_frame(sources).to_csv(tmp_path / "frame.csv", index=False)
    assert table_text(sources) == (tmp_path / "frame.csv").read_text(encoding="utf-8")


def test_rows_of_the_shipped_drawing_that_differ_by_a_number_alone_are_alike():
    rows: dict[str, set] = {}
    for own in load_drawing("rv20e_drawing").sources:
        like = rows.setdefault(re.sub(r"\d+", "", own.name), set())
        like.add((own.zone, own.minimum, own.maximum, own.cost, own.spectrum, own.each, own.over, own.group))
    assert {name: len(like) for name, like in rows.items()} == dict.fromkeys(rows, 1)


SHIPPED = ("rv20e", "rv40e", "rv80e", "rv110e")


@pytest.mark.parametrize("preset", SHIPPED[1:])
def test_shipped_drawings_of_larger_sizes_are_what_the_rule_makes(preset):
    reducer, drawing = load_reducer(preset), load_drawing(f"{preset}_drawing")
    assert table_text(drawing.sources) == table_text(sources_of(reducer, complete=True))
    assert drawing.settings == clearances_of(reducer)
    smaller = {own.name: own for own in load_drawing("rv20e_drawing").sources}
    assert all(own.zone > smaller[own.name].zone for own in drawing.sources if own.name in smaller)


@pytest.mark.parametrize("preset", ["rv20e", "rv40e", "rv110e"])
def test_modification_of_a_size_leaves_the_clearances_of_its_drawing(preset):
    reducer = load_reducer(preset)
    own, flank_and_radial = modification_of(reducer), [*clearances_of(reducer).values()]
    left = [own.flank_clearance(reducer.cycloid_stage), own.radial_clearance]
    assert np.array(left) / MICROMETRE == pytest.approx(flank_and_radial, abs=0.1)  # amounts in tenths


def test_files_are_found_beside_the_study_and_shipped_ones_by_name(tmp_path, monkeypatch):
    folder = tmp_path / "study"
    folder.mkdir()
    (folder / "own.csv").write_text("process,feature,Cp,note\nown,size,1.5,shop\n", encoding="utf-8")
    (folder / "like.csv").write_text("sources,correlation\nhub cage,0.5\n", encoding="utf-8")
    pd.DataFrame([{**HUB, "process": "own"}, CAGE]).to_csv(folder / "t.csv", index=False)
    monkeypatch.chdir(tmp_path)
    drawing = load_drawing("t.csv", "own.csv", "like.csv", "costs.csv", folder)
    assert drawing.sources[0].cp == 1.5
    assert drawing.correlation.source_matrix(drawing.sources)[0, 1] == 0.5
    assert drawing.costs == folder / "costs.csv"
    assert load_drawing("rv20e_table4", costs="rv20e", folder=folder).costs == "rv20e"
    assert load_drawing(folder / "t.csv", folder / "own.csv").sources == drawing.sources
    with pytest.raises(
        InputError, match="no such file; shipped tolerance table files are cd29_drawing, rv110e_drawing, rv20e_all"
    ):
        load_drawing("none.csv", folder=folder)


IMPORTED = """
import tolalloc as ta
drawing = ta.drawing("tables/t.csv", correlations="like.csv", costs="costs.csv")
def drawing_when_called():
    return ta.drawing("tables/t.csv")
"""


@pytest.fixture
def imported(tmp_path, monkeypatch):
    """Return the module of another folder that reads tables beside itself, with others of their names all around."""
    cages = {"mine": 1, "here": 2, ".": 3}
    for name, places in cages.items():
        (tmp_path / name / "tables").mkdir(parents=True, exist_ok=True)
        table = pd.DataFrame([HUB, *({**CAGE, "id": f"cage{at}" if at else "cage"} for at in range(places))])
        table.to_csv(tmp_path / name / "tables" / "t.csv", index=False)
        (tmp_path / name / "like.csv").write_text(f"sources,correlation\nhub cage,0.{places}\n", encoding="utf-8")
    (tmp_path / "mine" / "reads_beside.py").write_text(IMPORTED, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path / "here")
    yield importlib.import_module("mine.reads_beside")
    for name in ("mine.reads_beside", "mine"):
        sys.modules.pop(name, None)


def test_an_imported_file_reads_what_stands_beside_itself(imported, tmp_path):
    assert [own.name for own in imported.drawing.sources] == ["hub", "cage"]
    assert imported.drawing.correlation.source_matrix(imported.drawing.sources)[0, 1] == 0.1
    assert len(imported.drawing_when_called().sources) == 2
    assert len(load_drawing("tables/t.csv").sources) == 3  # who asks here has none beside it: the current folder
    assert len(load_drawing(tmp_path / "tables" / "t.csv").sources) == 4
    (tmp_path / "mine" / "tables" / "t.csv").unlink()
    assert len(imported.drawing_when_called().sources) == 3


def test_a_study_script_reads_nothing_of_the_current_folder_but_a_module_what_stands_beside_it(imported, tmp_path):
    script = tmp_path / "office" / "own_study.py"
    script.parent.mkdir()
    script.write_text(
        "import sys\nimport tolalloc as ta\nfrom mine.reads_beside import drawing_when_called\n"
        "drawing = drawing_when_called()\n"
        "study = ta.Study(ta.model(lambda hub, cage: hub - cage, inputs=('hub', 'cage'), outputs=('y [mm]',)),\n"
        "    drawing, limits={'y [mm]': ta.Limit(upper=60)})\n"
    )
    assert len(load_study(script).drawing.sources) == 2
    script.write_text("import tolalloc as ta\ndrawing = ta.drawing('tables/t.csv')\n")
    with pytest.raises(InputError, match=f"{script.parent}/tables/t.csv: no such file"):
        load_study(script)


def test_a_console_reads_beside_the_study_that_it_imports(imported, tmp_path):
    shown = subprocess.run(
        [sys.executable, "-c", "from mine.reads_beside import drawing\nprint(len(drawing.sources))"],
        cwd=tmp_path / "here",
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{Path(ta.__file__).parents[1]}"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert shown.stdout.split() == ["2"]


def test_a_drawing_carries_correlations_and_processes_written_in_python():
    pair = Pair(one="hub", other="cage", correlation=0.3)
    ways = {"hub": ("turned", "ground")}
    drawing = Drawing.of_rows([HUB, CAGE], correlations=Correlation(pairs=(pair,)), costs=ways)
    assert drawing.errors.is_correlated
    assert drawing.costs is ways


def test_a_notebook_shows_the_table():
    shown = Drawing.of_rows([HUB, CAGE], place="one-way clutch")._repr_html_()
    assert "one-way clutch: 2 sources" in shown
    assert "nominal [mm]" in shown and "55.29" in shown


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        ({"zone": 0.2}, UnknownNameError, r"drawing, row 1 \(hub\): unknown column 'zone'"),
        ({"unit": None}, InputError, r"drawing, row 1 \(hub\): unit is missing"),
        ({"plus": "wide"}, InputError, r"row 1 \(hub\): plus is 'wide'; allowed is a number"),
        ({"plus": 3000.0}, InputError, "the zone plus − minus is 3000100 µm and must be 0 to 1000000 µm"),
        (
            {"plus": 0.0, "minus": 0.0},
            InputError,
            r"^drawing, row 1 \(hub\): the zone is 0 but the row is not locked; allowed is 0 with locked = yes, which "
            "neglects the source, or a zone above 0 up to 1000000 µm\\.$",
        ),
        ({"feature": "weight"}, InputError, "feature is 'weight'; allowed is one of size"),
        ({"process": "grond"}, UnknownNameError, "unknown process .with an empty Cp. for feature size 'grond'"),
        ({"id": "cage"}, InputError, r"row 2 \(cage\): id is 'cage' for the second time"),
        ({"id": ""}, InputError, r"row 1 \(no id\): id is missing"),
    ],
)
def test_rows_in_python_are_checked_like_those_of_a_file(changes, error, sentence):
    with pytest.raises(error, match=sentence):
        Drawing.of_rows([{**HUB, **changes}, CAGE])


@pytest.mark.parametrize("changes", [{"locked": True}, {"min": 0.0, "cost": 0.0}])
def test_a_zone_of_0_is_neglected_where_the_row_is_locked_or_states_nothing_to_ask_for(changes):
    drawing = Drawing.of_rows([{**HUB, "plus": 0.0, "minus": 0.0, **changes}, CAGE])
    assert [own.name for own in drawing.errors.active] == ["cage"]


def test_a_row_without_a_field_that_is_needed_is_refused_by_name():
    with pytest.raises(InputError, match=r"row 1 \(hub\): the column 'cost' is missing; needed are id, plus, minus"):
        Drawing.of_rows([{name: cell for name, cell in HUB.items() if name != "cost"}])


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("id,plus,minus,unit,min,max,cost\n", "the table has no rows; one row per source is needed"),
        ("id,id,plus,minus,unit,min,max,cost\na,a,1,-1,mm,1,1,1\n", "the column 'id' is there twice"),
        ('id,plus,minus,unit,min,max,cost\na,"1,-1,mm,1,1,1\n', "row 2: a quotation mark is not closed"),
        ("id,plus,minus,unit,min,max,cost\na,0.1,-0.1,mm,0.1,0.3,1,9\n", "row 2: 8 cells stand under 7 headers"),
        (" \n", "the table is empty"),
    ],
)
def test_files_that_are_no_tolerance_tables_are_refused_in_one_sentence(tmp_path, rows, sentence):
    (tmp_path / "t.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(TolallocError, match=sentence) as refused:
        load_drawing(tmp_path / "t.csv")
    assert "\n" not in str(refused.value)


def test_parts_that_are_made_together_are_shipped_as_a_list_of_correlations():
    pairs = [ta.drawing(f"{size}_drawing", correlations="rv_pairs").errors.correlation.pairs for size in SHIPPED]
    assert [len(own) for own in pairs] == [6, 6, 10, 10]  # of three cranks any two are correlated
    with pytest.raises(UnknownNameError, match="the nearest known is rv_pairs"):
        ta.drawing("rv20e_drawing", correlations="rv_pair")


@pytest.mark.slow
def test_discs_and_cranks_made_together_leave_a_tenth_less_transmission_error():
    medians = []
    for correlations in ("", "rv_pairs"):
        drawing = ta.drawing("rv20e_drawing", correlations=correlations)
        model = ta.reducer("rv20e", neglected=("disc*.tilt",)).set_to(drawing.settings).bound(drawing.errors, "test")
        x = seeded_units(drawing.errors, 600)
        medians.append(np.median(model.reading((ta.PEAK_TO_PEAK,))(x).values[:, 0]))
    assert medians[1] / medians[0] == pytest.approx(0.91, abs=0.04)  # 1.7 % is a median's error of 600 units

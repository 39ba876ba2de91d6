"""What a drawing may leave out: of a study, of a reducer, of a diagnosis and a lot; and what `check` says of it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import ZONE_OF_A_LENGTH, written
from tolalloc.exceptions import InputError
from tolalloc.reducers.choice import bind
from tolalloc.study.prepared import Prepared
from tolalloc.wings.bench.ask.diagnose import Diagnose
from tolalloc.wings.bench.ask.lot import Lot

ROW = {"unit": "µm", "min": 1, "max": 10, "cost": 6.5}
ROWS = (
    {
        "id": "Exzenter",
        "source": "6x crank*.journal*.eccentricity",
        "feature": "position",
        "plus": 5,
        "minus": 0,
        **ROW,
    },
    {"id": "Bolzen", "source": "pin.diameter", "nominal": 8, "plus": 0, "minus": -6, **ROW},
)
LIMITS = {ta.PEAK_TO_PEAK: ta.Limit(upper=60)}


def study(reducer: tuple[str, ...] = (), own: tuple[str, ...] = (), rows: tuple[dict, ...] = ROWS) -> ta.Study:
    model = ta.reducer("rv80e", neglected=reducer)
    return ta.Study(model, ta.Drawing.of_rows(rows), limits=LIMITS, neglected=own, name="own")


@pytest.mark.parametrize(
    ("reducer", "own"), [(("*",), ()), ((), ["*"]), (["disc*"], ("housing.*", "c*", "sun.*", "planet*"))]
)
def test_a_study_leaves_out_what_its_reducer_may(reducer, own):
    fixed = Prepared(study=study(reducer, own)).model.kernel.fixed
    assert fixed == Prepared(study=study(("*",))).model.kernel.fixed


def test_a_list_adds_to_what_may_be_left_out_anyway():
    with pytest.raises(InputError, match="add rows to the tolerance table, or patterns to neglected of the study"):
        _ = Prepared(study=study()).model
    whole = ta.drawing("rv80e_drawing")
    few = [own for own in whole.sources if not own.name.startswith(("disc2.runout", "sun.pitch", "mesh"))]
    drawing = ta.Drawing(name="few", errors=type(whole.errors)(tuple(few)))
    # the sun's pitch and the meshes are left out without a word, so that one word for the run-out is enough
    model = Prepared(study=ta.Study(ta.reducer("rv80e"), drawing, limits=LIMITS, neglected=["disc2.runout"])).model
    (said,) = model.left_out
    assert said.startswith(
        "not in the tolerance table and taken as exact: disc2.runout (disc*.runout), sun.pitch, mesh*"
    )


def test_it_is_said_what_each_pattern_took():
    (said,) = Prepared(study=study(own=("housing.*", "disk*", "c*", "*"))).model.left_out  # as `check` says below
    assert "housing.* (housing.groove.radius, housing.runout, housing.pitch), disk* (which takes none), c* (" in said
    assert "crank*.journal*.phase" in said and "crank*.journal*.eccentricity" not in said
    assert "carrier.bore*.position" in said


@pytest.mark.parametrize("wrong", ["*", ["*", 1], {"*": 1}, 3])
def test_what_is_no_list_of_names_is_refused(wrong):
    with pytest.raises(InputError, match=r"study own: neglected is .*; allowed is a list of names in quotation marks"):
        study(own=wrong)


def lengths(**more: object) -> ta.Study:
    model = ta.model(lambda a, b: a + 2 * b, inputs={"a": 3.0, "b": 5.0}, outputs=("length [mm]",))
    drawing = ta.Drawing.of_rows([{"id": "a", **ZONE_OF_A_LENGTH}])
    return ta.Study(model, drawing, limits={"length [mm]": ta.Limit(lower=12.9, upper=13.1)}, name="own", **more)


def test_an_input_that_is_left_out_is_of_its_nominal_size():
    model = Prepared(study=lengths(neglected=["b"])).model
    assert model(np.array([[1e-5], [-1e-5]])).values[:, 0] == pytest.approx([13.01, 12.99])
    assert (
        "Neglected: not in the tolerance table and taken as exact: b." in ta.check(lengths(neglected=["b"])).sentences
    )
    with pytest.raises(InputError, match="the input 'b' has no row in the drawing"):
        ta.check(lengths(neglected=["c*"]))


def test_another_nominal_size_is_another_study():
    one, other = (ta.model(sum, inputs={"a": nominal}, outputs=("length [mm]",), name="own") for nominal in (3.0, 3.1))
    drawing, limits = ta.Drawing.of_rows([{"id": "a", **ZONE_OF_A_LENGTH}]), {"length [mm]": ta.Limit(upper=9)}
    digests = {Prepared(study=ta.Study(own, drawing, limits=limits)).digest for own in (one, other)}
    assert len(digests) == 2


HEADS = {"id": "Merkmal", "source": "Quelle", "feature": "Art", "nominal": "Nennmaß [mm]", "plus": "oberes Abmaß"}
HEADS |= {"minus": "unteres Abmaß", "unit": "Einheit", "min": "kleinste", "max": "größte", "cost": "Kosten [EUR]"}
HEADS |= {"process": "Verfahren"}
OFFICE = ("Exzenter", "crank*.journal*.eccentricity", "Lage", None, 5, 0, "µm", 1, 10, 6.5, "schleifen")
BOLZEN = ("Bolzen", "pin.diameter", "Maß", 8, "h5", None, "µm", 1, 10, 10, "schleifen")


def office(folder):
    """Write a German workbook with fits, a row for several places and a process of the shop; return its path."""
    names = "\n".join(f'"{head.split(" [")[0]}" = "{name}"' for name, head in HEADS.items())
    written(folder / "toleranzen.toml", f"[columns]\n{names}\n")
    shop = "process,feature,Cp,note\nschleifen,size,1.33,own\nschleifen,position,1.33,own\n"
    written(folder / "shop.csv", shop)
    pd.DataFrame([OFFICE, BOLZEN], columns=list(HEADS.values())).to_excel(folder / "toleranzen.xlsx", index=False)
    return folder / "toleranzen.xlsx"


def test_diagnose_takes_the_table_that_a_study_takes(tmp_path):
    table, more = office(tmp_path), {"processes": tmp_path / "shop.csv"}
    asked = ta.Study(ta.reducer("rv80e"), ta.drawing(table, **more), limits=LIMITS, neglected=["*"])
    curve = written(tmp_path / "curve.csv", "")
    found = Diagnose(curve=curve, reducer="rv80e", tolerances=str(table), neglected=["*"], **more).prepare()
    assert found.errors.columns == Prepared(study=asked).model.columns
    kernel, _ = bind(found.reducer, found.errors, found.torque_nm, "test", found.neglected)
    assert kernel.fixed == Prepared(study=asked).model.kernel.fixed
    without = Diagnose(curve=curve, reducer="rv80e", tolerances=str(table), **more).prepare()
    with pytest.raises(InputError, match=r"(is|are) not given"):
        bind(without.reducer, without.errors, without.torque_nm, "test", without.neglected)


def test_a_lot_takes_the_table_that_a_study_takes(tmp_path):
    table = office(tmp_path)
    rows = "".join(f"{at % 7 - 6};{at % 5}\n" for at in range(30))
    readings = written(tmp_path / "lot.csv", f"Bolzen [µm];crank2.journal1.eccentricity.radius [µm]\n{rows}")
    found = Lot(readings=readings, tolerances=table, processes=tmp_path / "shop.csv").prepare()
    assert [own.source.name for own in found.columns] == ["pin.diameter", "crank2.journal1.eccentricity"]
    assert [own.source.cp for own in found.columns] == [1.33, 1.33]
    with pytest.raises(InputError, match=r"neglected is \['\*'\]; allowed is none without curves"):
        Lot(readings=readings, tolerances=table, processes=tmp_path / "shop.csv", neglected=["*"]).prepare()

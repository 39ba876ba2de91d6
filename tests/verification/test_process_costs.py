"""Process cost tables and shop data: what features they allow, and what they refuse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tolalloc.allocation.cost.model import (
    Exponential,
    PowerExponential,
    Reciprocal,
    ReciprocalPower,
)
from tolalloc.allocation.cost.points import Spline, Tabulated, load_shop_points
from tolalloc.allocation.cost.process_costs import UNITS, ProcessCostRow, load_process_costs, priced, today
from tolalloc.drawings.table_file import DATA, read_rows
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, TolallocError
from tolalloc.reading.units import MICROMETRE

HEADER = (
    "sources,process,model,fixed [cost units],factor [cost units µm^n],exponent [-],scale [µm],points,min [µm],"
    "max [µm],change [cost units],inspection [cost units],note\n"
)
SHOP = """process,feature,tolerance [unit],unit,cost [cost units]
hobbed,,30,µm,1.2
hobbed,,0.01,mm,2.5
hobbed,,20,µm,1.5
hobbed,,5,µm,4.5
hobbed,runout,5,µm,9
hobbed,runout,20,µm,7
milled,,5,µm,2
milled,,20,µm,3
ground,runout,5,µm,2
ground,runout,20,µm,1
"""
SOURCES = load_tolerance_table("rv20e_table4")
PITCH = next(source for source in SOURCES if source.name == "disc1.pitch")


def loaded(folder, *rows, sources=(PITCH,), header=HEADER, shop=SHOP):
    (folder / "shop.csv").write_text(shop, encoding="utf-8")
    (folder / "own.csv").write_text(header + "\n".join(rows) + "\n", encoding="utf-8")
    return load_process_costs(folder / "own.csv", sources)


def cost_at(process, micrometres):
    return float(process.total(np.asarray(micrometres * MICROMETRE)))


@pytest.mark.parametrize("table", ["rv20e_table4", "rv20e_all_sources"])
def test_todays_processes_of_the_shipped_table_cost_what_the_tolerance_table_says(table):
    sources = load_tolerance_table(table)
    processes = load_process_costs("rv20e", sources)
    assert set(processes) == {source.name for source in sources if source.zone > 0 and not source.locked}
    for source in sources:
        if source.name in processes:
            first, *others = processes[source.name]
            assert not (others and "each_" in source.name)
            assert float(first.total(np.asarray(source.zone))) == pytest.approx(source.cost, rel=1e-12)
            assert (first.minimum, first.maximum) == (source.minimum, source.maximum)
            for other in others:
                assert source.minimum <= other.minimum < other.maximum <= source.maximum
                assert other.change > 0


def test_every_alternative_of_the_shipped_table_pays_somewhere_and_is_marked_as_assumed():
    rows = read_rows(DATA / "rv20e.process_costs.csv", ProcessCostRow, "sources", UNITS)
    assert all(row.note.startswith("assumed: ") for _, row in rows)
    for processes in load_process_costs("rv20e", SOURCES).values():
        assert len(processes) >= 2
        for other in processes[1:]:
            zones = np.linspace(other.minimum, other.maximum, 501)
            assert (other.total(zones) < processes[0].total(zones)).any()


def test_a_feature_without_a_row_keeps_the_process_of_the_tolerance_table(tmp_path):
    found = loaded(tmp_path, "disc1.pitch,own,reciprocal,,5,,,,,,,,shop", sources=SOURCES)
    runout = next(source for source in SOURCES if source.name == "disc1.runout")
    assert found["disc1.runout"] == (today(runout),)
    assert cost_at(found["disc1.runout"][0], 8.3) == pytest.approx(4.0)
    assert [process.name for process in found["disc1.pitch"]] == ["own"]
    assert "sun.assembly" not in found


@pytest.mark.parametrize(
    ("cells", "model"),
    [
        ("reciprocal,1,20,,,", Reciprocal(fixed=1.0, factor=20.0)),
        ("reciprocal power,1,20,1.4,,", ReciprocalPower(fixed=1.0, factor=20.0, exponent=1.4)),
        ("reciprocal squared,1,20,,,", ReciprocalPower(fixed=1.0, factor=20.0, exponent=2.0)),
        ("exponential,1,20,,9,", Exponential(fixed=1.0, factor=20.0, scale=9.0)),
        ("combined,1,20,0.4,9,", PowerExponential(fixed=1.0, factor=20.0, exponent=0.4, scale=9.0)),
    ],
)
def test_closed_forms_are_read_in_micrometres_and_given_in_metres(cells, model, tmp_path):
    (process,) = loaded(tmp_path, f"disc1.pitch,own,{cells},,,,,shop")["disc1.pitch"]
    assert type(process.cost) is type(model)
    assert cost_at(process, 7.0) == pytest.approx(float(model.value(np.asarray(7.0))), rel=1e-12)
    assert (process.minimum, process.maximum) == (PITCH.minimum, PITCH.maximum)


@pytest.mark.parametrize(
    "cells", ["reciprocal,1,,,,", "reciprocal squared,,,,,", "exponential,1,,,9,", "combined,1,,0.4,9,"]
)
def test_without_a_factor_the_zone_of_the_tolerance_table_costs_what_that_table_says(cells, tmp_path):
    (process,) = loaded(tmp_path, f"disc1.pitch,own,{cells},,,,0.25,shop")["disc1.pitch"]
    assert float(process.total(np.asarray(PITCH.zone))) == pytest.approx(PITCH.cost, rel=1e-12)


def test_leaving_todays_process_costs_its_change_and_inspection_is_always_charged(tmp_path):
    rows = [f"disc1.pitch,{name},reciprocal,0,20,,,,,,0.7,0.1,shop" for name in ("hobbed", "ground")]
    assert [process.change for process in loaded(tmp_path, *rows)["disc1.pitch"]] == pytest.approx([0.0, 0.7])
    assert [cost_at(process, 10) for process in loaded(tmp_path, *rows)["disc1.pitch"]] == pytest.approx([2.1, 2.8])
    named = replace(PITCH, process="ground")
    changes = [process.change for process in loaded(tmp_path, *rows, sources=(named,))["disc1.pitch"]]
    assert changes == pytest.approx([0.7, 0.0])


def test_zones_are_those_that_process_and_tolerance_table_both_allow(tmp_path):
    rows = [
        "disc*.pitch,rough,reciprocal,,20,,,,30,900,,,shop".replace("900", "90"),
        "disc*.pitch,fine,reciprocal,,20,,,,1,9,,,shop",
        "disc*.pitch,finest,reciprocal,,20,,,,,2,,,shop",
    ]
    rough, fine = loaded(tmp_path, *rows)["disc1.pitch"]
    assert (rough.name, fine.name) == ("rough", "fine")
    assert (rough.minimum, rough.maximum) == pytest.approx((30e-6, PITCH.maximum))
    assert (fine.minimum, fine.maximum) == pytest.approx((PITCH.minimum, 9e-6))


@pytest.mark.parametrize(("name", "kind"), [("tabulated", Tabulated), ("spline", Spline)])
def test_shop_points_give_costs_and_the_zones_between_them(name, kind, tmp_path):
    (process,) = loaded(tmp_path, f"disc1.pitch,hobbed,{name},,,,,shop.csv,,,,,shop")["disc1.pitch"]
    assert isinstance(process.cost, kind)
    assert [cost_at(process, zone) for zone in (5, 10, 20, 30)] == pytest.approx([4.5, 2.5, 1.5, 1.2])
    assert (process.minimum, process.maximum) == pytest.approx((5e-6, 30e-6))


@pytest.mark.parametrize("name", ["tabulated", "spline", "fitted"])
def test_inspection_is_part_of_what_shop_points_cost(name, tmp_path):
    rows = [f"disc1.pitch,hobbed,{name},,,,,shop.csv,,,,{inspection},shop" for inspection in ("", "0.3")]
    without, inspected = (loaded(tmp_path, row)["disc1.pitch"][0] for row in rows)
    for zone in (5, 8, 20):
        assert cost_at(inspected, zone) == pytest.approx(cost_at(without, zone) + 0.3, rel=1e-9)
    assert inspected.change == without.change == 0


def test_the_cost_of_the_tolerance_table_is_that_of_its_process_alone(tmp_path):
    rows = ["disc1.pitch,hobbed,reciprocal,,20,,,,,,,,shop", "disc1.pitch,ground,reciprocal,,,,,,,,,,shop"]
    sentence = (
        r"row 3 \(disc1.pitch\): factor is missing: the tolerance table's cost of disc1.pitch belongs to 'hobbed'\."
    )
    with pytest.raises(InputError, match=sentence):
        loaded(tmp_path, *rows)
    named = loaded(tmp_path, *rows, sources=(replace(PITCH, process="ground"),))["disc1.pitch"]
    assert float(named[1].total(np.asarray(PITCH.zone))) == pytest.approx(PITCH.cost, rel=1e-12)


@pytest.mark.slow
def test_a_fitted_row_takes_the_form_that_predicts_the_points(tmp_path):
    tolerances = np.geomspace(4, 40, 8)
    lines = [f"hobbed,{zone!r},µm,{1 + 20 / zone!r}" for zone in tolerances.tolist()]
    shop = "process,tolerance [unit],unit,cost [cost units]\n" + "\n".join(lines) + "\n"
    (process,) = loaded(tmp_path, "disc1.pitch,hobbed,fitted,,,,,shop.csv,,,,,shop", shop=shop)["disc1.pitch"]
    assert isinstance(process.cost, Reciprocal)
    assert (process.cost.fixed, process.cost.factor) == pytest.approx((1.0, 20e-6))


def test_points_of_the_kind_of_callout_come_first(tmp_path):
    runout = next(source for source in SOURCES if source.name == "disc1.runout")
    row = "disc1.*,hobbed,tabulated,,,,,shop.csv,,,,,shop"
    found = loaded(tmp_path, row, sources=(PITCH, runout))
    assert cost_at(found["disc1.runout"][0], 20) == pytest.approx(7.0)
    assert cost_at(found["disc1.pitch"][0], 20) == pytest.approx(1.5)


GOOD = "disc1.pitch,own,reciprocal,0,20,,,,,,,,shop"
BAD = [
    (("disc3.pitch,own,reciprocal,0,20,,,,,,,,s",), r"row 2 \(disc3.pitch\): unknown source 'disc3.pitch'"),
    ((GOOD, GOOD), r"row 3 \(disc1.pitch\): process is 'own' for disc1.pitch for the second time"),
    ((GOOD, GOOD.replace("disc1", "disc*")), "row 3 .* for the second time"),
    (("disc1.pitch,own,reciprocal,0,20,,,,,2,,,s",), "no process can hold a zone of 3.5 to 46.6 µm for disc1.pitch"),
    (("disc1.pitch,own,linear,0,20,,,,,,,,s",), "model is 'linear'; allowed is one of reciprocal, reciprocal power"),
    (("disc1.pitch,own,combined,0,20,,,,,,,,s",), "model combined needs exponent and scale"),
    (("disc1.pitch,own,reciprocal,0,20,2,,,,,,,s",), "model reciprocal takes no exponent"),
    (("disc1.pitch,own,spline,0,20,,,,,,,,s",), "model spline needs points"),
    (("disc1.pitch,own,spline,0,20,,,shop.csv,,,,,s",), "model spline takes no factor and no fixed"),
    (
        ("disc1.pitch,own,reciprocal,0,-20,,,,,,,,s",),
        "factor is -20.0; input should be greater than or equal to 0.000000000001",
    ),
    (("disc1.pitch,own,reciprocal,0,nan,,,,,,,,s",), "factor is nan; input should be a finite number"),
    (("disc1.pitch,own,reciprocal,0,20,,,,9,8,,,s",), "min must not be above max: 9, 8 µm"),
    (("disc1.pitch,own,reciprocal,0,20,,,,,,,,",), "note is missing"),
    (("disc1.pitch,own,reciprocal,2.9,,,,,,,,0.2,s",), "fixed and inspection without a factor is 3.1; .* less than 3,"),
    (("disc1.pitch,own,tabulated,,,,,shop.csv,,,,,s",), "unknown process for feature pitch 'own'; .* hobbed"),
    (("disc1.pitch,ground,spline,,,,,shop.csv,,,,,s",), "unknown process for feature pitch 'ground'"),
    (("disc1.pitch,milled,spline,,,,,shop.csv,,,,,s",), "a zone of 5 costs 2 and a zone of 20 costs 3; allowed"),
    (("disc1.pitch,hobbed,fitted,,,,,none.csv,,,,,s",), "none.csv: no such file"),
]


@pytest.mark.parametrize(("rows", "sentence"), BAD)
def test_bad_process_cost_tables_are_refused_in_one_sentence(rows, sentence, tmp_path):
    with pytest.raises(TolallocError, match=sentence) as caught:
        loaded(tmp_path, *rows)
    assert "\n" not in str(caught.value)


def test_a_process_of_the_tolerance_table_needs_its_row(tmp_path):
    with pytest.raises(TolallocError, match=r"unknown process of disc1.pitch in the tolerance table, 'groud'"):
        loaded(tmp_path, GOOD.replace("own", "ground"), sources=(replace(PITCH, process="groud"),))


def test_unknown_and_missing_columns_are_refused(tmp_path):
    with pytest.raises(TolallocError, match="unknown column 'fix'; the nearest known is fixed"):
        loaded(tmp_path, GOOD, header=HEADER.replace("fixed [", "fix ["))
    with pytest.raises(InputError, match="the column 'note' is missing; needed are sources, process, model, note"):
        loaded(tmp_path, "disc1.pitch,own,reciprocal", header="sources,process,model\n")


@pytest.mark.parametrize(
    ("text", "wrong", "sentence"),
    [
        ("30,µm", "3000,mm", r"row 2 \(hobbed\): tolerance is '3000 mm'; allowed is 1000000 µm or less"),
        ("30,µm", "30,cubit", "unit is 'cubit'"),
        ("30,µm", "-30,µm", "tolerance is -30.0; input should be greater than or equal to 0.000001"),
        ("hobbed,,30", ",,30", r"row 2 \(no process\): process is missing"),
        ("µm,1.2", "µm,cheap", "cost is 'cheap'; allowed is a number"),
        ("tolerance [unit]", "zone [µm]", "unknown column 'zone'"),
        ("ground,runout,20,µm,1\n", "", r"shop.csv \(ground, zones in µm\): zones and costs is .* two zones or more"),
    ],
)
def test_bad_shop_data_are_refused_in_one_sentence(text, wrong, sentence, tmp_path):
    assert text in SHOP
    path = tmp_path / "shop.csv"
    path.write_text(SHOP.replace(text, wrong), encoding="utf-8")
    with pytest.raises(TolallocError, match=sentence) as caught:
        load_shop_points(path)
    assert "\n" not in str(caught.value)


def test_shop_data_are_sorted_micrometres(tmp_path):
    (tmp_path / "shop.csv").write_text(SHOP, encoding="utf-8")
    found = load_shop_points(tmp_path / "shop.csv")
    assert found["hobbed", None].zones == pytest.approx((5.0, 10.0, 20.0, 30.0))
    assert found["hobbed", Feature.RUNOUT].costs == (9.0, 7.0)


@pytest.mark.parametrize(("tolerance", "factor"), [("zone", 0.02), ("half zone", 0.04)])
def test_costs_from_python_are_read_in_millimetres_and_given_in_metres(tolerance, factor):
    found = priced({"disc1.pitch": [("rough", 1.0, 0.02, 0.01, 0.4)]}, SOURCES, tolerance)
    (rough,) = found["disc1.pitch"]
    assert cost_at(rough, 20) == pytest.approx(1 + factor / 0.02)
    assert (rough.minimum, rough.maximum) == pytest.approx((0.01e-3 * factor / 0.02, PITCH.maximum))
    assert set(found) == set(load_process_costs("rv20e", SOURCES))
    runout = next(source for source in SOURCES if source.name == "disc1.runout")
    assert found["disc1.runout"] == (today(runout),)


def test_of_costs_from_python_those_stay_whose_zones_the_source_may_have():
    rows = [("rough", 1.0, 0.02, 0.01, 0.4), ("roughest", 0.5, 0.02, 1.0, 2.0)]
    assert [process.name for process in priced({"disc1.pitch": rows}, [PITCH])["disc1.pitch"]] == ["rough"]


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ({"disc3.pitch": []}, "process costs: unknown source with a free zone 'disc3.pitch'"),
        ({"disc1.pitch": [("own", 1, 1, 0.01, 0.02)] * 2}, "processes is .* allowed is each name once"),
        ({"disc1.pitch": [("own", 1, 1, 1, 2)]}, "no process can hold a zone of 3.5 to 46.6 µm for disc1.pitch"),
        ({"disc1.pitch": [("own", 1, -1, 0.01, 0.02)]}, "factor is -0.001; allowed is a finite number above 0"),
    ],
)
def test_bad_costs_from_python_are_refused_in_one_sentence(rows, sentence):
    with pytest.raises(TolallocError, match=sentence) as caught:
        priced(rows, [PITCH])
    assert "\n" not in str(caught.value)

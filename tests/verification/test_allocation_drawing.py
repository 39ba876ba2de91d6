"""The drawing as a file: the table reads back, and the formulas of the workbook say what tolalloc says."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from math import exp, floor, sqrt

import numpy as np
import pytest
from openpyxl import load_workbook
from typer.testing import CliRunner

import tolalloc as ta
from tests.builders import prepared, source, units_at_random
from tests.sheets import cells, frames
from tolalloc import RADIAL_CLEARANCE as RADIAL
from tolalloc.allocation.cost.model import (
    Exponential,
    PowerExponential,
    Reciprocal,
    ReciprocalPower,
    SumOfCosts,
    Weighted,
)
from tolalloc.allocation.cost.points import Points, Spline, Tabulated
from tolalloc.allocation.cost.process_costs import load_process_costs
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.effort import QUICK_ALLOCATION
from tolalloc.cli.main import app
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import FIGURES, rounded_down
from tolalloc.drawings.table_file import stated_settings
from tolalloc.drawings.tolerance_table import load_tolerance_table, table_frame
from tolalloc.drawings.zones import Feature
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.allocation_drawing import sources_table, tolerances_frame, write_drawing
from tolalloc.reports.tellers.allocation_workbook import cost_formula

UM = 1e-6
SEARCH = QUICK_ALLOCATION.search
SMALL = replace(
    QUICK_ALLOCATION,
    front_limits=(0.95, 1.1),
    front_units=512,
    front_steps=1,
    search=replace(SEARCH, steps=2),
    graded_steps=2,
    setting_steps=(1, 2),
    price_nodes=4,
    share_blocks=8,
)


class Workbook:
    """A workbook whose formulas are calculated: references, sums, products, roots, exponentials and conditions."""

    def __init__(self, path):
        self.sheets = load_workbook(path)

    def value(self, sheet, cell):
        held = self.sheets[sheet][cell].value
        return self.calculated(held[1:], sheet) if isinstance(held, str) and held.startswith("=") else held

    def cells(self, sheet, area):
        found = [self.value(sheet, cell.coordinate) for row in self.sheets[sheet][area] for cell in row]
        return np.array(found, dtype=object if isinstance(found[0], str) else float)

    def calculated(self, formula, sheet="drawing"):
        def looked_up(found):
            if found["text"]:
                return found["text"]
            place, cells = found["sheet"] or sheet, found["cells"].replace("$", "")
            return f"cells({place!r}, {cells!r})" if ":" in cells else f"value({place!r}, {cells!r})"

        cells = (
            r'(?P<text>"[^"]*")|(?:(?P<sheet>[a-z]+)!)?(?P<cells>\$?[A-Z]{1,2}\$?\d+(?::\$?[A-Z]{1,2}\$?\d+)?)(?![\d(])'
        )
        python = re.sub(cells, looked_up, formula).replace("^", "**")
        known = {
            "EXP": exp,
            "SQRT": sqrt,
            "INT": floor,
            "MAX": max,
            "SUM": np.sum,
            "SUMPRODUCT": lambda *arrays: float(np.sum(np.prod(arrays, axis=0))),
            "AND": lambda *asked: all(asked),
            "IF": lambda asked, then, other: then if asked else other,
            "value": self.value,
            "COUNTIF": lambda cells, text: int(np.sum(cells == text)),
            "cells": self.cells,
        }
        return eval(python, {"__builtins__": {}}, known)


CURVE = Points(zones=(1.0, 2.0, 3.5, 6.0, 11.0), costs=(9.0, 5.0, 3.0, 2.2, 2.0))
MODELS = (
    Reciprocal(fixed=0.3, factor=4e-6),
    ReciprocalPower(fixed=0.1, factor=2.5, exponent=1.7),
    Exponential(fixed=0.2, factor=8.0, scale=2.3),
    PowerExponential(factor=6.0, exponent=0.4, scale=3.0),
    Tabulated(CURVE),
    Spline(CURVE),
    Weighted(model=Reciprocal(factor=2.0), weight=1.25),
    SumOfCosts(models=(Spline(CURVE), Reciprocal(factor=3.0), Tabulated(CURVE)), ratios=(1.3, 2.0, 0.8)),
    Weighted(model=SumOfCosts(models=(Exponential(factor=2.0, scale=1.0),), ratios=(2.0,)), weight=0.8),
)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_formula_costs_what_its_model_costs(model):
    formula = cost_formula(model, "Z")
    calculator = Workbook.__new__(Workbook)
    for zone in (0.7, 1.0, 1.6, 2.0, 3.1, 5.0, 6.0, 9.0, 14.0):
        told = calculator.calculated(formula.replace("Z", repr(zone)))
        assert told == pytest.approx(float(model.value(np.array(zone))), rel=1e-11)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_formula_is_one_that_every_workbook_reads(model):
    formula = cost_formula(model.rescaled(4e-6), "D2")
    assert "np." not in formula
    assert "e" not in formula
    assert len(formula) < 8192
    assert formula.count("(") == formula.count(")")


def test_many_points_need_no_nested_conditions():
    zones = np.linspace(1, 40, 100)
    points = Points(zones=tuple(zones.tolist()), costs=tuple((50 / zones).tolist()))
    formula = cost_formula(Tabulated(points), "D2")
    assert len(formula) < 8192
    assert "IF" not in formula


def allocated(**changes):
    """Return the answer of the baseline's study with fields changed, at a small effort."""
    return prepared(effort=ta.Effort(allocation=SMALL, is_quick=True), **changes).study.allocate().result


@pytest.fixture(scope="module")
def graded():
    return allocated(name="graded", questions=(ta.Allocation(grades=True),))


@pytest.fixture(scope="module")
def priced(tmp_path_factory):
    """Four groups that may change, each by several processes, and a lower limit whose stack adds, too."""
    free = {"disc bores", "pin diameter", "disc run-out", "housing pitch"}
    sources = [replace(own, locked=own.dimension not in free) for own in load_tolerance_table("rv20e_table4")]
    table = tmp_path_factory.mktemp("table") / "locked.csv"
    table_frame(sources).to_csv(table, index=False)
    results = allocated(
        name="priced",
        drawing={"table": table, "costs": "rv20e"},
        limits={ta.PEAK_TO_PEAK: ta.Limit(upper=70.0), RADIAL: ta.Limit(lower=-20.0)},
        questions=(ta.Allocation(),),
    )
    chosen = results.free.chosen
    first, (side,) = chosen.checks[0], chosen.checks[1].constraints
    root_sum_square = side.stack.root_sum_square
    more = float(root_sum_square @ chosen.design[:-2])
    stack = replace(side.stack, worst_case=root_sum_square, budget=side.stack.budget + more)
    checks = (first, replace(chosen.checks[1], constraints=(replace(side, stack=stack),)))
    return replace(results, free=replace(results.free, chosen=replace(chosen, checks=checks)))


@pytest.fixture(scope="module", params=["graded", "priced"])
def drawn(request, tmp_path_factory):
    results, folder = request.getfixturevalue(request.param), tmp_path_factory.mktemp(request.param)
    write_drawing(results, Header(name=results.name, model=results.model.name), folder)
    return results, folder


def cost_cell(results):
    return f"D{2 + len(results.chosen.alone)}"


def scaled(results, workbook, position, factor):
    """Return the design whose zone at a position is another one, and change it in the workbook."""
    design = results.chosen.design.copy()
    design[position] *= factor
    workbook.sheets["drawing"].cell(2 + position, 2).value *= factor
    return design


@pytest.mark.slow
def test_the_workbook_says_what_tolalloc_says_of_the_drawing(drawn):
    results, folder = drawn
    workbook = Workbook(folder / "drawing.xlsx")
    assert workbook.value("requirements", cost_cell(results)) == pytest.approx(results.chosen.cost)
    for row, side in enumerate(results.chosen.alone, start=2):
        assert workbook.value("requirements", f"A{row}") == side.stack.name
        told = workbook.value("requirements", f"D{row}")
        assert told == pytest.approx(side.limit + side.sign * side.predicted(results.chosen.design))
        assert workbook.value("requirements", f"E{row}") == ("yes" if side.excess <= 0 else "no")
    for row in range(2, 2 + len(results.drawn.groups)):
        assert workbook.value("drawing", f"G{row}") == "yes"


def relief(results, side, design):
    """Return what zones that relieve a limit add when they shrink, which the model of the search leaves out."""
    groups = len(results.drawn.groups)
    slopes = np.minimum(side.batches[:, :groups].mean(axis=0), 0.0)
    return float(slopes @ (design - results.chosen.design)[:groups])


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.93, 1.1])
def test_the_workbook_says_what_tolalloc_says_of_another_zone(drawn, factor):
    results, folder = drawn
    space = results.drawn
    made = space.process_positions(results.chosen.design)
    for position, (feature, process) in enumerate(zip(space.features, made, strict=True)):
        workbook = Workbook(folder / "drawing.xlsx")
        design = scaled(results, workbook, position, factor)
        cost = space.problem(()).cost(design[:-2], made) + space.locked_cost
        assert workbook.value("requirements", cost_cell(results)) == pytest.approx(cost)
        for row, side in enumerate(results.chosen.alone, start=2):
            told = workbook.value("requirements", f"D{row}")
            assert told == pytest.approx(
                side.limit + side.sign * (side.predicted(design) + relief(results, side, design))
            )
        held = feature.processes[process]
        inside = held.minimum * (1 - 1e-6) <= design[position] <= held.maximum * (1 + 1e-6)
        assert workbook.value("drawing", f"G{2 + position}") == ("yes" if inside else "no")


@pytest.mark.slow
def test_formulas_hold_plain_numbers_and_the_zones_to_change_are_marked(drawn):
    results, folder = drawn
    sheets = load_workbook(folder / "drawing.xlsx")
    assert sheets.sheetnames == ["answer", "drawing", "requirements", "modification", "tolerances", "inspection plan"]
    formulas = [
        cell.value
        for name in ("drawing", "requirements")
        for row in sheets[name].iter_rows()
        for cell in row
        if isinstance(cell.value, str) and cell.value.startswith("=")
    ]
    sides = len(results.chosen.alone)
    groups = results.drawn.groups
    further = sum(name in groups and not members[0].locked for name, members in results.lines) - len(groups)
    assert len(formulas) == 5 * len(groups) + 2 * further + 2 * sides + 1 + 3 * sides + 1
    assert not any("np." in formula or "e-" in formula or "nan" in formula for formula in formulas)
    zones = sheets["drawing"]
    marked = {zones.cell(2 + at, 2).fill.fgColor.rgb for at in range(len(results.drawn.groups))}
    assert marked == {"FFFFF2CC"}
    assert zones["C2"].fill.fgColor.rgb not in marked
    assert any("yellow" in str(row[0].value) for row in zones.iter_rows())
    (guard,) = zones.data_validations.dataValidation
    assert all(zones.cell(2 + at, 2).coordinate in guard.sqref for at in range(len(results.drawn.groups)))
    assert zones.page_setup.orientation == "landscape" and zones.print_title_rows == "$1:$1"


@pytest.mark.slow
def test_a_reader_that_calculates_nothing_sees_what_the_formulas_give(drawn):
    _, folder = drawn
    workbook, kept = Workbook(folder / "drawing.xlsx"), load_workbook(folder / "drawing.xlsx", data_only=True)
    formulas = [
        (sheet.title, cell.coordinate)
        for sheet in workbook.sheets
        for row in sheet.iter_rows()
        for cell in row
        if isinstance(cell.value, str) and cell.value.startswith("=")
    ]
    for sheet, cell in formulas:
        seen, calculated = kept[sheet][cell].value, workbook.value(sheet, cell)
        assert seen == (calculated if isinstance(calculated, str) else pytest.approx(calculated, rel=1e-9)), (
            sheet,
            cell,
        )


@pytest.mark.slow
def test_every_line_of_the_drawing_states_the_one_verified_zone_of_its_members(drawn):
    results, folder = drawn
    workbook, rows = Workbook(folder / "drawing.xlsx"), {}
    verified = dict(
        zip((own.name for own in results.drawn.errors.active), results.drawn.zones(results.chosen.design), strict=True)
    )
    for (text,) in workbook.sheets["drawing"].iter_rows(max_col=1):
        rows[text.value] = text.row
    for line in results.lines:
        (zone,) = {round(verified[own.name] / UM, 6) for own in line[1]}
        frame = portrait_of(results.model).frame(line[1][0])
        stated = workbook.value("drawing", f"K{rows[results.line_name(line)]}")
        whole = 2e3 * stated if frame.characteristic == "size" else 1e3 * stated
        assert -1e-6 < zone - whole < 2e-2 + 1e-6
        assert frame.zone.lstrip("±⌀") == f"{stated:.5f}".rstrip("0").rstrip(".")
    inspected = [row[1] for row in cells(folder / "frames.dxf", "TABLE") if row[2:3] and row[2][:3] in ("Fp ", "Fr ")]
    assert {*frames(folder / "frames.dxf"), *inspected} == {results.line_name(line) for line in results.lines}


@pytest.mark.slow
def test_the_accepted_drawing_has_the_zones_in_whole_steps_that_were_verified_last(priced):
    design, space = priced.chosen, priced.drawn
    assert design.accepted
    assert design.independent is not None
    tabled = dict(zip((own.name for own in space.errors.active), space.zones(design.design), strict=True))
    for own in priced.space.errors.active:
        zone = tabled[own.name] / UM
        if own.locked or zone == pytest.approx(own.minimum / UM) or zone == pytest.approx(own.zone / UM):
            continue
        sides = 2 if own.feature is Feature.SIZE else 1
        step = 0.01 if zone / sides < 1 else 0.1 if zone / sides < 10 else 0.5
        assert zone / sides / step == pytest.approx(round(zone / sides / step), abs=1e-6), own.name
    assert design.cost == pytest.approx(sum(space.cost_of_sources(design.design).values()) + space.locked_cost)


def test_members_with_their_own_zones_are_rounded_each_on_its_own():
    zones = {"a": 4.2 * UM, "b": 4.0 * UM}
    first, other = (source(name, zone=zone, group="both", step=0.1 * UM) for name, zone in zones.items())
    alone = source("c", Feature.POSITION, zone=20.0 * UM, step=2.0 * UM)
    space = DesignSpace(errors=ErrorModel((first, other, alone)))
    stated, design = space.rounded_down(np.array([1.18, 0.77]))
    assert (stated.zones(design) / UM).tolist() == pytest.approx([4.8, 4.6, 14.0])
    assert stated.cost(design) == pytest.approx(4.2 / 4.8 + 4.0 / 4.6 + 20 / 14)
    same, design = space.rounded_down(np.array([1.0, 0.77]))
    assert same is space
    assert design.tolist() == pytest.approx([1.0, 0.7])
    _, least = space.rounded_down(np.array([1.0, space.lower[1]]))
    assert least[1] == space.lower[1]


@pytest.mark.parametrize(("zone", "stated"), [(106.86, 106.5), (199.99, 199.5), (2.009, 2.0), (0.004278, 0.00427)])
def test_a_number_of_any_other_assembly_has_three_figures(zone, stated):
    assert rounded_down(zone * UM, usual=FIGURES) == pytest.approx(stated * UM, rel=1e-12)


def test_three_figures_take_less_than_half_a_per_cent_of_a_zone():
    zones = np.geomspace(1e-9, 1e9, 5_000) * UM
    taken = np.array([1 - rounded_down(zone, usual=FIGURES) / zone for zone in zones.tolist()])
    assert (taken > -1e-12).all()
    assert (taken < 0.005).all()


def test_the_drawing_of_an_own_model_has_three_figures_where_its_table_states_no_steps():
    rows = [
        {"id": own, "plus": 7, "minus": -7, "unit": "µm", "nominal": 5, "cost": 1, "min": 1, "max": 60} for own in "ab"
    ]
    rows[1]["step"] = 2.0
    gap = ta.model(lambda a, b: 1000 * (a - b), inputs={"a": 5.0, "b": 5.0}, outputs=("gap [µm]",))
    limits = {"gap [µm]": ta.Limit(lower=-12.3, upper=12.3)}
    asked = ta.Study(
        gap, ta.Drawing.of_rows(rows), limits=limits, questions=[ta.Allocation(front=False, what_if=False)]
    )
    result = asked.allocate(effort="quick").result
    free, stepped = (own.zone / UM / 2 for own in result.drawn_sources)
    assert free == pytest.approx(rounded_down(free * UM, usual=FIGURES) / UM, rel=1e-9)
    assert stepped / 2.0 == pytest.approx(round(stepped / 2.0), rel=1e-9)
    assert result.chosen.unrounded_cost < result.chosen.cost


@pytest.mark.slow
def test_the_table_reads_back_with_the_zones_of_the_drawing(drawn):
    results, folder = drawn
    read = load_tolerance_table(folder / "allocation.csv")
    meant = dict(
        zip((own.name for own in results.drawn.errors.active), results.drawn.zones(results.chosen.design), strict=True)
    )
    assert [own.name for own in read] == [own.name for own in results.space.errors.sources]
    for own, before, after in zip(read, results.space.errors.sources, results.drawn_sources, strict=True):
        # The file has five decimals of a micrometre.
        assert own.zone == pytest.approx(meant.get(own.name, 0.0), abs=0.51e-5 * UM)
        assert own.locked == before.locked
        assert own.grade == after.grade
        assert own.group == before.group
        assert (own.minimum, own.maximum) == pytest.approx((before.minimum, before.maximum))
    assert sum(own.cost for own in read) == pytest.approx(results.chosen.cost, rel=1e-9)
    assert stated_settings(folder / "allocation.csv") == dict(
        zip(results.space.shared.names, results.chosen.settings.tolist(), strict=True)
    )
    if results.graded:
        np.testing.assert_allclose([own.zone for own in read], [own.zone for own in results.drawn_sources], rtol=1e-12)
        assert {own.grade for own in read if own.zone} == set(results.graded.labels)


@pytest.mark.slow
def test_the_files_read_back_have_the_verified_yield_and_cost(drawn, tmp_path):
    """6,144 other units at zones and modification of ``allocation.csv``; the workbook as LibreOffice calculates it."""
    results, folder = drawn
    sources, stated = load_tolerance_table(folder / "allocation.csv"), stated_settings(folder / "allocation.csv")
    errors = replace(results.space.errors, sources=sources)
    model = results.model.at(np.array([stated[name] for name in results.space.shared.names]))
    x = units_at_random(errors, 6144, 3)
    requirement = results.requirements[0]
    found = model.reading((requirement.output,))(x)
    kept = requirement.limits.kept_by(np.where(found.good, found.values[:, 0], np.nan)).mean()
    error = np.sqrt((1 - results.chosen.achieved.low) / 6144)
    assert kept == pytest.approx(results.chosen.achieved.estimate, abs=4 * error)
    if shutil.which("soffice") is None:
        pytest.skip("no LibreOffice to recalculate the workbook with")
    profile = f"-env:UserInstallation=file://{tmp_path / 'profile'}"
    convert = ["--headless", "--convert-to", "xlsx:Calc MS Excel 2007 XML", "--outdir", str(tmp_path)]
    command = ["soffice", profile, *convert, str(folder / "drawing.xlsx")]
    subprocess.run(command, check=True, capture_output=True, timeout=180)
    book = load_workbook(tmp_path / "drawing.xlsx", data_only=True)
    assert book["requirements"][cost_cell(results)].value == pytest.approx(results.chosen.cost)
    amounts = {row[0]: row[1] for row in book["modification"].iter_rows(min_row=2, values_only=True)}
    drawn_amounts = results.model.drawn_amounts
    values = drawn_amounts.by_setting @ results.chosen.settings
    assert [amounts[name.split(" [")[0]] for name in drawn_amounts.names] == pytest.approx(values.tolist())


@pytest.mark.slow
def test_the_table_reads_back_with_the_prices_of_the_drawing(priced, tmp_path):
    write_drawing(priced, Header(name=priced.name, model=priced.model.name), tmp_path)
    read = load_tolerance_table(tmp_path / "allocation.csv")
    assert sum(own.cost for own in read) == pytest.approx(priced.chosen.cost, rel=1e-9)
    again = load_process_costs("rv20e", read)
    made = priced.drawn.made_by(priced.chosen.design)
    assert set(again) == set(made)
    assert any(process.change > 0 for process in made.values())  # else nothing would be paid once
    for before, drawn, after in zip(priced.space.errors.sources, priced.drawn_sources, read, strict=True):
        if before.name not in made:
            assert (after.process, after.cost) == (before.process, before.cost)
            continue
        chosen = made[before.name]
        assert after.process == chosen.name
        assert after.cost == pytest.approx(drawn.cost, rel=1e-9)  # leaving the old process is a part of it
        assert {own.name for own in again[before.name]} == {own.name for own in priced.space.processes[before.name]}
        for own in again[before.name]:
            was = next(process for process in priced.space.processes[before.name] if process.name == own.name)
            assert (own.minimum, own.maximum) == pytest.approx((was.minimum, was.maximum), rel=1e-9)
            zones = np.linspace(own.minimum, own.maximum, 5)
            np.testing.assert_allclose(own.cost.value(zones), was.cost.value(zones), rtol=1e-9)
            if own.name == chosen.name:
                assert own.change == 0
                assert float(own.total(np.array(drawn.zone))) == pytest.approx(drawn.cost - chosen.change, rel=1e-9)


@pytest.mark.slow
def test_a_table_without_a_process_cost_table_keeps_its_own_processes(graded, tmp_path):
    kept = {"pin.diameter": "ground", "housing.pitch": "turned hard"}
    sources = tuple(replace(own, process=kept.get(own.name, "")) for own in graded.space.errors.sources)
    space = replace(graded.space, errors=replace(graded.space.errors, sources=sources))
    write_drawing(replace(graded, space=space), Header(name="graded", model=graded.model.name), tmp_path)
    read = load_tolerance_table(tmp_path / "allocation.csv")
    assert {own.name: own.process for own in read if own.process} == kept


@pytest.mark.parametrize(("middle", "widest"), [(0.0, 2.4691), (1.76549, 2.46911), (-0.33333, 1.00007), (5.1, 0.3)])
def test_a_zone_at_its_largest_is_not_refused_for_its_last_decimal(middle, widest, tmp_path):
    pin = next(own for own in load_tolerance_table("rv20e_table4") if own.name == "pin.diameter")
    drawn = replace(pin, zone=widest * UM, middle=middle * UM, minimum=0.01 * UM, maximum=widest * UM)
    table_frame([drawn]).to_csv(tmp_path / "table.csv", index=False)
    (read,) = load_tolerance_table(tmp_path / "table.csv")
    assert read.zone == pytest.approx(drawn.zone, rel=1e-12)
    assert read.zone == read.maximum
    assert read.middle == pytest.approx(drawn.middle, abs=0.51e-5 * UM)


@pytest.mark.slow
def test_check_accepts_a_study_that_goes_on_from_the_drawing(drawn):
    _, folder = drawn
    script = folder / "again.py"
    script.write_text(
        "import tolalloc as ta\n"
        f'study = ta.Study(ta.reducer("rv20e_liu2020"), ta.drawing({str(folder / "allocation.csv")!r}), name="again",\n'
        "    limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)})\n"
    )
    answered = CliRunner().invoke(app, ["check", str(script)])
    assert answered.exit_code == 0, answered.output


@pytest.mark.slow
def test_the_tables_of_the_drawing_add_up(drawn):
    results, _ = drawn
    short, full = sources_table(results).frame(), tolerances_frame(results)
    assert short["cost [cost units]"].sum() == pytest.approx(results.chosen.cost)
    assert short["cost before [cost units]"].sum() == pytest.approx(results.free.baseline.cost)
    assert short["share of variance [%]"].sum() == pytest.approx(100)
    assert len(full) == len(results.space.errors.sources)
    if not results.graded:
        made = dict(zip(results.space.groups, results.chosen.processes, strict=True))
        groups = {own.name: own.group for own in results.space.errors.active}
        changed = short[short["locked"] == "no"]
        assert all(row["process"] == made[groups[row["source"]]] for _, row in changed.iterrows())


def test_a_zone_a_hair_below_a_whole_step_is_that_step():
    """A solver ends at 9.99999995 µm where 10 µm are allowed; the drawing says 10 µm and no 9.9."""
    own = source("a", Feature.POSITION, zone=8.0 * UM)
    for zone, drawn in ((10.0 * (1 - 5e-9), 10.0), (9.6, 9.6), (9.69, 9.6)):
        assert own.rounded_down(zone * UM) == pytest.approx(drawn * UM, rel=1e-12)

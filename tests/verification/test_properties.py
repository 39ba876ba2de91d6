"""What holds for every tolerance table and every file of stiffnesses, on some that hypothesis makes up and shrinks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.drawings.drawing import Drawing, load_drawing
from tolalloc.drawings.sources import ANGULAR
from tolalloc.drawings.tolerance_table import table_frame
from tolalloc.exceptions import InputError
from tolalloc.reducers.reducer.files import IDENTIFIABLE, load_identified_stiffness, write_identified_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reports.excel import write_sheets

Row = dict[str, object]

NAMES = (
    st.text(st.characters(exclude_categories=["Cs", "Cc", "Cf", "Zs"], include_characters=" "), max_size=8)
    .map(str.strip)
    .filter(
        lambda text: (
            text and text[0] != "#" and not any(angle in text for angle in ANGULAR)
        )  # an angle needs a length, too
    )
)
HUNDREDTHS = st.integers(1, 20_000).map(lambda number: number / 100)
SHARES = st.integers(-100, 100).map(lambda number: number / 100)

every_table = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@st.composite
def tables(draw: st.DrawFn) -> list[Row]:
    """Make up the rows of a table of sizes, some of them in groups that keep a range in common."""
    rows = []
    for name in draw(st.lists(NAMES, min_size=1, max_size=6, unique=True)):
        zone, at = draw(HUNDREDTHS), draw(SHARES)
        shape = draw(st.sampled_from(["normal", "uniform", "triangular"]))
        rows.append(
            {
                "id": name,
                "nominal": draw(HUNDREDTHS),
                "plus": round(zone * (1 + at) / 2, 5),
                "minus": round(zone * (1 + at) / 2 - zone, 5),
                "unit": "µm",
                "distribution": shape,
                "Cp": draw(st.integers(50, 200)) / 100,
                "shift": draw(st.integers(-50, 50)) / 100 if shape == "normal" else 0.0,
                "group": draw(st.sampled_from(["", "one group", "another"])),
                "locked": draw(st.booleans()),
                "min": round(zone / 4, 5),
                "max": round(zone * 4, 5),
                "cost": draw(HUNDREDTHS),
            }
        )
    return rows


def zones(rows: list[Row]) -> dict[str, tuple[float, float, float]]:
    """Return zone, middle and cost of every source [m, m, cost units]."""
    return {own.name: (own.zone, own.middle, own.cost) for own in Drawing.of_rows(rows).sources}


def alone(name: str) -> Row:
    """Return the smallest row; hypothesis found one whose name made it a comment in the written file."""
    return {"id": name, "plus": 0.01, "minus": 0.0, "unit": "µm", "min": 0.0025, "max": 0.04, "cost": 0.01}


@pytest.mark.slow
@every_table
@example(rows=[alone("=1+1"), alone("-1"), alone("@"), alone('"'), alone(",;")])
@given(rows=tables())
def test_a_table_that_is_written_is_read_back_the_same(rows, tmp_path_factory):
    folder, drawing = tmp_path_factory.mktemp("table"), Drawing.of_rows(rows)
    workbook = folder / "table.xlsx"
    write_sheets({"tolerances": table_frame(drawing.sources)}, workbook)
    for path in (drawing.to_csv(folder / "table.csv"), workbook):
        again = load_drawing(path)
        assert again.to_frame().equals(drawing.to_frame()), path
        assert [own.name for own in again.sources] == [row["id"] for row in rows]


def test_a_name_that_would_make_its_row_a_comment_is_refused():
    with pytest.raises(InputError, match=r"row 1 \(#1\): id is .#1.; allowed is a name that does not begin with #"):
        Drawing.of_rows([alone("#1")])


@pytest.mark.slow
@every_table
@given(rows=tables(), order=st.randoms(use_true_random=False))
def test_the_order_of_rows_changes_no_zone_and_no_cost(rows, order):
    shuffled = order.sample(rows, len(rows))
    assert zones(shuffled) == zones(rows)
    spaces = [DesignSpace(errors=Drawing.of_rows(own).errors) for own in (rows, shuffled)]
    assert {*spaces[0].groups} == {*spaces[1].groups}
    first, second = (own.cost(own.uniform(1.3)) for own in spaces)
    assert second == pytest.approx(first, rel=1e-12)


@every_table
@given(rows=tables())
def test_the_unit_of_length_changes_no_zone(rows):
    lengths = ("plus", "minus", "min", "max")
    in_millimetres = [{**row, **{name: row[name] / 1000 for name in lengths}, "unit": "mm"} for row in rows]
    for name, known in zones(rows).items():
        assert zones(in_millimetres)[name] == pytest.approx(known, rel=1e-9, abs=1e-17)


@every_table
@given(rows=tables(), scales=st.tuples(st.floats(0.3, 3.0), st.floats(0.3, 3.0)))
def test_wider_zones_deviate_more_and_cost_no_more(rows, scales):
    drawing = Drawing.of_rows(rows)
    space, (narrow, wide) = DesignSpace(errors=drawing.errors), sorted(scales)
    standard = drawing.errors.standard_values(np.random.default_rng(1).random((32, len(drawing.errors.columns))))
    found = [
        np.ptp(drawing.errors.deviations(standard, space.zones(space.uniform(scale))), axis=0)
        for scale in (narrow, wide)
    ]
    assert (space.zones(space.uniform(wide)) >= space.zones(space.uniform(narrow))).all()
    assert (found[1] >= found[0] * (1 - 1e-12)).all()
    assert space.cost(space.uniform(wide)) <= space.cost(space.uniform(narrow)) * (1 + 1e-12)


@every_table
@given(rows=tables())
def test_a_group_goes_by_what_is_in_it_and_not_by_its_name(rows):
    other = {"one group": "another", "another": "one group"}
    renamed = [{**row, "group": other.get(row["group"], row["group"])} for row in rows]
    spaces = [DesignSpace(errors=Drawing.of_rows(own).errors) for own in (rows, renamed)]
    for space in spaces:
        assert len(space.lower) == len(space.groups)
    scale = np.random.default_rng(2).uniform(0.5, 2.0, len(spaces[0].groups))
    by_name = dict(zip(spaces[0].groups, scale, strict=True))
    same = np.array([by_name[other.get(name, name)] for name in spaces[1].groups])
    np.testing.assert_array_equal(spaces[1].zones(same), spaces[0].zones(scale))
    assert spaces[1].cost(same) == pytest.approx(float(spaces[0].cost(scale)), rel=1e-12)


@every_table
@given(
    values=st.dictionaries(st.sampled_from(IDENTIFIABLE), st.floats(1e4, 1e13), min_size=1, max_size=5),
    share=st.floats(1e-6, 0.9),
    text=st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=20),
)
def test_a_file_of_stiffnesses_is_read_back_equal(values, share, text, tmp_path_factory):
    identified = IdentifiedStiffness(
        source=text,
        values=values,
        standard_uncertainty={name: share * value for name, value in values.items()},
        notes=(text, f'"{text}"'),
    )
    path = tmp_path_factory.mktemp("stiffness") / "found.toml"
    write_identified_stiffness(identified, path)
    assert load_identified_stiffness(path) == identified

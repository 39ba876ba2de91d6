"""Tables whose every cell is allowed but wrong in sense: each is read as meant, refused, or doubted in a sentence."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.drawings.tolerance_table import doubts
from tolalloc.exceptions import InputError
from tolalloc.reports.portrait import portrait_of

UNIT = {"mm": 1.0, "µm": 1e-3}


def sensible_row(generator: np.random.Generator, name: str) -> dict:
    """Return a size of 5 to 200 mm with a zone of IT6 to IT11, in mm or µm, symmetric, to one side or neither."""
    nominal = float(np.round(5 * 40 ** generator.random(), 2))
    factor = 0.45 * nominal ** (1 / 3) + 0.001 * nominal  # i of ISO 286-1 [µm]
    zone = float(np.round(10 * 10 ** generator.random() * factor)) * 1e-3  # mm
    above = float(generator.choice([0.5, 0.5, 0.0, 1.0, 0.3]))
    unit = str(generator.choice([*UNIT]))
    cells = {
        "plus": zone * above,
        "minus": zone * (above - 1),
        "min": zone / generator.uniform(2, 8),
        "max": min(zone * generator.uniform(2, 8), 2.0),
    }
    stated = {key: float(np.round(value / UNIT[unit], 6)) for key, value in cells.items()}
    cost = float(np.round(0.5 * 8 ** generator.random(), 2))
    cp = float(np.round(generator.uniform(0.8, 1.67), 2))
    return {"id": name, "nominal": nominal, **stated, "unit": unit, "cost": cost, "Cp": cp, "distribution": "normal"}


def table(generator: np.random.Generator) -> list[dict]:
    return [sensible_row(generator, f"row{at}") for at in range(int(generator.integers(4, 9)))]


def limits_of_size(row: dict) -> dict:
    nominal = row["nominal"] / UNIT[row["unit"]]
    return {"plus": nominal + row["plus"], "minus": nominal + row["minus"]}


def scaled(*keys: str, by: float):
    return lambda row: {key: row[key] * by for key in keys}


def other_unit(row: dict) -> dict:
    return {"unit": "µm" if row["unit"] == "mm" else "mm"}


ZONE = ("plus", "minus")
WRONG = {
    "limits of size for deviations": limits_of_size,
    "limits of size, no nominal": lambda row: {**limits_of_size(row), "nominal": 0.0},
    "minus without its sign": lambda row: {"minus": -row["minus"]},
    "plus with a minus sign": lambda row: {"plus": -row["plus"]},
    "plus and minus exchanged": lambda row: {"plus": row["minus"], "minus": row["plus"]},
    "both signs turned": lambda row: {"plus": -row["plus"], "minus": -row["minus"]},
    "the other unit": other_unit,
    "zone in another unit than its range": scaled(*ZONE, by=1e3),
    "zone a thousandth": scaled(*ZONE, by=1e-3),
    "range in another unit": scaled("min", "max", by=1e3),
    "range a thousandth": scaled("min", "max", by=1e-3),
    "max a thousandfold": scaled("max", by=1e3),
    "min a thousandth": scaled("min", by=1e-3),
    "nominal a thousandfold": scaled("nominal", by=1e3),
    "nominal a thousandth": scaled("nominal", by=1e-3),
    "nominal below zero": scaled("nominal", by=-1.0),
    "no nominal": lambda row: {"nominal": 0.0},
    "cost a thousandfold": scaled("cost", by=1e3),
    "cost a thousandth": scaled("cost", by=1e-3),
    "cost below zero": scaled("cost", by=-1.0),
    "cost of zero": scaled("cost", by=0.0),
    "Cp in percent": scaled("Cp", by=100.0),
    "Cp tenfold": scaled("Cp", by=10.0),
    "Cp a tenth": scaled("Cp", by=0.1),
    "shift in micrometres": lambda row: {"shift": 5.0},
    "zone of zero": lambda row: {"plus": 0.0, "minus": 0.0},
}
SAME = {"minus without its sign", "plus with a minus sign", "plus and minus exchanged", "both signs turned"}
"""Where a deviation is 0 these may change nothing."""


def outcome(rows: list[dict], place: int, kind: str) -> str:
    """Return what becomes of a table one row of which is wrong in sense."""
    row, changed = rows[place], {**rows[place], **WRONG[kind](rows[place])}
    if all(abs(float(changed[key]) - float(row[key])) < 1e-12 for key in ("plus", "minus", "nominal")) and kind in SAME:
        return "read as meant"
    wrong = [*rows[:place], changed, *rows[place + 1 :]]
    try:
        drawing = ta.Drawing.of_rows(wrong)
    except InputError as error:
        assert row["id"] in str(error)
        return "refused"
    if any(f", {row['id']}: " in note for note in drawing.notes):
        return "doubted"
    names = tuple(own["id"] for own in rows)
    model = ta.model(lambda *sizes: sum(sizes), inputs=names, outputs=("sum [mm]",)).bound(drawing.errors, "table")
    said = portrait_of(model).examination({}).sentences  # what `check` prints of the model
    if any("No nominal size" in sentence and row["id"] in sentence for sentence in said):
        return "doubted"
    return "silent"


def outcomes(count: int, seed: int) -> Counter[tuple[str, str]]:
    generator, found = np.random.default_rng(seed), Counter[tuple[str, str]]()
    for number in range(count):
        rows, kind = table(generator), [*WRONG][number % len(WRONG)]
        assert ta.Drawing.of_rows(rows).notes == ()
        found[kind, outcome(rows, int(generator.integers(len(rows))), kind)] += 1
    return found


def test_no_wrong_table_is_read_without_a_word():
    found = outcomes(3 * len(WRONG), seed=1)
    assert {kind for kind, what in found if what == "silent"} == set()


@pytest.mark.slow
def test_none_of_two_thousand_wrong_tables_is_read_without_a_word():
    found = outcomes(2000, seed=2)
    sums = Counter[str]()
    for (_, what), count in found.items():
        sums[what] += count
    assert sums["silent"] == 0
    assert sums["read as meant"] < 0.02 * 2000  # a deviation of 0 has no sign to lose
    assert sums["refused"] > 900
    assert sums["doubted"] > 500


@pytest.mark.parametrize(
    "name", ["rv20e_table4", "rv20e_all_sources", "rv20e_drawing", "rv40e_drawing", "rv110e_drawing"]
)
def test_nothing_is_doubted_of_shipped_tables(name):
    assert doubts(ta.drawing(name).sources, name) == ()


OF_A_REDUCER = {
    "zone a thousandfold": scaled(*ZONE, by=1e3),
    "zone a thousandth": scaled(*ZONE, by=1e-3),
    "zone and range a thousandth": scaled(*ZONE, "min", "max", by=1e-3),
    "range a thousandfold": scaled("min", "max", by=1e3),
    "min and max exchanged": lambda row: {"min": row["max"], "max": row["min"]},
    "zone below zero": lambda row: {"plus": row["minus"], "minus": row["plus"]},
    "cost a thousandfold": scaled("cost", by=1e3),
    "Cp in percent": scaled("Cp", by=100.0),
    "shift in micrometres": lambda row: {"shift": 5.0},
    "length of an angle a thousandth": lambda row: {"over": row["over"] / 1e3} if "over" in row else {},
    "length of an angle a thousandfold": lambda row: {"over": row["over"] * 1e3} if "over" in row else {},
}


def rows_of(name: str) -> list[dict]:
    """Return the rows of a packaged table as cells."""
    frame = ta.drawing(name).to_frame().rename(columns=lambda head: head.split(" [")[0])
    return [{field: cell for field, cell in row.items() if cell != ""} for row in frame.to_dict("records")]


@pytest.mark.parametrize("kind", [*OF_A_REDUCER])
def test_no_wrong_row_of_a_reducer_is_read_without_a_word(kind):
    """Positions, pitches, run-outs and angles, which have no nominal size beside which a zone is too wide."""
    rows, silent, tried = rows_of("rv20e_all_sources"), [], 0
    assert {row["feature"] for row in rows} == {"size", "position", "pitch", "runout"}
    for place, row in enumerate(rows):
        changed = {**row, **OF_A_REDUCER[kind](row)}
        if changed == row:
            continue
        tried += 1
        try:
            notes = ta.Drawing.of_rows([*rows[:place], changed, *rows[place + 1 :]]).notes
        except InputError as error:
            assert row["id"] in str(error)
            continue
        if not any(f", {row['id']}: " in note for note in notes):
            silent.append(row["id"])
    assert silent == []
    assert tried >= 12


def test_limits_are_refused_with_the_deviations_to_write():
    row = {"id": "hub", "nominal": 10, "unit": "mm", "min": 0.01, "max": 0.5, "cost": 1}
    with pytest.raises(InputError, match=r"limits of a size of 10 mm; .* here plus 0.05 and minus -0.05 mm"):
        ta.Drawing.of_rows([{**row, "plus": 10.05, "minus": 9.95}])
    in_micrometres = {**row, "unit": "µm", "min": 10, "max": 500}
    with pytest.raises(InputError, match=r"here plus 50 and minus -50 µm"):
        ta.Drawing.of_rows([{**in_micrometres, "plus": 10050, "minus": 9950}])
    with pytest.raises(InputError, match=r"100 times their zone"):
        ta.Drawing.of_rows([{**row, "nominal": 0, "plus": 10.05, "minus": 9.95}])
    with pytest.raises(InputError, match=r"if ± 0.05 is meant, minus is −0.05"):
        ta.Drawing.of_rows([{**row, "plus": 0.05, "minus": 0.05}])


def test_fits_of_iso_286_are_no_limits():
    """c11 on 10 mm is −80/−170 µm, zc6 is +106/+97 µm: far from the nominal size, and doubted alone."""
    row = {"id": "pin", "nominal": 10, "unit": "µm", "min": 2, "max": 200, "cost": 1}
    for plus, minus in ((-80, -170), (106, 97), (0, -9), (9, 0), (34, 23)):
        drawing = ta.Drawing.of_rows([{**row, "plus": plus, "minus": minus}])
        assert len(drawing.notes) == (plus * minus > 0)


def test_a_mapping_says_where_the_middle_of_an_asymmetric_zone_lies():
    row = {"id": "pin", "nominal": 4, "unit": "µm", "min": 2, "max": 20, "cost": 1}
    sided, even = (ta.Drawing.of_rows([{**row, **own}]) for own in ({"plus": 0, "minus": -6}, {"plus": 3, "minus": -3}))
    assert "its middle −3 µm from the nominal size" in sided.sources[0].mapping
    assert "middle" not in even.sources[0].mapping

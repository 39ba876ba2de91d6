"""Files of measuring rooms behind a tolerance row: Q-DAS (AQDEF), mean and sigma, and what is refused of them."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from tests.builders import refusal, written
from tolalloc.drawings.measured_parts import read_characteristics
from tolalloc.drawings.tolerance_table import doubts, load_tolerance_table, table_frame
from tolalloc.exceptions import UnknownNameError

PARTS = np.round(np.random.default_rng(3).normal(0.4, 0.6, 24), 3)  # deviations from the nominal size [µm]
NOMINAL = 5.0
HEAD = {
    "K2001": "17",
    "K2002": "Bolzen Ø",
    "K2101": "5,0000",
    "K2112": "-0,002",
    "K2113": "0,002",
    "K2142": "mm",
}
SIZE = {"id": "a", "plus": 2, "minus": -2, "unit": "µm", "min": 1, "max": 9, "cost": 1, "nominal": 5}
POSITION = SIZE | {"feature": "position", "plus": 4, "minus": 0, "nominal": 0}


def head(at=1, **fields):
    own = {key: content for key, content in (HEAD | fields).items() if content is not None}
    return [f"{key}/{at} {content}" for key, content in own.items()]


def as_written(deviation, sign=","):
    return f"{NOMINAL + deviation / 1e3:.6f}".replace(".", sign)


def aqdef(folder, lines, name="parts.dfq", encoding="cp1252"):
    (folder / name).write_bytes("\r\n".join(["K0100 1", "K1001 4711", *lines]).encode(encoding))


def coded(parts=PARTS, at=1, sign=","):
    return [line for own in parts for line in (f"K0001/{at} {as_written(own, sign)}", f"K0002/{at} 0")]


def table(folder, measured="parts.dfq", row=SIZE, **more):
    own = row | {"distribution": "empirical", "measured": measured} | more
    pd.DataFrame([own]).to_csv(folder / "t.csv", index=False)
    return folder / "t.csv"


def read(folder, *arguments, **more):
    return load_tolerance_table(table(folder, *arguments, **more))[0].measured


@pytest.mark.parametrize("sign", [",", "."])
@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-8-sig", "utf-16"])
def test_aqdef_values_in_fields_are_deviations_from_the_nominal_size(sign, encoding, tmp_path):
    aqdef(tmp_path, [*head(), *coded(sign=sign)], encoding=encoding)
    own = read(tmp_path)
    np.testing.assert_allclose(own.values, PARTS * 1e-6, atol=1e-12)
    assert not own.are_radii


def test_aqdef_values_in_lines_have_their_attribute_date_and_operator_left_aside(tmp_path):
    valid = [f"{as_written(own)}\x140\x1412.08.2024/15:23:45\x14\x14\x14#1\x141" for own in PARTS]
    left_out = [f"{as_written(900)}\x14{attribute}" for attribute in (129, 255, 256, 290)]
    aqdef(tmp_path, [*head(), *left_out, *valid, "\x14256"])
    own = read(tmp_path)
    np.testing.assert_allclose(own.values, PARTS * 1e-6, atol=1e-12)
    assert own.left_out == 4
    assert "4 values that the file marks as not valid left out" in own.sentence


def test_aqdef_invalid_fields_of_values_are_left_out(tmp_path):
    aqdef(tmp_path, [*head(), *coded(), f"K0001/1 {as_written(1500)}", "K0002/1 129"])
    assert read(tmp_path).parts == PARTS.size


def test_aqdef_characteristic_is_found_by_number_or_name_and_written_again(tmp_path):
    other = head(2, K2001="18", K2002="Länge")
    lines = [f"{as_written(own)}\x140\x0f{as_written(-own)}\x140" for own in PARTS]
    aqdef(tmp_path, [*head(), *other, *lines])
    for name, sign in (("17", 1), ("Bolzen Ø", 1), ("18", -1), ("Länge", -1)):
        sources = load_tolerance_table(table(tmp_path, f"parts.dfq:{name}"))
        np.testing.assert_allclose(sources[0].measured.values, sign * PARTS * 1e-6, atol=1e-12)
        assert table_frame(sources, tmp_path)["measured"].tolist() == [f"parts.dfq:{name}"]


def test_aqdef_pair_of_files_and_a_unit_of_all_characteristics(tmp_path):
    aqdef(tmp_path, [*head(K2142=None), "K2142/0 mm"], name="parts.dfd")
    (tmp_path / "parts.dfx").write_text("\n".join(as_written(own) for own in PARTS))
    np.testing.assert_allclose(read(tmp_path, "parts.dfd").values, PARTS * 1e-6, atol=1e-12)


def test_aqdef_position_is_a_diameter_and_limits_are_absolute_or_allowances(tmp_path):
    diameters = np.abs(PARTS)
    limits = {"K2101": "0", "K2112": None, "K2113": None, "K2111": "0.004"}
    aqdef(tmp_path, [*head(**limits), *(f"K0001/1 {own / 1e3:.6f}" for own in diameters)])
    own = read(tmp_path, row=POSITION)
    np.testing.assert_allclose(own.values, diameters / 2 * 1e-6, atol=1e-12)
    assert own.are_radii
    aqdef(tmp_path, [*head(K2112=None, K2113=None, K2110="4.998", K2111="5.002"), *coded()])
    assert read(tmp_path).parts == PARTS.size
    aqdef(tmp_path, [*head(K2112="-0.003", K2113="0.003"), *coded()])
    assert read(tmp_path, measured_zone=6).zone == pytest.approx(6e-6)


BAD_AQDEF = {
    "unit is missing": (head(K2142=None), coded(), r"17 Bolzen Ø: the unit \(K2142\) is ''; allowed is µm, um or mm"),
    "unit is unknown": (head(K2142="inch"), coded(), r"the unit \(K2142\) is 'inch'"),
    "nominal is missing": (head(K2101=None), coded(), r"the nominal size \(K2101\) is ''; allowed is a number"),
    "nominal is another": (head(K2101="6"), coded(), r"\(K2101\) is '6 mm'; allowed is the 5 mm of the row"),
    "lower allowance": (head(K2112="-0,005"), coded(), r"the lower limit \(K2112\) is '-5 µm from nominal'.*-2 µm"),
    "upper limit": (head(K2113=None, K2111="5.01"), coded(), r"the upper limit \(K2111\) is '\+10 µm from nominal'"),
    "limit is no number": (head(K2113="x"), coded(), r"the upper limit \(K2113\) is 'x'; allowed is a number"),
    "value is no number": (head(), [*coded(), "K0001/1 five"], r"a value \(K0001\) is 'five'; allowed is a number"),
    "value is far off": (head(), [*coded(), "K0001/1 5000.0"], "'5000.0'; allowed is a number within 1,000,000 µm"),
    "few parts": (head(), coded(PARTS[:19]), "number of measured parts is 19; allowed is 20 or more"),
    "equal parts": (head(), coded([1.0] * 30), "parts that differ"),
    "no values": (head(), [], "it has no measured values"),
    "all are invalid": (head(), [f"{as_written(own)}\x14255" for own in PARTS], "number of measured parts is 0"),
}


@pytest.mark.parametrize("case", BAD_AQDEF)
def test_bad_aqdef_files_are_refused_in_one_sentence(case, tmp_path):
    fields, values, sentence = BAD_AQDEF[case]
    aqdef(tmp_path, [*fields, *values])
    said = refusal(load_tolerance_table, table(tmp_path))
    assert re.search(sentence, said), said
    assert "\n" not in said and "parts.dfq" in said


def test_bad_names_of_aqdef_characteristics_and_files_are_refused(tmp_path):
    both = [*head(), *head(2, K2001="18"), *coded(), *coded(at=2)]
    aqdef(tmp_path, both)
    said = refusal(load_tolerance_table, table(tmp_path))
    assert (
        "measured is 'parts.dfq'; allowed is parts.dfq:NAME with the number or name of one of 17 Bolzen Ø, 18" in said
    )
    assert "2 characteristics are called 'Bolzen Ø'" in refusal(
        load_tolerance_table, table(tmp_path, "parts.dfq:Bolzen Ø")
    )
    with pytest.raises(UnknownNameError, match="unknown characteristic '19'; the nearest known"):
        load_tolerance_table(table(tmp_path, "parts.dfq:19"))
    assert "allowed is parts.dfd, which describes" in refusal(load_tolerance_table, table(tmp_path, "parts.dfx"))
    aqdef(tmp_path, head(), name="parts.dfd")
    assert "parts.dfx: no such file" in refusal(load_tolerance_table, table(tmp_path, "parts.dfd"))
    aqdef(tmp_path, [*head(K2101="0", K2112=None, K2113="0,004"), "K0001/1 -0.001", *["K0001/1 0.001"] * 30])
    assert "allowed is a diameter, 0 or more" in refusal(load_tolerance_table, table(tmp_path, row=POSITION))


def test_mean_and_sigma_are_a_normal_process(tmp_path):
    (tmp_path / "s.csv").write_text("mean [µm],sigma [mm],parts\n0.5,0.0004,35\n")
    own = load_tolerance_table(table(tmp_path, "s.csv", measured_zone=4))[0]
    assert own.measured.parts == 35
    uniform = np.array([[0.1], [0.5], [0.975]])
    deviations = own.zone * own.standard_values(uniform)[:, 0]
    np.testing.assert_allclose(deviations, stats.norm(0.5e-6, 0.4e-6).ppf(uniform[:, 0]), rtol=1e-9)
    assert "as 35 measured parts of s.csv (Cp 1.67, Cpk 1.25), taken for normal" in own.mapping


BAD_SUMMARIES = [
    ("mean [µm],sigma [µm],parts\n0.5,0,35\n", r"sigma \[µm\] is '0'; allowed is a standard deviation above 0"),
    ("mean [µm],sigma [µm],parts\n0.5,0.4,12\n", "parts is '12'; allowed is the number of parts behind mean and sigma"),
    ("mean [µm],sigma [µm],parts\n0.5,0.4,\n", "parts is ''; allowed is the number of parts"),
    ("mean [µm],sigma [µm],parts\n0.5,0.4,20.5\n", "parts is '20.5'"),
    ("mean [µm],sigma [µm],parts\n0.5,0.4,30\n0.6,0.4,30\n", "rows with mean, sigma and parts is 2; allowed is 1"),
    ("mean [µm],sigma [µm]\n0.5,0.4\n", r"allowed is deviation \[µm\] or mean \[µm\] and sigma \[µm\] and parts"),
    ("mean,sigma [µm],parts\n0.5,0.4,30\n", "the unit of column 'mean' is ''"),
]


@pytest.mark.parametrize(("content", "sentence"), BAD_SUMMARIES)
def test_bad_summaries_are_refused_in_one_sentence(content, sentence, tmp_path):
    (tmp_path / "s.csv").write_text(content, encoding="utf-8")
    said = refusal(load_tolerance_table, table(tmp_path, "s.csv"))
    assert re.search(sentence, said), said
    assert "\n" not in said


def doubted(folder, values, nominal=10.0):
    """Return what is doubted of a size of 10 ± 0.02 mm whose parts deviate by these [µm]."""
    written(folder / "parts.csv", "deviation [µm]\n" + "".join(f"{value!r}\n" for value in values))
    row = f"a,{nominal},0.02,-0.02,mm,0.005,0.1,1,empirical,parts.csv"
    path = written(folder / "zones.csv", f"id,nominal [mm],plus,minus,unit,min,max,cost,distribution,measured\n{row}\n")
    return doubts(load_tolerance_table(path), "zones.csv")


GOOD = (np.random.default_rng(3).standard_normal(25) * 5).tolist()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([10_000 + value for value in GOOD], "250 zones from the middle on average"),
        ([value - 10_000 for value in GOOD], "250 zones from the middle on average"),
        ([value - 5_000 for value in GOOD], "125 zones from the middle on average"),
        ([*GOOD[1:], 2_000.0], r"1 of its 25 measured parts lie far from all others, one at \+2,000 µm"),
        ([*GOOD[1:], 2_000.0, -500.0], r"2 of its 26 measured parts .* one at \+2,000 µm"),
        ([*GOOD[1:], 90.0], r"1 of its 25 measured parts .* one at \+90 µm"),
    ],
)
def test_measured_parts_that_are_hardly_meant_are_doubted(values, said, tmp_path):
    (sentence,) = doubted(tmp_path, values)
    assert re.search(said, sentence)


@pytest.mark.parametrize("shift", [0.0, 15.0, 60.0])
def test_parts_of_one_process_are_not_doubted_wherever_it_lies(shift, tmp_path):
    assert doubted(tmp_path, [value + shift for value in GOOD]) == ()
    heavy = np.random.default_rng(5).standard_t(4, 200) * 5 + shift
    assert doubted(tmp_path, heavy.tolist()) == ()


def test_a_second_part_in_an_aqdef_file_is_refused_with_its_line(tmp_path):
    parts = [*head(), *coded(PARTS)]
    aqdef(tmp_path, [*parts, *parts])
    assert f"line {len(parts) + 3}: a second part begins (K2001" in refusal(load_tolerance_table, table(tmp_path))
    aqdef(tmp_path, [*parts, "K1001 4712", *head(2), *coded(PARTS, 2)])
    assert "a second part begins (K1001 4712)" in refusal(load_tolerance_table, table(tmp_path))
    aqdef(tmp_path, [*parts, *head(2), *coded(PARTS, 2)])  # two characteristics of one part
    assert len(read_characteristics(tmp_path / "parts.dfq")) == 2

"""The command ``tolalloc mount``."""

from __future__ import annotations

import pytest

from tests.builders import baseline_errors, summary_of
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.wings.assembly.stock import drawn_parts


def parts_file(folder, units, seed=5):
    """Write random parts of an RV-20E."""
    errors = baseline_errors()
    lines = ["part,kind,error,value,unit"]
    for part in drawn_parts(errors, load_reducer("rv20e_liu2020"), units, SeedTree(seed)):
        lines += [f"{part.name},{part.kind},{name},{value / MICROMETRE},µm" for name, value in part.errors.items()]
    path = folder / "parts.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_one_unit_is_mounted_in_the_best_of_all_ways(tmp_path):
    answer = answer_of("mount", str(parts_file(tmp_path, 1)))
    assert answer["every mounting tried"] is True
    assert answer["units solved [-]"] == 8
    unit = answer["units"][0]
    mounted, as_they_come = unit["peak-to-peak as mounted [arcsec]"], unit["peak-to-peak as the parts come [arcsec]"]
    assert mounted <= as_they_come
    assert mounted < answer["mean of random mountings [arcsec]"] < answer["worst random mounting [arcsec]"]
    places = {row["place"] for row in answer["fittings"]}
    assert places == {"housing", "carrier", "crank1", "crank2", "disc1", "disc2"}  # the sun has no errors


@pytest.mark.slow
def test_two_units_share_their_parts_and_are_reported(tmp_path):
    folder = tmp_path / "report"
    said = tolalloc(
        "mount", str(parts_file(tmp_path, 2)), "--reducer", "rv20e_liu2020", "--starts", "1", "--out", folder
    )
    assert said.returncode == 0, said.stderr
    summary = summary_of(folder)
    parts = [row["part"] for row in summary["fittings"]]
    assert len(set(parts)) == len(parts) == 12
    assert summary["mean peak-to-peak as mounted [arcsec]"] < summary["mean of random mountings [arcsec]"]
    assert (folder / "figures" / "chance.png").is_file()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--starts", "0"), "--starts is 0; allowed is 1 to 64"),
        (("--torque", "0"), "torque is 0.0"),
        (("--reducer", "rv21e"), "unknown name 'rv21e'"),
    ],
)
def test_a_wrong_option_is_refused(tmp_path, options, sentence):
    refused(tolalloc("mount", str(parts_file(tmp_path, 1)), *options), sentence)


def test_a_missing_file_is_refused(tmp_path):
    refused(tolalloc("mount", str(tmp_path / "none.csv")), "no such file")

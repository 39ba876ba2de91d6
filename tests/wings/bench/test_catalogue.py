"""One factor on all rolling bearings: the rigidity it gives, what it leaves open, and the file that studies reuse."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.builders import says
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.perfect import exact_loop
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.reports.header import Header
from tolalloc.reports.portraits.reducer import twist_table
from tolalloc.study.answer import Answer
from tolalloc.wings.bench.catalogue import identify_from_catalogue, with_bearings
from tolalloc.wings.bench.telling.catalogue import CatalogueTeller


@pytest.fixture(scope="module")
def found():
    return identify_from_catalogue(load_reducer("rv20e"))


@pytest.mark.slow
def test_the_factor_gives_the_rigidity_of_the_catalogue(found):
    rigidity = exact_loop(with_bearings(load_reducer("rv20e"), found.factor)).torsional_stiffness[0]
    assert rigidity * ARCMINUTE == pytest.approx(49.0, rel=1e-8)
    assert 1.0 < found.factor < 1.5  # the preset is 6 % too soft, and bearings are a third of its twist


def test_its_slope_is_that_of_the_bearings_share_of_the_twist(found):
    """By virtual work a spring's share of the twist is how much the rigidity feels it; shares are taken secant-wise."""
    shares = twist_table(found.after)
    bearings = shares[shares["part"].str.contains("bearing")]["share of the twist [%]"].sum() / 100
    assert found.slope == pytest.approx(bearings, abs=0.05)


@pytest.mark.slow
def test_printed_stiffnesses_are_scaled_alike():
    printed = replace(load_reducer("rv20e_liu2020"), catalogue=load_reducer("rv20e").catalogue)
    with pytest.raises(InputError, match="with bearings of any stiffness") as caught:
        identify_from_catalogue(replace(printed, catalogue=replace(printed.catalogue, torsional_rigidity=1e9)))
    assert "torsional_rigidity_nm_per_arcmin" in str(caught.value)
    found = identify_from_catalogue(printed)
    assert found.factor < 0.05
    answer = Answer(
        kind="catalogue", header=Header(name="catalogue", model=printed.name), result=found, told_by=CatalogueTeller
    )
    assert says(answer.warnings[0], "catalogue.warning", factor=found.factor)
    for name in RV.identified:
        ratio = getattr(found.after.stiffness, name) / getattr(printed.stiffness, name)
        assert ratio == pytest.approx(found.factor, rel=1e-12)


@pytest.mark.slow
def test_the_file_gives_a_study_the_same_rigidity(tmp_path):
    path = tmp_path / "bearings.toml"
    said = answer_of("identify", "--catalogue", "--reducer", "rv20e", "--write", path)
    identified = load_identified_stiffness(path)
    assert dict(identified.values) == said["stiffness at rated torque [N/m]"]
    rigidity = exact_loop(with_stiffness(load_reducer("rv20e"), identified)).torsional_stiffness[0] * ARCMINUTE
    # Constant secants at rated torque: stiffer than the bearings at small torques, softer nowhere.
    assert rigidity == pytest.approx(49.0, rel=0.03)


def test_what_does_not_go_together_is_refused():
    refused(tolalloc("identify"), "a measurement file is missing", "--catalogue")
    refused(tolalloc("identify", "--catalogue", "units.toml"), "leave out a measurement file")
    refused(tolalloc("identify", "--catalogue", "--parameter", "bias"), "leave out --parameter")
    refused(tolalloc("identify", "--catalogue", "--reducer", "rv20e_liu2020"), "no table [catalogue]")

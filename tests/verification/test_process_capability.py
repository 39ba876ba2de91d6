"""Process capability libraries: what a table takes from them, and what they refuse."""

from __future__ import annotations

import pytest

from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.tolerance_table import load_process_capabilities, load_tolerance_table
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError

LIBRARY = """process,feature,Cp [-],shift [half zone],distribution,shape [-],sorted,note
own,size,1.25,0.1,weibull,2.0,yes,measured in the shop
own,position,1.5,,,,,measured in the shop
"""
TABLE = "id,part,feature,plus,minus,unit,min,max,cost,process,{header}\na,p,size,2,-2,µm,1,9,1,{process},{value}\n"


def loaded(folder, process, header="Cp", value="", library=LIBRARY):
    (folder / "own.csv").write_text(library, encoding="utf-8")
    (folder / "t.csv").write_text(TABLE.format(header=header, process=process, value=value), encoding="utf-8")
    return load_tolerance_table(folder / "t.csv", capabilities=folder / "own.csv")[0]


def test_a_row_takes_what_it_does_not_state_itself(tmp_path):
    row = loaded(tmp_path, "own")
    assert (row.cp, row.shift, row.distribution, row.shape, row.sorted) == (1.25, 0.1, Distribution.WEIBULL, 2.0, True)
    assert "process own" in row.mapping
    own = loaded(tmp_path, "own", "Cp", "0.9")
    assert (own.cp, own.shift, own.distribution) == (0.9, 0.1, Distribution.WEIBULL)
    assert loaded(tmp_path, "own", "sorted", "no").sorted is False


def test_a_row_with_another_distribution_does_not_take_the_shape(tmp_path):
    row = loaded(tmp_path, "own", "distribution", "normal")
    assert (row.distribution, row.shape, row.cp) == (Distribution.NORMAL, 0.0, 1.25)
    assert loaded(tmp_path, "own", "distribution", "weibull").shape == 2.0


def test_the_shipped_library_is_marked_as_assumed():
    library = load_process_capabilities("generic")
    assert len(library) >= 5
    assert all(capability.note.startswith("assumed") for capability in library.values())
    assert library["ground", Feature.SIZE].Cp == 1.33


def test_an_unknown_process_is_refused_with_the_nearest_ones(tmp_path):
    with pytest.raises(
        UnknownNameError, match=r"row 2 \(a\): unknown process .with an empty Cp. for feature size 'owm'; .* own"
    ):
        loaded(tmp_path, "owm")
    with pytest.raises(UnknownNameError, match="shipped process capability library"):
        load_process_capabilities("generik")


def test_a_process_of_which_only_the_price_is_known_needs_its_own_cp(tmp_path):
    row = loaded(tmp_path, "turned hard", "Cp", "1.1")
    assert (row.process, row.cp, row.distribution, row.sorted) == ("turned hard", 1.1, Distribution.NORMAL, False)
    with pytest.raises(UnknownNameError, match="with an empty Cp"):
        loaded(tmp_path, "turned hard", "shift", "0.1")


BAD = [
    ("own,size,1.25", "own,size,99", r"own.csv, row 2 \(own\): Cp is 99"),
    ("own,size,1.25", "own,size,good", "Cp is 'good'; allowed is a number"),
    ("own,size,1.25", "own,weight,1.25", "feature is 'weight'; allowed is one of size"),
    ("weibull,2.0", "weibull,", "needs a shape from 0.3 to 20"),
    ("weibull,2.0", "mixture,", "mixture belongs to single sources"),
    ("own,position,1.5,", "own,position,1.5,0.2", "shift must be 0 for feature position: 0.2"),
    ("own,position", "own,size", r"row 3 \(own\): process is 'own' for feature size for the second time"),
    ("note\n", "source\n", "unknown column 'source'; the nearest known"),
    ("Cp [-]", "shift [-]", "the column 'shift' is there twice"),
    (",measured in the shop\nown,pos", ",\nown,pos", "note is missing"),
]


@pytest.mark.parametrize(("text", "wrong", "sentence"), BAD)
def test_bad_libraries_are_refused_in_one_sentence(text, wrong, sentence, tmp_path):
    assert text in LIBRARY
    with pytest.raises(TolallocError, match=sentence) as caught:
        loaded(tmp_path, "own", library=LIBRARY.replace(text, wrong))
    assert "\n" not in str(caught.value)


def test_a_library_without_capabilities_is_refused(tmp_path):
    with pytest.raises(InputError, match="the column 'Cp' is missing; needed are process, feature, Cp, note"):
        loaded(tmp_path, "own", library="process,feature,note\nown,size,x\n")


def test_a_truncated_library_is_refused(tmp_path):
    with pytest.raises(InputError, match="row 3: 2 of 8 cells are there"):
        loaded(tmp_path, "own", library=LIBRARY[: LIBRARY.index("own,position") + 12])

"""The faults that `tests/faults/plant.py` plants apply to the present text."""

from __future__ import annotations

from tests.faults.plant import load_faults
from tests.import_graph import ROOT

FAULTS = load_faults()


def test_every_fault_has_a_name_of_its_own():
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 40


def test_a_fault_stands_once_in_its_file():
    assert not [fault.name for fault in FAULTS for edit in fault.edits if edit.places() != 1 or edit.new == edit.old]


def test_the_tests_that_a_fault_names_are_there():
    assert not [path for fault in FAULTS for path in fault.tests if not (ROOT / path).is_file()]

"""The faults that `tests/faults/plant.py` plants apply to the present text."""

from __future__ import annotations

import pytest

from tests.faults.plant import ROOT, load_faults

FAULTS = load_faults()


def test_every_fault_has_a_name_of_its_own():
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 40


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_stands_once_in_its_file(fault):
    assert fault.places() == 1
    assert fault.new != fault.old
    assert all((ROOT / path).is_file() for path in fault.tests)

"""Every case of the validation manual is shown by the test that it names, and by no other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.validation_manual import CASES, shown

ROOT = Path(__file__).parents[2]
PREFIX = {"code": "C", "solution": "S", "validation": "V"}


def shown_in_tests() -> dict[str, set[str]]:
    """Return test file → numbers of the cases that it shows, those of a size by their letter."""
    found = {}
    for path in (ROOT / "tests").rglob("test_*.py"):
        numbers = {*re.findall(r'shown\(f?"([CSV](?:\d+|\{))', path.read_text(encoding="utf-8"))}
        if numbers and path.name != Path(__file__).name:
            found[path.relative_to(ROOT).as_posix()] = numbers
    return found


def test_every_case_is_shown_where_it_says():
    tests = shown_in_tests()
    for number, case in CASES.items():
        assert {number, "V{"} & tests[case["test"]], number
    named = {number for numbers in tests.values() for number in numbers} - {"V{"}
    assert named <= CASES.keys()


def test_the_numbers_count_on_within_their_kind():
    for kind, letter in PREFIX.items():
        own = [case["number"] for case in CASES.values() if case["kind"] == kind]
        assert own == [f"{letter}{at}" for at in range(1, len(own) + 1)]


def test_pictures_are_there():
    assert all((ROOT / "docs" / "figures" / own["figure"]).is_file() for own in CASES.values() if "figure" in own)


def test_another_number_is_not_shown():
    shown("V1", 44.93)
    shown("C5", 1e-5)
    for number, value in (("V1", 45.0), ("C5", 3e-4)):
        with pytest.raises(AssertionError, match="prints"):
            shown(number, value)

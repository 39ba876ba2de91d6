"""What commands say and write is what it was, word for word; numbers as far as processors agree.

``python -m tests.golden.record --check`` compares all digits, on the machine that made the files. The shipped
studies are compared in `test_every_study`, where they run.
"""

from __future__ import annotations

import json
import re
from decimal import Decimal
from math import isclose

import pytest

from tests.golden.cases import LONGER, PUSHED, SEARCHED, SMALL, Case
from tests.golden.record import CASES, Look, Run, kept, recorded, this_processor
from tests.studies.command import tolalloc

NUMBER = re.compile(r"(?<![\w.])[-−+]?\d[\d,]*(?:\.\d+)?(?:[eE][-+]?\d{1,2}(?!\d))?")
"""A number as it is written; the digits behind an e in a hash are no exponent."""


def value(text: str) -> float:
    return float(text.replace(",", "").replace("−", "-"))


def alike(one: str, other: str, relative: float, absolute: float = 1e-9) -> bool:
    """Return whether two numbers agree, or differ by one in the last place that is written."""
    exponent = int(Decimal(one.replace(",", "").replace("−", "-")).as_tuple().exponent)
    last = 10.0**exponent if exponent > -8 else 0.0
    return isclose(value(one), value(other), rel_tol=relative, abs_tol=max(1.01 * last, absolute))


def laid_out(text: str) -> list[str]:
    """Return the lines without numbers, rules of tables and blanks, whose widths follow the digits of the numbers."""
    lines = re.sub(r"[ \u2500-\u257f]+", " ", NUMBER.sub("#", text)).splitlines()
    return [line.strip() for line in lines if line.strip()]


def require_alike(before: str, now: str, relative: float, absolute: float = 1e-9) -> None:
    """Assert the same words and numbers, whichever of equal extremes of a turn a processor finds first."""
    before, now = (re.sub(r"at [\d.]+°", "at °", text) for text in (before, now))
    assert laid_out(now) == laid_out(before)
    pairs = zip(NUMBER.findall(before), NUMBER.findall(now), strict=True)
    assert not [pair for pair in pairs if not alike(*pair, relative, absolute)]


def require_golden(name: str, run: Run = tolalloc, look: Look = lambda *_: None) -> None:
    """Assert that the commands of a case say and write what its golden files hold."""
    case = CASES[name]
    prose, numbers = recorded(case, run, look)
    before, known, made_on = kept(name)
    if made_on not in ("", this_processor()):
        require_alike_answers(before, prose)
        assert known.keys() == numbers.keys()
        return
    require_alike(*(_settled(case, text) for text in (before, prose)), 1e-3)
    absolute = case.agreement if case.agreement > Case.agreement else 1e-9
    require_alike(
        *(_settled(case, json.dumps(these, indent=1)) for these in (known, numbers)), case.agreement, absolute
    )


def require_alike_answers(before: str, now: str) -> None:
    """Assert the same commands, verdicts and, within what searches differ by, costs."""
    answers = [
        re.findall(r"^(?:\$|exit|Met|Not met|Cannot|Cost|No drawing).{0,24}", text, re.M) for text in (before, now)
    ]
    assert [*map(_verdict, answers[1])] == [*map(_verdict, answers[0])]
    costs = [[value(own) for own in re.findall(r"^Cost [\d.,]+ → ([\d.,]*\d)", text, re.M)] for text in (before, now)]
    assert costs[0]
    assert costs[1] == pytest.approx(costs[0], rel=SEARCHED)


def _verdict(line: str) -> str:
    return NUMBER.sub("#", line)[:14]


def _settled(case: Case, text: str) -> str:
    """Return the lines that no random search's path decides."""
    return "\n".join(line for line in text.splitlines() if not re.search(case.wandering, line))


def marks_of(case: Case) -> list[pytest.MarkDecorator]:
    """Return the marks of the test of a case."""
    return [] if case in SMALL else [pytest.mark.slow, *([pytest.mark.push] if case.name in PUSHED else [])]


@pytest.mark.parametrize("case", [pytest.param(own, marks=marks_of(own), id=own.name) for own in (*SMALL, *LONGER)])
def test_a_command_says_and_writes_what_it_did(case):
    require_golden(case.name)

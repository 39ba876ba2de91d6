"""What a check says of the size of a question holds for what is then solved."""

from __future__ import annotations

import pytest

import tolalloc as ta
from tests.builders import study_of_lengths
from tests.golden.cases import small_effort
from tests.verification.test_own_words import ROWS
from tolalloc.reports.tellers.check import CheckedTime
from tolalloc.study.duration import durations
from tolalloc.study.prepared import Prepared


def counted(study: ta.Study) -> dict[str, tuple[int, tuple[int, int]]]:
    """Return question → units solved, and those that were foretold, at least and at most."""
    told = {own.kind: own.units for own in durations(Prepared(study=study))}
    solved = {kind: sum(study.ask(kind).header.statuses.values()) for kind in told}
    return {kind: (solved[kind], told[kind]) for kind in told}


def require_foretold(study: ta.Study) -> None:
    found = counted(study)
    assert {*found} == {"ranking", "allocation"}
    for kind, (solved, (least, most)) in found.items():
        assert least <= solved <= most, f"{kind}: {solved} of {least} to {most}"


@pytest.mark.slow
def test_the_units_of_an_own_function_are_foretold():
    questions = [ta.Ranking(), ta.Allocation(front=False, what_if=False)]
    require_foretold(study_of_lengths(ta.Drawing.of_rows(ROWS), questions=questions))


@pytest.mark.slow
def test_the_units_of_a_reducer_of_uncertain_stiffness_are_foretold():
    modification = {"flank_clearance": (1.0, 5.0), "radial_clearance": (5.0, 20.0)}
    require_foretold(
        ta.Study(
            ta.reducer("rv20e_liu2020", stiffness="rv20e_table6", **modification),
            ta.drawing("rv20e_table4"),
            limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.95))},
            effort=small_effort(),
        )
    )


def test_it_is_said_in_words():
    told = CheckedTime(effort="full", kind="ranking", units=(9_000, 54_000), seconds=(12.3, 310.0))
    assert told.sentence == "ranking: about 9,000 to 54,000 units, 12 s to 5.2 min here."

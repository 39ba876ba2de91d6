"""What the gate runs of a push: what is touched, its turn, the time; and how a whole run is written down."""

from __future__ import annotations

import ast
from dataclasses import replace

import pytest

from tests import push
from tests.import_graph import ROOT, graph, module_of, public_uses, steps_to
from tests.push import NEAR, NEW, TIME, TURNS, Touched, chosen, reason_for_all
from tests.whole_run import WholeRun, summed_up

SADDLE = "tests/verification/test_saltelli.py"
TESTS = [f"{SADDLE}::test_one", *(f"tests/architecture/test_house.py::test_{number}" for number in range(400))]


def run_of(commit: str = "HEAD", **seconds: float) -> WholeRun:
    return WholeRun(commit=commit, date="2026-01-01", minutes=60.0, processor="any", tests=1, seconds=seconds)


def test_steps_count_imports():
    assert steps_to("tests.verification.test_saltelli", frozenset({"tests.verification.test_saltelli"})) == 0
    assert steps_to("tests.verification.test_saltelli", frozenset({"tolalloc.sensitivity.saltelli"})) == 1
    assert steps_to("tolalloc.exceptions", frozenset({"tolalloc.cli.main"})) is None


def test_a_command_leads_to_what_tells_of_its_answer_though_no_import_names_it():
    assert (
        steps_to("tests.studies.test_allocate_command", frozenset({"tolalloc.reports.tellers.allocation_drawing"})) == 3
    )


def test_a_public_name_leads_to_its_module():
    assert public_uses(ast.parse("import tolalloc as ta\nta.Study(ta.reducer('x'))")) == {
        "tolalloc.study.study",
        "tolalloc.reducers.choice",
    }
    assert "tolalloc.study.study" in graph()["tests.builders"]


def test_a_file_of_the_package_that_is_no_module_touches_those_beside_it():
    touched = Touched.of(["tolalloc/reports/sentences/ranking.toml"])
    assert "tolalloc.reports.document" in touched.modules
    assert not touched.modules - {module_of(path) for path in (ROOT / "tolalloc/reports").glob("*.py")}


@pytest.mark.parametrize("file", ["studies/rv20e_speeds.py", "tests/golden/shipped_rv20e_speeds.json"])
def test_a_study_and_its_golden_file_touch_the_test_that_runs_it(file):
    touched = Touched.of([file])
    assert touched.steps("tests/studies/test_every_study.py::test_a_study_runs[rv20e_speeds]") == 0
    assert touched.steps("tests/studies/test_every_study.py::test_a_study_runs[rv20e_moving]") != 0


def test_a_push_runs_what_it_touches_and_an_eighth_of_the_others_and_in_eight_commits_all():
    touched = Touched.of(["tolalloc/sensitivity/saltelli.py"])
    seen = set()
    for commits in range(TURNS):
        push = chosen(TESTS, set(), run_of(**dict.fromkeys(TESTS, 2 * NEW)), touched, commits)
        assert TESTS[0] in push.tests
        assert len(push.turn) == pytest.approx(len(TESTS) / TURNS, abs=1)
        seen |= set(push.turn)
    assert seen == set(TESTS)


def test_tests_of_every_push_are_run_whatever_they_take():
    push = chosen(TESTS, {TESTS[7]}, run_of(**{TESTS[7]: 2 * TIME}), Touched.of([]), 0)
    assert push.always == (TESTS[7],)
    assert not push.near
    assert push.seconds > 2 * TIME


def test_what_failed_in_the_last_whole_run_is_run_until_the_next():
    run = replace(run_of(**dict.fromkeys(TESTS, 1.0)), failed=(TESTS[7],))
    assert all(TESTS[7] in chosen(TESTS, set(), run, Touched.of([]), turn).always for turn in range(TURNS))


def test_the_nearest_have_some_minutes_however_long_the_others_take():
    tests = [f"{SADDLE}::test_{number}" for number in range(40)]
    cost = dict.fromkeys(tests, NEAR / 4) | {TESTS[7]: 2 * TIME}
    near = chosen([*tests, TESTS[7]], {TESTS[7]}, run_of(**cost), Touched.of([SADDLE]), None)
    assert len(near.near) == 3
    assert near.seconds == 2 * TIME + 3 * NEAR / 4 + 2 * NEW  # the fixtures of two files too


def test_shapes_are_checked_where_a_push_touches_and_in_eight_commits_everywhere():
    modules = [f"tolalloc.room.module{number}" for number in range(40)]
    touched = Touched(modules=frozenset(modules[3:5]), stems=frozenset())
    found = [push.shaped(modules, touched, commits) for commits in range(TURNS)]
    assert all({*modules[3:5]} <= {*own} for own in found)
    assert {own for some in found for own in some} == {*modules}
    assert max(map(len, found)) <= 2 + 5


def test_short_tests_of_a_file_have_one_turn_and_long_ones_their_own():
    cost = {f"a.py::test_{at}": 1.0 for at in range(20)} | {f"a.py::test_long_{at}": 2 * NEW for at in range(TURNS)}
    turns = [push.turn_of(cost, run_of(), commits) for commits in range(TURNS)]
    assert sorted(test for own in turns for test in own) == sorted(cost)
    (whole,) = (own for own in turns if "a.py::test_0" in own)
    assert {f"a.py::test_{at}" for at in range(20)} <= {*whole}
    assert all(any("long" in test for test in own) for own in turns if own is not whole)


def test_what_the_time_does_not_allow_is_counted_and_the_nearest_comes_first():
    tests = [f"{SADDLE}::test_{number}" for number in range(40)]
    near = chosen(tests, set(), run_of(**dict.fromkeys(tests, TIME / 4)), Touched.of([SADDLE]), 0)
    assert len(near.turn) + len(near.near) == max(4, len(near.turn))
    assert len(near.left) == 40 - len(near.tests)
    assert f"{len(near.left)} others" in near.sentence(40)


def test_the_whole_gate_is_due_without_a_record_after_many_commits_and_with_other_libraries(monkeypatch):
    assert "no whole run" in reason_for_all(None)
    assert "not in this clone" in reason_for_all(run_of("0" * 40))
    said = {"rev-list": "40", "diff": "README.md", "ls-files": ""}
    monkeypatch.setattr(push, "git", lambda word, *_: said[word])
    assert not reason_for_all(run_of())
    said["diff"] = ".ci/constraints.txt"
    assert "libraries" in reason_for_all(run_of())
    said["rev-list"] = "41"
    assert "41 commits" in reason_for_all(run_of())


def test_a_test_takes_what_it_took_or_what_its_function_did():
    run = run_of(**summed_up({"a.py::test[1]": 2.0, "a.py::test[2]": 4.0, "a.py::test[3]": 50.0}))
    assert run.seconds == {"a.py::test": 3.0, "a.py::test[3]": 50.0}
    assert [run.taken_by(f"a.py::test[{number}]") for number in (1, 3, 9)] == [3.0, 50.0, 3.0]
    assert run.taken_by("a.py::test_other") is None

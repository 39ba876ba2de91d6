"""What a study refuses, what its script may lean on, and what the package offers by name."""

from __future__ import annotations

import copy
import doctest
import pickle
import subprocess
import sys
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says
from tests.studies.command import ROOT, command, refused, tolalloc
from tests.studies.scripts import study_script
from tolalloc.allocation.space.effort import QUICK_ALLOCATION, AllocationEffort
from tolalloc.drawings.drawing import Drawing
from tolalloc.exceptions import InputError, TolallocError, UnknownNameError
from tolalloc.sensitivity.effort import QUICK_RANKING
from tolalloc.study.prepared import Prepared

LIMITS = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)}
LATE = ("cvxpy", "sklearn", "pymoo", "pandas")
DOCUMENTED = (
    "tolalloc",
    *(f"tolalloc.study.{path.stem}" for path in sorted((ROOT / "tolalloc" / "study").glob("*.py"))),
    *(
        "tolalloc.models.function_model",
        "tolalloc.drawings.drawing",
        "tolalloc.reducers.choice",
        "tolalloc.reports.wording",
    ),
)


def nothing(quick: bool):
    raise AssertionError(f"a refused study was built, quick {quick}")


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("model", ta.reducer("rv20e_liu2020")),
        ("drawing", ta.drawing("rv20e_table4")),
        ("limits", LIMITS),
        ("seed", 2),
        ("largest_failed_share", 0.02),
    ],
)
def test_a_field_that_no_question_reads_is_refused_by_name(field, value):
    with pytest.raises(InputError, match=f"no question of it reads {field} .it asks: calculation"):
        ta.Study(questions=[ta.Calculation(nothing)], **{field: value})
    asked = ta.Study(questions=[ta.Calculation(nothing), ta.Ranking()], **{field: value})
    assert getattr(asked, field) == value


def test_what_a_user_writes_can_be_copied_and_pickled():
    limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.99))}
    study = ta.Study(ta.reducer("rv20e"), ta.drawing("rv20e_table4"), limits=limits, questions=[ta.Ranking()])
    for found in (copy.copy(study), copy.deepcopy(study), pickle.loads(pickle.dumps(study))):
        assert (found.limits, found.questions, found.seed) == (limits, (ta.Ranking(),), 1)
        assert Prepared(study=found).digest == Prepared(study=study).digest


@pytest.mark.parametrize(
    ("kind", "given", "words"),
    [
        (ta.Study, {"limit": LIMITS}, "the nearest known is limits"),
        (ta.Study, {"name": "mine", "drawin": None}, "the nearest known is drawing"),
        (ta.Ranking, {"grades": True}, "known is by"),
        (ta.Limit, {"max": 60.0}, "known are lower, show, upper"),
        (ta.Allocation, {"grade": True}, "the nearest known is grades"),
        (ta.Allocation, {"fixedfirst": True}, "the nearest known is fixed_first"),
        (ta.Calculation, {"built": nothing}, "the nearest known is build"),
    ],
)
def test_an_unknown_field_is_refused_with_the_nearest_name_or_all_of_them(kind, given, words):
    with pytest.raises(UnknownNameError, match=rf"unknown field '{[*given][-1]}'; {words}"):
        kind(**given)


def test_a_value_without_its_name_is_refused():
    with pytest.raises(InputError, match=r"^limit: 60.0 stands without its name; write upper=\.\.\.\.$"):
        ta.Limit(60.0)


def test_a_study_a_reducer_and_a_drawing_say_in_a_line_what_they_are():
    study = ta.Study(ta.reducer("rv20e_liu2020", stiffness="rv20e_table6"), ta.drawing("rv20e_table4"), limits=LIMITS)
    assert repr(study).startswith("Study('study': RV-20E at rv20e_table4; limits: peak-to-peak")
    assert repr(study.model) == "<reducer RV-20E: 2 cranks, 2 discs, stiffness of liu2020, Table 6>"
    assert repr(study.drawing) == "<drawing rv20e_table4: 23 sources>"
    assert ta.__version__


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"toleranzen": "mine.csv"}, ["written_study.py", "study written", "unknown field 'toleranzen'", "known are"]),
        ({"written": "questions=[ta.Allocation(grade=True)]"}, ["question allocation", "'grade'", "grades"]),
        ({"written": "questions=[ta.Calculation(print)]"}, ["no question of it reads model"]),
    ],
)
def test_the_command_line_says_what_a_study_does_not_know_in_one_sentence(tmp_path, fields, words):
    result = tolalloc("check", study_script(tmp_path, **fields))
    refused(result, *words)
    assert len(result.stderr.strip().splitlines()) == 1


def test_the_command_line_says_its_version():
    result = tolalloc("--version")
    assert (result.returncode, result.stdout.strip()) == (0, f"tolalloc {ta.__version__}")


def test_a_whole_number_is_a_limit_like_any_other():
    assert ta.Limit(upper=60, lower=-1) == ta.Limit(upper=60.0, lower=-1.0)
    assert repr(ta.Limit(upper=60)) == repr(ta.Limit(upper=60.0))
    with pytest.raises(InputError, match="lower is inf; allowed is a finite number"):
        ta.Limit(lower=float("inf"))


@pytest.mark.parametrize("kind", ["ranked", "alocation"])
def test_a_question_that_is_none_is_refused_with_the_nearest_name(tmp_path, kind):
    out = tmp_path / "run"
    result = tolalloc("run", study_script(tmp_path), "--only", kind, "--out", out)
    refused(result, f"question {kind!r}", "ranking" if kind == "ranked" else "allocation")
    assert not out.exists()


@pytest.mark.slow
def test_a_script_finds_its_modules_and_files_beside_it_from_any_folder(tmp_path):
    script, elsewhere = tmp_path / "mine" / "own_study.py", tmp_path / "elsewhere"
    (tmp_path / "mine" / "tables").mkdir(parents=True)
    elsewhere.mkdir()
    table = ta.drawing("rv20e_table4").to_csv(script.parent / "tables" / "own.csv")
    (script.parent / "own_helper_of_a_study.py").write_text("TABLE = 'tables/own.csv'\nUPPER = 55.0\n")
    script.write_text(
        "import tolalloc as ta\nfrom own_helper_of_a_study import TABLE, UPPER\n"
        "limits = {ta.PEAK_TO_PEAK: ta.Limit(upper=UPPER)}\n"
        "study = ta.Study(ta.reducer('rv20e_liu2020'), ta.drawing(TABLE), limits=limits)\n"
        "if __name__ == '__main__':\n    ta.run_script()\n"
    )
    environment = {"PYTHONPATH": str(ROOT), "PATH": "", "COLUMNS": "200"}
    words = command("check", script)
    found = subprocess.run(words, capture_output=True, text=True, cwd=elsewhere, check=False, env=environment)
    assert found.returncode == 0, found.stderr
    assert "Study study can be run, but" in found.stdout and "at most 55" in found.stdout
    words = [sys.executable, str(script), "--help"]  # Python reads the study itself before any command does
    found = subprocess.run(words, capture_output=True, text=True, cwd=elsewhere, check=False, env=environment)
    assert found.returncode == 0, found.stderr
    table.unlink()
    refused(tolalloc("check", script), str(table), "no such file")


def test_the_package_is_imported_without_what_is_needed_later():
    said = f"import sys, tolalloc; tolalloc.Study; print(*(name for name in {LATE!r} if name in sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", said], cwd=ROOT, capture_output=True, text=True, check=True)
    assert loaded.stdout.split() == []


@pytest.mark.parametrize("name", ta.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name):
    found = getattr(ta, name)
    assert name in dir(ta)
    if isinstance(found, str):
        assert found.endswith("]")  # an output carries its unit
    else:
        assert (found.__doc__ or "").strip().splitlines()[0].endswith((".", ":"))


def test_an_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Studdy"):
        _ = ta.Studdy


@pytest.mark.parametrize("name", DOCUMENTED)
def test_examples_in_docstrings_say_what_happens(name):
    found = doctest.testmod(import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0


def test_public_records_have_examples():
    """Doctests run on what there is; here is what must be there."""
    finder = doctest.DocTestFinder()
    for own in (ta.Study, ta.Ranking, ta.Allocation, ta.Limit, ta.reducer, ta.drawing, ta.model, Drawing.of_rows):
        assert any(test.examples for test in finder.find(own)), own


class Own(ta.Question):
    kind = "own"

    def answer(self, prepared, record):
        return prepared


MODEL = ta.model(lambda a: a, inputs=("a",), outputs=("y [mm]",))
SETTING = {"name": "h [mm]", "value": 2, "lower": 1, "upper": 3, "step": 0.1}


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: ta.Study("rv20e_liu2020"), "model is 'rv20e_liu2020'; allowed is ta.reducer"),
        (lambda: ta.Study(MODEL, "rv20e_table4"), "drawing is 'rv20e_table4'; allowed is ta.drawing"),
        (lambda: ta.Study(ta.drawing("rv20e_table4"), MODEL), "model is <drawing rv20e_table4: 23 sources>"),
        (lambda: ta.Study(limits=[60]), "limits is .60.; allowed is a dictionary"),
        (lambda: ta.Study(limits={"y [mm]": 60}), r"limits\['y \[mm\]'\] is 60; allowed is ta.Limit"),
        (lambda: ta.Study(questions=[ta.Ranking]), "questions is .*; allowed is ta.Ranking"),
        (lambda: ta.Study(questions=()), "questions is"),
        (lambda: ta.Study(questions=[ta.Allocation(), ta.Allocation(grades=True)]), "asks allocation 2 times"),
        (lambda: ta.Study(effort=None), "effort is None; allowed is 'quick', 'full' or"),
        (lambda: ta.Study(effort="fast"), "unknown effort 'fast'; known are full, quick"),
        (lambda: ta.Study(largest_failed_share="1"), "largest_failed_share is '1'; allowed is 0 to 0.5"),
        (lambda: ta.Study(seed=True), "seed is True"),
        (lambda: ta.Limit(upper=True), "upper is True; allowed is a finite number"),
        (lambda: ta.Limit(upper="60"), "upper is '60'"),
        (lambda: ta.Limit(upper=60, show=ta.WorstCase), "show is .*WorstCase.*; allowed is AtYield"),
        (lambda: ta.AtYield(99.73), "guarantee AtYield: target is 99.73; allowed is a share .* such as 0.9973"),
        (lambda: ta.AtYield(value=0.9973), "unknown field 'value'; known is target"),
        (lambda: ta.AtCpk(), "guarantee AtCpk: target is missing; write target="),
        (
            lambda: ta.Setting(**{**SETTING, "value": "5"}),
            r"setting h \[mm\]: value is '5'; allowed is a finite number",
        ),
        (lambda: ta.Setting(**{**SETTING, "lower": 6}), "lower is 6; allowed is at most upper = 3"),
        (lambda: ta.Setting(**{**SETTING, "step": 0}), "step is 0; allowed is above 0"),
        (lambda: ta.QualityLoss(60.0), "quality loss: at_limit is missing"),
        (lambda: ta.UnitPrice(scrapp=3.0), "price of a unit: unknown field 'scrapp'; the nearest known is scrap"),
        (lambda: ta.reducer("rv20e_liu2020", flank_clearance=5), "flank_clearance is 5; allowed is two numbers"),
        (lambda: ta.reducer("rv20e", torque=0.0), "reducer rv20e: torque is 0.0; allowed is -1670 to 1670"),
    ],
)
def test_a_slip_is_one_sentence_of_the_project(made, words):
    with pytest.raises(TolallocError, match=words) as caught:
        made()
    assert str(caught.value).endswith(".")


def test_numbers_of_numpy_are_numbers_and_one_question_needs_no_list():
    assert ta.Limit(upper=np.int64(3)).upper == ta.Limit(upper=np.float32(3)).upper == 3.0
    assert ta.Study(questions=ta.Ranking()).questions == (ta.Ranking(),)
    assert ta.Study(effort="quick").quick
    assert not ta.Study(effort="full").quick


def test_full_is_full_whatever_effort_a_study_has():
    own = ta.Effort(ranking=ta.RankingEffort(units=4000))
    for study in (ta.Study(effort="quick"), ta.Study(effort=own)):
        assert study.with_effort("full").effort == ta.Effort()
        assert study.with_effort("quick").quick
        assert study.with_effort(None) is study


def test_a_question_of_ones_own_and_a_model_without_a_name_are_shown():
    class Source:
        def bound(self, errors, place):
            return errors

    assert repr(ta.Study(Source(), questions=[Own()])).startswith("Study('study': Source at none")
    with pytest.raises(UnknownNameError, match="question own: unknown field 'units'; it has none"):
        Own(units=3)


class Heard:
    """Progress that remembers what it was told."""

    def __init__(self):
        self.said = []

    def begin(self, stage, units=0, counted=""):
        self.said.append(stage)

    def advance(self, units):
        self.said.append(units)

    def tell(self, sentence):
        self.said.append(sentence)


@pytest.mark.slow
def test_a_run_first_says_how_the_drawing_stands_as_it_is(tmp_path):
    """Of a uniform deviation within ±3 µm five sixths lie below 2 µm and two thirds above −1 µm, one half between."""
    row = {
        "id": "a",
        "plus": 3.0,
        "minus": -3.0,
        "unit": "µm",
        "distribution": "uniform",
        "min": 1,
        "max": 9,
        "cost": 1,
    }
    outputs = ("high [mm]", "low [mm]")
    limits = {"high [mm]": ta.Limit(upper=0.002), "low [mm]": ta.Limit(lower=-0.001)}
    study = ta.Study(
        ta.model(lambda a: (a, a), inputs=("a",), outputs=outputs),
        ta.Drawing.of_rows([row]),
        limits=limits,
        questions=[ta.Ranking()],
        name="today",
        seed=2,
    )
    found, heard = Prepared(study=study).kept_limits(1024), Heard()
    for share, own in zip((5 / 6, 2 / 3, 1 / 2), (*found.each.values(), found.joint), strict=True):
        assert own.estimate == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 1024))
    few = {"derivative_units": 10, "surrogate_units": 96, "level_units": 100}
    sobol = ta.SobolEffort(start=16, limit=16, resamples=50)
    study.run(tmp_path / "run", ta.Effort(ranking=replace(QUICK_RANKING, sobol=sobol, **few)), heard)
    assert heard.said[:2] == ["the drawing as it is", 1024]
    assert says(heard.said[2], "check.today", share=found.joint.estimate)


def _sums(effort: ta.Effort, function=lambda a, b: a + 2 * b) -> ta.Study:
    row = {"plus": 3.0, "minus": -3.0, "unit": "µm", "distribution": "uniform", "min": 1, "max": 9, "cost": 1}
    return ta.Study(
        ta.model(function, inputs=("a", "b"), outputs=("y [mm]",)),
        ta.Drawing.of_rows([{"id": name, **row} for name in "ab"]),
        limits={"y [mm]": ta.Limit(upper=0.008)},
        questions=[ta.Ranking(), ta.Allocation(front=False, what_if=False)],
        name="sums",
        effort=effort,
    )


def test_seconds_are_counted_and_shared_by_ranking_and_allocation():
    """At 20,000 units a second; twice the time is twice the units, whatever the machine."""
    numbers = lambda a, b: float(a) + 2 * float(b)  # noqa: E731 (no arrays)
    short, longer = (Prepared(study=_sums(ta.Effort(seconds=seconds), numbers)) for seconds in (2.0, 4.0))
    assert longer.ranking_effort.units == pytest.approx(2 * short.ranking_effort.units, abs=1)
    assert longer.ranking_effort.sobol.limit == 2 * short.ranking_effort.sobol.limit
    assert short.ranking_effort.counted(2) == pytest.approx(1.0 * 20_000, rel=0.5)
    assert longer.allocation_effort.counted == pytest.approx(2.0 * 20_000, rel=0.02)
    assert "4 s at 20,000 units a second" in longer.header.assumptions[-1]
    assert longer.allocation_effort.search.steps == QUICK_ALLOCATION.search.steps, "what a full run needs is more"
    day = Prepared(study=_sums(ta.Effort(seconds=80.0), numbers))
    assert day.allocation_effort.search.steps == AllocationEffort().search.steps
    hurried = Prepared(study=_sums(ta.Effort(seconds=0.1), numbers))
    assert hurried.header.assumptions[-1].startswith("0.1 s were asked for; the least effort that has an answer takes")
    whole_day = Prepared(study=_sums(ta.Effort(seconds=86_400.0)))
    assert whole_day.ranking_effort.sobol.limit * 4 <= 2**26, "what is kept of a day's units must fit into memory"
    assert whole_day.ranking_effort.units * 2 <= 2**20
    assert whole_day.allocation_effort.confirmation_units <= 2**23


@pytest.mark.slow
def test_blocks_grow_until_the_order_that_is_asked_for_is_stable():
    found = _sums(ta.Effort(ranking=QUICK_RANKING, until="order of the first two")).rank().result.sobol.convergence
    assert found.stable
    assert found.history[-1].first == (1, 0)


@pytest.mark.parametrize(
    "wrong", [{"seconds": 0}, {"seconds": 1e9}, {"seconds": "3"}, {"until": "three"}, {"until": "order of the first"}]
)
def test_an_effort_that_means_nothing_is_refused(wrong):
    with pytest.raises(InputError, match=r"^effort: (seconds|until) is .*; allowed is "):
        ta.Effort(**wrong)

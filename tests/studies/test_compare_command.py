"""``tolalloc compare`` on folders that hold what a run writes."""

from __future__ import annotations

import json
from dataclasses import replace

import pandas as pd
import pytest
from scipy.stats import norm

import tolalloc as ta
from tests.builders import says, summary_of
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.reports.finished_run import Member, read_run
from tolalloc.sensitivity.effort import QUICK_RANKING
from tolalloc.study.answer import Answer

SUMMARY = {
    "reducer": "RV-20E",
    "torque [N·m]": -1.0,
    "limit [arcsec]": 60.0,
    "yield target [-]": 0.9973,
    "met": True,
    "yield [-]": 0.9987,
    "yield interval 95 % [-]": [0.997, 0.999],
    "cost [cost units]": 41.6,
}

NEEDED = ("study", "study hash", "quick", "yield [-]")


def run_folder(place, cost=41.6, index=0.3, zone=4.0, asked="allocation", **changes):
    (place / "tables").mkdir(parents=True)
    summary = SUMMARY | {"cost [cost units]": cost} | changes
    summary |= {"study": place.name, "study hash": place.name, "quick": False}
    (place / "summary.json").write_text(json.dumps({asked: summary}), encoding="utf-8")
    manifest = {"study": place.name, "study hash": place.name, "quick": False, "versions": {"tolalloc": "0.1.0"}}
    (place / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    ranking = {
        "rank [-]": [1, 2],
        "source": ["disc1.pitch", "pin.diameter"],
        "total index ST [-]": [index, 0.1],
        "ST low 5 % [-]": [index - 0.02, 0.05],
        "ST high 95 % [-]": [index + 0.02, 0.15],
    }
    pd.DataFrame(ranking).to_csv(place / "tables" / f"{'shares' if asked == 'allocation' else asked}.csv", index=False)
    zones = {
        "id": ["disc1.pitch", "pin.diameter"],
        "unit": ["µm", "µm"],
        "plus [unit]": [zone, 2.0],
        "minus [unit]": [0.0, -2.0],
        "cost [cost units]": [3.0, 1.0],
    }
    pd.DataFrame(zones).to_csv(
        place / ("allocation.csv" if asked == "allocation" else "tables/tolerances.csv"), index=False
    )
    return place


@pytest.fixture
def runs(tmp_path):
    return run_folder(tmp_path / "first"), run_folder(tmp_path / "second", cost=50.0, index=0.4, zone=5.0)


def test_two_runs_side_by_side(runs, tmp_path):
    answer = answer_of("compare", *runs, "--out", tmp_path / "report")
    assert (answer["A"], answer["B"], answer["same question"]) == ("first", "second", True)
    cost = next(row for row in answer["answers"] if row["quantity"] == "cost [cost units]")
    assert cost["B − A"] == pytest.approx(8.4)
    assert [row["90 % intervals"] for row in answer["rankings"]] == ["apart", "overlap"]
    pitch, pin = answer["zones"]
    assert (pitch["zone A"], pitch["zone B"], pitch["B over A, less 1 [%]"]) == (4.0, 5.0, pytest.approx(25.0))
    assert pin["zone A"] == 4.0
    names = {"report.html", "results.xlsx", "summary.json", "manifest.json"}
    assert {path.name for path in (tmp_path / "report").iterdir()} == names | {"figures", "tables"}
    said = tolalloc("compare", *runs).stdout
    assert "rankings" in said
    assert "zones" in said
    assert [row["dimension"] for row in answer["rankings"]] == ["disc1.pitch", "pin.diameter"]


def test_two_runs_of_one_study_are_told_apart_by_their_folders_and_by_what_differs(tmp_path):
    amounts = [{"flank clearance [µm]": value, "radial clearance [µm]": 7.0} for value in (1.0, 2.5)]
    runs = [run_folder(tmp_path / part / "mine", **own) for part, own in zip("ab", amounts, strict=True)]
    neglected = "sun.assembly,µm,0.0,0.0,0.0\n"
    for run in runs:
        zones = run / "allocation.csv"
        zones.write_text(zones.read_text(encoding="utf-8") + neglected, encoding="utf-8")
    compared = ta.compare(*runs)
    assert compared.subtitle == f"A: mine in {runs[0]}; B: mine in {runs[1]}."
    assert list(compared.to_frame("zones")["source"]) == ["disc1.pitch", "pin.diameter"]
    (row,) = compared.teller.terminal[0][0].to_dict("records")
    assert (row["quantity"], row["B − A"]) == ("flank clearance [µm]", 1.5)


def test_runs_of_other_questions_and_the_same_run_are_told(runs, tmp_path):
    other = run_folder(tmp_path / "other", **{"limit [arcsec]": 45.0})
    warnings = answer_of("compare", runs[0], other)["warnings"]
    assert says(warnings, "comparison.other_question")
    warnings = answer_of("compare", runs[0], runs[0])["warnings"]
    assert says(warnings, "comparison.same_study")


@pytest.mark.parametrize(
    "changes",
    [{"reducer": "RV-40E"}, {"torque [N·m]": -167.0}, {"yield target [-]": 0.99}, {"lower limit [arcsec]": 1.0}],
)
def test_another_reducer_torque_yield_or_side_is_another_question(tmp_path, changes):
    runs = (run_folder(tmp_path / "one", asked="ranking"), run_folder(tmp_path / "two", asked="ranking", **changes))
    for pair in (runs, runs[::-1]):
        assert answer_of("compare", *pair)["same question"] is False


def test_a_limit_beside_the_leading_one_is_part_of_the_question(tmp_path):
    def required(upper, shown="99.73 % of units"):
        lost = {"requirement": "lost motion [arcmin]", "limit": f"at most {upper} arcmin", "shown for": shown}
        return {"requirements": [lost]}

    asked = (required(1), required(1), required(1.2), required(1, "99 % of units"), {})
    one, *others = (run_folder(tmp_path / f"run{at}", **own) for at, own in enumerate(asked))
    same = [answer_of("compare", one, own)["same question"] for own in others]
    assert same == [True, False, False, True]  # the last is of a version that did not say it


def test_rankings_of_the_same_limits_are_of_one_question(tmp_path):
    def ranked(upper):
        rows = [{"requirement": "lost motion", "USL": upper, "OK": "yes"}, {"requirement": "twist"}]
        return run_folder(tmp_path / str(upper), asked="ranking", requirements=rows)

    one, other = ranked(1.0), ranked(1.2)
    shown = {"requirement": "lost motion [arcmin]", "limit": "at most 1 arcmin", "shown for": "99.73 % of units"}
    allocated = run_folder(tmp_path / "allocated", requirements=[shown])
    pairs = ((one, one), (one, other), (one, allocated))
    same = [answer_of("compare", *pair)["same question"] for pair in pairs]
    assert same == [True, False, True]


def test_rankings_with_a_lower_limit_alone_are_compared(tmp_path):
    runs = []
    for name, index in (("one", 0.3), ("two", 0.4)):
        runs.append(run_folder(tmp_path / name, index=index, asked="ranking", **{"lower limit [N·m/arcmin]": 150.0}))
        said = summary_of(runs[-1])
        del said["ranking"]["limit [arcsec]"], said["ranking"]["met"]
        (runs[-1] / "summary.json").write_text(json.dumps(said), encoding="utf-8")
    result = tolalloc("compare", *runs)
    assert result.returncode == 0, result.stderr
    said = " ".join(result.stdout.split())
    assert "99.87 %" in said and " 150 N·m/arcmin" in said


def test_a_source_of_one_run_alone_is_shown(runs):
    table = pd.read_csv(runs[1] / "tables" / "shares.csv").iloc[:1]
    table.to_csv(runs[1] / "tables" / "shares.csv", index=False)
    answer = answer_of("compare", *runs)
    assert answer["rankings"][1]["90 % intervals"] == "only in one"
    assert answer["rankings"][1]["total index B [-]"] is None


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("summary.json", None, ["no such file", "folder of a finished run"]),
        ("summary.json", "{", ["cannot be read as JSON", "truncated"]),
        ("summary.json", "[]", ["holds a list"]),
        ("summary.json", "{}", ["neither a ranking nor an allocation"]),
        ("summary.json", '{"allocation": {}}', ["study is missing"]),
        ("summary.json", json.dumps({"ranking": {**dict.fromkeys(NEEDED, 0)}}), ["limit is missing"]),
        ("tables/shares.csv", None, ["no such file"]),
        ("tables/shares.csv", "", ["cannot be read as a table"]),
        ("allocation.csv", "id\nx\n", ["unit is missing"]),
    ],
)
def test_broken_runs_are_refused_in_one_sentence(runs, tmp_path, name, text, words):
    path = runs[1] / name
    path.unlink()
    if text is not None:
        path.write_text(text, encoding="utf-8")
    refused(tolalloc("compare", *runs, "--out", tmp_path / "report"), name, *words)
    assert not (tmp_path / "report").exists()


def test_folders_that_are_none_or_in_use_are_refused(runs, tmp_path):
    refused(tolalloc("compare", runs[0], tmp_path / "nowhere"), "no such run folder")
    refused(tolalloc("compare", *runs, "--out", runs[0]), "not empty")


def test_each_limit_and_all_at_once_are_compared_where_the_answers_have_them(tmp_path):
    each = {"yield of peak-to-peak [-]": 0.9987, "yield of lost motion [-]": 0.995, "yield of all limits [-]": 0.9941}
    several = run_folder(tmp_path / "several", **each)
    ranked = run_folder(tmp_path / "ranked", asked="ranking", **each | {"yield of all limits [-]": 0.9})
    old = run_folder(tmp_path / "old", **{"yield of all limits [-]": 0.9987})
    first, second, _ = ta.compare(several, ranked).sentences
    for sentence, joint in ((first, 0.9941), (second, 0.9)):
        assert says(sentence, "comparison.others", joint=joint)
        assert says(sentence, "comparison.limit", output="lost motion", share=0.995)
        assert not says(sentence, "comparison.limit", output="peak-to-peak", share=0.9987)
    (row,) = [
        own for own in ta.compare(several, ranked).summary["answers"] if own["quantity"].startswith("yield of all")
    ]
    assert row["B − A"] == pytest.approx(-0.0941)
    assert not says(ta.compare(several, old).sentences[1], "comparison.others")


def test_runs_of_several_limits_say_the_yield_of_each_and_of_all(tmp_path):
    """Two outputs that never fail together: what both keep is what both leave."""
    row = {"plus": 3.0, "minus": -3.0, "unit": "µm", "min": 1.0, "max": 9.0, "cost": 1.0}
    study = ta.Study(
        ta.model(lambda a, b: (a + b, a + b), inputs=("a", "b"), outputs=("high [mm]", "low [mm]")),
        ta.Drawing.of_rows([{"id": name, **row} for name in "ab"]),
        limits={"high [mm]": ta.Limit(upper=0.002), "low [mm]": ta.Limit(lower=-0.001)},
        questions=[ta.Ranking()],
        name="apart",
    )
    sobol = ta.SobolEffort(start=16, limit=16, resamples=50)
    fields = {"derivative_units": 10, "surrogate_units": 96, "level_units": 100}
    ranking = study.rank(ta.Effort(ranking=replace(QUICK_RANKING, sobol=sobol, **fields)))
    assert list(ranking.result.yields) == ["low [mm]", "high [mm]"]  # 24 % miss the second limit, 8 % the first
    low, high = ranking.result.yields.values()
    assert ranking.result.joint.estimate == pytest.approx(high.estimate + low.estimate - 1)
    share = norm.cdf(2**0.5) - norm.cdf(-(0.5**0.5))
    assert ranking.result.joint.estimate == pytest.approx(share, abs=0.06)  # four standard errors
    assert says(ranking.sentences, "ranking.all_limits", share=ranking.result.joint.estimate)
    said = {name: value for name, value in ranking.summary.items() if name.startswith("yield of ")}
    run = read_run(run_folder(tmp_path / "run", asked="ranking", **said))
    assert run.yields == {"low": low.estimate, "high": high.estimate}
    assert run.joint == ranking.result.joint.estimate
    checked = ta.check(study, timed=True)
    assert checked.result.kept.joint.units == 256
    assert says(checked.sentences, "check.today", share=checked.result.kept.joint.estimate)
    assert ta.check(study).result.kept is None
    member = Member(name="apart", folder=run.folder, found=run)
    table = Answer(kind="series", header=checked.header, result=(member,)).summary
    assert table["studies"][0]["yield of all limits [-]"] == run.joint

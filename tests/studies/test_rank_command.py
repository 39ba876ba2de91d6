"""``tolalloc rank`` as a user meets it: answer, files, order rule, correlated sources, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from scipy.stats import binom

from tests.builders import FEW, few_sources, page_of, says, summary_of, wording
from tests.studies.command import WRITTEN, answer_of, refused, tolalloc
from tests.studies.scripts import study_script
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import load_process_capabilities, load_tolerance_table

PEAK_TO_PEAK = "peak-to-peak transmission error"
EFFORT = """effort=ta.Effort(ranking=RankingEffort(
    units=1024, sobol=SobolEffort(start=128, limit=128, second_order=True),
    derivative_units=64, inverse_units=926, surrogate_units=96, level_units=100, level_runs=2, widened_units=200,
    permutations=200))"""


IMPORTS = """from tolalloc.sensitivity.effort import RankingEffort
from tolalloc.sensitivity.effort import SobolEffort
"""
SIX = (*FEW, "housing.groove.radius")
LIMIT = "{ta.PEAK_TO_PEAK: ta.Limit(upper=60.0, show=ta.AtYield(target=0.99))}"


def script_with(path: Path, limits: str = LIMIT, **drawing: object) -> Path:
    """Write a study of few sources: the sources of the housing and the pitch of the discs."""
    table = str(few_sources(path, *SIX))
    return study_script(
        path,
        reducer={"neglected": ("*",)},
        drawing={"table": table, **drawing},
        limits=limits,
        written=EFFORT,
        imports=IMPORTS,
        name="ranked",
    )


@pytest.fixture(scope="module")
def ranked(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("rank")
    result = tolalloc("rank", script_with(path), "--out", path / "report")
    assert result.returncode == 0, result.stderr
    assert says(" ".join(result.stdout.split()), "ranking.drivers_short", output="peak-to-peak")
    return path / "report"


@pytest.mark.slow
def test_the_report_is_complete(ranked):
    names = {path.name for path in ranked.iterdir()}
    assert names == WRITTEN | {"figures", "tables"}
    figures = {path.stem for path in (ranked / "figures").iterdir()}
    assert {"ranking", "requirements", "orders", "peak_to_peak", "rejects", "reducer"} <= figures
    page = page_of(ranked)
    assert page.count('class="moving"') == 1
    for key in ("overall", "orders", "yield", "rejects", "alone", "surrogates", "mapping"):
        assert wording(f"ranking.{key}_heading") in page
    assert wording("ranking.drivers_heading", output="peak-to-peak") in page
    assert "<script src" not in page


@pytest.mark.slow
def test_pairs_say_what_errors_add_together(ranked):
    pairs = pd.read_csv(ranked / "tables" / "pairs.csv")
    assert len(pairs) == 10  # of five dimensions, both discs' pitch one of them
    assert (pairs["S2 low 5 % [-]"] <= pairs["second index S2 [-]"]).mean() > 0.9
    # The two discs and the housing act together, pin and groove hardly at all.
    assert "pin diameter" not in set(pairs.iloc[0][["dimension", "with"]])


@pytest.mark.slow
def test_the_answer_for_programs_is_whole(ranked):
    answer = summary_of(ranked)["ranking"]
    assert len(answer["ranking"]) == 5
    totals = [row["total index [-]"] for row in answer["ranking"]]
    assert totals == sorted(totals, reverse=True)
    assert answer["Sobol blocks dropped [-]"] == 0
    assert set(answer["statuses"]) >= {"equilibrium found"}
    (requirement,) = [row for row in answer["requirements"] if row["requirement"] == PEAK_TO_PEAK]
    assert requirement["Yield low 2.5 % [%]"] < requirement["Yield [%]"] < requirement["Yield high 97.5 % [%]"]


@pytest.mark.slow
def test_errors_of_the_housing_make_multiples_of_the_teeth_and_turning_ones_of_the_pins(ranked):
    orders = pd.read_csv(ranked / "tables" / "orders.csv")
    order, alone = orders["order of the output turn [-]"], orders["alone low 5 % [-]"] > 0.05
    of_housing, of_discs = (
        orders["dimension"].str.startswith("housing "),
        orders["dimension"] == "disc pitch",
    )
    # The main orders of either: order 2 of the housing's pins, order 1 of a disc's teeth; the discs stand opposite each
    # other, so the odd orders of the housing nearly cancel.
    assert set(order[of_housing & alone]) == {78, 156}
    assert {40, 160} <= set(order[of_discs & alone])
    # At other orders their interval of 90 % lies above by chance alone, one in twenty.
    others = of_discs & ~order.isin([40, 80, 120, 160])
    assert (others & alone).sum() <= binom.ppf(0.999, others.sum(), 0.05)
    # Order 1 comes from both together.
    first = order == 1
    assert not alone[first].any()
    assert (orders["with others low 5 % [-]"][first & (of_housing | of_discs)] > 0.2).sum() >= 2


@pytest.mark.slow
def test_seed_zero_is_a_seed_like_every_other(tmp_path):
    script = script_with(tmp_path)
    answers = []
    for number in range(2):
        answers.append(answer_of("rank", script, "--quick", "--seed", 0, "--out", tmp_path / str(number))["ranking"])
    assert answers[0] == answers[1]
    found = answer_of("compare", tmp_path / "0", tmp_path / "1")
    assert found["same question"] is True
    assert {row["90 % intervals"] for row in found["rankings"]} == {"overlap"}
    assert says(found["warnings"], "comparison.same_study")


@pytest.mark.slow
def test_measured_parts_and_processes_reach_the_report(tmp_path):
    table = pd.read_csv(few_sources(tmp_path, *SIX), dtype=str, keep_default_na=False)
    parts = SeedTree(1).generator().normal(0.2, 0.4, 60)
    (tmp_path / "pins.csv").write_text(
        "deviation [µm]\n" + "\n".join(f"{value:.3f}" for value in parts) + "\n", encoding="utf-8"
    )
    of_pins = table["id"] == "pin.diameter"
    table.loc[of_pins, "distribution"] = "empirical"
    table["measured"], table["measured_zone"] = (
        of_pins.map({True: "pins.csv", False: ""}),
        of_pins.map({True: "4.0", False: ""}),
    )
    process = next(iter(load_process_capabilities("generic")))[0]
    table["process"] = [process if name == "housing.groove.radius" else "" for name in table["id"]]
    table.to_csv(tmp_path / "few.csv", index=False)
    script = script_with(tmp_path)
    table.to_csv(tmp_path / "few.csv", index=False)
    result = tolalloc("rank", script, "--quick", "--out", tmp_path / "report")
    assert result.returncode == 0, result.stderr
    fitted = pd.read_csv(tmp_path / "report" / "tables" / "measured parts.csv")
    assert set(fitted["source"]) == {"pin.diameter"}
    assert fitted["parts [-]"].eq(60).all()
    assert (fitted["best"] == "yes").sum() == 1
    page = page_of(tmp_path / "report")
    assert process in page


@pytest.mark.slow
def test_correlated_sources_are_ranked_as_a_block_and_share_by_shapley(tmp_path):
    (tmp_path / "lot.csv").write_text(
        "sources,correlation,note\ndisc?.pitch,0.9,both discs on one machine\n", encoding="utf-8"
    )
    script = script_with(tmp_path, correlations=str(tmp_path / "lot.csv"))
    answer = answer_of("rank", script, "--quick", "--out", tmp_path / "report")["ranking"]
    assert "disc pitch" in [row["dimension"] for row in answer["ranking"]]
    shapley = pd.read_csv(tmp_path / "report" / "tables" / "Shapley effects.csv")
    assert set(shapley["source"]) == {source.name for source in load_tolerance_table(few_sources(tmp_path, *SIX))}
    assert shapley["Shapley effect [-]"].sum() == pytest.approx(1.0)
    assert "correlation" in page_of(tmp_path / "report")


@pytest.mark.parametrize(
    ("drawing", "words"),
    [
        ({"correlations": "nowhere.csv"}, ["nowhere.csv"]),
        ({"processes": "nowhere"}, ["nowhere"]),
    ],
)
def test_bad_fields_are_refused_in_one_sentence(tmp_path, drawing, words):
    refused(tolalloc("rank", script_with(tmp_path, **drawing), "--quick", "--out", tmp_path / "report"), *words)
    assert not (tmp_path / "report").exists()


def test_a_limit_on_an_unknown_output_names_the_known_ones(tmp_path):
    script = script_with(tmp_path, limits="{'lost motoin [arcmin]': ta.Limit(upper=1.0)}")
    refused(
        tolalloc("rank", script, "--out", tmp_path / "report"),
        "unknown output in limits 'lost motoin",
        "lost motion [arcmin]",
    )
    assert not (tmp_path / "report").exists()

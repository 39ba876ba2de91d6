"""Every command on every guest: the answers by hand, and one answer to one question whichever command is asked."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import tolalloc as ta
from tests.builders import page_of, summary_of
from tests.golden.cases import small_effort
from tests.guests.cases import GUESTS, REDUCER_UNITS, STUDIES, UNITS, Guest
from tests.studies.command import answer_of, tolalloc
from tolalloc.cli.live.desk import Desk
from tolalloc.cli.live.session import Session
from tolalloc.study.prepared import Prepared
from tolalloc.study.problem import QUICK
from tolalloc.study.script import load_study

pytestmark = pytest.mark.filterwarnings("ignore:.*NumbaPerformanceWarning")


def params(*, slow: bool = False, reducers_slow: bool = True) -> list[Any]:
    """Return the guests as parameters, those of reducers or all of them marked slow."""
    marks = [pytest.mark.slow]
    return [
        pytest.param(own, id=own.name, marks=marks if slow or (own.reducer and reducers_slow) else []) for own in GUESTS
    ]


def effort(guest: Guest) -> ta.Effort:
    """Return the quick effort, of reducers one of seconds that may show 99.73 %, for which 329 units are needed."""
    if not guest.reducer:
        return QUICK
    own = small_effort()
    more = {"verification_units": 384, "confirmation_units": 768, "stiffness_units": 384}
    return replace(own, allocation=replace(own.allocation, **more))


def prepared(guest: Guest) -> Prepared:
    return Prepared(study=load_study(guest.script))


def test_there_are_guests_of_every_kind():
    assert len(GUESTS) >= 25
    assert {own.name for own in GUESTS} == {own.name for own in STUDIES.iterdir() if own.is_dir()}


@pytest.mark.parametrize("guest", params(reducers_slow=False))
def test_mean_and_deviation_are_those_by_hand(guest):
    study = prepared(guest)
    # Four standard errors of the mean, σ/√n, and of the deviation, σ/√(2n) for tails no longer than the normal one's.
    units = REDUCER_UNITS if guest.reducer else UNITS
    x, error = study.random_units(units), 4 / np.sqrt(units)
    for output, hand in guest.hand.items():
        values = study.model.reading((output,))(x).values[:, 0]
        assert values.mean() == pytest.approx(hand.mean, abs=hand.sigma * (error + hand.within)), output
        assert values.std() == pytest.approx(hand.sigma, rel=error + hand.within), output


@pytest.mark.parametrize("guest", params())
def test_a_guest_is_in_order_and_its_table_costs_what_its_rows_say(guest):
    found = answer_of("check", guest.script)
    assert (found["study"], found["but"]) == (guest.name, "")
    assert found["cost of the tolerance table [cost units]"] == pytest.approx(guest.cost)


def unchanged(guest: Guest) -> dict[str, float]:
    """Return the zone of one source of a guest as it is [µm]."""
    source = prepared(guest).errors.active[0]
    return {source.name: 1e6 * source.zone}


@pytest.mark.slow
@pytest.mark.parametrize("guest", params())
def test_what_if_of_no_change_is_the_drawing_as_it_is(guest):
    answer = answer_of("whatif", guest.script, *_zones(unchanged(guest)))
    rows = {row["what"]: row for row in answer["changes"]}
    for row in rows.values():
        assert row["after [unit]"] == pytest.approx(row["before [unit]"], rel=1e-9)
    assert rows["cost"]["before [unit]"] == pytest.approx(guest.cost)
    if guest.reducer:
        return  # whose `check --time` takes a minute
    # check judges other units: both shares are means of 0 and 1 over 256 and 1024 units
    said = tolalloc("check", guest.script, "--json", "--time")
    today = json.loads(said.stdout)["yield of all limits [-]"]
    share = rows["yield, all limits"]["before [unit]"] / 100
    assert today == pytest.approx(share, abs=4 * np.sqrt(max(share * (1 - share), 1e-3) / 256) + 1 / 256)


def _zones(zones: dict[str, float]) -> list[str]:
    return [f"{name}={zone!r}um" for name, zone in zones.items()]


@pytest.mark.slow
@pytest.mark.parametrize("guest", params())
def test_what_if_in_python_on_the_command_line_and_on_the_live_page_is_one_answer(guest):
    study = load_study(guest.script)
    answer = ta.whatif(guest.script, dict(guest.zones), units=256)
    typed = answer_of("whatif", guest.script, *_zones(dict(guest.zones)), "--units", 256)
    said = {row["what"]: row["after [unit]"] for row in typed["changes"]}
    before, after = answer.result.whole_cost, answer.result.whole_cost + answer.result.cost_change
    assert said["cost"] == pytest.approx(after)
    names = {own.name: 1e6 * own.zone for own in answer.result.after}
    desk = Desk(session=Session(prepared=Prepared(study=study)), script=guest.script)
    sent = {"tab": "tab", "turn": 1, "design": {"zones": names}}
    live = desk.answer("units", {**sent, "units": 256})
    assert live["yield"][0] == pytest.approx(answer.result.yields[1], abs=1e-12)
    assert said["yield, all limits"] == pytest.approx(100 * live["yield"][0])
    told = [item["value"] for own in live["outputs"] for item in own["quantiles"]]
    assert told == pytest.approx([own for _, own in answer.result.quantiles])
    priced = desk.answer("design", sent)
    assert (priced["before"], priced["cost"]) == pytest.approx((before, after))
    if not guest.reducer:
        assert after > before or answer.result.cost_change == pytest.approx(0)


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """The folder of all runs; each guest is run once for all that is asked of its folder."""
    return tmp_path_factory.mktemp("guests")


def run_of(guest: Guest, place: Path) -> Path:
    """Return the folder of a guest's run."""
    folder = place / "runs" / guest.name
    if not folder.exists() and guest.reducer:
        load_study(guest.script).run(folder, effort=effort(guest))
    elif not folder.exists():
        ran = tolalloc("run", guest.script, "--quick", "--out", folder)
        assert ran.returncode == 0, ran.stderr
        assert "Traceback" not in ran.stderr
    return folder


@pytest.mark.parametrize("guest", params(slow=True))
def test_one_cost_stands_in_the_table_the_workbook_the_summary_and_on_the_page(guest, place):
    folder = run_of(guest, place)
    said = summary_of(folder)["allocation"]
    cost = next(value for name, value in said.items() if re.fullmatch(r"cost \[.*\]", name))
    study = load_study(guest.script).changed(folder / "allocation.csv")
    # of a shop's processes the table alone knows the cost at its zone
    rows = Prepared(study=replace(study, drawing=replace(study.drawing, costs=""))).errors.sources
    assert sum(own.cost for own in rows) == pytest.approx(cost, rel=1e-6)
    sheets = pd.read_excel(folder / "results.xlsx", sheet_name=None)
    lines = sheets.get("allocation dimensions", sheets["dimensions"])  # a ranking of dimensions has the plain name
    (column,) = [own for own in lines.columns if own.startswith("cost [")]
    assert lines[column].sum() == pytest.approx(cost, rel=1e-6)
    assert f"{cost:,.2f}" in page_of(folder)
    assert f"cost {cost:.4f}" in (folder / "allocation.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize("guest", params(slow=True))
def test_the_ranking_has_the_order_by_hand_and_the_zones_are_the_next_table(guest, place):
    folder = run_of(guest, place)
    if (folder / "tables" / "allocation dimensions.csv").exists():
        ranked = pd.read_csv(folder / "tables" / "dimensions.csv")["dimension"].tolist()
    else:
        ranked = [own["dimension"] for own in summary_of(folder)["ranking"]["ranking"]]
    assert tuple(ranked[: len(guest.order)]) == guest.order
    drawn = {own["source"]: own for own in summary_of(folder)["allocation"]["drawing"]}
    again = Prepared(study=load_study(guest.script).changed(folder / "allocation.csv")).errors.sources
    for own in again:
        (zone,) = [value for name, value in drawn[own.row or own.name].items() if re.fullmatch(r"zone \[.*\]", name)]
        assert own.zone == pytest.approx(zone * (0.0254 if own.unit == "in" else 1e-6), rel=1e-4)


@pytest.mark.parametrize("guest", params(slow=True))
def test_a_series_and_a_comparison_read_what_the_run_says(guest, place):
    folder = run_of(guest, place)
    said = summary_of(folder)["allocation"]
    cost = next(value for name, value in said.items() if re.fullmatch(r"cost \[.*\]", name))
    study = load_study(guest.script)
    before = (folder / "summary.json").stat().st_mtime_ns
    (member,) = ta.series([study], place / "runs", effort=effort(guest)).result
    assert (member.folder.name, (folder / "summary.json").stat().st_mtime_ns) == (guest.name, before)
    row = ta.series([study], place / "runs", effort=effort(guest)).to_frame("answers").iloc[0]
    (column,) = [own for own in row.index if own.startswith("cost [")]
    assert row[column] == pytest.approx(cost)
    assert row["answer"] == ("met" if said["met"] else "NOT met")
    second = shutil.copytree(folder, place / f"{guest.name} again", dirs_exist_ok=True)
    side = {row["quantity"]: row for row in answer_of("compare", folder, second)["answers"]}
    (both,) = [own for name, own in side.items() if re.fullmatch(r"cost \[.*\]", name)]
    _, first, other, apart = both.values()
    assert (first, other, apart) == (pytest.approx(cost), pytest.approx(cost), 0.0)


@pytest.mark.parametrize("guest", params(slow=True))
def test_what_if_of_the_found_zones_keeps_what_the_run_says(guest, place):
    folder = run_of(guest, place)
    said = summary_of(folder)["allocation"]
    found = load_study(guest.script).changed(folder / "allocation.csv")
    source = Prepared(study=found).errors.active[0]
    answer = found.ask(
        ta.Difference(zones={source.name: 1e6 * source.zone}, units=REDUCER_UNITS if guest.reducer else 8192)
    )
    share, low = answer.result.yields[0], said["yield of all limits [-]"]
    units = answer.result.values.shape[1]
    # two means of 0 and 1: what the run verified, and these units
    verified = effort(guest).allocation.verification_units
    error = 4 * np.sqrt(max(low * (1 - low), 1e-3) * (1 / units + 1 / verified))
    assert share == pytest.approx(low, abs=error + 1 / units)


@pytest.mark.slow
@pytest.mark.parametrize(
    "guest", [own for own in GUESTS if own.name in ("compiled", "buero_csv", "spacers_4x")], ids=lambda own: own.name
)
def test_a_quick_run_as_typed_is_met(guest, place):
    assert summary_of(run_of(guest, place))["allocation"]["met"] is True

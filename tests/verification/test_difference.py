"""What other zones change, on the same units: exact answers of a linear model, and intervals that cover."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tolalloc as ta
from tests.builders import says
from tests.studies.command import answer_of, refused, tolalloc
from tolalloc.capability.monte_carlo import quantile_change, share_change
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.study.prepared import Prepared

ZONE = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 2}


def gap(housing, shaft):
    return housing - shaft


def fit(**changes) -> ta.Study:
    rows = [{"id": "housing", "nominal": 30.1, **ZONE}, {"id": "shaft", "nominal": 30.0, **ZONE}]
    return ta.Study(
        ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",)),
        ta.Drawing.of_rows(rows, **changes),
        limits={"gap [mm]": ta.Limit(upper=0.12, show=ta.AtYield(target=0.98))},
        name="fit",
        seed=3,
    )


def true_change() -> tuple[float, float]:
    """Return the change of the share within 0.12 mm and of the 98 % quantile [mm] with the housing's zone halved."""
    before, after = np.hypot(0.02 / 3, 0.02 / 3), np.hypot(0.01 / 3, 0.02 / 3)
    share = norm.cdf(0.02 / after) - norm.cdf(0.02 / before)
    return share, norm.ppf(0.98) * (after - before)


def test_the_output_that_passes_its_limit_is_told_and_not_the_first_one():
    rows = [{"id": own, "plus": 5, "minus": -5, "unit": "µm", "min": 1, "max": 20, "cost": 1} for own in "ab"]
    both = ta.model(
        lambda a, b: (1000 * (a - b), 1000 * (a + b)), inputs={"a": 5, "b": 5}, outputs=("gap [µm]", "sum [µm]")
    )
    for most, told in ((10_008.0, "sum"), (10_030.0, "gap")):
        limits = {"gap [µm]": ta.Limit(upper=30.0), "sum [µm]": ta.Limit(upper=most)}
        asked = ta.Study(both, ta.Drawing.of_rows(rows), limits=limits)
        assert f"quantile of the {told}" in ta.whatif(asked, {"a": 18.0}, units=4096).sentences[1]


def test_a_name_without_letters_means_no_source():
    rows = [{"id": own, "plus": 5, "minus": -5, "unit": "µm", "min": 1, "max": 20, "cost": 1} for own in "ab"]
    gap = ta.model(lambda a, b: 1000 * (a - b), inputs={"a": 5.0, "b": 5.0}, outputs=("gap [µm]",))
    asked = ta.Study(gap, ta.Drawing.of_rows(rows), limits={"gap [µm]": ta.Limit(upper=12.0)})
    with pytest.raises(UnknownNameError, match="whatif: unknown source ''"):
        ta.whatif(asked, {"": 8.0})


def test_a_locked_zone_that_is_changed_is_said_to_be_locked():
    rows = [{"id": own, "plus": 5, "minus": -5, "unit": "µm", "min": 1, "max": 20, "cost": 1} for own in "ab"]
    rows[0]["locked"] = True
    gap = ta.model(lambda a, b: 1000 * (a - b), inputs={"a": 5.0, "b": 5.0}, outputs=("gap [µm]",))
    asked = ta.Study(gap, ta.Drawing.of_rows(rows), limits={"gap [µm]": ta.Limit(upper=12.0)})
    for name, is_locked in (("a", True), ("b", False)):
        assert says(ta.whatif(asked, {name: 8.0}).teller.warnings, "difference.locked", names="a") == is_locked


def test_a_linear_models_change_lies_in_the_intervals():
    found = fit().ask(ta.Difference(zones={"hous*": 20.0}, units=8192))
    share, quantile = true_change()
    assert found.result.yield_change.low < share < found.result.yield_change.high
    assert found.result.quantile_changes[0].low < quantile < found.result.quantile_changes[0].high
    assert found.result.cost_change == pytest.approx(2.0)  # 1/zone: twice the cost of 2
    assert found.result.whole_cost == 4.0
    assert list(found.tables["changed zones"]["source"]) == ["housing"]
    assert found.warnings == ()


def test_two_limits_have_a_quantile_each():
    limit = ta.Limit(lower=0.085, upper=0.115, show=ta.AtYield(target=0.96))
    found = replace(fit(), limits={"gap [mm]": limit}).ask(ta.Difference(zones={"hous*": 20.0}, units=8192))
    narrower = norm.ppf(0.98) * (np.hypot(0.01, 0.02) - np.hypot(0.02, 0.02)) / 3
    above, below = found.result.quantile_changes  # 2 % of the units beyond either
    assert above.low < narrower < above.high < 0.0
    assert 0.0 < below.low < -narrower < below.high
    assert [own.split(" %")[0] for own in found.tables["changes"]["what"]][2:] == ["98", "2"]
    for share in ("98 %", "2 %"):
        assert says(found.sentences[1], "difference.quantile", share=share, output="gap")


def test_the_limit_that_moves_is_told_where_the_first_one_does_not():
    rows = [{"id": "housing", "nominal": 30.1, **ZONE}, {"id": "shaft", "nominal": 30.0, **ZONE}]
    both = ta.Study(
        ta.model(
            lambda housing, shaft: (housing, shaft), inputs=("housing", "shaft"), outputs=("bore [mm]", "pin [mm]")
        ),
        ta.Drawing.of_rows(rows),
        limits={"bore [mm]": ta.Limit(upper=30.12), "pin [mm]": ta.Limit(upper=30.02)},
        name="both",
    )
    (_, said) = both.ask(ta.Difference(zones={"shaft": 20.0}, units=4096)).sentences
    assert "quantile of the pin" in said
    assert "bore" not in said


def test_no_change_is_none_and_the_same_units_cancel_what_two_runs_do_not():
    same = fit().ask(ta.Difference(zones={"housing": 40.0}))
    assert same.result.yield_change.estimate == 0.0
    assert (same.result.quantile_changes[0].low, same.result.quantile_changes[0].high) == (0.0, 0.0)
    little = fit().ask(ta.Difference(zones={"housing": 39.0}, units=8192)).result.quantile_changes[0]
    # Two runs of 8,192 units differ by √2 standard errors of either: some 0.3 µm where the change is 0.2 µm.
    spread = np.sqrt(2) * np.sqrt(0.98 * 0.02 / 8192) / norm.pdf(norm.ppf(0.98)) * np.hypot(0.02, 0.02) / 3
    assert little.high - little.low < 0.5 * 2 * 1.96 * spread
    assert little.high < 0.0


def test_a_neglected_source_is_refused_as_such():
    rows = [{"id": "housing", **ZONE}, {"id": "shaft", **ZONE, "plus": 0, "minus": 0, "locked": True}]
    neglected = replace(fit(), drawing=ta.Drawing.of_rows(rows))
    sentence = (
        "^whatif: source 'shaft' is neglected, because its zone is 0 in the tolerance table; give it a zone "
        r"above 0 there\.$"
    )
    with pytest.raises(InputError, match=sentence):
        neglected.ask(ta.Difference(zones={"shaft": 5.0}))
    with pytest.raises(UnknownNameError, match="unknown source 'shafts'; known is housing"):
        neglected.ask(ta.Difference(zones={"shafts": 5.0}))


def test_units_are_in_memory_some_at_a_time_and_the_same_ones(monkeypatch):
    whole = fit().ask(ta.Difference(zones={"housing": 20.0}, units=5000))
    monkeypatch.setattr("tolalloc.allocation.difference._CHUNKS_AT_ONCE", 2)
    parts = fit().ask(ta.Difference(zones={"housing": 20.0}, units=5000))
    np.testing.assert_array_equal(whole.result.values, parts.result.values)
    assert whole.result.quantile_changes == parts.result.quantile_changes


@pytest.mark.slow
def test_intervals_cover():
    """400 samples of 300 pairs: 95 % less two standard errors of 1.1 %; the share's interval is on the safe side."""
    share, quantile, hits = true_change()[0], true_change()[1], np.zeros(2)
    for number in range(400):
        generator = SeedTree(number).generator()
        housing, shaft = generator.standard_normal((2, 300)) * 0.02 / 3
        before, after = housing - shaft, 0.5 * housing - shaft
        own = share_change(before <= 0.02, after <= 0.02)
        hits[0] += own.low <= share <= own.high
        if number < 200:
            middle = quantile_change(before, after, 0.9, generator)
            hits[1] += middle.low <= quantile * norm.ppf(0.9) / norm.ppf(0.98) <= middle.high
    assert hits[0] / 400 >= 0.95
    assert hits[1] / 200 == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 200) + 0.02)


def test_few_units_beyond_a_quantile_are_warned_of():
    found = fit().ask(ta.Difference(zones={"shaft": 30.0}, units=128))
    assert len(found.warnings) == 1 and says(found.warnings, "difference.few", units=128, beyond=10)


def test_shares_of_units_are_no_worst_case_and_say_so():
    warned = fit(population="none").ask(ta.Difference(zones={"housing": 20.0}, units=2048)).teller.warnings
    assert any("do not show that" in own for own in warned)
    assert not any(
        "do not show that" in own for own in fit().ask(ta.Difference(zones={"housing": 20.0})).teller.warnings
    )


def test_a_process_prices_the_zone_that_it_holds():
    costs = {"housing": [("turned", 1.0, 0.02, 0.01, 0.1), ("ground", 3.0, 0.02, 0.002, 0.02)]}
    study = fit(costs=costs)
    ground = study.ask(ta.Difference(zones={"housing": 10.0}))  # ± 0.005 mm
    assert ground.result.after[0].cost == pytest.approx(3.0 + 0.02 / 0.005)
    with pytest.raises(InputError, match=r"housing is '1 µm'; allowed is 5 to 100 µm, what its processes hold"):
        study.ask(ta.Difference(zones={"housing": 1.0}))


@pytest.mark.parametrize(
    ("zones", "words"),
    [
        (3, "zones is 3; allowed is source names with their zones"),
        ({1: 2.0}, "allowed is source names with their zones"),
        ({}, "no zone is given"),
        ({"bolt": 3.0}, "unknown source 'bolt'"),
        ({"shaft": -1.0}, "shaft is -1.0; allowed is a zone above 0"),
        ({"shaft": float("nan")}, "shaft is nan; allowed is a zone above 0"),
    ],
)
def test_what_cannot_be_asked_is_refused_in_one_sentence(zones, words):
    with pytest.raises(ta.TolallocError, match=words):
        fit().ask(ta.Difference(zones=zones))


def test_the_command_says_what_python_says(tmp_path):
    script = tmp_path / "fit.py"
    script.write_text(
        "import tolalloc as ta\nfrom tests.verification.test_difference import fit\nstudy = fit()\n",
        encoding="utf-8",
    )
    told = answer_of("whatif", script, "hous*=20", "--units", "2048", "--out", tmp_path / "report")
    own = fit().ask(ta.Difference(zones={"hous*": 20.0}, units=2048)).summary
    assert told["changes"] == own["changes"]
    assert (tmp_path / "report" / "report.html").stat().st_size > 0
    for text in ("shaft", "shaft=x"):
        refused(tolalloc("whatif", script, text), "allowed is SOURCE=µm, such as pin.diameter=3")


def test_the_next_question_of_a_reducer_finds_its_tables():
    """Condensing them takes longer than a fifth of a what-if."""

    def asked(torque: float) -> EquivalentModel:
        reducer = ta.reducer("rv20e_liu2020", torque=torque)
        study = ta.Study(reducer, ta.drawing("rv20e_table4"), limits={ta.PEAK_TO_PEAK: ta.Limit(upper=60.0)})
        return Prepared(study=study).model.kernel.model

    assert asked(-2.0) is asked(-2.0)
    believable = [
        ta.reducer("rv20e", torque=torque).bound(ta.drawing("rv20e_table4").errors, "test").kernel.model
        for torque in (-2.0, -100.0)
    ]
    assert believable[0].reducer.stiffness != believable[1].reducer.stiffness  # that of the parts under each torque

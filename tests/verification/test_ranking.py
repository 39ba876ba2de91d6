"""A ranking of a model that is no reducer: its own names and units, any limits, derivatives by differences."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import tolalloc as ta
from tests.builders import says, sizes
from tests.verification.test_saltelli import of_the_largest
from tolalloc.capability.indices import Limits
from tolalloc.drawings.correlation import CorrelatedSource
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Model, Response
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import portrait_of
from tolalloc.running.progress import SILENT, RunRecord
from tolalloc.sensitivity.effort import QUICK_RANKING, RankingEffort, SobolEffort
from tolalloc.sensitivity.measures import Measures, rank
from tolalloc.sensitivity.result import RankingResult
from tolalloc.study.answer import Answer

GAP, PLAY = "gap [mm]", "play [deg]"
EFFORT = RankingEffort(
    units=1500,
    sobol=SobolEffort(start=64, limit=64),
    derivative_units=50,
    inverse_units=100,
    surrogate_units=100,
    level_units=100,
    level_runs=2,
    widened_units=100,
)


@dataclass(frozen=True)
class Read:
    """Some outputs of a chain of two lengths; a third column scales both, where it is asked for."""

    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    scale: float = 0.0

    def __call__(self, x: np.ndarray) -> Evaluation:
        factor = 1.0 + self.scale + (x[:, 2] if x.shape[1] > 2 else 0.0)
        found = {GAP: factor * (1.0 + 1e3 * (3.0 * x[:, 0] - x[:, 1])), PLAY: factor * (2.0 + 1e4 * x[:, 1])}
        values = np.stack([found[name] for name in self.outputs], axis=1)
        return Evaluation(values=values, status=np.zeros(len(x), np.uint8))


@dataclass(frozen=True)
class Chain(Model):
    """Two lengths, and a scale that is not known if asked for."""

    deviation: float = 0.0
    scale: float = 0.0
    name = "a chain"
    columns = ("a", "b")
    outputs = (GAP, PLAY)

    def reading(self, outputs: tuple[str, ...]) -> Response:
        return Read(self.columns, outputs, self.scale)

    @property
    def uncertain(self) -> tuple[CorrelatedSource, ...]:
        own = CorrelatedSource(name="scale", columns=("scale",), covariance=np.array([[self.deviation**2]]))
        return (own,) if self.deviation else ()

    def with_uncertain(self, outputs: tuple[str, ...]) -> Response:
        return Read((*self.columns, "scale"), outputs)

    def changed(self, change: np.ndarray) -> Chain:
        return Chain(self.deviation, float(change[0]))


ERRORS = sizes("ab", zone=20e-6, minimum=1e-6, maximum=1e-3)


def ranked(limits: dict[str, Limits], model: Chain = Chain()) -> Answer[RankingResult]:
    record = RunRecord(SILENT, portrait_of(model).outcomes)
    asked = Measures(
        model=model,
        errors=ERRORS,
        limits=limits,
        target=0.95,
        effort=EFFORT,
        seeds=SeedTree(1),
        largest_failed_share=0.01,
    )
    result = rank(asked, record)
    header = Header(name="links", model=model.name, seed=1, statuses=record.counts, stages=record.stages)
    return Answer(kind="ranking", header=header, result=result)


@pytest.fixture(scope="module")
def answer() -> Answer[RankingResult]:
    return ranked({GAP: Limits(upper=1.02), PLAY: Limits(lower=1.9)})


@pytest.mark.slow
def test_the_answer_speaks_of_the_outputs_by_name_and_unit(answer):
    text = " ".join((answer.title, answer.subtitle, *answer.sentences))
    assert answer.header.model in answer.title and answer.header.name in answer.title
    assert says(text, "ranking.the_limit", limit="1.02 mm") or says(text, "ranking.worst_share")
    assert "″" not in text
    assert "[arcsec" not in " ".join(" ".join(frame.columns) for frame in answer.tables.values())
    assert says(answer.sections[0].heading, "ranking.drivers_heading", output="gap")
    assert "orders" not in answer.tables
    assert {"gap", "ranking", "rejects", "requirements"} <= {*answer.figures}
    assert answer.summary["model"] == "a chain"
    assert answer.summary["limit [mm]"] == 1.02
    assert answer.header.statuses == {"answer found": sum(answer.header.statuses.values()), "no answer": 0}


def test_the_ranking_is_that_of_the_closed_form(answer):
    assert answer.result.indices.sources == ("a", "b")
    np.testing.assert_allclose(answer.result.indices.total, [0.9, 0.1], atol=0.05)
    np.testing.assert_allclose(answer.result.local.slope, [3e-3, -1e-3], rtol=1e-6)
    assert answer.result.choice.chosen is not None
    assert [frame["requirement"] for frame in answer.summary["requirements"]] == ["gap", "play"]


@pytest.mark.slow
def test_a_lower_limit_is_an_upper_one_of_the_output_with_its_sign_turned(answer):
    turned = ranked({PLAY: Limits(lower=1.98)})
    yields = turned.result.sample.evaluation.values[:, 0] >= 1.98
    assert turned.result.outputs == (PLAY, GAP)
    assert turned.result.beyond.interval.estimate == pytest.approx(yields.mean())
    assert says(turned.sentences, "ranking.limit_lower", limit=1.98, sign="°")
    assert turned.summary["lower limit [deg]"] == 1.98
    # Only b moves it, and its 95 % quantile is 1.945: its zone alone may close to 0.36 of itself.
    assert (np.isnan(turned.result.inverse.factor[0]), np.isinf(turned.result.inverse.factor[0])) in (
        (True, False),
        (False, True),
    )
    assert turned.result.inverse.low[1] <= 0.02 / 0.0548 <= turned.result.inverse.high[1]


@pytest.mark.slow
def test_two_limits_count_the_units_beyond_either():
    both = ranked({GAP: Limits(lower=0.98, upper=1.02)})
    values = both.result.sample.evaluation.values[:, 0]
    inside = (values >= 0.98) & (values <= 1.02)
    assert both.result.beyond.interval.estimate == pytest.approx(inside.mean())
    assert says(both.sentences, "ranking.value_inside") or says(both.sentences, "ranking.value_beyond")


@pytest.mark.slow
def test_what_is_not_known_of_the_model_is_a_source_of_every_ranked_output():
    found = ranked({GAP: Limits(upper=1.02), PLAY: Limits(lower=1.9)}, Chain(deviation=0.01))
    assert found.result.indices.sources == ("a", "b", "scale")
    at = found.result.sobol.sources.index("scale")
    assert (found.result.sobol.indices.total[:, at] > 0.01).all()
    own, variance = found.result.indices, found.result.sample.evaluation.values[:, 0].var() + 0.01**2
    assert own.total[at] == pytest.approx(0.01**2 / variance, abs=3 * own.total_resamples[:, at].std())
    effect = found.summary["not known of the model"]
    assert effect["sigma of a unit [mm]"] == pytest.approx(0.01, rel=0.01)
    assert effect["total index ST [-]"] == pytest.approx(own.total[at])
    assert found.result.effect.first_order.root_mean_square < 1e-12
    assert found.result.local.sources == ("a", "b")
    assert says(found.sentences, "ranking.uncertain", names="scale")
    assert ranked({GAP: Limits(upper=1.02)}).summary.keys().isdisjoint({"not known of the model"})


def test_an_own_model_without_a_portrait_says_its_assumptions_itself():
    class Said(Model):
        name, columns, outputs = "said", ("a",), (GAP,)
        assumptions = ("all holes are round",)

        def reading(self, outputs):
            raise NotImplementedError

    assert portrait_of(Said()).assumptions == ("all holes are round",)
    assert portrait_of(Said()).facts == {}


@pytest.mark.slow
def test_a_function_of_arrays_has_the_shares_of_a_sum_to_a_hundredth_in_a_quick_run():
    """y = 2·a + b + c at equal zones has the shares 4/6, 1/6, 1/6; single numbers have the blocks of any model."""
    span = {"plus": 10.0, "minus": -10.0, "unit": "µm", "min": 1.0, "max": 90.0, "cost": 1.0}
    study = ta.Study(
        ta.model(lambda a, b, c: 2 * a + b + c, inputs=("a", "b", "c"), outputs=("sum [mm]",)),
        ta.Drawing.of_rows([{"id": name, **span} for name in "abc"]),
        limits={"sum [mm]": ta.Limit(upper=0.06)},
        questions=[ta.Ranking()],
        name="sum",
    )
    found = study.rank("quick").result.sobol.of(0)
    np.testing.assert_allclose(found.total, [4 / 6, 1 / 6, 1 / 6], atol=0.01)
    assert found.blocks == QUICK_RANKING.of_fast_model(3).sobol.limit > 50 * QUICK_RANKING.sobol.limit
    assert (found.total_interval[1] - found.total_interval[0] < 0.05).all()
    assert EFFORT.of_fast_model(3) is EFFORT  # numbers of a user stay


def largest_of_twelve(a, b, c, d, e, f, g, h, i, j, k, m):
    return float(max(abs(n * x) for n, x in enumerate((a, b, c, d, e, f, g, h, i, j, k, m), start=1)))


@pytest.mark.slow
def test_a_quick_run_says_of_which_sources_too_few_blocks_show_what_they_do():
    """max |n·x| of one number at a time: a third of the sources is hardly ever the largest, in 32 blocks of its own."""
    span = {"plus": 10.0, "minus": -10.0, "unit": "µm", "min": 1.0, "max": 90.0, "cost": 1.0}
    output = "largest [mm]"
    study = ta.Study(
        ta.model(largest_of_twelve, inputs=dict.fromkeys("abcdefghijkm", 0.0), outputs=(output,)),
        ta.Drawing.of_rows([{"id": name, **span} for name in "abcdefghijkm"]),
        limits={output: ta.Limit(upper=0.2)},
        questions=[ta.Ranking()],
        name="largest",
    )
    answer = study.rank("quick")
    found = answer.result.sobol.of(0)
    assert says(answer.sentences, "ranking.unseen", blocks=QUICK_RANKING.sobol.start, fewest=5)
    assert answer.result.sobol.small and says(answer.sentences, "ranking.others", count=4)
    said = [own for own in answer.sentences if "too few to measure" in own]
    named = [name for own in said for name in own.rpartition(": ")[2].partition(".")[0].split(", ")]
    assert {"b", "c"} <= set(named) and not {"k", "m"} & set(named)
    for low, high in (found.first_interval, found.total_interval, answer.result.sobol.overall.total_interval):
        assert low.min() >= 0.0 and high.max() <= 1.0
    assert (found.total_interval[1, :3] > 0.02).all()
    table = answer.tables["ranking"]
    assert found.first.min() < 0.0 <= min(table["S1 low 5 % [-]"].min(), table["first index S1 [-]"].min())
    exact = of_the_largest(np.arange(1.0, 13.0))[1]
    assert ((found.total_interval[0] <= exact) & (exact <= found.total_interval[1])).sum() >= 10


def both_limits(first: float, second: float) -> ta.Study:
    span = {"plus": 10.0, "minus": -10.0, "unit": "µm", "min": 1.0, "max": 90.0, "cost": 1.0}
    return ta.Study(
        ta.model(lambda a, b, c: (2 * a + b, b - 3 * c), inputs=("a", "b", "c"), outputs=("sum [mm]", "gap [mm]")),
        ta.Drawing.of_rows([{"id": name, **span} for name in "abc"]),
        limits={"sum [mm]": ta.Limit(upper=first), "gap [mm]": ta.Limit(upper=second)},
        questions=[ta.Ranking()],
        name="both",
    )


def test_the_limit_that_most_units_miss_leads_and_the_first_one_has_a_line():
    """σ of the sum is 7.5 µm, of the gap 10.5 µm: at 20 and 10 µm 0.4 and 17 % miss, at 15 and 20 µm 2.3 and 2.9 %."""
    answer = both_limits(0.02, 0.01).rank("quick")
    found = answer.result
    assert (found.leading, found.first_limited) == ("gap [mm]", "sum [mm]")
    assert answer.sentences[0].startswith("Gap decides: 1")
    assert found.indices.order[0] == found.indices.sources.index("c")
    assert any(own.startswith("Drivers of sum") and "a 80 %" in own for own in answer.sentences)
    values = found.sample.evaluation.values
    np.testing.assert_allclose(values[:, 0], found.sample.x @ [0.0, 1e3, -3e3], atol=1e-12)
    assert answer.summary["limit [mm]"] == 0.01
    alike = both_limits(0.015, 0.02).rank("quick")
    assert (alike.result.leading, alike.result.first_limited) == ("sum [mm]", "sum [mm]")
    assert not any("decides" in own for own in alike.sentences)


def test_single_sources_are_ranked_where_they_are_asked_for():
    span = {"plus": 10.0, "minus": -10.0, "unit": "µm", "min": 1.0, "max": 90.0, "cost": 1.0}
    rows = [{"id": name, "group": "pins" if name in "ab" else "", **span} for name in "abc"]
    study = ta.Study(
        ta.model(lambda a, b, c: 2 * a + b + c, inputs=("a", "b", "c"), outputs=("sum [mm]",)),
        ta.Drawing.of_rows(rows),
        limits={"sum [mm]": ta.Limit(upper=0.06)},
        name="sum",
    )
    lines, alone = (replace(study, questions=[ta.Ranking(by=by)]).rank("quick") for by in ("dimension", "source"))
    assert lines.to_frame()["dimension"].tolist() == ["pins", "c"]
    np.testing.assert_allclose(lines.result.indices.total, [5 / 6, 1 / 6], atol=0.01)
    assert alone.to_frame()["source"].tolist() == ["a", "b", "c"]
    np.testing.assert_allclose(alone.result.indices.total, [4 / 6, 1 / 6, 1 / 6], atol=0.01)
    assert [*lines.result.share_of_source] == ["a", "b", "c"]
    with pytest.raises(InputError, match="by is 'line'; allowed is dimension or source"):
        ta.Ranking(by="line")


def test_a_quick_run_counts_the_units_beyond_a_limit_and_says_that_rarer_ones_need_more():
    study = both_limits(0.03, 0.06)
    quick = study.rank("quick")
    assert [own.method for own in quick.result.beyond.estimates] == ["Monte Carlo"]
    assert any("rarer ones need a full run" in own for own in quick.sentences)
    asked = study.rank(ta.Effort(ranking=replace(QUICK_RANKING, rare=True)))
    assert len(asked.result.beyond.estimates) > 1
    # σ is 7.5 µm: 30 µm are 4.02 σ away.
    assert asked.result.beyond.estimate.probability == pytest.approx(2.9e-5, rel=0.5)
    found = quick.result.beyond.interval
    assert found.low <= 1 - 2.9e-5 <= found.high

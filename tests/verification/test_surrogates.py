"""Surrogates and the choice among them: what they are worth is measured on answers that they have not seen."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from tests.builders import baseline_errors, kernel_of, seeded_units
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation, Response
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reducers.surrogates import ContactCandidate, Corrected, CurveCandidate, corrected
from tolalloc.reports.tellers.ranking import chosen_surrogate
from tolalloc.reports.tellers.ranking_tables import quantile_name, shortfalls, surrogate_table
from tolalloc.sensitivity.surrogate.regression import (
    RegressionCandidate,
    fit_quadratic_form,
    quadratic_regression,
    sparse_quadratic_regression,
)
from tolalloc.sensitivity.surrogate.validation import (
    ENOUGH_Q2,
    Candidate,
    Score,
    answers_of,
    choose,
    cross_validate,
)

COLUMNS = ("a", "b", "c")
OUTPUTS = ("answer [arcsec]",)
GOOD = Score(
    name="good",
    q2=0.99,
    rms_error=1.0,
    quantile_error=0.5,
    quantile=50.0,
    target=0.9973,
    speed=5.0,
    per_second=1e4,
    trained=80,
    held_out=100,
    failed=0,
)


@dataclass(frozen=True)
class Exact:
    """A quadratic of three columns, with noise of the given deviation."""

    noise: float = 0.0
    fail: tuple[int, ...] = ()
    columns: tuple[str, ...] = COLUMNS
    outputs: tuple[str, ...] = OUTPUTS

    def __call__(self, x: np.ndarray) -> Evaluation:
        y = 20 + x[:, 0] + x[:, 1] * x[:, 2]
        # Noise that belongs to the sample, whatever chunk it comes in.
        y += self.noise * np.sqrt(2) * np.sin(1e6 * x.sum(axis=1))
        status = np.zeros(x.shape[0], np.uint8)
        for row in self.fail:
            y[row], status[row] = np.nan, 1
        return Evaluation(values=y[:, np.newaxis], status=status)


@dataclass(frozen=True)
class Fixed:
    """A candidate whose fit is the given response; it notes what it was shown."""

    response: Response
    name: str = "fixed"
    shown: list[np.ndarray] = field(default_factory=list)

    def fit(self, x: np.ndarray, y: np.ndarray) -> Response:
        self.shown.append(x)
        return self.response


@dataclass(frozen=True)
class Memory:
    """Returns the answer of the nearest sample that it has seen."""

    name: str = "memory"

    def fit(self, x: np.ndarray, y: np.ndarray) -> Response:
        @dataclass(frozen=True)
        class Nearest:
            columns: tuple[str, ...] = COLUMNS
            outputs: tuple[str, ...] = OUTPUTS

            def __call__(self, new: np.ndarray) -> Evaluation:
                nearest = ((new[:, np.newaxis] - x) ** 2).sum(axis=2).argmin(axis=1)
                return Evaluation(values=y[nearest, np.newaxis], status=np.zeros(new.shape[0], np.uint8))

        return Nearest()


def samples(count: int, columns: int = 3) -> np.ndarray:
    return SeedTree(3).child("samples").generator().standard_normal((count, columns))


def regression(estimator=quadratic_regression) -> RegressionCandidate:
    return RegressionCandidate(name="regression", columns=COLUMNS, outputs=OUTPUTS, estimator=estimator)


@pytest.fixture(scope="module")
def errors() -> ErrorModel:
    return baseline_errors()


@pytest.fixture(scope="module")
def kernel(rv20e: EquivalentModel, errors: ErrorModel) -> KernelResponse:
    return kernel_of(rv20e, errors, -1.0)


@pytest.fixture(scope="module")
def units(errors: ErrorModel) -> np.ndarray:
    return seeded_units(errors, 200, 5)


def test_every_candidate_becomes_a_response(kernel):
    candidates = (regression(), ContactCandidate(kernel=kernel, angles=234), CurveCandidate(kernel=kernel))
    assert all(isinstance(candidate, Candidate) for candidate in candidates)
    fitted = regression().fit(samples(50), samples(50)[:, 0])
    assert isinstance(fitted, Response)
    assert isinstance(Corrected(response=fitted, offset=0.0, factor=1.0), Response)


def test_predictivity_is_the_share_of_the_variance_that_is_not_noise():
    x = samples(2000)
    answers = answers_of(Exact(noise=0.5), x, SeedTree(1))
    score = cross_validate(Fixed(Exact()), answers)
    # Variance 1 of a, 1 of b·c, and the noise's 1/4. Errors have a relative standard deviation of √(1/2) squared,
    # the squares of the answers one of about 2.5: four standard errors of the ratio are 0.2·2.6/√2000·4.
    assert score.q2 == pytest.approx(1 - 0.25 / 2.25, abs=0.03)
    assert score.rms_error == pytest.approx(0.5, rel=4 * 0.36 / np.sqrt(2000))
    wanted = np.quantile(Exact()(x).values, 0.9973) - np.quantile(answers.y, 0.9973)
    assert score.quantile_error == pytest.approx(wanted, abs=1e-12)


def test_the_quantile_compared_is_the_one_asked_for_and_is_named():
    x = samples(400)
    answers = answers_of(Exact(noise=1.0), x, SeedTree(1))
    found = {share: cross_validate(Fixed(Exact()), answers, share) for share in (0.9, 0.9973)}
    for share, score in found.items():
        assert score.quantile == np.quantile(answers.y, share)
    assert found[0.9].quantile_error != found[0.9973].quantile_error
    choice = choose(Exact(noise=1.0), (Fixed(Exact()),), x, SeedTree(1), quantile=0.9)
    assert choice.scores[0].quantile == found[0.9].quantile
    assert surrogate_table(choice)["error of the 90 % quantile [arcsec]"].tolist() == [found[0.9].quantile_error]
    assert quantile_name(replace(choice.scores[0], target=0.99995)) == "99.995 % quantile"
    off = replace(GOOD, quantile_error=3.0)
    assert shortfalls(off) == ("its 99.73 % quantile is off by 6.0 %, more than 2.0 %",)
    with pytest.raises(InputError, match="quantile"):
        cross_validate(Fixed(Exact()), answers, 1.0)


def test_no_fit_sees_what_it_predicts():
    x = samples(100)
    candidate = Fixed(Exact())
    score = cross_validate(candidate, answers_of(Exact(), x, SeedTree(1)))
    assert [shown.shape[0] for shown in candidate.shown] == [80] * 5
    hidden = [{tuple(row) for row in x} - {tuple(row) for row in shown} for shown in candidate.shown]
    assert set().union(*hidden) == {tuple(row) for row in x}
    assert sum(map(len, hidden)) == 100
    assert (score.trained, score.held_out) == (80, 100)


def test_a_memory_of_answers_is_worth_nothing_on_noise():
    answers = answers_of(Exact(), samples(400), SeedTree(1))
    noise = replace(answers, y=SeedTree(2).generator().standard_normal(400))
    assert cross_validate(Memory(), noise).q2 < 0


def test_the_best_of_those_that_pass_is_fitted_to_all_answers():
    x, slow = samples(200), Exact()
    rough, best = Fixed(Exact(noise=0.25), "rough"), Fixed(Exact(), "best")
    choice = choose(slow, (rough, best), x, SeedTree(0))
    assert 0.95 <= choice.scores[0].q2 < ENOUGH_Q2
    assert choice.scores[choice.best].name == "best"
    assert choice.chosen is best.response
    assert best.shown[-1].shape[0] == 200
    assert "best: Q² = 1.000 on 200 held-out answers" in chosen_surrogate(choice)
    assert "its 99.73 % quantile is off by 0.0 %" in chosen_surrogate(choice)


def test_once_little_is_left_to_gain_no_other_candidate_is_tried():
    good, other = Fixed(Exact(noise=0.02), "good"), Fixed(Exact(), "other")
    choice = choose(Exact(), (good, other, regression()), samples(200), SeedTree(0))
    assert [score.name for score in choice.scores] == ["good"] and choice.scores[0].q2 >= ENOUGH_Q2
    assert choice.untried == ("other", "regression") and not other.shown
    assert chosen_surrogate(choice).endswith("Not tried, because nothing more can be gained: other, regression.")


def test_a_candidate_that_may_not_be_used_does_not_end_the_search():
    failing, other = Fixed(Exact(fail=(0,)), "failing"), Fixed(Exact(), "other")
    choice = choose(Exact(), (failing, other), samples(200), SeedTree(0))
    assert choice.scores[0].q2 >= ENOUGH_Q2 and shortfalls(choice.scores[0])
    assert choice.chosen is other.response


def test_below_the_gate_nothing_stands_in():
    poor = choose(Exact(noise=3.0), (regression(),), samples(200), SeedTree(0))
    assert poor.chosen is None and "Q² = " in chosen_surrogate(poor) and "is below 0.95" in chosen_surrogate(poor)


@pytest.mark.parametrize(
    ("change", "phrase"),
    [
        ({"q2": 0.9499}, "Q²"),
        ({"q2": float("nan")}, "Q²"),
        ({"quantile_error": 1.01}, "quantile"),
        ({"quantile_error": -1.01}, "quantile"),
        ({"failed": 2}, "fail"),
    ],
)
def test_the_gate_asks_for_every_one_of_its_numbers(change, phrase):
    assert shortfalls(GOOD) == ()
    (shortfall,) = shortfalls(replace(GOOD, **change))
    assert phrase in shortfall


def test_failed_samples_are_counted_and_never_learnt_from():
    candidate = Fixed(Exact())
    choice = choose(Exact(fail=(7,)), (candidate,), samples(200), SeedTree(1))
    assert choice.scores[0].held_out == 199
    with pytest.raises(SolveError, match="3 of 200 samples"):
        choose(Exact(fail=(1, 2, 3)), (candidate,), samples(200), SeedTree(1))


def test_failed_predictions_are_counted_and_close_the_gate():
    answers = answers_of(Exact(), samples(200), SeedTree(1))
    score = cross_validate(Fixed(Exact(fail=(0,))), answers)
    assert score.failed == 5
    assert score.q2 == 1.0
    assert any("fail" in phrase for phrase in shortfalls(score))
    with pytest.raises(SolveError, match="every prediction of fixed failed"):
        cross_validate(Fixed(Exact(fail=tuple(range(40)))), answers)


def test_the_errors_are_the_same_in_every_run_and_seed_0_is_a_seed():
    def errors(seed: int) -> list[float]:
        answers = answers_of(Exact(noise=0.3), samples(150), SeedTree(seed))
        score = cross_validate(regression(sparse_quadratic_regression), answers)
        return [score.q2, score.rms_error, score.quantile_error]

    assert errors(0) == errors(0)
    assert errors(0) != errors(1)


def test_folds_and_candidates_must_exist():
    for folds in (1, 6):
        with pytest.raises(InputError, match="folds"):
            answers_of(Exact(), samples(10), SeedTree(1), folds=folds)
    with pytest.raises(InputError, match="candidates"):
        choose(Exact(), (), samples(10), SeedTree(1))


def test_the_table_has_a_row_per_candidate_and_a_unit_per_number():
    choice = choose(Exact(), (Fixed(Exact(noise=1.0)), regression()), samples(60), SeedTree(1))
    assert surrogate_table(choice)["candidate"].tolist() == ["fixed", "regression"]
    assert surrogate_table(choice)["rms error [arcsec]"].tolist() == [score.rms_error for score in choice.scores]
    for header, column in surrogate_table(choice).items():
        assert len(column) == 2
        assert isinstance(column[0], str) or header.endswith("]")


def test_the_sparse_regression_finds_few_products_among_many():
    x = samples(300, columns=15)
    y = 5 + x[:, 3] + 2 * x[:, 4] * x[:, 9] + 0.1 * SeedTree(4).generator().standard_normal(300)
    sparse, dense = (
        replace(regression(estimator), columns=tuple("abcdefghijklmno")).fit(x[:240], y[:240])
        for estimator in (sparse_quadratic_regression, quadratic_regression)
    )
    weights = np.abs(sparse.estimator[-1].regressor_.coef_)
    products = sparse.estimator["polynomialfeatures"].get_feature_names_out()
    assert {products[at] for at in np.argsort(-weights)[:2]} == {"x3", "x4 x9"}
    assert (weights > 0).sum() < 0.3 * weights.size
    errors = [float(np.mean((found(x[240:]).values[:, 0] - y[240:]) ** 2)) for found in (sparse, dense)]
    assert errors[0] < 0.01 * np.var(y[240:]) and errors[0] < errors[1]


def test_a_correction_is_the_line_of_least_squares():
    x = samples(50)
    line = corrected(Exact(fail=(4,)), Exact(fail=(4,))(x), 3.0 - 2.0 * Exact()(x).values[:, 0])
    assert (line.offset, line.factor) == pytest.approx((3.0, -2.0))
    found = line(x)
    assert found.status[4] == 1 and found.good.sum() == 49
    assert (line.columns, line.outputs) == (COLUMNS, OUTPUTS)


@pytest.mark.slow
def test_contact_at_fewer_angles_passes_and_more_angles_miss_less(kernel, units):
    answers = answers_of(kernel, units, SeedTree(1))
    scores = [cross_validate(ContactCandidate(kernel=kernel, angles=angles), answers) for angles in (234, 936)]
    assert scores[1].q2 > 0.99 > scores[0].q2 > 0.9
    assert scores[1].rms_error < 1.0
    assert abs(scores[1].quantile_share) < 0.02
    # Angles of the kernel's own coarse turn can only miss an extreme; the line then adds what they miss on average.
    fitted = ContactCandidate(kernel=kernel, angles=936).fit(answers.x, answers.y)
    assert (fitted.response(answers.x).values[:, 0] <= answers.y + 1e-9).all()


@pytest.mark.slow
def test_contact_at_fewer_angles_holds_at_other_zones_than_it_was_fitted_at(kernel, errors, units):
    fitted = ContactCandidate(kernel=kernel, angles=936).fit(units, kernel(units).values[:, 0])
    smaller = seeded_units(errors, 100, 6, scale=0.5)
    error = fitted(smaller).values[:, 0] - kernel(smaller).values[:, 0]
    # On 1,024 units the mean error is 0.25″ and the deviation 0.41″: four standard errors of 100 units are 0.17″.
    assert abs(error.mean()) < 0.45
    assert np.sqrt((error**2).mean()) < 0.7


def test_a_failed_contact_stays_a_failed_sample(kernel, units):
    x = units[:8].copy()
    fitted = ContactCandidate(kernel=kernel, angles=234).fit(x, kernel(x).values[:, 0])
    x[3] = np.nan
    assert fitted(x).status[3] != 0
    assert fitted(x).good.tolist() == [row != 3 for row in range(8)]


@pytest.mark.slow
def test_the_regression_of_curves_follows_them_where_few_columns_vary(kernel, units):
    columns = ("disc1.bore1.position.x", "disc1.bore1.position.y", "pin.diameter")
    still = {name: 0.0 for name in kernel.columns if name not in columns}
    few = replace(kernel, columns=columns, fixed={**kernel.fixed, **still})
    x = units[:100, [kernel.columns.index(name) for name in columns]]
    y = few(x).values[:, 0]
    fitted = CurveCandidate(kernel=few, modes=6).fit(x[:80], y[:80])
    error = fitted(x[80:]).values[:, 0] - y[80:]
    assert 1 - (error**2).sum() / ((y[80:] - y[:80].mean()) ** 2).sum() > 0.8
    # A straight line through the columns, which knows no contact, does not get there.
    linear = np.column_stack([np.ones(100), x])
    weights = np.linalg.lstsq(linear[:80], y[:80], rcond=None)[0]
    assert ((linear[80:] @ weights - y[80:]) ** 2).sum() > 2 * (error**2).sum()


@pytest.mark.parametrize("units", [500, 12])
def test_a_quadratic_form_is_the_ridge_on_all_products_of_two(generator, units):
    """With more units than terms, and with fewer."""
    x = generator.standard_normal((units, 4)) * [1.0, 1e-6, 3.0, 0.0]
    y = np.stack([x[:, 0] - x[:, 1] * x[:, 2] * 1e6 + x[:, 0] ** 2, x[:, 2]], axis=1)
    form = fit_quadratic_form(x, y, 50.0)
    library = make_pipeline(StandardScaler(), PolynomialFeatures(2, include_bias=False), Ridge(50.0)).fit(x, y)
    np.testing.assert_allclose(form(x), library.predict(x), rtol=1e-9, atol=1e-9)
    assert np.abs(fit_quadratic_form(x, y, 1e-6)(x) - y).max() < 1e-4 < np.abs(form(x) - y).max()

"""How far a zone may open alone, against the closed form of a normal sum."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.stats import norm

from tests.builders import source
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.inverse import inverse_sensitivity

NAMES = ("a", "b", "c", "d")
DEVIATIONS = np.array([1.0, 0.7, 0.5, 0.01])
"""What each source gives to the output's standard deviation."""
TARGET = 0.99


def errors_with(group: str = "") -> ErrorModel:
    limits = {"minimum": 0.001, "maximum": 9.0, "group": group}
    sources = (source(name, zone=6.0 * own, **limits) for name, own in zip(NAMES, DEVIATIONS, strict=True))
    return ErrorModel(tuple(sources))


ERRORS = errors_with()


@dataclass(frozen=True)
class Sum:
    """10 and the sum of all columns; it fails where one column is beyond ``breaks``."""

    breaks: float = np.inf
    at_once: int = 10**9
    columns: tuple[str, ...] = NAMES
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        values = np.empty((x.shape[0], 1))
        for start in range(0, x.shape[0], self.at_once):
            rows = x[start : start + self.at_once]
            values[start : start + self.at_once, 0] = 10.0 + (((rows[:, 0] + rows[:, 1]) + rows[:, 2]) + rows[:, 3])
        return Evaluation(values=values, status=(np.abs(x).max(axis=1) > self.breaks).astype(np.uint8))


@dataclass(frozen=True)
class Counted(Sum):
    """The same, with the answers that it gave."""

    answers: list[Evaluation] = field(default_factory=list)

    def __call__(self, x: np.ndarray) -> Evaluation:
        self.answers.append(super().__call__(x))
        return self.answers[-1]


def true_factor(limit: float) -> np.ndarray:
    """Return the factor that makes the quantile of the normal sum equal to the limit, NaN if none does."""
    variance = ((limit - 10.0) / norm.ppf(TARGET)) ** 2
    square = 1 + (variance - (DEVIATIONS**2).sum()) / DEVIATIONS**2
    return np.sqrt(np.where(square >= 0, square, np.nan))


def found(limit: float, seed: int = 0, response: Sum | None = None, errors: ErrorModel = ERRORS, **more):
    return inverse_sensitivity(
        Experiment.of(response or Sum(), errors, SeedTree(seed)), limit=limit, target=TARGET, **more
    )


def test_a_zone_may_open_as_far_as_the_closed_form_says():
    """Within the 90 % interval widened to 4 standard errors, 4/1.645 of its halves."""
    counted = Counted()
    truth, result = true_factor(14.0), found(14.0, response=counted)
    assert result.meets
    np.testing.assert_array_equal(result.factor[3], np.inf)
    for at in range(3):
        below, above = result.factor[at] - result.low[at], result.high[at] - result.factor[at]
        assert result.factor[at] - below * 4 / 1.645 < truth[at] < result.factor[at] + above * 4 / 1.645
    np.testing.assert_allclose(result.zone[:3], result.factor[:3] * ERRORS.zones[:3])
    assert len(counted.answers) <= 10


def test_a_zone_that_repairs_the_design_alone_must_close_and_others_cannot():
    truth, result = true_factor(12.6), found(12.6, units=20000)
    assert not result.meets
    assert np.isnan(result.factor[3])
    assert np.isnan(truth[3])
    assert result.low[0] < truth[0] < result.high[0] < 1.0
    np.testing.assert_array_equal(np.isnan(result.low), np.isnan(result.factor))


def test_the_factor_puts_the_quantile_on_the_limit():
    result = found(14.0)
    uniform = np.concatenate(list(SeedTree(0).uniform_chunks(2048, 4)))
    for at in range(3):
        zones = ERRORS.zones.copy()
        zones[at] = result.zone[at]
        values = Sum()(ERRORS.deviations(ERRORS.standard_values(uniform), zones)).values[:, 0]
        assert abs(np.quantile(values, TARGET) - 14.0) <= 1e-3 * 14.0


@pytest.mark.slow
def test_intervals_cover():
    """90 % intervals of 150 samples cover 0.9 less 3 standard errors and 0.03 for the slope taken as constant."""
    truth, inside = true_factor(14.0)[:2], []
    for seed in range(150):
        result = found(14.0, seed)
        inside.append((result.low[:2] <= truth) & (truth <= result.high[:2]))
    assert np.mean(inside, axis=0).min() > 0.9 - 0.03 - 3 * np.sqrt(0.09 / 150)


def test_sources_of_a_group_open_one_at_a_time():
    np.testing.assert_array_equal(found(14.0, errors=errors_with("g")).factor, found(14.0).factor)


def test_same_bits_for_any_chunks():
    np.testing.assert_array_equal(found(14.0, response=Sum(at_once=37)).factor, found(14.0).factor)


def test_same_bits_however_many_trials_go_into_one_call(monkeypatch):
    counted = Counted(), Counted()
    together = found(14.0, response=counted[0])
    monkeypatch.setattr("tolalloc.sensitivity.inverse._ROWS_AT_ONCE", 3 * 2048)
    apart = found(14.0, response=counted[1])
    for name in ("factor", "low", "high"):
        np.testing.assert_array_equal(getattr(together, name), getattr(apart, name))
    assert len(counted[1].answers) > len(counted[0].answers)


def test_zones_that_the_worst_units_refute_are_those_that_all_units_refute(monkeypatch):
    for limit in (11.0, 12.0, 12.6, 13.0):
        quick = found(limit)
        monkeypatch.setattr("tolalloc.sensitivity.inverse._WORST", 1.0)
        thorough = found(limit)
        monkeypatch.undo()
        for name in ("factor", "low", "high", "meets"):
            np.testing.assert_array_equal(getattr(quick, name), getattr(thorough, name))


def test_no_call_takes_more_rows_than_are_held_at_once():
    @dataclass(frozen=True)
    class Watched(Sum):
        def __call__(self, x: np.ndarray) -> Evaluation:
            rows.append(x.shape[0])
            return super().__call__(x)

    rows: list[int] = []
    found(14.0, response=Watched(), units=50_001)
    assert max(rows) == 50_001  # one trial
    rows.clear()
    found(14.0, response=Watched(), units=6_000)
    assert max(rows) == 2 * 6_000 <= 2**14


def test_few_failed_samples_are_left_out_and_many_stop():
    few = Counted(breaks=6.5)
    assert np.isfinite(found(13.5, response=few).factor[0])
    assert not all(own.good.all() for own in few.answers)
    with pytest.raises(SolveError, match="a at"):
        found(14.0, response=Sum(breaks=3.0))


def test_a_jump_over_the_limit_is_refused():
    @dataclass(frozen=True)
    class Jump(Sum):
        def __call__(self, x: np.ndarray) -> Evaluation:
            spread = np.full((x.shape[0], 1), float(x[:, 0].std() > 1.7))
            return Evaluation(values=spread, status=np.zeros(x.shape[0], np.uint8))

    errors = ErrorModel(ERRORS.sources[:1])
    with pytest.raises(SolveError, match="jumps over the limit"):
        found(0.5, response=Jump(columns=("a",)), errors=errors)


def test_too_few_units_are_refused():
    with pytest.raises(InputError, match="500 or more"):
        found(14.0, units=400)

"""Contribution of sources to the waves of orders against closed forms, and how often the intervals hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tests.builders import sizes
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.models.model import Evaluation
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.ranking import Convergence, Step
from tolalloc.sensitivity.saltelli import saltelli_indices
from tolalloc.sensitivity.sobol import OrderContribution, SobolAnalysis, order_contribution, sobol_indices

NAMES = ("a", "b", "c", "d")
ORDERS = (1, 2, 39)
OUTPUTS = tuple(f"{wave} of order {order} [arcsec]" for order in ORDERS for wave in ("cosine", "sine"))
WAVES = {order: OUTPUTS[2 * at : 2 * at + 2] for at, order in enumerate(ORDERS)}
AMPLITUDES = np.array([[4.0, 2.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.5], [0.02, 0.03, 0.0, 0.03]])
"""Standard deviation of the wave that a source gives to an order [order, source]."""
PHASES = np.array([[0.3, 1.2, 2.0, 0.0], [0.0, 2.5, 0.1, 1.0], [0.7, 0.7, 0.0, 3.0]])
WEIGHTS = np.stack([AMPLITUDES * np.cos(PHASES), AMPLITUDES * np.sin(PHASES)], axis=1).reshape(-1, len(NAMES))
SHARES = AMPLITUDES**2 / (AMPLITUDES**2).sum(axis=1, keepdims=True)


def errors() -> ErrorModel:
    return sizes(NAMES, minimum=1.0, maximum=10.0)


@dataclass(frozen=True)
class Waves:
    """Every source adds a wave of fixed phase and random height to every order."""

    weights: np.ndarray
    columns: tuple[str, ...] = NAMES
    outputs: tuple[str, ...] = OUTPUTS

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=x @ self.weights.T, status=np.zeros(len(x), np.uint8))


def analysed(response: Waves, blocks: int = 1024, seed: int = 3) -> SobolAnalysis:
    model = errors()
    return sobol_indices(Experiment.of(response, model, SeedTree(seed)), SobolEffort(start=blocks, limit=blocks))


def within(found: OrderContribution, truth: np.ndarray, standard_errors: float) -> None:
    for values, resamples in ((found.first, found.first_resamples), (found.total, found.total_resamples)):
        assert (np.abs(values - truth) <= standard_errors * resamples.std(axis=1) + 1e-12).all()


def test_shares_and_deviations_of_random_waves_are_those_of_the_closed_form():
    found = order_contribution(analysed(Waves(WEIGHTS)), WAVES)
    assert (found.orders, found.sources) == (ORDERS, NAMES)
    within(found, SHARES, 4)
    np.testing.assert_allclose(found.deviation, np.sqrt((AMPLITUDES**2).sum(axis=1)), rtol=0.03)
    assert found.total_interval.shape == (3, 2, 4)
    assert (found.first_interval[:, 0] <= np.maximum(found.first, 0.0)).all()


def test_shares_do_not_depend_on_where_the_turn_begins():
    """The indices of cosine and sine alone do, which is why nobody should read them."""
    turned = WEIGHTS.reshape(3, 2, -1)
    angle = np.array(ORDERS)[:, np.newaxis] * 0.4
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [cosine * turned[:, 0] + sine * turned[:, 1], cosine * turned[:, 1] - sine * turned[:, 0]], axis=1
    )
    one, two = analysed(Waves(WEIGHTS)), analysed(Waves(turned.reshape(6, -1)))
    assert np.abs(one.of(0).total - two.of(0).total).max() > 0.05
    one, two = order_contribution(one, WAVES), order_contribution(two, WAVES)
    np.testing.assert_allclose(one.total, two.total, rtol=0, atol=1e-10)
    np.testing.assert_allclose(one.first, two.first, rtol=0, atol=1e-10)
    np.testing.assert_allclose(one.total_resamples, two.total_resamples, rtol=0, atol=1e-10)
    np.testing.assert_allclose(one.deviation, two.deviation)


@dataclass(frozen=True)
class Random(Waves):
    """The phase is random too: a gives height and b turns the wave, so neither varies it without the other."""

    def __call__(self, x: np.ndarray) -> Evaluation:
        phase = 100 * x[:, 1]
        values = np.zeros((len(x), 6))
        values[:, 0], values[:, 1] = (1 + x[:, 0]) * np.cos(phase), (1 + x[:, 0]) * np.sin(phase)
        return Evaluation(values=values, status=np.zeros(len(x), np.uint8))


def test_a_source_that_acts_through_another_has_a_total_share_alone():
    """Height 1 + a of variance 1, any phase b: E|w|² = 2; a alone gives nothing, b alone 1/2, a takes part in 1/2."""
    found = order_contribution(analysed(Random(WEIGHTS), 4096), {1: WAVES[1]})
    for values, resamples, truth in (
        (found.first, found.first_resamples, [0.0, 0.5, 0.0, 0.0]),
        (found.total, found.total_resamples, [0.5, 1.0, 0.0, 0.0]),
    ):
        assert (np.abs(values[0] - truth) <= 4 * resamples[0].std(axis=0) + 1e-12).all()


def test_a_part_that_does_not_vary_has_no_weight_and_a_still_wave_no_share():
    weights = WEIGHTS.copy()
    weights[1] = weights[2:4] = 0.0
    analysis = analysed(Waves(weights))
    found = order_contribution(analysis, WAVES)
    np.testing.assert_allclose(found.total[0], analysis.of(0).total, rtol=1e-12)
    np.testing.assert_allclose(found.first_resamples[0], analysis.of(0).first_resamples, rtol=1e-9, atol=1e-15)
    assert np.isnan(found.total[1]).all()
    assert np.isnan(found.first_resamples[1]).all()
    assert found.deviation[1] == 0.0
    assert np.isfinite(found.total[2]).all()


def test_waves_that_do_not_exist_are_refused():
    analysis = analysed(Waves(WEIGHTS), 64)
    with pytest.raises(UnknownNameError, match="cosine of order 3"):
        order_contribution(analysis, {3: ("cosine of order 3 [arcsec]", OUTPUTS[0])})
    with pytest.raises(InputError, match="no order"):
        order_contribution(analysis, {})


def independent_blocks(weights: np.ndarray, blocks: int, seed: int) -> SobolAnalysis:
    """Return the analysis of random blocks, which are independent as bootstrap intervals assume."""
    sources = weights.shape[1]
    a, b = SeedTree(seed).child("samples").generator().normal(size=(2, blocks, sources))
    between = [np.where(np.arange(sources) == source, b, a) for source in range(sources)]
    evaluation = Waves(weights)(np.stack([a, *between, b], axis=1).reshape(-1, sources))
    return SobolAnalysis(
        outputs=OUTPUTS,
        ranked=OUTPUTS,
        followed=OUTPUTS,
        sources=NAMES[:sources],
        indices=saltelli_indices(evaluation, sources, SeedTree(seed).child("resamples"), resamples=200),
        convergence=Convergence(history=(Step(blocks=blocks, first=(0,), probability=1.0),), probability=0.9),
        samples=evaluation.status.size,
        first_blocks=blocks,
    )


@pytest.mark.slow
def test_90_percent_intervals_hold_the_closed_form_as_often_as_they_say():
    """Four standard errors of a share of 90 % over 200 repetitions are 8.5 %."""
    held, amplitudes = [], AMPLITUDES[:, :3]
    truth = amplitudes**2 / (amplitudes**2).sum(axis=1, keepdims=True)
    for seed in range(200):
        found = order_contribution(independent_blocks(WEIGHTS[:, :3], 128, seed), WAVES)
        intervals = (found.first_interval, found.total_interval)
        held.append([(own[:, 0] <= truth) & (truth <= own[:, 1]) for own in intervals])
    shares = np.mean(held, axis=0)[:, truth > 0]
    assert shares.min() >= 0.815
    assert shares.max() <= 0.985


def test_seed_zero_is_a_seed_like_every_other():
    one, two = (order_contribution(analysed(Waves(WEIGHTS), 64, 0), WAVES) for _ in range(2))
    np.testing.assert_array_equal(one.total_resamples, two.total_resamples)
    assert (one.total != order_contribution(analysed(Waves(WEIGHTS), 64, 1), WAVES).total).any()

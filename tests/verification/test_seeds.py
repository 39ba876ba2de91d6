"""Sampling designs: the same bits in any order of chunks, and what each design promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import kstest, qmc

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.monte_carlo import monte_carlo
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import CHUNK, SamplingDesign, SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Evaluation

COLUMNS = 3
LATIN, SOBOL = SamplingDesign.LATIN_HYPERCUBE, SamplingDesign.SOBOL


def chunks(design: SamplingDesign, seed: int, samples: int, columns: int = COLUMNS) -> np.ndarray:
    return np.concatenate(list(SeedTree(seed).child("units").uniform_chunks(samples, columns, design)))


@pytest.mark.parametrize("design", SamplingDesign)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_chunk_has_the_same_bits_in_any_order_and_for_any_number_of_samples(design, seed):
    whole = chunks(design, seed, 3 * CHUNK + 7)
    seeds = SeedTree(seed).child("units")
    backwards = [seeds.uniform_chunk(index, COLUMNS, design) for index in (3, 2, 1, 0)][::-1]
    np.testing.assert_array_equal(whole, np.concatenate(backwards)[: whole.shape[0]])
    np.testing.assert_array_equal(whole[: CHUNK + 9], chunks(design, seed, CHUNK + 9))
    assert 0 < whole.min() < whole.max() < 1
    assert not np.array_equal(whole, chunks(design, seed + 1, whole.shape[0]))
    for column in whole.T:
        assert kstest(column, "uniform").pvalue > 1e-4


def test_monte_carlo_is_the_seed_trees_own_numbers():
    own = list(SeedTree(0).child("units").uniform_chunks(CHUNK + 9, COLUMNS))
    np.testing.assert_array_equal(chunks(SamplingDesign.MONTE_CARLO, 0, CHUNK + 9), np.concatenate(own))


def test_every_chunk_of_a_latin_hypercube_has_one_sample_in_every_stratum():
    for chunk in np.split(chunks(LATIN, 0, 3 * CHUNK), 3):
        strata = np.sort((chunk * CHUNK).astype(int), axis=0)
        np.testing.assert_array_equal(strata, np.tile(np.arange(CHUNK)[:, np.newaxis], COLUMNS))
        # Columns are permuted on their own: four standard errors of a rank correlation.
        assert np.abs(np.corrcoef(chunk.T) - np.eye(COLUMNS)).max() < 4 / np.sqrt(CHUNK - 1)


def test_chunks_of_sobol_are_one_scrambled_sequence():
    generator = SeedTree(0).child("units").generator()
    whole = qmc.Sobol(COLUMNS, bits=32, rng=generator).random(4 * CHUNK)
    np.testing.assert_allclose(chunks(SOBOL, 0, 4 * CHUNK), whole, rtol=0, atol=2.0**-32)
    strata = np.sort((chunks(SOBOL, 0, 4 * CHUNK) * 4 * CHUNK).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(4 * CHUNK)[:, np.newaxis], COLUMNS))


def answer(uniform: np.ndarray) -> np.ndarray:
    """Return a function with an additive part, whose mean is 2, and a product, whose mean is 0."""
    normal = ndtri(uniform)
    return (normal[:, :2] ** 2).sum(axis=1) + 0.3 * normal[:, 1] * normal[:, 2]


@pytest.mark.parametrize("design", SamplingDesign)
def test_means_converge_within_their_standard_error(design):
    """Independent nodes of the seed tree give the standard error of every design; four of them."""
    means = np.array([answer(chunks(design, seed, 2 * CHUNK)).mean() for seed in range(60)])
    error = means.std(ddof=1) / np.sqrt(means.size)
    assert abs(means.mean() - 2.0) < 4 * error
    variance = 4.0 + 0.3**2
    spread = means.std(ddof=1) / np.sqrt(variance / (2 * CHUNK))
    # Independent samples have spread 1 within four standard errors of a deviation; the Latin hypercube is left with
    # the product's 0.09 of 4.09, and Sobol' with less.
    if design is SamplingDesign.MONTE_CARLO:
        assert abs(spread - 1) < 4 / np.sqrt(2 * 59)
    else:
        assert spread < 0.35


@pytest.mark.slow
def test_the_spread_of_latin_hypercube_chunks_gives_an_honest_standard_error():
    """Each chunk's mean is independent of the others: 16 of them cover the mean as Student's t says."""
    means = answer(chunks(LATIN, 3, 16 * 200 * CHUNK)).reshape(200, 16, CHUNK).mean(axis=2)
    t = (means.mean(axis=1) - 2.0) / (means.std(axis=1, ddof=1) / 4)
    covered = (np.abs(t) < 1.753).mean()  # 90 % for 15 degrees of freedom
    assert abs(covered - 0.9) < 4 * np.sqrt(0.9 * 0.1 / 200)


@dataclass(frozen=True)
class First:
    columns: tuple[str, ...] = ("a", "b")
    outputs: tuple[str, ...] = ("y [-]",)

    def __call__(self, x: np.ndarray) -> Evaluation:
        return Evaluation(values=x[:, :1], status=np.zeros(x.shape[0], np.uint8))


@pytest.mark.parametrize("design", SamplingDesign)
def test_monte_carlo_takes_every_design(design):
    part = {"part": "part", "feature": Feature.SIZE, "zone": 6.0, "minimum": 1.0, "maximum": 9.0, "cost": 1.0}
    errors = ErrorModel((Source(name="a", **part), Source(name="b", **part)))
    seeds = SeedTree(0)
    sample = monte_carlo(Experiment.of(First(), errors, seeds), 2 * CHUNK + 5, design)
    uniform = np.concatenate(list(seeds.uniform_chunks(2 * CHUNK + 5, 2, design)))
    np.testing.assert_array_equal(sample.x, errors.deviations(errors.standard_values(uniform), errors.zones))
    np.testing.assert_array_equal(sample.values, sample.x[:, 0])

"""What a Sobol analysis gives to SALib: its own analysis of it has the printed indices, and its plots work on it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from SALib.analyze import delta, pawn, sobol
from SALib.plotting.bar import plot as bar_plot

from tests.builders import sizes
from tests.verification.test_sobol_growth import CORRELATED, Linear
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.seeds import SeedTree
from tolalloc.sensitivity.effort import SobolEffort
from tolalloc.sensitivity.sobol import sobol_indices

WEIGHTS = np.array([[3.0, 1.0, 2.0], [0.0, 1.0, 2.0]])


def analysed(correlation=None, *, second_order: bool = False, broken: tuple[int, ...] = ()):
    errors = sizes("abc", correlation)
    response = Linear(WEIGHTS, errors.columns, broken)
    effort = SobolEffort(start=64, limit=64, second_order=second_order)
    return sobol_indices(Experiment.of(response, errors, SeedTree(5), 0.1), effort)


@pytest.mark.parametrize("second_order", [False, True])
@pytest.mark.parametrize("correlation", [None, CORRELATED])
@pytest.mark.parametrize("broken", [(), (11,)])
def test_salibs_analysis_of_the_arrays_gives_the_printed_indices(second_order, correlation, broken):
    found = analysed(correlation, second_order=second_order, broken=broken)
    own, given = found.of(0), found.to_salib()
    theirs = sobol.analyze(**given.for_sobol, num_resamples=100, seed=1)
    np.testing.assert_array_equal(theirs["S1"], own.first)
    np.testing.assert_array_equal(theirs["ST"], own.total)
    if second_order:
        np.testing.assert_array_equal([theirs["S2"][pair] for pair in own.pairs], own.second)
    assert given.samples.shape == (given.outputs.size, 3)
    assert found.dropped == len(broken)
    assert list(theirs.to_df()[0].index) == list(own.sources)


def test_salibs_plot_of_the_arrays_has_a_bar_per_source():
    found = analysed()
    total = sobol.analyze(**found.to_salib().for_sobol, seed=1).to_df()[0]
    axes = bar_plot(total)
    assert [text.get_text() for text in axes.get_xticklabels()] == ["a", "b", "c"]
    np.testing.assert_allclose([bar.get_height() for bar in axes.containers[-1]], found.of(0).total)
    plt.close(axes.figure)


@pytest.mark.slow
def test_the_samples_feed_salibs_measures_of_given_data():
    given = analysed().to_salib()
    for measure in (pawn, delta):
        found = measure.analyze(given.problem, given.samples, given.outputs, seed=1)
        assert len(next(iter(found.values()))) == 3
    np.testing.assert_array_less(0.0, pawn.analyze(given.problem, given.samples, given.outputs, seed=1)["median"])

"""OpenTURNS as the oracle of rare failures: its own distributions, transformations and samplers beside ours.

Nothing is shared but the formula of the limit state: OpenTURNS draws its inputs from its own marginals, where ours come
from standard normal numbers. Two independent estimates of one probability differ by no more than three standard errors
of their difference.
"""

from __future__ import annotations

from functools import reduce
from operator import add

import numpy as np
import pytest

from tests.builders import Sum, source
from tests.first_order import design_point
from tests.reliability import FOUR_BRANCHES, MARGINS, PROBLEMS, problem
from tolalloc.capability.experiment import Experiment
from tolalloc.capability.limit_state import RareFailure, ResponseLimit
from tolalloc.capability.rare_failure import scaled_sigma_sampling, subset_simulation
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.zones import Distribution

ot = pytest.importorskip("openturns", reason="OpenTURNS, the oracle of rare failures, is not installed.")
pytestmark = pytest.mark.slow

STACK = "stack of five sizes"
ZONES = {"first": 4.0, "second": 3.0, "third": 2.0, "fourth": 3.0, "fifth": 1.0}
"""Size → width of its zone; the first three are uniform over it, the others normal with six σ in it."""
UNIFORM = ("first", "second", "third")
LIMIT = 5.0
"""Largest sum of the deviations of the stack, exceeded by one in ten thousand."""
ONE_POINT = ("RP8", "RP14")
SAMPLES = 10_000
"""Samples of a level, ours and theirs."""


def stack() -> ResponseLimit:
    """Return the limit of a chain of sizes as a drawing states them."""
    forms = {name: Distribution.UNIFORM if name in UNIFORM else Distribution.NORMAL for name in ZONES}
    errors = ErrorModel(tuple(source(name, zone=zone, distribution=forms[name]) for name, zone in ZONES.items()))
    return ResponseLimit(experiment=Experiment.of(Sum(errors.columns), errors, SeedTree(1)), limit=LIMIT)


def theirs(kind, first, second):
    """Return the marginal of an input in their words."""
    if kind == "normal":
        return ot.Normal(first, second)
    if kind == "uniform":
        return ot.Uniform(first, second)
    parameters = ot.LogNormalMuSigma(first, second) if "lognormal" in kind else ot.GumbelMuSigma(first, second)
    return ot.ParametrizedDistribution(parameters)


def marginals(name):
    """Return the marginals of a problem."""
    if name == STACK:
        return [ot.Uniform(-z / 2, z / 2) if own in UNIFORM else ot.Normal(0.0, z / 6) for own, z in ZONES.items()]
    return [theirs(kind, float(first), float(second)) for _, kind, first, second in PROBLEMS[name]["inputs"]]


def event(name):
    """Return the failure of a problem as an event of theirs."""
    margin = (lambda x: LIMIT - x.sum(axis=1)) if name == STACK else MARGINS[name]
    inputs = marginals(name)
    function = ot.PythonFunction(len(inputs), 1, func_sample=lambda x: margin(np.asarray(x))[:, np.newaxis])
    output = ot.CompositeRandomVector(function, ot.RandomVector(ot.JointDistribution(inputs)))
    return ot.ThresholdEvent(output, ot.Less(), 0.0)


def first_order(name):
    """Return what their search for the design point finds, from the mean of the inputs."""
    search = ot.AbdoRackwitz()
    search.setStartingPoint(ot.JointDistribution(marginals(name)).getMean())
    found = ot.FORM(search, event(name))
    found.run()
    return found.getResult()


def simulated(algorithm, block):
    """Return probability and standard error of a simulation of theirs."""
    ot.RandomGenerator.SetSeed(1)
    algorithm.setMaximumOuterSampling(SAMPLES // block)
    algorithm.setBlockSize(block)
    if isinstance(algorithm, ot.PostAnalyticalImportanceSampling):
        algorithm.setMaximumCoefficientOfVariation(0.0)  # it would stop at a tenth
    algorithm.run()
    return algorithm.getResult().getProbabilityEstimate(), algorithm.getResult().getStandardDeviation()


def ours(name):
    """Return the limit state of a problem as this package takes it."""
    return stack() if name == STACK else problem(name)


def require_same(found: RareFailure, probability: float, error: float) -> None:
    """Require two estimates within three standard errors of their difference, and that neither is a guess."""
    assert not found.cautions
    assert 0 < found.coefficient_of_variation < 0.12
    assert 0 <= error / probability < 0.12
    assert abs(found.probability - probability) <= 3 * np.hypot(found.standard_error, error)


@pytest.mark.parametrize("name", [*ONE_POINT, FOUR_BRANCHES, STACK])
@pytest.mark.parametrize("method", [subset_simulation, scaled_sigma_sampling])
def test_subset_sampling_finds_the_same_probability(method, name):
    found = method(ours(name), SeedTree(7).child(name), samples=SAMPLES // 2, runs=2)
    require_same(found, *simulated(ot.SubsetSampling(event(name)), block=100))


@pytest.mark.parametrize("name", ONE_POINT)
def test_importance_sampling_at_their_design_point_finds_the_same_probability(name):
    result = first_order(name)
    assert design_point(problem(name)).beta == pytest.approx(result.getHasoferReliabilityIndex(), rel=1e-3)
    found = subset_simulation(ours(name), SeedTree(11).child(name), samples=SAMPLES, runs=2)
    require_same(found, *simulated(ot.PostAnalyticalImportanceSampling(result), block=100))


def test_the_law_of_a_stack_is_theirs():
    """Their law of a sum of independent sizes has no sampling error: ours must lie within three of its own."""
    exact = reduce(add, marginals(STACK)).computeComplementaryCDF(LIMIT)
    assert exact == pytest.approx(1.053e-4, rel=1e-3)
    found = subset_simulation(stack(), SeedTree(13), samples=SAMPLES, runs=2)
    require_same(found, exact, 0.0)

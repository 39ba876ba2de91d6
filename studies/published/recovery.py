"""Would this bench find the truth? Measured again and again with fresh noise, and fitted each time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.capability.monte_carlo import Yield, proportion
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.wings.bench.information import information
from tolalloc.wings.bench.least_squares import IdentificationProblem, gauss_newton
from tolalloc.wings.bench.parameters import Parameter
from tolalloc.wings.bench.prediction import KernelPredictor, data_of

from .simulated_bench import SimulatedBench


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """Fits to repeated measurements.

    Parameters
    ----------
    error
        Found less true coordinate of every repetition [-].
    standard_error
        What each fit said of its own error [-].
    covered
        Whether each fit's 95 % interval held the truth, 0 or 1 [-].
    """

    error: Float[np.ndarray, "repetition parameter"]
    standard_error: Float[np.ndarray, "repetition parameter"]
    covered: Int[np.ndarray, "repetition parameter"]

    @property
    def recovered(self) -> int:
        """Repetitions in which all parameters are within three standard errors of the truth [-]."""
        return int((np.abs(self.error) <= 3.0 * self.standard_error).all(axis=1).sum())

    @property
    def coverage(self) -> tuple[Yield, ...]:
        """Share of the intervals that hold the truth, with its own interval, parameter by parameter."""
        repetitions = self.error.shape[0]
        return tuple(proportion(repetitions, repetitions - int(count)) for count in self.covered.sum(axis=0))


def recovery(
    reducer: Reducer,
    parameters: tuple[Parameter, ...],
    truth: Float[np.ndarray, " parameter"],
    bench: SimulatedBench,
    repetitions: int,
    seeds: SeedTree,
    observe: Callable[[int], None] = lambda _: None,
) -> Recovery:
    """Return the fits to a bench's readings with fresh noise each time, on the model itself.

    Parameters
    ----------
    reducer
        Where each fit begins.
    parameters
        The unknowns.
    truth
        Coordinates of the truth [-].
    bench
        Readings of the true stiffness, without noise.
    repetitions
        How often they are measured [-].
    seeds
        Node of the seed tree.
    observe
        Told of the units answered for.
    """
    error, standard_error, covered = [], [], []
    for number in range(repetitions):
        measured = bench.measured(seeds.child(str(number)))
        data = data_of(measured, "simulated units")
        problem = IdentificationProblem(
            parameters=parameters,
            data=data,
            predictor=KernelPredictor(reducer, parameters, measured, data, observe),
            weight=np.ones(len(measured.units)),
        )
        found = gauss_newton(problem, problem.start[np.newaxis]).coordinates
        own = information(problem, problem.predictor(found), found)
        error.append(found - truth)
        standard_error.append(own.standard_errors)
        low, high = own.interval
        covered.append((low <= truth) & (truth <= high))
    return Recovery(error=np.array(error), standard_error=np.array(standard_error), covered=np.array(covered, np.int64))

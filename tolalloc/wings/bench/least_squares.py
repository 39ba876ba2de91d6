"""The weighted least squares that identification minimises, and Gauss–Newton, which minimises them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError, SolveError
from tolalloc.wings.bench.parameters import Parameter, box, prior_weights
from tolalloc.wings.bench.prediction import AllReadings, Prediction, Predictor

_STEPS = 40


@dataclass(frozen=True, kw_only=True)
class IdentificationProblem:
    """Half the sum of squares of all residuals over their noise, and of the coordinates over their prior deviation.

    liu2020, equations (15)–(16), with weights. Theory page, equation (38) [-], for noise that is independent from
    reading to reading.
    """

    parameters: tuple[Parameter, ...]  # The unknowns
    data: AllReadings  # The readings
    predictor: Predictor  # What says what should have been read
    # How often each unit counts: 1, 0 for one that is left out, more in a bootstrap sample [-]
    weight: Float[np.ndarray, " unit"]
    # Whether the bounds count as knowledge: an even distribution between them, by its mean and variance
    evenly: bool = False
    place: str = "identify"  # Where the data were read, for errors
    _root: Float[np.ndarray, " datum"] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        # The square root of every reading's weight over its noise is asked for thousands of times.
        root = np.sqrt(self.weight[self.data.unit]) / self.data.noise
        object.__setattr__(self, "_root", root)

    @property
    def lower(self) -> Float[np.ndarray, " parameter"]:
        """Lower bounds of the coordinates [-]."""
        return box(self.parameters)[0]

    @property
    def upper(self) -> Float[np.ndarray, " parameter"]:
        """Upper bounds of the coordinates [-]."""
        return box(self.parameters)[1]

    @property
    def start(self) -> Float[np.ndarray, " parameter"]:
        """Coordinates of the reducer as it was given: all zero."""
        return np.zeros(len(self.parameters))

    @property
    def readings(self) -> int:
        """Readings that count, less one for every mean removed [-]."""
        removed = sum(
            block.centred and bool(self.weight[self.data.unit[block.rows.start]]) for block in self.data.blocks
        )
        return int(np.count_nonzero(self.weight[self.data.unit])) - removed

    def residuals(
        self, prediction: Prediction, coordinates: Float[np.ndarray, " parameter"]
    ) -> Float[np.ndarray, " row"]:
        """Return all residuals over their noise, then the coordinates over their prior deviation [-]."""
        own = (prediction.values - self.data.measured) * self._root
        if not np.isfinite(own).all():
            unit = int(self.data.unit[np.flatnonzero(~np.isfinite(own))[0]]) + 1
            values = ", ".join(
                f"{item.name} = {item.value(float(at)):.4g}"
                for item, at in zip(self.parameters, coordinates, strict=True)
            )
            raise SolveError(
                f"{self.place}: unit {unit} in the order of the file has no equilibrium at {values}; leave it out, or "
                "narrow the bounds."
            )
        known = [coordinates * prior_weights(self.parameters)]
        if self.evenly:
            known.append((coordinates - 0.5 * (self.lower + self.upper)) * self._pull)
        return np.concatenate([own, *known])

    @property
    def _pull(self) -> Float[np.ndarray, " parameter"]:
        """One over the standard deviation of an even distribution between the bounds [-]."""
        return np.asarray(np.sqrt(12.0) / (self.upper - self.lower))

    def jacobian(self, prediction: Prediction) -> Float[np.ndarray, "row parameter"]:
        """Return the derivatives of the residuals by the coordinates [-]."""
        own = prediction.by_coordinate * self._root[:, np.newaxis]
        known = [np.diag(prior_weights(self.parameters)), *([np.diag(self._pull)] if self.evenly else [])]
        return np.concatenate([own, *known])

    def objectives(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, " point"]:
        """Return the objective at many points [-]."""
        own = (self.predictor.values(coordinates) - self.data.measured) * self._root
        known = coordinates * prior_weights(self.parameters)
        return np.asarray(0.5 * ((own**2).sum(axis=1) + (known**2).sum(axis=1)))

    @property
    def freedom(self) -> int:
        """Readings less parameters, at least 1 [-]."""
        return max(self.readings - len(self.parameters), 1)

    def widened(self, variance_factor: float) -> IdentificationProblem:
        """Return the problem with the variance of the noise times a factor."""
        noise = self.data.noise * np.sqrt(variance_factor)
        return replace(self, data=replace(self.data, noise=noise))

    def of(self, parameters: Sequence[Parameter], predictor: Predictor) -> IdentificationProblem:
        """Return the same data asked for other parameters."""
        return replace(self, parameters=tuple(parameters), predictor=predictor)


def require_enough(problem: IdentificationProblem) -> None:
    """Refuse data that cannot fix so many parameters whatever they read."""
    asked, units = len(problem.parameters), problem.data.units.size
    names = ", ".join(item.symbol for item in problem.parameters)
    if problem.data.only_peak_to_peak and units <= asked:
        raise InputError(
            f"{problem.place}: peak-to-peaks of {units} units cannot fix {asked} parameters ({names}); allowed is one "
            "parameter fewer than units, or measured curves and loops."
        )
    if problem.readings <= asked:
        raise InputError(f"{problem.place}: {problem.readings} readings cannot fix {asked} parameters ({names}).")


NAME = "Gauss–Newton"

Batch = tuple[Float[np.ndarray, "point parameter"], Float[np.ndarray, " point"]]
"""Points that were tried together, and the objective at each [-]."""


@dataclass(frozen=True, kw_only=True)
class Identified:
    """Answer of one run of one method, and how it got there."""

    method: str  # Name of the method
    coordinates: Float[np.ndarray, " parameter"]  # Where the least objective was found [-]
    objective: float  # Half the weighted sum of squares there [-]
    evaluated: Int[np.ndarray, " batch"]  # How often all readings were predicted up to the end of each batch [-]
    least: Float[np.ndarray, " batch"]  # Least objective until then [-]
    status: str  # Why it ended

    @classmethod
    def among(cls, batches: Sequence[Batch], method: str, status: str) -> Identified:
        """Return the best of all points that a method tried."""
        coordinates, objective, least = np.zeros(batches[0][0].shape[1]), np.inf, []
        for points, objectives in batches:
            at = int(objectives.argmin())
            if objectives[at] < objective:
                coordinates, objective = points[at], float(objectives[at])
            least.append(objective)
        return cls(
            method=method,
            coordinates=coordinates,
            objective=objective,
            evaluated=np.cumsum([objectives.size for _, objectives in batches]),
            least=np.array(least),
            status=status,
        )

    @property
    def evaluations(self) -> int:
        """How often all readings were predicted [-]."""
        return int(self.evaluated[-1])

    def after(self, before: Identified) -> Identified:
        """Return the answer with the way of the run that it started from."""
        return replace(
            self,
            evaluated=np.concatenate([before.evaluated, before.evaluated[-1] + self.evaluated]),
            least=np.concatenate([before.least, self.least]),
        )


def starts(problem: IdentificationProblem, count: int, seeds: SeedTree) -> Float[np.ndarray, "start parameter"]:
    """Return the reducer as it was given, then random points inside the bounds, in all so many."""
    scattered = seeds.generator().random((count - 1, len(problem.parameters)))
    return np.concatenate([problem.start[np.newaxis], problem.lower + scattered * (problem.upper - problem.lower)])


def gauss_newton(problem: IdentificationProblem, start: Float[np.ndarray, "start parameter"]) -> Identified:
    """Return the least objective that any start, a row each, leads to.

    References
    ----------
    Branch, Coleman and Li 1999, the trust region with bounds that SciPy implements.
    """
    batches: list[Batch] = []
    status, least = "", np.inf
    for row in start:
        begun = len(batches)
        converged = _descend(problem, row, batches)
        reached = min(float(objectives[0]) for _, objectives in batches[begun:])
        if reached < least:
            least, status = reached, "converged" if converged else f"stopped after {_STEPS} steps"
    return Identified.among(batches, NAME, status)


def _descend(problem: IdentificationProblem, start: Float[np.ndarray, " parameter"], batches: list[Batch]) -> bool:
    """Add the points that one start leads to, and return whether they converged."""
    predicted = _remembered(problem, batches)
    inside = 1e-6 * (problem.upper - problem.lower)  # the method walks in the interior
    found = least_squares(
        lambda at: problem.residuals(predicted(at), at),
        np.clip(start, problem.lower + inside, problem.upper - inside),
        jac=lambda at: problem.jacobian(predicted(at)),
        bounds=(problem.lower, problem.upper),
        x_scale=problem.upper - problem.lower,
        ftol=1e-8,
        xtol=1e-6,
        gtol=1e-8,
        max_nfev=_STEPS,
    )
    return bool(found.status > 0)


def _remembered(
    problem: IdentificationProblem, batches: list[Batch]
) -> Callable[[Float[np.ndarray, " parameter"]], Prediction]:
    """Return the predictor with its last answer kept: the solver asks for residuals and derivatives at one point."""
    last: list[Prediction] = []

    def predicted(coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        if not last or not np.array_equal(coordinates, batches[-1][0][0]):
            last[:] = [problem.predictor(coordinates)]
            own = problem.residuals(last[0], coordinates)
            batches.append((coordinates[np.newaxis].copy(), np.array([0.5 * own @ own])))
        return last[0]

    return predicted

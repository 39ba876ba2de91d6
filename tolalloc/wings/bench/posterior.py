"""Errors of the parts that have a measured curve: the best explanation, and units drawn around it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_triangular
from scipy.optimize import brentq
from scipy.stats import chi2

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source, limited_measure
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.model import Equilibria
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.running.chunks import map_chunks
from tolalloc.wings.bench.measurements import MeasuredCurve
from tolalloc.wings.bench.readings import TURN

FEWEST_READINGS = 24
"""Fewest readings that a diagnosis starts from [-]."""

_STEP = 1e-4
"""Step of the standard normal numbers in the derivative of the deviations, which are smooth in them [-]."""

_CORRELATION = 0.4
"""A step ends when the particles' correlation with where they stood before has fallen this far [-]."""

_ACCEPTED = 0.25
"""Share of moves that the length of a move is adapted to [-]."""

_INFLATION = 1.3
"""Covariance of the moves over that of the particles, so that the tails are reached [-]."""

_DAMPINGS = 10.0 ** np.arange(-2, 3)
"""Dampings tried in each step, over the one that did best before [-]."""

_WIDER = 3.0
"""Weight of the readings in one neighbourhood over that in the next wider one [-]."""

_VAIN = 3
"""Searches in vain, each in a wider neighbourhood, that end an attempt [-]."""

_ENOUGH, _LEAST = 0.05, 0.001
"""Plausibility with which an attempt ends once nothing better was found nearby, and with which the attempts end [-]."""

_SAME_DEPTH = 2.0
"""Objectives this close belong to one neighbourhood, whose kinks leave many small minima [-]."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What separates a reading from the model."""

    reading: float = 0.5 * ARCSECOND  # Standard deviation of one reading, independent of all others [rad]
    discrepancy: float = 0.5 * ARCSECOND  # Standard deviation of what the model leaves out [rad]
    # Angle over which what is left out stays alike: its correlation falls as exp(−½(Δ/angle)²) [rad]
    correlation_angle: float = 1.5 * DEGREE

    def left_out(self, carrier_angle: Float[np.ndarray, " angle"]) -> Float[np.ndarray, "angle angle"]:
        """Return the covariance of what the model leaves out at angles of one turn [rad²]."""
        apart = np.abs(carrier_angle[:, np.newaxis] - carrier_angle) % TURN
        apart = np.minimum(apart, TURN - apart)
        return np.asarray(self.discrepancy**2 * np.exp(-0.5 * (apart / self.correlation_angle) ** 2))


@dataclass(frozen=True, kw_only=True)
class ThinnedCurve:
    """Readings of one curve that a diagnosis starts from."""

    carrier_angle: Float[np.ndarray, " angle"]  # Their angles [rad]
    values: Float[np.ndarray, " angle"]  # Transmission error [rad]
    covariance: Float[np.ndarray, "angle angle"]  # Of their noise and of what the model leaves out [rad²]

    @property
    def freedom(self) -> int:
        """Independent numbers that they hold; no bench knows their mean [-]."""
        return self.values.size - 1

    @cached_property
    def whitening(self) -> Float[np.ndarray, "angle angle"]:
        """What makes residuals independent with variance 1 and takes out a common offset of the readings [1/rad]."""
        whitened = np.linalg.inv(np.linalg.cholesky(self.covariance))
        offset = whitened.sum(axis=1, keepdims=True) / np.linalg.norm(whitened.sum(axis=1))
        return np.asarray(whitened - offset @ (offset.T @ whitened))


def thinned(curve: MeasuredCurve, noise: Noise, most: int) -> ThinnedCurve:
    """Return those readings of a measured curve that stand nearest to equally spaced angles.

    There are ``most`` such angles in a turn; closer readings share what the model leaves out and tell little more.
    """
    step = TURN / most
    place = np.mod(curve.carrier_angle, TURN) / step
    nearest = np.rint(place)
    order = np.lexsort((np.abs(place - nearest), np.mod(nearest, most)))
    _, first = np.unique(np.mod(nearest, most)[order], return_index=True)
    kept = np.sort(order[first])
    if kept.size < FEWEST_READINGS:
        raise InputError.at("measured curve", "number of readings apart", int(kept.size), f"{FEWEST_READINGS} or more")
    angle = curve.carrier_angle[kept]
    return ThinnedCurve(
        carrier_angle=angle,
        values=curve.transmission_error[kept],
        covariance=noise.reading**2 * np.eye(kept.size) + noise.left_out(angle),
    )


def gauges_shown(
    errors: ErrorModel, sources: Sequence[Source], deviations: Float[np.ndarray, "sample column"]
) -> Float[np.ndarray, "sample source"]:
    """Return what exact gauges would show of sources of units with these columns [m]."""
    owner = np.array(errors.source_of_column)
    return np.stack([limited_measure(source, deviations[:, owner == source.name]) for source in sources], axis=1)


@dataclass(frozen=True, kw_only=True)
class GaugeReading:
    """What a gauge has shown of one source of the unit."""

    source: Source
    value: float  # As `limited_measure` says it [m]
    deviation: float  # Standard deviation of the reading [m]


@dataclass(frozen=True, kw_only=True)
class CurveProblem:
    """Errors of one unit as standard normal numbers, and how badly they explain its curve and what gauges read."""

    kernel: KernelResponse  # The real model; its columns are those of the errors
    errors: ErrorModel  # What is known of the errors before the curve is read
    zones: Float[np.ndarray, " source"]  # Zones of the sources that vary [m]
    readings: ThinnedCurve  # The curve
    gauged: tuple[GaugeReading, ...] = ()  # What gauges have read of this unit's parts

    @property
    def freedom(self) -> int:
        """Independent numbers that were read [-]."""
        return self.readings.freedom + len(self.gauged)

    @property
    def size(self) -> int:
        """Number of columns [-]."""
        return len(self.errors.columns)

    def deviations(self, numbers: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return the columns [m, angles rad] for standard normal numbers."""
        return self.errors.deviations_of_normal(numbers, self.zones)

    def curves(self, deviations: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample angle"]:
        """Return the transmission error at the angles of the readings, not a number where one angle failed [rad]."""
        values = np.empty((deviations.shape[0], self.readings.values.size))
        for rows, answer in map_chunks(self._equilibria, deviations):
            values[rows] = answer.transmission_error
            self.kernel.observe(answer.status.max(axis=1))
        return values

    def _equilibria(self, x: Float[np.ndarray, "chunk column"]) -> Equilibria:
        kernel = self.kernel
        return kernel.model.equilibria(kernel.errors(x), kernel.torque, self.readings.carrier_angle)

    def misfit_of(self, deviations: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
        """Return half the sum of squared residuals, each in standard deviations; infinite where a curve failed [-]."""
        residual = (self.curves(deviations) - self.readings.values) @ self.readings.whitening.T
        half = 0.5 * np.einsum("sa,sa->s", residual, residual)
        if self.gauged:
            half += 0.5 * (self._off(deviations) ** 2).sum(axis=1)
        return np.where(np.isfinite(half), half, np.inf)

    def _off(self, deviations: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample gauge"]:
        """Return how far the gauges would be from what they read, in standard deviations [-]."""
        shown = gauges_shown(self.errors, [own.source for own in self.gauged], deviations)
        value, deviation = np.array([(own.value, own.deviation) for own in self.gauged]).T
        return np.asarray((shown - value) / deviation)

    def misfit(self, numbers: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, " sample"]:
        """Return the same for standard normal numbers [-]."""
        return self.misfit_of(self.deviations(numbers))

    def linearised(
        self, numbers: Float[np.ndarray, "sample column"]
    ) -> tuple[Float[np.ndarray, "sample angle"], Float[np.ndarray, "sample angle column"]]:
        """Return the residuals in standard deviations and their derivatives by the numbers [-]."""
        samples, size = numbers.shape
        deviations = self.deviations(numbers)
        kernel, readings = self.kernel, self.readings
        curve, derivatives = kernel.model.rotation_derivatives(
            kernel.errors(deviations), kernel.torque, readings.carrier_angle
        )
        columns = [kernel.model.columns.index(name) for name in self.errors.columns]
        by_column = derivatives.by_error[:, columns].reshape(samples, -1, size)
        moved = self.deviations((numbers[:, np.newaxis] + _STEP * np.eye(size)).reshape(-1, size))
        by_number = (moved.reshape(samples, size, size) - deviations[:, np.newaxis]).transpose(0, 2, 1) / _STEP
        kernel.observe(derivatives.status.reshape(samples, -1).max(axis=1))
        residual, slope = (curve - readings.values) @ readings.whitening.T, readings.whitening @ by_column @ by_number
        if not self.gauged:
            return residual, slope
        off = self._off(deviations)
        steps = (self._off(moved).reshape(samples, size, -1) - off[:, np.newaxis]).transpose(0, 2, 1) / _STEP
        return np.concatenate([residual, off], axis=1), np.concatenate([slope, steps], axis=1)


LogDensity = Callable[[Float[np.ndarray, "particle column"]], Float[np.ndarray, " particle"]]


@dataclass(frozen=True, kw_only=True)
class Neighbourhood:
    """A normal density that is easy to draw from."""

    centre: Float[np.ndarray, " column"]  # Its mean [-]
    precision: Float[np.ndarray, "column column"]  # Inverse of its covariance [-]

    @cached_property
    def _root(self) -> Float[np.ndarray, "column column"]:
        return np.linalg.cholesky(self.precision)

    def drawn(self, count: int, generator: np.random.Generator) -> Float[np.ndarray, "particle column"]:
        """Return particles of it."""
        standard = generator.standard_normal((count, self.centre.size))
        return np.asarray(self.centre + solve_triangular(self._root.T, standard.T).T)

    def __call__(self, where: Float[np.ndarray, "particle column"]) -> Float[np.ndarray, " particle"]:
        """Return the logarithm of its density, up to a constant."""
        return np.asarray(-0.5 * (((where - self.centre) @ self._root) ** 2).sum(axis=1))


def bridge(
    start: Neighbourhood,
    target: LogDensity,
    particles: int,
    generator: np.random.Generator,
    *,
    effective: float = 0.5,
    most: int = 20,
    settling: int = 0,
) -> Float[np.ndarray, "particle column"]:
    """Return particles of the target density from particles of the start density.

    The target is the logarithm of a density, up to a constant; minus infinity where a particle may not be. Each step
    leaves the effective share of the particles, which sets its length, and makes at most so many moves; settling are
    the moves at the end of the way.

    Sequential Monte Carlo over start^(1−t)·target^t: at each t the particles are weighed, resampled and moved. A move
    is a step of an autoregressive process that has the particles' mean and covariance, accepted by Metropolis–Hastings,
    so that a normal density in any number of dimensions needs few of them.

    References
    ----------
    Del Moral, Doucet & Jasra 2006, J. R. Stat. Soc. B 68; Cotter et al. 2013, Stat. Sci. 28.
    """
    where, time, length = start.drawn(particles, generator), 0.0, 0.5
    own, wanted = start(where), target(where)
    while time < 1.0:
        time, weight = _next_time(time, wanted - own, effective)
        mean, root = _cloud(where, weight)
        chosen = _resampled(weight, generator)
        where, own, wanted = where[chosen], own[chosen], wanted[chosen]
        before = np.asarray(solve_triangular(root, (where - mean).T, lower=True).T)
        reference = before
        for _ in range(most + (settling if time == 1.0 else 0)):
            step = np.minimum(length * np.exp(0.5 * generator.standard_normal(len(where))), 1.0)[:, np.newaxis]
            to = np.sqrt(1.0 - step**2) * before + step * generator.standard_normal(where.shape)
            there = np.asarray(mean + to @ root.T)
            own_there, wanted_there = start(there), target(there)
            gain = (1.0 - time) * (own_there - own) + time * (wanted_there - wanted)
            gain += 0.5 * ((to**2).sum(axis=1) - (before**2).sum(axis=1))
            taken = np.log(generator.random(len(where))) < gain
            where, before = np.where(taken[:, None], there, where), np.where(taken[:, None], to, before)
            own, wanted = np.where(taken, own_there, own), np.where(taken, wanted_there, wanted)
            length = float(np.clip(length * np.exp(taken.mean() - _ACCEPTED), 0.02, 0.9))
            if time < 1.0 and (before * reference).sum() < _CORRELATION * (reference**2).sum():
                break
    return where


def _cloud(
    where: Float[np.ndarray, "particle column"], weight: Float[np.ndarray, " particle"]
) -> tuple[Float[np.ndarray, " column"], Float[np.ndarray, "column column"]]:
    """Return mean and root of the covariance of the particles, in which their moves are made."""
    mean = weight @ where
    apart = where - mean
    covariance = _INFLATION * (apart.T * weight) @ apart
    ridge = 1e-9 * np.trace(covariance) / mean.size  # so that few particles still span all columns
    return mean, np.linalg.cholesky(covariance + ridge * np.eye(mean.size))


def _weight(gain: Float[np.ndarray, " particle"]) -> Float[np.ndarray, " particle"]:
    weight = np.exp(gain - gain.max())
    return np.asarray(weight / weight.sum())


def _next_time(
    time: float, gain: Float[np.ndarray, " particle"], effective: float
) -> tuple[float, Float[np.ndarray, " particle"]]:
    """Return the time at which the effective share of the particles has fallen so far, and their weights [-]."""

    def left(to: float) -> float:
        return float(1.0 / (gain.size * (_weight((to - time) * gain) ** 2).sum())) - effective

    to = 1.0 if left(1.0) >= 0.0 else float(brentq(left, time, 1.0, xtol=1e-12))
    return to, _weight((to - time) * gain)


def _resampled(weight: Float[np.ndarray, " particle"], generator: np.random.Generator) -> Int[np.ndarray, " particle"]:
    """Return which particles go on, each about as often as its weight says."""
    comb = (np.arange(weight.size) + generator.random()) / weight.size
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weight), comb), weight.size - 1))


@dataclass(frozen=True, kw_only=True)
class DiagnosisEffort:
    """How much a diagnosis may compute."""

    angles: int = 240  # Most readings of a turn that are used [-]
    scouts: int = 320  # Particles led from the drawings' distribution to one that knows the curve roughly [-]
    rough: float = 1.0  # Error of a reading for the scouts, over the spread of the curves that the drawings allow [-]
    climbers: int = 16  # Scouts from which steps are taken [-]
    attempts: int = 5  # Most attempts from fresh scouts [-]
    nearby: int = 8  # Most searches around the best so far in each attempt [-]
    particles: int = 512  # Size of the population that is sampled around the explanation [-]
    weight: float = 0.01  # Weight of the readings in the normal distribution that the population starts from [-]
    settling: int = 20  # Moves of the population at the end [-]
    judged: int = 128  # Sampled units whose dominant source is looked for [-]


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """The errors that explain a curve best."""

    numbers: Float[np.ndarray, " column"]  # Standard normal numbers [-]
    # What the readings tell of them nearby: sum of squared derivatives [-]
    information: Float[np.ndarray, "column column"]
    objective: float  # Half the sum of squares of residuals and numbers [-]
    # Probability of residuals at least as large, were the model true; and were the noise twice as large as stated [-]
    plausible: float
    plausible_at_twice: float

    def neighbourhood(self, weight: float) -> Neighbourhood:
        """Return what would be known if the model were linear and the readings had this weight [-]."""
        return Neighbourhood(centre=self.numbers, precision=weight * self.information + np.eye(self.numbers.size))


def explain(problem: CurveProblem, seeds: SeedTree, effort: DiagnosisEffort) -> Explanation:
    """Return the best explanation of some attempts.

    They end early with one that is plausible, or with the second of two that would not be plausible even at twice the
    noise: such a curve is no near miss, and three more attempts would only repeat that.
    """
    everywhere = Neighbourhood(centre=np.zeros(problem.size), precision=np.eye(problem.size))
    curves = problem.curves(problem.deviations(everywhere.drawn(64, seeds.child("spread").generator())))
    spread = float(np.nanstd(curves)) * effort.rough
    # The weight of the readings, were they as wrong as the curves of all allowed errors differ.
    rough = min(1.0, float(np.diag(problem.readings.covariance).mean()) / spread**2)
    found: list[Explanation] = []
    for number in range(effort.attempts):
        found.append(_attempt(problem, everywhere, rough, seeds.child(str(number)), effort))
        plausible = max(one.plausible for one in found) >= _LEAST
        hopeless = len(found) > 1 and max(one.plausible_at_twice for one in found) < _LEAST
        if plausible or hopeless:
            break
    return min(found, key=lambda one: one.objective)


def _attempt(
    problem: CurveProblem, everywhere: Neighbourhood, rough: float, seeds: SeedTree, effort: DiagnosisEffort
) -> Explanation:
    """Search among all errors, then around the best so far, in a wider neighbourhood after each search in vain."""
    best, vain = _search(problem, everywhere, rough, seeds.child("first").generator(), effort), 0
    for number in range(effort.nearby):
        near, weight = best.neighbourhood(_WIDER ** (1 - vain) * rough), max(_WIDER ** (2 - vain), 1.0) * rough
        one = _search(problem, near, weight, seeds.child(str(number)).generator(), effort)
        vain = 0 if one.objective < best.objective - _SAME_DEPTH else vain + 1
        best = min(best, one, key=lambda found: found.objective)
        if vain == _VAIN or (vain > 0 and best.plausible >= _ENOUGH):
            break
    return best


def _search(
    problem: CurveProblem, start: Neighbourhood, weight: float, generator: np.random.Generator, effort: DiagnosisEffort
) -> Explanation:
    """Lead scouts from the start towards the curve, taken with this weight, and climb from some of them."""
    rough = weight
    scouts = bridge(
        start,
        lambda numbers: -0.5 * (numbers**2).sum(axis=1) - rough * problem.misfit(numbers),
        effort.scouts,
        generator,
        most=10,
    )
    climbers = scouts[generator.permutation(effort.scouts)[: effort.climbers]]
    while weight < 1.0:
        climbers, weight = climb(problem, climbers, weight, 2), 4.0 * weight
    objective = problem.misfit(climbers) + 0.5 * (climbers**2).sum(axis=1)
    best = climb(problem, climbers[np.argsort(objective)[: max(effort.climbers // 4, 1)]], 1.0, 6)
    misfit = problem.misfit(best)
    objective = misfit + 0.5 * (best**2).sum(axis=1)
    first = int(np.argmin(objective))
    _, slope = problem.linearised(best[first : first + 1])
    information = slope[0].T @ slope[0]
    fitted = float(np.trace(np.linalg.solve(information + np.eye(problem.size), information)))
    freedom = max(problem.freedom - fitted, 1.0)
    return Explanation(
        numbers=best[first],
        information=information,
        objective=float(objective[first]),
        plausible=float(chi2.sf(2.0 * misfit[first], freedom)),
        plausible_at_twice=float(chi2.sf(2.0 * misfit[first] / 4.0, freedom)),
    )


def climb(
    problem: CurveProblem, numbers: Float[np.ndarray, "sample column"], weight: float, steps: int
) -> Float[np.ndarray, "sample column"]:
    """Return the samples after some damped Gauss–Newton steps, each with the best of several dampings.

    The weight is that of the readings against what is known of the errors; below 1 the valleys are wide.
    """
    samples, damping = np.arange(len(numbers)), np.ones(len(numbers))
    objective = weight * problem.misfit(numbers) + 0.5 * (numbers**2).sum(axis=1)
    for _ in range(steps):
        residual, slope = problem.linearised(numbers)
        across = slope.transpose(0, 2, 1)
        value, vector = np.linalg.eigh(weight * across @ slope)
        pull = vector.transpose(0, 2, 1) @ (weight * across @ residual[:, :, None] + numbers[:, :, None])
        tried = damping[:, np.newaxis] * _DAMPINGS
        step = pull[:, np.newaxis, :, 0] / (value[:, np.newaxis] + 1.0 + tried[:, :, np.newaxis])
        to = numbers[:, np.newaxis] - (vector[:, np.newaxis] @ step[..., np.newaxis])[..., 0]
        misfit = problem.misfit(to.reshape(-1, problem.size)).reshape(tried.shape)
        reached = weight * misfit + 0.5 * (to**2).sum(axis=2)
        best = reached.argmin(axis=1)
        better = reached[samples, best] < objective
        numbers = np.where(better[:, np.newaxis], to[samples, best], numbers)
        objective = np.where(better, reached[samples, best], objective)
        damping = np.clip(np.where(better, tried[samples, best], 30.0 * damping), 1e-6, 1e9)
    return numbers


def posterior(
    problem: CurveProblem, explanation: Explanation, generator: np.random.Generator, effort: DiagnosisEffort
) -> Float[np.ndarray, "particle column"]:
    """Return standard normal numbers drawn from all errors near the explanation that the curve allows [-]."""
    return bridge(
        explanation.neighbourhood(effort.weight),
        lambda numbers: -0.5 * (numbers**2).sum(axis=1) - problem.misfit(numbers),
        effort.particles,
        generator,
        settling=effort.settling,
    )

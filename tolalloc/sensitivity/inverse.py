"""Inverse sensitivity: how far each zone may open alone before the requirement fails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import quantile_interval
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Response

Found = Float[np.ndarray, " found"]
"""A number of every source whose factor is found."""
Bracket = Float[np.ndarray, "4 found"]
"""Two factors of each, and the excess of the quantile over the limit at either [-, output]."""
Quantiles = Float[np.ndarray, "found 3"]
"""Quantile of each with the ends of its interval [output]."""
Trials = Int[np.ndarray, " trial"]
"""Position of the source that each trial opens or closes."""
Factors = Float[np.ndarray, " trial"]
"""Factor on its zone [-]."""
_LEAST_OUTSIDE = 5.0
"""Units that must lie beyond the quantile on average, so that order statistics bound it from above [-]."""
_SAME = 1e-3
"""Distance from the limit, over the limit, at which the quantile counts as equal to it [-]."""
_LARGEST_FACTOR = 10.0
"""Factor up to which a zone is opened [-]."""
_FAR_BELOW = 0.9
"""Part of the limit that a quantile must leave free by its squares, not to be tried at the largest factor [-]."""
_MOST_STEPS = 30
"""Steps between two factors after which the quantile cannot be continuous; about four are usual [-]."""
_CONFIDENCE = 0.9
"""Confidence of the two-sided interval of every factor [-]."""
_ROWS_AT_ONCE = 2**14
"""Units of all trials that one call of the response takes, unless one trial alone has more [-]."""
_WORST = 1 / 16
"""Share of the units, the worst ones at the present zones, that may show alone that a closed zone is not enough [-]."""


@dataclass(frozen=True, kw_only=True)
class InverseSensitivity:
    """The factor of each zone at which the requirement is just kept, all other zones as they are."""

    sources: tuple[str, ...]  # Names of the sources that a drawing limits, in the order of all arrays
    meets: bool  # Whether the zones as they are keep the limit; if so the factors are above 1, if not below
    # Whether the interval of the present quantile leaves the limit out; if not, these units tell no factor from 1, all
    # are NaN, and none is searched for
    decided: bool
    # Factor of the zone; infinite if the largest factor tried keeps the limit too, NaN if the limit is missed even
    # without the source [-]
    factor: Float[np.ndarray, " source"]
    # Ends of the 90 % interval of the factor, NaN where it is not finite [-]
    low: Float[np.ndarray, " source"]
    high: Float[np.ndarray, " source"]
    zone: Float[np.ndarray, " source"]  # Factor times the zone [m]
    units: int  # Units of every trial [-]


def inverse_sensitivity(
    experiment: Experiment[Response], *, limit: float, target: float, units: int = 2048
) -> InverseSensitivity:
    """Return how far each zone may open, or must close, alone, until a share of the units just keeps an upper limit.

    The first output is limited; a joint source stays as it is.

    Notes
    -----
    Theory page equation (48), factors [-], limit [unit of the output].
    All trials use the same uniform numbers, so the quantile is a continuous function of each factor. A zone is opened
    to twice its width, then to the largest factor, so the first crossing is found unless the quantile returns within
    one of these steps; what by its squares stays far from the limit is not tried at the largest. Between two factors
    the square of the quantile is taken as linear in the square of the factor, exact for errors that add in quadrature;
    so is its slope. Where the interval of the present quantile holds the limit, no factor could be told from 1, and
    none is searched for. A zone whose closing leaves too many of the worst units beyond the limit cannot repair the
    design alone, and no other unit is solved with it closed. Sources of a group that share a zone on the drawing open
    one at a time here. The interval is that of the quantile by order statistics, over its slope; the middle of a size
    does not move. What counts is the empirical quantile, without the margin that shows a yield with confidence.

    References
    ----------
    Regula falsi with halving of the stale end (Illinois): Dowell & Jarratt 1971.

    Examples
    --------
    With σ of 1 and 2 a limit of 8 at 97.72 % (2σ) leaves a spread of 4: the first σ may be √(16 − 4) = 3.46, the second
    √(16 − 1)/2 = 1.94 of what it is; estimates of 2,048 units scatter by some percent.

    >>> from tolalloc.drawings.seeds import SeedTree
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 6, "minus": -6, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> inverse_sensitivity(experiment, limit=8.0, target=0.9772).factor.round(1).tolist()
    [3.5, 2.0]
    """
    needed = fewest_units(target)
    if units < needed:
        raise InputError.at("inverse sensitivity", "units", units, f"{needed} or more for a yield of {target:.4%}")
    errors = experiment.errors
    openings = _Openings(experiment, errors.standard_values(experiment.uniform(units)), target)
    now, *ends = openings.quantile(*openings.present)
    meets, count = now <= limit, len(errors.active)
    decided = not ends[0] <= limit <= ends[1]
    factor = np.full(count, np.inf if meets and decided else np.nan)
    low, high = np.full((2, count), np.nan)
    own, bracket = _bracket(openings, now, limit) if decided else (np.empty(0, int), np.empty((4, 0)))
    if own.size:
        factor[own], quantiles = _crossings(openings, own, bracket, limit)
        low[own], high[own] = _interval(factor[own], quantiles, bracket, limit)
    return InverseSensitivity(
        sources=tuple(source.name for source in errors.active),
        meets=meets,
        decided=decided,
        factor=factor,
        low=low,
        high=high,
        zone=factor * experiment.zones[:count],
        units=units,
    )


def fewest_units(target: float) -> int:
    """Return the fewest units that show a quantile at the target yield [-]."""
    return int(np.ceil(_LEAST_OUTSIDE / (1.0 - target)))


@dataclass(frozen=True)
class _Openings:
    """The same units with one zone multiplied by a factor, for several sources in each call of the response."""

    experiment: Experiment[Response]
    standard: Float[np.ndarray, "unit column"]
    target: float

    @cached_property
    def present(self) -> tuple[Float[np.ndarray, " unit"], Bool[np.ndarray, " unit"]]:
        """Output of every unit with the zones as they are, and which are good."""
        ((values, good),) = self._solved(np.zeros(1, int), np.ones(1))
        self._require_few_failures(good, np.zeros(1, int), np.ones(1))
        return values[0], good[0]

    def quantiles(self, sources: Trials, factors: Factors) -> Float[np.ndarray, "trial 3"]:
        """Return the quantile of every trial at the target yield, and the ends of its interval [output]."""
        found = list[tuple[float, float, float]]()
        for values, good in self._solved(sources, factors):
            part = slice(len(found), len(found) + len(good))
            self._require_few_failures(good, sources[part], factors[part])
            found += [self.quantile(*trial) for trial in zip(values, good, strict=True)]
        return np.array(found)

    def quantile(
        self, values: Float[np.ndarray, " unit"], good: Bool[np.ndarray, " unit"]
    ) -> tuple[float, float, float]:
        """Return the quantile of the good units at the target yield, and the ends of its interval [output]."""
        found = quantile_interval(values[good], self.target, _CONFIDENCE)
        return found.estimate, found.low, found.high

    def may_repair(self, sources: Trials, limit: float) -> Bool[np.ndarray, " trial"]:
        """Return which zones may keep the limit if they are closed: all that the worst units alone do not refute.

        A quantile lies beyond the limit if as many units do as lie above it, and the unit just below it too.
        """
        values, good = self.present
        needed = good.size - int(np.floor((good.size - 1) * self.target))
        worst = np.argsort(np.where(good, values, -np.inf))[-max(needed, int(_WORST * good.size)) :]
        closed = self._solved(sources, np.zeros(sources.size), worst)
        beyond = [np.count_nonzero(good & (values > limit), axis=1) for values, good in closed]
        return np.concatenate(beyond) < needed

    def _solved(
        self, sources: Trials, factors: Factors, units: slice | Int[np.ndarray, " unit"] = slice(None)
    ) -> Iterator[tuple[Float[np.ndarray, "some_trials unit"], Bool[np.ndarray, "some_trials unit"]]]:
        """Yield the outputs of units in some trials from one call of the response, and which are good."""
        standard = self.standard[units]
        trials = max(1, _ROWS_AT_ONCE // standard.shape[0])
        for start in range(0, sources.size, trials):
            zones = np.repeat(self.experiment.zones[np.newaxis], sources[start : start + trials].size, axis=0)
            zones[np.arange(len(zones)), sources[start : start + trials]] *= factors[start : start + trials]
            x = np.stack([self.experiment.errors.deviations(standard, own) for own in zones])
            evaluation = self.experiment.response(x.reshape(-1, standard.shape[1]))
            yield evaluation.values[:, 0].reshape(x.shape[:2]), evaluation.good.reshape(x.shape[:2])

    def _require_few_failures(self, good: Bool[np.ndarray, "trial unit"], sources: Trials, factors: Factors) -> None:
        """Raise if more units of a trial failed than allowed."""
        failed = np.count_nonzero(~good, axis=1)
        worst = int(failed.argmax())
        if failed[worst] > self.experiment.largest_failed_share * good.shape[1]:
            name = self.experiment.errors.active[sources[worst]].name
            raise SolveError(
                f"Inverse sensitivity: {failed[worst]} of {good.shape[1]} units have no usable answer with "
                f"{name} at {factors[worst]:.4g} times its zone; allowed is "
                f"{self.experiment.largest_failed_share:.4g} of them, because more would bias the quantile."
            )


def _bracket(openings: _Openings, now: float, limit: float) -> tuple[Int[np.ndarray, " found"], Bracket]:
    """Return the sources whose quantile crosses the limit between factor 1 and the farthest, and what brackets it.

    These are two factors per source with the limit between their quantiles, then quantile less limit at both.
    """
    trials = [2.0, _LARGEST_FACTOR] if now <= limit else [0.0]
    left = np.arange(len(openings.experiment.errors.active))
    if now > limit:
        left = left[openings.may_repair(left, limit)]
    near, near_excess, found = 1.0, np.full(left.size, now - limit), []
    for far in trials:
        if not left.size:
            break
        excess = openings.quantiles(left, np.full(left.size, far))[:, 0] - limit
        crossed = (excess > 0.0) != (now > limit)
        ends = np.full((2, left.size), [[near], [far]])
        found.append(np.stack([left, *ends, near_excess, excess])[:, crossed])
        left, near, near_excess = left[~crossed], far, excess[~crossed]
        if now <= limit and limit > 0.0:
            # What adds in quadrature is far from the limit at the largest factor too.
            rise = (_squared(near_excess, limit) - _squared(np.array([now - limit]), limit)) / (far**2 - 1.0)
            farthest = max(now, 0.0) ** 2 + rise * (_LARGEST_FACTOR**2 - 1.0)
            may = farthest > (_FAR_BELOW * limit) ** 2
            left, near_excess = left[may], near_excess[may]
    sources, bracket = np.split(np.concatenate([np.empty((5, 0)), *found], axis=1), [1])
    return sources[0].astype(int), bracket


def _squared(excess: Found, limit: float) -> Found:
    """Return quantile² less limit² with the sign of the excess, or the excess where no limit above 0 has a square."""
    return np.maximum(limit + excess, 0.0) ** 2 - limit**2 if limit > 0.0 else excess


def _crossings(
    openings: _Openings, sources: Int[np.ndarray, " found"], bracket: Bracket, limit: float
) -> tuple[Found, Quantiles]:
    """Return the factors at which the quantile equals the limit [-], and there the quantile and its interval."""
    stale, fresh = bracket[:2].copy()
    stale_excess, fresh_excess = (_squared(excess, limit) for excess in bracket[2:])
    left, quantiles = np.arange(stale.size), np.empty((stale.size, 3))
    for _ in range(_MOST_STEPS):
        a, b, at_a, at_b = stale[left], fresh[left], stale_excess[left], fresh_excess[left]
        trial = np.sqrt(b**2 - at_b * (b**2 - a**2) / (at_b - at_a))
        quantiles[left] = openings.quantiles(sources[left], trial)
        excess = quantiles[left, 0] - limit
        # The new end replaces the one on its own side; an end that stays twice loses half its weight.
        other_side = (excess > 0.0) != (at_b > 0.0)
        stale[left], stale_excess[left] = np.where(other_side, b, a), np.where(other_side, at_b, at_a / 2.0)
        fresh[left], fresh_excess[left] = trial, _squared(excess, limit)
        left = left[np.abs(excess) > _SAME * abs(limit)]
        if not left.size:
            return fresh, quantiles
    name = openings.experiment.errors.active[sources[left[0]]].name
    raise SolveError(f"Inverse sensitivity: the quantile jumps over the limit at {fresh[left[0]]:.6g} of {name}.")


def _interval(factor: Found, quantiles: Quantiles, bracket: Bracket, limit: float) -> tuple[Found, Found]:
    """Return the ends of the factors' intervals: those of the quantile, over its slope between the brackets [-]."""
    estimate, low, high = quantiles.T
    near, far, *excesses = bracket
    at_near, at_far = (_squared(excess, limit) for excess in excesses)
    slope = (at_far - at_near) / (far**2 - near**2) * 2.0 * factor
    slope = slope / (2.0 * np.maximum(estimate, np.finfo(float).tiny)) if limit > 0.0 else slope
    # Where the quantile does not rise, it does not bound the factor.
    down, up = (
        np.where(slope > 0.0, way / np.where(slope > 0.0, slope, 1.0), np.inf) for way in (high - limit, limit - low)
    )
    return np.maximum(factor - down, 0.0), factor + up

"""What a share of the units lies beyond, of the largest excess over some limits, wherever zones and settings go.

A sample average: units of one verified design, each with its own derivatives, stand for those of any design near by.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from tolalloc.allocation.space.problem import Stack, root_sum_square_stack
from tolalloc.allocation.space.tail import (
    FEWEST_OF_TAIL,
    FurthestUnits,
    norm_score,
    norm_share,
    tail_scores,
    tail_units,
    tail_weights,
)
from tolalloc.capability.near_limit import largest_first


@dataclass(frozen=True, kw_only=True)
class ExcessQuantile:
    """What a share of the units of a design lies beyond, of the largest excess over some limits.

    Every excess counts over the deviation of its output, so that the limits are alike [-].
    """

    name: str  # What is kept where it is zero or below
    design: Float[np.ndarray, " variable"]  # The verified design
    share: float  # That may lie beyond [-]
    parts: tuple[FurthestUnits, ...]  # Of every limit
    level: float = 0.0  # What verified units show [-]
    error: float = 0.0  # Standard error of it [-]

    def at_excess(self, excess: float, error: float) -> ExcessQuantile:
        """Return the quantile of one output at an excess and a standard error [unit of the output].

        Where so few units show nothing it lies where the outermost one does.
        """
        if not np.isfinite(excess):
            return replace(self, level=max(float(own.excess.max(initial=-np.inf)) for own in self.parts))
        return replace(self, level=excess / self.parts[0].deviation, error=error / self.parts[0].deviation)

    def at_level(self, level: float, error: float, units: int) -> ExcessQuantile:
        """Return the quantile at a level and a standard error that so many units tell, over the limits [-].

        It lies where as many of these units lie further out: over the limits and over the deviations they stand in
        other orders, but as many fail. Its error is no larger than by the line through the tail: the outermost few of a
        short sample tell little of how they scatter.

        error = s·√(f(1 − f)/n)/φ(z) at most, with the slope s of the line at the share f (own derivation) [-].
        """
        if not np.isfinite(level):
            return self.at_excess(level, error)
        relative = np.repeat([own.relative for own in self.parts], [own.rows.size for own in self.parts])
        over_limits, over_deviations = self._outermost(self._excess / relative), self._outermost(self._excess)
        scores = tail_scores(self.parts[0].units, over_limits.size)
        lines = [np.polyfit(scores, own, 1) for own in (over_limits, over_deviations)]
        by = float(lines[1][0] / lines[0][0]) if lines[0][0] > 0 else 1.0
        density = np.exp(-(norm_score(self.share) ** 2) / 2) / np.sqrt(2 * np.pi)
        by_line = lines[1][0] * np.sqrt(self.share * (1 - self.share) / units) / density
        if over_limits[-1] <= 0.0 <= over_limits[0]:
            known, told = (np.sort(np.append(own, 0.0)) for own in (over_limits, over_deviations))
            found = float(np.interp(level, known, told))
        else:
            inside = over_limits[-1] <= level <= over_limits[0]
            on_line = (level - lines[0][1]) / (lines[0][0] or 1.0)
            score = float(np.interp(level, over_limits[::-1], scores[::-1])) if inside else on_line
            found = float(tail_weights(self.parts[0].units, norm_share(score), scores.size) @ over_deviations)
        return replace(self, level=found, error=float(min(error * by, by_line)))

    @property
    def alone(self) -> tuple[ExcessQuantile, ...]:
        """The same of every limit alone, which none of all lies below; nothing of one limit."""
        if len(self.parts) == 1:
            return ()
        shift = self.level - self._own
        found = (replace(self, parts=(own,), level=0.0) for own in self.parts if own.rows.size >= FEWEST_OF_TAIL)
        return tuple(replace(own, level=own._own + shift) for own in found)

    def batch(self, first: int, count: int) -> ExcessQuantile:
        """Return the same by every so-manieth unit."""
        return replace(self, parts=tuple(own.batch(first, count) for own in self.parts))

    def counted_as(self, other: ExcessQuantile) -> tuple[float, float]:
        """Return level and standard error over the deviations of another design's units [-]."""
        ratios = [own.deviation / its.deviation for own, its in zip(self.parts, other.parts, strict=True)]
        by = float(np.repeat(ratios, [own.rows.size for own in self.parts])[self._furthest(self.design)[1]].mean())
        return self.level * by, self.error * by

    def moved_out(self, by: float) -> ExcessQuantile:
        """Return the quantile that lies further out [-]."""
        return replace(self, level=self.level + by)

    @cached_property
    def _excess(self) -> Float[np.ndarray, " entry"]:
        return np.concatenate([own.excess for own in self.parts])

    def _outermost(self, excess: Float[np.ndarray, " entry"]) -> Float[np.ndarray, " few"]:
        """Return the largest excess of every one of the outermost units, the largest first."""
        return np.asarray(excess[self._first(excess)])

    def _first(self, excess: Float[np.ndarray, " entry"]) -> Int[np.ndarray, " few"]:
        """Return which entries are of the outermost units: each fails by the limit that it lies furthest beyond."""
        order = np.lexsort((-excess, self._rows))
        first = order[np.append(True, np.diff(self._rows[order]) != 0)]
        return np.asarray(first[largest_first(excess[first], tail_units(self.parts[0].units, self.share))])

    @cached_property
    def _rows(self) -> Int[np.ndarray, " entry"]:
        return np.concatenate([own.rows for own in self.parts])

    @cached_property
    def _slopes(self) -> Float[np.ndarray, "entry variable"]:
        return np.concatenate([own.slopes for own in self.parts])

    def _furthest(
        self, design: Float[np.ndarray, " variable"]
    ) -> tuple[Float[np.ndarray, " entry"], Int[np.ndarray, " few"]]:
        """Return the excess of every unit over every limit, and which entries are of the outermost units."""
        excess = self._excess + self._slopes @ (design - self.design)
        return excess, self._first(excess)

    def __call__(self, design: Float[np.ndarray, " variable"]) -> tuple[float, Float[np.ndarray, " variable"]]:
        """Return the quantile of another design, and its derivative by every variable."""
        value, gradient = self._read(design)
        return self.level + value - self._own, gradient

    @cached_property
    def _own(self) -> float:
        return self._read(self.design)[0]

    @property
    def gradient(self) -> Float[np.ndarray, " variable"]:
        """Its derivative at its own design by every variable."""
        return self._read(self.design)[1]

    def _read(self, design: Float[np.ndarray, " variable"]) -> tuple[float, Float[np.ndarray, " variable"]]:
        excess, furthest = self._furthest(design)
        if furthest.size < FEWEST_OF_TAIL:
            few = self._slopes[furthest]
            return float(excess[furthest].sum()), few.mean(axis=0) if len(few) else np.zeros(few.shape[1])
        weights = tail_weights(self.parts[0].units, self.share, furthest.size)
        return float(weights @ excess[furthest]), np.asarray(weights @ self._slopes[furthest])

    def stacks(self, design: Float[np.ndarray, " variable"], groups: int) -> tuple[Stack, ...]:
        """Return convex models of all limits and of each alone around a design; so many variables are scales.

        Each alone asks for nothing more, but says where another limit begins to be the nearest.
        """
        most, _ = of_all = self(design)
        found = [of_all, *((min(level, most), slopes) for level, slopes in (own(design) for own in self.alone))]
        return tuple(root_sum_square_stack(self.name, design, level, slopes, groups) for level, slopes in found)

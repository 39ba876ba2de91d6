"""The worst unit whose parts are all inside their zones, searched by ascent from many random units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.sources import Source
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import ResponseWithDerivatives

Units = Float[np.ndarray, "unit column"]
"""Deviations of units, or derivatives by them."""
_WEIGHT = 0.3
"""Weight of the newest gradient in the mean of all before [-]."""
_TURNS = 0.5 ** np.arange(2, 8)
"""Steps of the search over the phases of waves [turn]."""


@dataclass(frozen=True, kw_only=True)
class WorstUnit:
    """The worst unit found inside the zones."""

    # Its output. Nothing proves that no other unit is worse: the true worst case is this or beyond [output].
    value: float
    x: Float[np.ndarray, " column"]  # Its deviations, in the order of the response's columns [m, angles rad]
    by_zone: Float[np.ndarray, " source"]  # Change of the worst value with each zone [output/m]
    # Worst value of every start, NaN where it had none; how closely they agree tells how far to trust the search
    # [output]
    ends: Float[np.ndarray, " start"]


def worst_unit(
    experiment: Experiment[ResponseWithDerivatives], starts: int = 32, steps: int = 60, sense: Literal[1, -1] = 1
) -> WorstUnit:
    """Return the worst unit that an ascent from many random units finds inside the zones.

    Correlations of the sources do not count, any part may be anywhere in its zone. The sense is 1 where large outputs
    are bad, for an upper limit; −1 where small ones are, for a lower limit [-].

    Notes
    -----
    Conditional gradient (Frank–Wolfe): the k-th step goes 2/(k + 1) of the way to the unit that is worst by the
    gradient alone, source by source. A peak-to-peak has ridges, on either side of which the gradient points across;
    so the gradient is a mean over the last few steps, which points along them. A size may end anywhere in its interval
    and an axis anywhere in its circle; pitch and run-out fill their zones with the amplitudes of their spectrum, at any
    phases. The change with the zones is that of the units' own deviations, by the mean gradient (envelope theorem).

    References
    ----------
    Frank, M. and Wolfe, P. (1956). An algorithm for quadratic programming. Naval Research Logistics 3, 95-110.

    Examples
    --------
    Sizes with zones of 6 and 8 add up to 3 + 4 at worst.

    >>> from tolalloc.drawings.seeds import SeedTree
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "min": 1, "max": 60, "cost": 1}
    >>> rows = [{"id": "a", "plus": 3, "minus": -3, **row}, {"id": "b", "plus": 4, "minus": -4, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> y = ta.model(lambda a, b: a + b, inputs=("a", "b"), outputs=("y [mm]",)).bound(errors, "")
    >>> experiment = Experiment.of(y, errors, SeedTree(1))
    >>> round(worst_unit(experiment, starts=2, steps=4).value, 6)
    7.0
    """
    errors, allowed = experiment.errors, experiment.largest_failed_share
    if errors.joint:
        raise InputError.at("worst case", "joint sources", errors.joint[0].name, "none, because they have no zone")
    if min(starts, steps) < 1:
        raise InputError.at("worst case", "starts and steps", (starts, steps), "1 or more")
    uniform, parts = experiment.uniform(starts), tuple(zip(errors.active, errors.columns_of_source, strict=True))
    units = np.concatenate([source.at_limit(uniform[:, own]) for source, own in parts], axis=1)
    gradients, failed = np.zeros_like(units), 0
    # Of every start the worst value, its unit as deviations per unit of zone, and the mean gradients there
    worst, worst_units, worst_gradients = np.full(starts, -np.inf), units, gradients
    # Steps only come ever closer to the corners of the zones, where a convex output is largest: the last goes to them.
    for step in range(steps + 1):
        weight = max(_WEIGHT, 1.0 / (step + 1))
        if step == steps:
            units, gradients = _moved(experiment, worst_units, worst_gradients, 1.0), worst_gradients
            weight = 0.0
        elif step:
            units = _moved(experiment, units, gradients, 2.0 / (step + 1))
        found = experiment.response.with_derivatives(experiment.deviations(units))
        good = found.evaluation.good & np.isfinite(found.by_column).all(axis=1)
        values = np.where(good, sense * found.evaluation.values[:, 0], -np.inf)
        newest = np.where(good[:, np.newaxis], sense * found.by_column, gradients)
        gradients = gradients + weight * (newest - gradients)
        failed += int(np.isinf(values).sum())
        worse = (values > worst)[:, np.newaxis]
        worst, worst_units = np.maximum(worst, values), np.where(worse, units, worst_units)
        worst_gradients = np.where(worse, gradients, worst_gradients)
    if failed > allowed * starts * (steps + 1) or np.isinf(worst).all():
        raise SolveError(
            f"Worst case: {failed} of {starts * (steps + 1)} units have no usable answer; allowed is a share of "
            f"{allowed:.4g}."
        )
    most = int(worst.argmax())
    by_column = sense * worst_gradients[most] * worst_units[most]
    return WorstUnit(
        value=sense * float(worst[most]),
        x=experiment.deviations(worst_units[[most]])[0],
        by_zone=np.array([by_column[own].sum() for own in errors.columns_of_source]),
        ends=np.where(np.isinf(worst), np.nan, sense * worst),
    )


def _moved(experiment: Experiment[ResponseWithDerivatives], units: Units, gradients: Units, part: float) -> Units:
    """Return units a part of the way to the extremes of the zones along the gradients."""
    moved, errors = np.empty_like(units), experiment.errors
    for source, own in zip(errors.active, errors.columns_of_source, strict=True):
        extremes = _extreme_in_zone(source, units[:, own], gradients[:, own])
        if source.spectrum:  # waves with phases between theirs
            phases = _phases(units[:, own])
            apart = np.remainder(_phases(extremes) - phases + 0.5, 1.0) - 0.5
            moved[:, own] = _filled(source, phases + part * apart)
        else:
            moved[:, own] = units[:, own] + part * (extremes - units[:, own])
    return moved


def _extreme_in_zone(source: Source, units: Units, gradients: Units) -> Units:
    """Return, for every unit, the part inside the zone that goes furthest along a gradient, waves from the units' own.

    Exact for sizes and positions. Waves keep the relative amplitudes of the spectrum, and how large all of them may be
    follows from their phases by the range over a turn; the phases are searched one at a time and together, as if the
    part were turned, from those of the unit or of the gradient, whichever is the better start.
    """
    if source.feature is Feature.SIZE:
        return source.at_limit(np.where(gradients > 0.0, 0.75, 0.25))
    if source.feature is Feature.POSITION:
        return _filled(source, _phases(gradients))

    def along(phases: Float[np.ndarray, "unit order"]) -> Float[np.ndarray, " unit"]:
        return np.asarray((_filled(source, phases) * gradients).sum(axis=1))

    orders = np.array([order for order, _ in source.spectrum], float)
    directions = np.concatenate([np.eye(orders.size), orders[np.newaxis] / orders.max()])
    phases = _phases(units)
    furthest = along(phases)
    moves = [_phases(gradients) - phases, *(turn * own for turn in _TURNS for own in (*directions, *-directions))]
    for move in moves:
        found = along(phases + move)
        better = found > furthest
        phases = np.where(better[:, np.newaxis], phases + move, phases)
        furthest = np.maximum(found, furthest)
    return _filled(source, phases)


def _phases(columns: Units) -> Float[np.ndarray, "unit vector"]:
    """Return the direction of every vector [turn]."""
    return np.asarray(np.arctan2(columns[:, 1::2], columns[:, 0::2]) / (2 * np.pi))


def _filled(source: Source, phases: Float[np.ndarray, "unit vector"]) -> Units:
    """Return the vectors or waves with these phases [turn] that fill the zone."""
    return np.asarray(source.at_limit(np.repeat(phases % 1.0, 2, axis=1)))

"""Where a search of the settings begins: limits may be kept in more than one place, far from those of today."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import USUAL_YIELD, AtYield, Requirement
from tolalloc.allocation.space.tail import tail_weights
from tolalloc.allocation.verify.verification import Verifier
from tolalloc.capability.near_limit import largest_first
from tolalloc.drawings.seeds import SeedTree

_SCATTERED, _FOLLOWING = 16, 8
"""Settings that are looked at all over their ranges, and where the interpolation then says that it is best [-]."""
_INTERPOLATED = 1024
"""Settings of which the interpolation is asked [-]."""
_UNITS = 0.125
"""Units of each over those that verify a design [-]."""
_OUTERMOST = 0.1
"""Part of them that tells the tail [-]."""
_WITHIN = (-6.0, 20.0)
"""Levels between which they are told apart [-]."""
_APART = 0.1
"""How far others lie from those of the drawing, over a range [-]."""

Settings = Float[np.ndarray, " setting"]
Levels = Float[np.ndarray, " requirement"]


def units_of_scan(units: int) -> int:
    """Return how many units `other_settings` solves, where a verification solves so many [-]."""
    return (1 + _SCATTERED + _FOLLOWING) * max(int(_UNITS * units), 1)


def other_settings(verifier: Verifier, design: Float[np.ndarray, " variable"]) -> Float[np.ndarray, " variable"]:
    """Return a design with other settings that keep it far inside its limits, of some all over their ranges.

    Parameters
    ----------
    verifier
        Has the model, the limits and the ranges.
    design
        Scales [-] and settings; these stay where they cannot be others.

    Notes
    -----
    Common random units at a scrambled Sobol sequence over the ranges; then, one after another, where cubic radial basis
    functions through the levels of each limit have their least largest level, as each is smooth where the largest has
    an edge. The level of a limit is how far beyond it as many units lie as may, over the deviation of its output
    (`tail_weights`; own derivation).

    References
    ----------
    H.-M. Gutmann, J. Global Optim. 19 (2001) 201–227, for searches by radial basis functions.

    Examples
    --------
    A gap that is too far up by 0.2·setting, of which 0 is the best:

    >>> from tests.builders import verifier_with_setting
    >>> other_settings(verifier_with_setting(0.0, 10.0, present=5.0), np.array([1.0, 5.0])).round(1).tolist()
    [1.0, 0.0]
    """
    from scipy.stats import qmc

    space, groups = verifier.space, len(verifier.space.groups)
    lower, size = space.shared.lower, space.shared.upper - space.shared.lower
    free = np.flatnonzero(size > 0)
    if not free.size:
        return design
    seeds = verifier.seeds.child("settings")

    def at(point: Float[np.ndarray, " free"]) -> Float[np.ndarray, " variable"]:
        settings = design[groups:].copy()
        settings[free] = lower[free] + point * size[free]
        return np.append(design[:groups], settings)

    scattered, asked = (qmc.Sobol(free.size, rng=seeds.generator(at)) for at in range(2))
    points = [(design[groups:] - lower)[free] / size[free], *scattered.random(_SCATTERED)]
    levels, many = [_levels(verifier, at(point), seeds) for point in points], asked.random(_INTERPOLATED)
    for _ in range(_FOLLOWING):
        points.append(_most_promising(points, levels, many))
        levels.append(_levels(verifier, at(points[-1]), seeds))
    apart = np.abs(np.array(points) - points[0]).max(axis=1) > _APART
    largest = np.where(apart, np.max(levels, axis=1), np.inf)
    return at(points[int(largest.argmin())])


def _most_promising(
    points: list[Float[np.ndarray, " free"]], levels: list[Levels], among: Float[np.ndarray, "many free"]
) -> Float[np.ndarray, " free"]:
    """Return where the interpolated levels have their least largest, of many points that are not yet looked at."""
    from scipy.interpolate import RBFInterpolator

    known = np.array(points)
    predicted = RBFInterpolator(known, np.array(levels), kernel="cubic")(among).max(axis=1)
    seen = (np.abs(among[:, np.newaxis] - known).max(axis=2) < 1e-6).any(axis=1)
    return np.asarray(among[int(np.where(seen, np.inf, predicted).argmin())])


def _levels(verifier: Verifier, design: Float[np.ndarray, " variable"], seeds: SeedTree) -> Levels:
    """Return how far beyond each limit as many units of a design lie as may, over the deviations [-].

    The largest that is told apart where too many have no answer.
    """
    model = verifier.model.at(verifier.space.settings_of(design))
    asked = [own.in_force(model) for own in verifier.requirements if not isinstance(own, JointRequirement)]
    names = tuple(dict.fromkeys(name for own in asked for name in own.outputs))
    found = model.reading(names)(verifier.space.units(design, seeds, max(int(_UNITS * verifier.units), 1)))
    if 1 - found.good.mean() > verifier.largest_failed_share:
        return np.full(len(asked), _WITHIN[1])
    values = dict(zip(names, found.values[found.good].T, strict=True))
    return np.clip([_level(own, values, _share(verifier.requirements)) for own in asked], *_WITHIN)


def _level(asked: Requirement, values: dict[str, Float[np.ndarray, " unit"]], share: float) -> float:
    read = asked.read(values)
    excess = asked.limits.excess(read).max(axis=0) / (float(read.std()) or 1.0)
    outermost = excess[largest_first(excess, max(int(_OUTERMOST * excess.size), 2))]
    return float(tail_weights(excess.size, share, outermost.size) @ outermost)


def _share(asked: tuple[Requirement, ...]) -> float:
    """Return the share of units that may fail [-]."""
    targets = [own.guarantee.target for own in asked if isinstance(own.guarantee, AtYield)]
    return 1 - max(targets, default=USUAL_YIELD)

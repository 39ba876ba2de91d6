"""What moving one nominal to the middle of an output's limits brings: it costs nothing, a narrower zone does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tolalloc.capability.experiment import Experiment
from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.drawings.zones import Feature
from tolalloc.models.model import Response
from tolalloc.reading.units import MICROMETRE
from tolalloc.sensitivity.derivatives import LocalDerivatives

_OFF = 0.25
"""Distance of the mean from the middle of the limits over the standard deviation from which it is told [-]."""
_GAIN = 1e-3
"""Share of units that moving a nominal must bring inside the limits until it is told [-]."""
_ALIKE = 1e-6
"""Relative difference of two derivatives up to which the first size of the table moves, and no last digit decides."""
_UNITS = 4096
"""Units on which it is tried at most [-]."""


@dataclass(frozen=True, kw_only=True)
class Centring:
    """One nominal that puts the mean of an output into the middle of its limits."""

    source: str  # Size whose nominal moves: the one that has to move least
    shift: float  # By how much [m]
    off: float  # How far the mean lies above the middle of the limits [output]
    # Share of the same units inside the limits, with the nominal as it is and moved [-]
    now: float
    moved: float


def centring(
    experiment: Experiment[Response], sample: MonteCarlo, limits: Limits, local: LocalDerivatives
) -> Centring | None:
    """Return what moving one nominal brings; none with one limit, a mean in the middle, or no size that can move.

    The limited output is the first one of the experiment and of the random units.

    A nominal that is longer by d is a column that is longer by d in every unit: d = −off/(dy/dx), and the units are
    solved there, so that no linear model decides (own derivation).

    Examples
    --------
    The middle of a gap of 50 − 49.9 mm lies at 0.1 mm; its limits at 0.08 and 0.16 mm ask for 0.12 mm.

    >>> from tolalloc.capability.monte_carlo import monte_carlo
    >>> from tolalloc.drawings.seeds import SeedTree
    >>> from tolalloc.models.model import derived
    >>> from tolalloc.sensitivity.derivatives import local_derivatives
    >>> import tolalloc as ta
    >>> row = {"unit": "mm", "plus": 0.03, "minus": -0.03, "min": 0.01, "max": 0.1, "cost": 1}
    >>> rows = [{"id": "bore", "nominal": 50, **row}, {"id": "pin", "nominal": 49.9, **row}]
    >>> errors = ta.Drawing.of_rows(rows).errors
    >>> gap = ta.model(lambda bore, pin: bore - pin, inputs=("bore", "pin"), outputs=("gap [mm]",)).bound(errors, "")
    >>> asked = Experiment.of(gap.reading(("gap [mm]",)), errors, SeedTree(1))
    >>> sample = monte_carlo(asked, 1000)
    >>> slopes = Experiment.of(derived(gap, "gap [mm]", sample.x.std(axis=0)), errors, SeedTree(2))
    >>> found = centring(asked, sample, Limits(lower=0.08, upper=0.16), local_derivatives(slopes, 10))
    >>> found.source, round(1e3 * found.shift, 2), found.moved > 0.98 > found.now
    ('bore', 0.02, True)
    """
    values = sample.values[np.isfinite(sample.values)]
    if limits.lower is None or limits.upper is None or not np.ptp(values):
        return None
    off = float(values.mean()) - (limits.lower + limits.upper) / 2
    chosen = _least_moved(experiment, local)
    if chosen is None or abs(off) < _OFF * values.std():
        return None
    source, column, slope = chosen
    x = sample.x[:_UNITS].copy()
    x[:, column] -= off / slope
    now, moved = (
        float(np.mean(limits.kept_by(own)))
        for own in (sample.evaluation.values[:_UNITS, 0], experiment.response(x).values[:, 0])
    )
    if moved < now + _GAIN:
        return None
    return Centring(source=source, shift=-off / slope, off=off, now=now, moved=moved)


def _least_moved(experiment: Experiment[Response], local: LocalDerivatives) -> tuple[str, int, float] | None:
    """Return the free size with the steepest derivative, its column, and that derivative [output per m]."""
    errors, slopes = experiment.errors, dict(zip(local.sources, local.slope, strict=True))
    free = [
        (abs(slopes[own.name]), own.name, at.start)
        for own, at in zip(errors.active, errors.columns_of_source, strict=False)
        if own.feature is Feature.SIZE and len(own.columns) == 1 and own.lever == 1.0 and not own.locked
    ]
    steepest = max((own[0] for own in free), default=0.0)
    if not steepest:
        return None
    _, name, column = next(own for own in free if own[0] >= (1 - _ALIKE) * steepest)
    return name, column, float(slopes[name]) / MICROMETRE

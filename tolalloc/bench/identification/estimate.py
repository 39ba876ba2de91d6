"""The answer as other studies take it: stiffnesses with their covariance, and what the data leave open said as such."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tolalloc.bench.identification.information import Information
from tolalloc.bench.identification.parameters import Parameter
from tolalloc.bench.identification.profile import Profile
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One parameter.

    Parameters
    ----------
    parameter
        Which one.
    value
        Most probable if the bounds count as an even distribution: next to the least objective where the data say much,
        the middle of the bounds where they say nothing [as parameter].
    uncertainty
        Its standard uncertainty, of the logarithm but for the bias [-, arcsec].
    interval
        95 % profile interval [as parameter].
    identified
        Whether the interval keeps away from at least one bound.
    on_bound
        Whether the least objective stands on a bound.
    """

    parameter: Parameter
    value: float
    uncertainty: float
    interval: tuple[float, float]
    identified: bool
    on_bound: bool

    @property
    def sentence(self) -> str:
        """What to make of it."""
        item = self.parameter
        low, high = (f"{value:.4g}" for value in self.interval)
        if not self.identified:
            spanned = item.written(f"{low}…{high}")
            return f"{item.symbol} is not identified by these data: its 95 % interval spans the bounds, {spanned}."
        bound = "; the least objective is on a bound" if self.on_bound else ""
        value, interval = item.written(f"{self.value:.4g}"), item.written(f"{low}…{high}")
        return f"{item.symbol} = {value}, 95 % interval {interval}{bound}."


def estimates(
    parameters: Sequence[Parameter],
    found: Information,
    written: Information,
    profiles: Sequence[Profile],
) -> tuple[Estimate, ...]:
    """Return all parameters.

    Parameters
    ----------
    parameters
        The unknowns.
    found, profiles
        What the readings say around the least objective.
    written
        The same where readings and bounds together put the parameters.
    """
    deviations, rows = np.sqrt(np.diag(written.covariance)), []
    for at, (item, own) in enumerate(zip(parameters, profiles, strict=True)):
        low, high = own.interval
        rows.append(
            Estimate(
                parameter=item,
                value=item.value(float(written.coordinates[at])),
                uncertainty=float(deviations[at]),
                interval=(item.value(low), item.value(high)),
                identified=own.is_identified,
                on_bound=bool(found.on_bound[at]),
            )
        )
    return tuple(rows)


def as_stiffness(
    answer: Sequence[Estimate], written: Information, source: str, notes: Sequence[str]
) -> IdentifiedStiffness | None:
    """Return the stiffnesses for a stiffness file; none if no stiffness was asked for.

    Parameters
    ----------
    answer
        All parameters.
    written
        Their information, whose covariance links them: what is fixed is often a combination.
    source
        Where the readings come from.
    notes
        What a reader must know.
    """
    places = [at for at, item in enumerate(answer) if item.parameter.is_stiffness]
    if not places:
        return None
    covariance = written.covariance
    spread = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(spread, spread)
    np.fill_diagonal(correlation, 1.0)
    chosen = [answer[at] for at in places]
    return IdentifiedStiffness(
        source=source,
        values={item.parameter.name: item.value for item in chosen},
        standard_uncertainty={item.parameter.name: item.value * item.uncertainty for item in chosen},
        correlation=correlation[np.ix_(places, places)],
        notes=(*notes, *(item.sentence for item in answer if not item.identified or item.on_bound)),
    )

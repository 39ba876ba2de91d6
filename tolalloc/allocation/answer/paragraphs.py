"""What stands between a heading and its tables, where it depends on what was found."""

from __future__ import annotations

import numpy as np

from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.answer.tables import unit_of, unit_quantile
from tolalloc.allocation.guarantee import AtYield


def quantiles(results: AllocationResults) -> tuple[str, ...]:
    """Return how much safer than asked the drawing is, since its units are few."""
    said = []
    for check in results.chosen.checks:
        kept, value, guarantee = unit_quantile(results.chosen, check), check.sides[0].value, check.requirement.guarantee
        if isinstance(guarantee, AtYield) and np.isfinite(kept) and np.isfinite(value):
            unit = unit_of(check.requirement.output)
            said.append(
                f"{check.requirement.output.split(' [')[0]}: {guarantee.target:.2%} of these units keep "
                f"{'at most' if check.sides[0].sign > 0 else 'at least'} {kept:.4g} {unit}; {value:.4g} {unit} is what "
                f"{results.chosen.joint.units:,} units show with 95 % confidence."
            )
    return tuple(said)


def cheapest_clearances(results: AllocationResults) -> tuple[str, ...]:
    """Return where the zones are cheapest among the clearances that were tried."""
    trade = results.trade
    flank, radial = trade.cheapest
    if not np.isfinite([flank, radial]).all():
        return ("With no pair of clearances that was tried were zones found that keep all requirements.",)
    missed_by = f", whose corrected model misses the kernel by {trade.error:.2g}″" if np.isfinite(trade.error) else ""
    return (
        f"Of the pairs that were tried the zones are cheapest with {flank:.3g} µm on the flank and {radial:.3g} µm at "
        f"tip and root: {np.nanmin(trade.cost):.2f} cost units by the local models{missed_by}.",
    )

"""The tables of what would be otherwise: clearances, assumptions, yields; a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.units import MICROMETRE


def trade_table(results: AllocationResults) -> pd.DataFrame:
    """Return cost and price of a micrometre for every pair of clearances."""
    trade = results.trade
    flank, radial = np.meshgrid(trade.flank, trade.radial, indexing="ij")
    return pd.DataFrame(
        {
            "flank clearance [µm]": flank.ravel(),
            "radial clearance [µm]": radial.ravel(),
            "cost [cost units]": trade.cost.ravel(),
            "1 µm more on the flank costs at the rate of [cost units/µm]": trade.price_of_flank.ravel(),
            "1 µm more at tip and root costs at the rate of [cost units/µm]": trade.price_of_radial.ravel(),
        }
    )


def robustness_table(results: AllocationResults) -> pd.DataFrame:
    """Return how far every free zone moves when an assumption is wrong."""
    found, zones = results.robustness, results.space.first_zones / MICROMETRE
    ratios, best = found.ratios, found.optimum * zones
    return pd.DataFrame(
        {
            "group": found.groups,
            "free zone [µm]": best,
            "smallest under all changes [µm]": best * ratios.min(axis=0),
            "largest under all changes [µm]": best * ratios.max(axis=0),
            "same in all": ["yes" if same else "no" for same in found.same],
        }
    )


def variants_table(results: AllocationResults) -> pd.DataFrame:
    """Return the answers under changed assumptions."""
    rows = [
        {
            "assumption": variant.name,
            "cheapest then [cost units]": variant.cost,
            "free zones cost more by [%]": variant.regret * 100,
            "free zones keep all": "yes" if variant.kept else "no",
        }
        for variant in results.robustness.variants
    ]
    return pd.DataFrame(rows)


def prices_table(results: AllocationResults) -> pd.DataFrame:
    """Return the price of a good unit over yield targets, nothing where none has a price."""
    found = results.prices
    if found is None or not found.priced.size:
        return pd.DataFrame()
    return pd.DataFrame(
        {
            "yield target [%]": found.targets * 100,
            "cheapest unit made to it [cost units]": found.manufacturing,
            "price of a good unit [cost units]": found.prices,
        }
    )

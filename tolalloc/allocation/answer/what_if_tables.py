"""The tables of what would be otherwise: settings, assumptions, yields; a unit in every header."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.allocation.cost.unit_price import YieldLadder
from tolalloc.allocation.front.what_if import Robustness, SettingTrade
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.wording import quantity

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer


def trade_table(trade: SettingTrade) -> pd.DataFrame:
    """Return cost and price of one more unit of each setting, for every choice of settings."""
    values = np.meshgrid(*trade.values, indexing="ij")
    frame = pd.DataFrame({name: own.ravel() for name, own in zip(trade.names, values, strict=True)})
    frame["cost [cost units]"] = trade.cost.ravel()
    for at, name in enumerate(trade.names):
        header = f"1 {unit_of(name)} more {quantity(name)} costs at the rate of [cost units/{unit_of(name)}]"
        frame[header] = trade.price(at).ravel()
    return frame


def robustness_table(answer: AllocationAnswer, found: Robustness) -> pd.DataFrame:
    """Return how far every free zone moves when an assumption is wrong."""
    zones = answer.space.first_zones / MICROMETRE
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


def variants_table(found: Robustness) -> pd.DataFrame:
    """Return the answers under changed assumptions."""
    rows = [
        {
            "assumption": variant.name,
            "cheapest then [cost units]": variant.cost,
            "free zones cost more by [%]": variant.regret * 100,
            "free zones keep all": "yes" if variant.kept else "no",
        }
        for variant in found.variants
    ]
    return pd.DataFrame(rows)


def prices_table(found: YieldLadder) -> pd.DataFrame:
    """Return the price of a good unit over yield targets."""
    return pd.DataFrame(
        {
            "yield target [%]": found.targets * 100,
            "cheapest unit made to it [cost units]": found.manufacturing,
            "price of a good unit [cost units]": found.prices,
        }
    )

"""What a good unit costs: quality loss, scrap, rework and inspection, and the yield that makes it cheapest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.reading.named_fields import NamedFields, number

_COST = number("a finite number, 0 or above", least=0)


@dataclass(frozen=True, kw_only=True)
class QualityLoss(NamedFields):
    """What a unit costs its user although it is within its limit, growing with the square of the deviation.

    Theory page equation (53).

    Parameters
    ----------
    limit
        Deviation from the best value at which the loss is `at_limit` [unit of the output].
    at_limit
        Loss of a unit at the limit, such as its repair [cost units].

    Raises
    ------
    InputError
        A limit that is not above 0, or a loss below 0.

    References
    ----------
    G. Taguchi, E. A. Elsayed, T. C. Hsiang, Quality Engineering in Production Systems, McGraw-Hill (1989).
    """

    called: ClassVar[str] = "quality loss"
    by_position: ClassVar[int] = 2

    limit: Annotated[float, number("a finite number above 0", above=0)]
    at_limit: Annotated[float, _COST]

    def nominal_is_best(self, offset: float, deviation: float) -> float:
        """Return the mean loss per unit where the nominal value is best [cost units].

        A/Δ²·(offset² + σ²), theory page equation (53), with the loss A at the limit Δ; the offset is the mean less the
        nominal value, the deviation the standard one [unit of the output].

        >>> QualityLoss(limit=10.0, at_limit=50.0).nominal_is_best(offset=3.0, deviation=4.0)
        12.5
        """
        return self.at_limit / self.limit**2 * (offset**2 + deviation**2)

    def smaller_is_better(self, mean: float, deviation: float) -> float:
        """Return the mean loss per unit where 0 is best, such as for the transmission error [cost units].

        A/Δ²·(mean² + σ²), theory page equation (53).
        """
        return self.nominal_is_best(mean, deviation)


@dataclass(frozen=True, kw_only=True)
class UnitPrice(NamedFields):
    """What becomes of units beyond the limit, and so what a good unit costs.

    Theory page equation (52).

    Parameters
    ----------
    inspection
        Inspecting one unit [cost units].
    rework_share
        Share of the units beyond the limit that rework makes good; the others are scrapped [-].
    rework
        Reworking one unit [cost units].
    scrap
        Scrapping one unit, beyond what making it cost [cost units].

    Raises
    ------
    InputError
        A cost below 0 or a share outside 0 to 1.
    """

    called: ClassVar[str] = "price of a unit"
    by_position: ClassVar[int] = 4

    inspection: Annotated[float, _COST] = 0.0
    rework_share: Annotated[float, number("a number from 0 to 1", least=0, most=1)] = 0.0
    rework: Annotated[float, _COST] = 0.0
    scrap: Annotated[float, _COST] = 0.0

    def good_share(self, target: float) -> float:
        """Return the share of good units after rework, y + (1 − y)·r of the yield y before it [-].

        Examples
        --------
        >>> UnitPrice(rework_share=0.5).good_share(0.9)
        0.95
        """
        good = target + (1 - target) * self.rework_share
        if not (0 <= target <= 1 and good > 0):
            raise InputError.at("price of a unit", "yield", target, "a share from 0 to 1 that leaves good units")
        return good

    def of_good_unit(self, manufacturing: float, target: float) -> float:
        """Return what all units cost over the number of good ones [cost units].

        Parameters
        ----------
        manufacturing
            Making one unit, good or bad [cost units].
        target
            Yield before rework [-].

        Notes
        -----
        (c + inspection + (1 − y)·(r·rework + (1 − r)·scrap)) / (y + (1 − y)·r), theory page equation (52), with the
        yield y and the share r that rework makes good.

        Examples
        --------
        A tenth of the units is beyond the limit, half of these are made good for 20, the others cost 10 to scrap:

        >>> UnitPrice(inspection=1.0, rework_share=0.5, rework=20.0, scrap=10.0).of_good_unit(93.0, 0.9)
        100.52631578947368
        """
        beyond = self.rework_share * self.rework + (1 - self.rework_share) * self.scrap
        return (manufacturing + self.inspection + (1 - target) * beyond) / self.good_share(target)


@dataclass(frozen=True, kw_only=True)
class YieldLadder:
    """Prices of a good unit over yield targets."""

    targets: Float[np.ndarray, " step"]  # Yield targets [-]
    # Cheapest unit made to each target; not a number where no design is shown to reach it [cost units]
    manufacturing: Float[np.ndarray, " step"]
    prices: Float[np.ndarray, " step"]  # Price of a good unit [cost units]

    @property
    def best(self) -> float:
        """Yield target with the cheapest good unit, not a number where no target has a price [-]."""
        return float(self.targets[np.nanargmin(self.prices)]) if self.priced.size else np.nan

    @property
    def priced(self) -> Float[np.ndarray, " known"]:
        """Yield targets that a design reaches and that the units can show [-]."""
        return np.asarray(self.targets[~np.isnan(self.prices)])


def best_yield(cost_of_yield: Callable[[float], float], price: UnitPrice, yields: Sequence[float]) -> YieldLadder:
    """Return the prices of a good unit over a ladder of yield targets; its `best` is the cheapest.

    The least p(y) = (c(y) + inspection + (1 − y)·(r·rework + (1 − r)·scrap)) / (y + (1 − y)·r), as `UnitPrice` (own
    derivation) [cost units]; for yields from 0 to 1 that leave good units.

    Parameters
    ----------
    cost_of_yield
        Manufacturing cost of the cheapest design that keeps a yield, or not a number where none does.
    price
        What becomes of the units beyond the limit.
    yields
        Yield targets to choose from [-].

    Examples
    --------
    >>> best_yield(lambda target: 50 / (1 - target) ** 0.1, UnitPrice(scrap=40.0), (0.9, 0.99, 0.999)).best
    0.9
    """
    if not yields:
        raise InputError.at("price of a unit", "yields", list(yields), "one target or more")
    for target in yields:  # before anything long runs
        price.good_share(target)
    manufacturing = np.array([cost_of_yield(target) for target in yields], dtype=float)
    prices = [price.of_good_unit(float(cost), target) for cost, target in zip(manufacturing, yields, strict=True)]
    return YieldLadder(targets=np.array(yields, dtype=float), manufacturing=manufacturing, prices=np.array(prices))

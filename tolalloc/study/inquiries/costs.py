"""What a shop charges for a zone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tolalloc.allocation.cost.points import ShopFit, currency_of_prices, load_shop_points, shop_fits
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, Word


@dataclass(frozen=True, kw_only=True)
class Costs(Inquiry[tuple[ShopFit, ...]]):
    """Fit the cost of a zone to shop data: every closed form with its fit error and the range where it is valid."""

    word: ClassVar[str] = "costs"
    example: ClassVar[str] = "tolalloc costs mine/shop.csv"
    by_position: ClassVar[int] = 1

    shop: Annotated[Path, Word("CSV: columns process, tolerance [unit], unit, cost [cost units].")]

    def prepare(self) -> tuple[ShopFit, ...]:
        """Return the forms through the points of the file."""
        return shop_fits(load_shop_points(self.shop))

    def solve(self, prepared: tuple[ShopFit, ...], progress: Progress) -> Answer[tuple[ShopFit, ...]]:  # noqa: ARG002
        """Return the forms with the currency that the file states."""
        header = Header(name=self.shop.name, model="closed forms", currency=currency_of_prices(self.shop))
        return Answer(kind="costs", header=header, result=prepared)

"""The command ``tolalloc costs``: from a shop's prices to cost models with their errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, tell, write_report


def costs(
    shop: Annotated[Path, typer.Argument(help="CSV: columns process, tolerance [unit], unit, cost [cost units].")],
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Cost of a zone from shop data: every closed form with its fit error and the range where it holds."""
    from tolalloc.allocation.cost.answer import CostFitsAnswer
    from tolalloc.allocation.cost.points import currency_of_prices, load_shop_points
    from tolalloc.report.currency import in_currency

    answer = CostFitsAnswer.of(load_shop_points(shop), shop.name, currency_of_prices(shop))
    write_report(answer, out)
    fits = answer.to_frame("fits")
    form = in_currency("form, t in µm [cost units]", answer.header.currency)
    shown = ["process", form, "rms error [%]", "error at points left out [%]", "taken"]
    tell(answer, as_json, (fits[shown], f"{shop.name}: what a zone costs"))

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
    from tolalloc.allocation.cost.points import load_shop_points

    answer = CostFitsAnswer.of(load_shop_points(shop), shop.name)
    write_report(answer, out)
    columns = ["process", "form, t in µm [cost units]", "rms error [%]", "error at points left out [%]", "taken"]
    tell(answer, as_json, (answer.fits[columns], f"{shop.name}: what a zone costs"))

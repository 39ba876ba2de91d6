"""The command ``tolalloc costs``: from a shop's prices to cost models with their errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, print_json, print_table, say


def costs(
    shop: Annotated[Path, typer.Argument(help="CSV: columns process, tolerance [unit], unit, cost [cost units].")],
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Cost of a zone from shop data: every closed form with its fit error and the range where it holds."""
    from tolalloc.allocation.cost.fits_answer import cost_fits_document, fits_table, fitted_processes
    from tolalloc.allocation.cost.points_file import load_shop_points
    from tolalloc.cli.document_script import written

    found = fitted_processes(load_shop_points(shop))
    document = cost_fits_document(found, shop.name)
    if out:
        written(out, lambda: document)
    if as_json:
        print_json(document.summary)
        return
    table = fits_table(found)
    columns = ["process", "form, t in µm [cost units]", "rms error [%]", "error at points left out [%]", "taken"]
    print_table(table[columns], f"{shop.name}: what a zone costs")
    say(document)

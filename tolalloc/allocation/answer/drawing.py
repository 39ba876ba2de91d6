"""What to write on the drawing: the allocated table, and a workbook that goes on calculating."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.calculator import calculator_sheets, style_calculator
from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.cost.process_costs_file import today
from tolalloc.drawing.fields import HEADERS
from tolalloc.drawing.sources import Source
from tolalloc.drawing.tolerance_table import table_frame
from tolalloc.report.excel import write_sheets
from tolalloc.units import MICROMETRE


def drawn_sources(results: AllocationResults) -> tuple[Source, ...]:
    """Return all sources of the tolerance table at the zones of the drawing, with process, grade and cost."""
    space, chosen = results.drawn, results.chosen
    zones = dict(zip((source.name for source in space.errors.active), space.zones(chosen.design), strict=True))
    made = space.made_by(chosen.design)
    labels = dict(zip(space.groups, results.graded.labels, strict=True)) if results.graded else {}
    found = []
    for source in results.space.errors.sources:
        if source.name not in made:
            found.append(source)
            continue
        zone = float(zones[source.name])
        found.append(
            replace(
                source,
                zone=zone,
                cost=float(made[source.name].total(np.array(zone))),
                process=made[source.name].name if _has_prices(source, results) else source.process,
                grade=labels.get(source.group, ""),
            )
        )
    return tuple(found)


def _has_prices(source: Source, results: AllocationResults) -> bool:
    """Return whether the process cost table knows a source; where it does not, no process was chosen."""
    alone = (today(source),)
    return results.space.processes.get(source.name, alone) != alone


def sources_to_go_on_from(results: AllocationResults) -> tuple[Source, ...]:
    """Return the drawn sources as the next study takes them: leaving the old process was paid for, once."""
    made = results.drawn.made_by(results.chosen.design)
    return tuple(
        replace(source, cost=source.cost - made[source.name].change) if source.name in made else source
        for source in drawn_sources(results)
    )


def drawing_table(results: AllocationResults) -> pd.DataFrame:
    """Return the drawing in short: zone, grade, process, share of the variance and cost of every source."""
    made = results.drawn.made_by(results.chosen.design)
    now = results.space.made_by(results.joint.baseline.design)
    shares = _shares(results)
    rows = []
    for before, after in zip(results.space.errors.sources, drawn_sources(results), strict=True):
        if before.zone == 0.0:
            continue
        changed = before.name in made
        rows.append(
            {
                "source": before.name,
                "callout": before.feature.value,
                "zone before [µm]": before.zone / MICROMETRE,
                "zone [µm]": after.zone / MICROMETRE,
                "change [%]": (after.zone / before.zone - 1) * 100,
                "grade": after.grade,
                "process before": now[before.name].name if changed else before.process,
                "process": made[before.name].name if changed else before.process,
                "share of variance [%]": shares.get(before.name, float("nan")),
                "cost before [cost units]": before.cost,
                "cost [cost units]": after.cost,
                "locked": "yes" if before.locked else "no",
            }
        )
    return pd.DataFrame(rows)


def _shares(results: AllocationResults) -> dict[str, float]:
    """Return the share of every source in the sum of the total indices [%]."""
    shares = results.shares
    total = shares.total / shares.total.sum() * 100
    return {name: float(share) for name, share in zip(shares.sources, total, strict=True)}


def full_drawing_table(results: AllocationResults) -> pd.DataFrame:
    """Return the tolerance table in the layout of the input, with share of the variance and change added."""
    frame, short = table_frame(drawn_sources(results)), drawing_table(results).set_index("source")
    names = frame[HEADERS["id"]]
    for header in ("share of variance [%]", "change [%]", "cost before [cost units]"):
        frame[header] = names.map(short[header])
    return frame


def write_drawing(results: AllocationResults, folder: Path) -> None:
    """Write ``allocation.csv``, which ``tolalloc`` reads back, and ``drawing.xlsx``, which goes on calculating.

    Parameters
    ----------
    results
        The finished allocation.
    folder
        The written report.
    """
    table_frame(sources_to_go_on_from(results), folder).to_csv(folder / "allocation.csv", index=False)
    sheets = {"drawing": full_drawing_table(results), **calculator_sheets(results)}
    write_sheets(sheets, folder / "drawing.xlsx")
    style_calculator(folder / "drawing.xlsx")

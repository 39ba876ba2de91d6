"""What to write on the drawing: the allocated table, and a workbook that goes on calculating."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.allocation.answer.calculator import calculator_sheets, style_calculator
from tolalloc.allocation.answer.dimensions import frames_of
from tolalloc.allocation.answer.sentences import amounts_convention, drawn_amounts
from tolalloc.allocation.cost.process_costs import today
from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import setting_line
from tolalloc.drawings.tolerance_table import table_frame, with_own_words
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.currency import in_currency
from tolalloc.reports.excel import write_sheets
from tolalloc.reports.feature_frame import write_frames
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.writer import write_csv

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer


def drawn_sources(answer: AllocationAnswer) -> tuple[Source, ...]:
    """Return all sources of the tolerance table at the zones of the drawing, with process, grade and cost."""
    space, chosen = answer.drawn, answer.chosen
    zones = dict(zip((source.name for source in space.errors.active), space.zones(chosen.design), strict=True))
    made, costs = space.made_by(chosen.design), space.cost_of_sources(chosen.design)
    on_grades = answer.graded and chosen is answer.graded.chosen
    labels = dict(zip(space.groups, answer.graded.labels, strict=True)) if answer.graded and on_grades else {}
    found = []
    for source in answer.space.errors.sources:
        if source.name not in made:
            found.append(source)
            continue
        found.append(
            replace(
                source,
                zone=float(zones[source.name]),
                cost=costs[source.name],
                process=made[source.name].name if _has_prices(source, answer) else source.process,
                grade=labels.get(source.group, ""),
            )
        )
    return tuple(found)


def _has_prices(source: Source, answer: AllocationAnswer) -> bool:
    """Return whether the process cost table knows a source; where it does not, no process was chosen."""
    alone = (today(source),)
    return answer.space.processes.get(source.name, alone) != alone


def sources_to_go_on_from(answer: AllocationAnswer) -> tuple[Source, ...]:
    """Return the drawn sources as the next study takes them: leaving the old process was paid for, once."""
    changes = process_changes(answer)
    return tuple(replace(source, cost=source.cost - changes.get(source.name, 0.0)) for source in answer.drawn_sources)


def process_changes(answer: AllocationAnswer) -> dict[str, float]:
    """Return what leaving the old process costs once, of every source whose zone may change [cost units]."""
    made = answer.drawn.made_by(answer.chosen.design)
    return {name: process.change for name, process in made.items()}


def drawing_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return the drawing in short: zone, grade, process, share of the variance and cost of every source."""
    made = answer.drawn.made_by(answer.chosen.design)
    now = answer.space.made_by(answer.free.baseline.design)
    shares, changes = _shares(answer), process_changes(answer)
    unit = unit_of(answer.leading)
    sens = _by_source(answer, answer.chosen.by_deviation)
    slopes = _by_source(answer, answer.chosen.by_zone)
    rows = []
    for before, after in zip(answer.space.errors.sources, answer.drawn_sources, strict=True):
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
                **({f"Sens [{unit}/µm]": sens.get(before.name, float("nan"))} if sens else {}),
                **({f"kept value per zone [{unit}/µm]": slopes.get(before.name, float("nan"))} if slopes else {}),
                "cost before [cost units]": before.cost,
                "cost [cost units]": after.cost,
                **(
                    {"of it for a new process [cost units]": changes.get(before.name, 0.0)}
                    if any(changes.values())
                    else {}
                ),
                "locked": "yes" if before.locked else "no",
            }
        )
    return with_own_words(pd.DataFrame(rows), "source", {own.name: (own,) for own in answer.space.errors.sources})


def _by_source(answer: AllocationAnswer, derivatives: Float[np.ndarray, " source"] | None) -> dict[str, float]:
    """Return derivatives of the chosen design by the name of the source, none where there are none [output per µm]."""
    if derivatives is None:
        return {}
    names = [source.name for source in answer.drawn.errors.active]
    return dict(zip(names, (derivatives * MICROMETRE).tolist(), strict=True))


def _shares(answer: AllocationAnswer) -> dict[str, float]:
    """Return the share of every source in the sum of the total indices [%]."""
    shares = answer.shares
    total = shares.total / shares.total.sum() * 100
    return {name: float(share) for name, share in zip(shares.sources, total, strict=True)}


def full_drawing_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return the tolerance table in the layout of the input, with share of the variance and change added."""
    frame, short = table_frame(answer.drawn_sources), answer.drawing_table.set_index("source")
    names = pd.Series([source.name for source in answer.drawn_sources])
    for header in ("share of variance [%]", "change [%]", "cost before [cost units]"):
        frame[header] = names.map(short[header])
    return frame


def write_drawing(answer: AllocationAnswer, folder: Path) -> None:
    """Write ``allocation.csv``, which ``tolalloc`` reads back, and ``drawing.xlsx``, which goes on calculating."""
    currency = answer.header.currency
    write_csv(in_currency(table_frame(answer.drawn_sources, folder), currency), folder / "allocation.csv")
    with (folder / "allocation.csv").open("a", encoding="utf-8") as file:
        file.write("".join(f"{line}\n" for line in _table_comments(answer)))
    sheets = {**calculator_sheets(answer), **_settings_sheet(answer), "tolerances": full_drawing_table(answer)}
    write_sheets({name: in_currency(frame, currency) for name, frame in sheets.items()}, folder / "drawing.xlsx")
    style_calculator(answer, folder / "drawing.xlsx")
    notes = (*drawn_amounts(answer), *amounts_convention(answer))
    write_frames(frames_of(answer), folder / "frames.dxf", notes)


def _table_comments(answer: AllocationAnswer) -> list[str]:
    """Return what a table says below its rows: of which study it is, what it costs, and the settings that belong to it.

    Without commas and semicolons, so that no program that reads the rows parts them into cells.
    """
    paid = sum(process_changes(answer).values())
    once = f"; of it {paid:.4f} once for new processes" if paid else ""
    said = [
        f"drawing of study {answer.header.name} ({answer.header.digest[:12]}): cost {answer.cost:.4f}{once}",
        *drawn_amounts(answer),
        *amounts_convention(answer),
    ]
    values = zip(answer.space.shared.names, answer.chosen.settings.tolist(), strict=True)
    lines = [f"# {sentence}".replace(",", " and").replace(";", " -") for sentence in said]
    return [*lines, *(setting_line(name, value) for name, value in values)]


def _settings_sheet(answer: AllocationAnswer) -> dict[str, pd.DataFrame]:
    """Return a sheet of the settings that belong to the drawing and of what is made for them; none without any."""
    if not answer.space.settings:
        return {}
    drawn, chosen, today = answer.model.drawn_amounts, answer.chosen.settings, answer.free.baseline.settings
    names = [*drawn.names, *(name for name in answer.space.shared.names if name not in drawn.names)]
    value, before = (
        {
            **dict(zip(answer.space.shared.names, own, strict=True)),
            **dict(zip(drawn.names, drawn.by_setting @ own, strict=True)),
        }
        for own in (chosen, today)
    )
    rows: list[dict[str, object]] = [
        {
            "what": name.split(" [")[0],
            "value [unit]": float(value[name]),
            "before [unit]": float(before[name]),
            "unit": unit_of(name),
        }
        for name in names
    ]
    rows += [{"what": sentence} for sentence in amounts_convention(answer)]
    return {portrait_of(answer.model).settings_word: pd.DataFrame(rows)}

"""The drawing with one line per dimension: what to write, what it takes part in, what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import with_own_words
from tolalloc.reports.feature_frame import FeatureFrame, Frames, callout
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.wording import short, with_unit

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer

_SAME = 1e-9
"""Relative difference up to which two zones are the same [-]."""
_STEP = 0.1
"""Share of a zone by which the figure of effects opens it [-]."""
PART = "part in the variance (total index) [%]"
"""Header of the share of the variance in which a dimension has a part."""


def dimensions(answer: AllocationAnswer) -> dict[str, tuple[Source, ...]]:
    """Return the members of every dimension that has a zone, as drawn."""
    found: dict[str, list[Source]] = {}
    for source in answer.drawn_sources:
        if source.zone > 0.0:
            found.setdefault(source.group or source.name, []).append(source)
    return {name: tuple(members) for name, members in found.items()}


def frames(members: Sequence[Source]) -> Frames:
    """Return the different frames of the members of a dimension."""
    return Frames(dict.fromkeys(map(callout, members)))


def dimensions_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return one row per dimension of the drawing."""
    table, parts = answer.drawing_table.set_index("source"), _parts(answer)
    rows = []
    for name, members in dimensions(answer).items():
        own = table.loc[[source.name for source in members]]
        first, cost = own.iloc[0], own["cost [cost units]"].sum()
        rows.append(
            {
                "dimension": name,
                "places [-]": len(members),
                "write [mm]": frames(members),
                "zone before [µm]": _span(own["zone before [µm]"]),
                "zone [µm]": _span(own["zone [µm]"]),
                "change [%]": first["change [%]"],
                "grade": first["grade"],
                "process before": first["process before"],
                "process": first["process"],
                PART: _part(members, parts),
                "cost before [cost units]": own["cost before [cost units]"].sum(),
                "cost [cost units]": cost,
                "locked": first["locked"],
            }
        )
    frame = with_own_words(pd.DataFrame(rows), "dimension", dimensions(answer))
    said = {"grade": "", "process before": "as today", "process": "as today", "locked": "no"}
    return frame.drop(columns=[name for name, nothing in said.items() if (frame[name].isin([nothing, ""])).all()])


def _span(zones: pd.Series[float]) -> float | str:
    """Return the zone of all members, or the smallest and the largest of them."""
    low, high = float(zones.min()), float(zones.max())
    return low if high - low <= _SAME * high else f"{low:.4g}…{high:.4g}"


def _parts(answer: AllocationAnswer) -> Mapping[str, float]:
    """Return the total index of every dimension, correlated ones under each of their names [%]."""
    found = answer.shares_of_dimensions
    return {
        name: float(total) * 100.0
        for joined, total in zip(found.sources, found.total, strict=True)
        for name in joined.split(" + ")
    }


def _part(members: Sequence[Source], parts: Mapping[str, float]) -> float:
    """Return the total index of a dimension [%]; none where nothing of it varies."""
    return parts.get(members[0].group or members[0].name, np.nan)


def effects_figure(answer: AllocationAnswer) -> Figure | None:
    """Return what opening each dimension does to what is kept of the leading output, largest effect first.

    None where the model of the drawing knows no derivatives by zones.
    """
    if answer.chosen.by_zone is None:
        return None
    names = [source.name for source in answer.drawn.errors.active]
    slope = dict(zip(names, answer.chosen.by_zone.tolist(), strict=True))
    effects = {
        name: sum(_STEP * source.zone * slope.get(source.name, 0.0) for source in members)
        for name, members in dimensions(answer).items()
    }
    order = sorted(effects, key=lambda name: -abs(effects[name]))
    kept = with_unit(f"{answer.chosen.quantile_bound:.4g}", answer.leading)
    return Figure(
        name="effects",
        title=f"What opening one dimension by {_STEP:.0%} adds to the {short(answer.leading)} kept ({kept})",
        x_label=f"change of {answer.leading}",
        series=(
            Series(
                label="effect with its sign, to first order", kind="bars", x=order, y=[effects[name] for name in order]
            ),
        ),
        vertical=((0.0, ""),),
    )


def frames_of(answer: AllocationAnswer) -> list[tuple[str, FeatureFrame]]:
    """Return every frame with the name of its dimension, for a drawing program."""
    return [(name, frame) for name, members in dimensions(answer).items() for frame in frames(members)]

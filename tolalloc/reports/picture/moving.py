"""The moving picture of a reducer in a report: the module of the live page in the page, and the same drawn as PNG."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure as Canvas

from tolalloc.reports.charts import chart
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.picture.animation import animate
from tolalloc.reports.picture.still import draw_still
from tolalloc.reports.plots import drawn, save_png


@dataclass(frozen=True, kw_only=True)
class MovingPicture(Figure):
    """A reducer that moves in the page.

    Parameters
    ----------
    record
        The scene as `tolalloc.reports.picture.blocks.scene_record` says it.
    shares
        Place → how strongly it is coloured, from 0 to 1 [-].
    pictures
        Pictures of its PNG, one for a still one; more make one turn of the cranks as the output sees it, after which
        it closes [-].
    """

    x_label: str = ""
    series: tuple[Series, ...] = ()
    record: Mapping[str, Any]
    shares: Mapping[str, float] = field(default_factory=dict)
    pictures: int = 1


@chart.register
def _(figure: MovingPicture) -> dict[str, Any]:
    return {"title": figure.title, "scene": figure.record, "shares": figure.shares}


@drawn.register
def _(figure: MovingPicture) -> Canvas:
    return draw_still(figure.record, figure.shares, title=figure.title)


@save_png.register
def _(figure: MovingPicture, path: Path) -> None:
    if figure.pictures > 1:
        animate(figure.record, figure.shares, path, figure.pictures, figure.title)
    else:
        drawn(figure).savefig(path, dpi=130)


def strongest(shares: Mapping[str, float], place_by_source: Mapping[str, str]) -> dict[str, float]:
    """Return how strongly to colour each place: the sum of its sources' shares over the largest such sum [-].

    Examples
    --------
    >>> strongest({"disc1.pitch": 0.3, "disc1.runout": 0.1, "pin.diameter": 0.2}, {"disc1.pitch": "disc1.teeth",
    ...     "disc1.runout": "disc1.teeth", "pin.diameter": "pins"})
    {'disc1.teeth': 1.0, 'pins': 0.5}
    """
    sums: dict[str, float] = {}
    for source, share in shares.items():
        if source in place_by_source:
            place = place_by_source[source]
            sums[place] = sums.get(place, 0.0) + max(share, 0.0)
    most = max(sums.values(), default=0.0) or 1.0
    return {place: own / most for place, own in sums.items()}

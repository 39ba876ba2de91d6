"""Pictures of a drawing before and after, whatever chose it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.capability.indices import Limits
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.wording import short, with_unit


def zones_figure(drawing: pd.DataFrame, after: str) -> Figure:
    """Return the zones before and after.

    Parameters
    ----------
    drawing
        One row per source; those without a zone are left out.
    after
        Header of the column with the zones after.
    """
    frame = drawing[drawing["zone before [µm]"] > 0]
    names = list(frame["source"])
    return Figure(
        name="zones",
        title="Drawing zones before and after",
        x_label="zone [µm]",
        y_label="",
        series=(
            Series(label="before", kind="bars", x=names, y=list(frame["zone before [µm]"])),
            Series(label="after", kind="bars", x=names, y=list(frame[after])),
        ),
    )


def units_figure(
    output: str, before: Float[np.ndarray, " before"], after: Float[np.ndarray, " after"], share: float, limits: Limits
) -> Figure:
    """Return an output of random units before and after, with the yield after."""
    return Figure(
        name=short(output).replace("-", "_").replace(" ", "_"),
        title=f"Random units before and after; yield after {share:.2%}",
        x_label=output,
        y_label="share of the units [%]",
        series=(
            Series(label="tolerance table as it is", kind="histogram", x=list(before)),
            Series(label="as drawn", kind="histogram", x=list(after)),
        ),
        vertical=tuple(
            (limit, f"limit {with_unit(f'{limit:g}', output)}")
            for limit in (limits.upper, limits.lower)
            if limit is not None
        ),
    )

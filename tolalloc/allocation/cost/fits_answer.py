"""What a shop charges for a zone: closed forms through its points, how well they hold, and between which zones."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import pandas as pd

from tolalloc.allocation.cost.closed_forms import ClosedForm
from tolalloc.allocation.cost.fit import Fit, best_fit, fits
from tolalloc.allocation.cost.points import Points
from tolalloc.allocation.cost.points_file import ShopPoints
from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure, Series

_DRAWN = 80
"""Points of a drawn curve [-]."""


@dataclass(frozen=True, kw_only=True)
class FittedProcess:
    """The points of one process and the forms through them.

    Parameters
    ----------
    name
        Process, and the kind of callout if the points are for one kind alone.
    points
        Zones [µm] and costs.
    forms
        All forms that the points suffice for.
    best
        The form that a process cost table would take.
    """

    name: str
    points: Points
    forms: tuple[Fit, ...]
    best: Fit


def fitted_processes(shop: ShopPoints) -> tuple[FittedProcess, ...]:
    """Return the fits of every process of a file of shop data.

    Raises
    ------
    InputError
        Too few points, or costs that do not fall with the zone.
    """
    return tuple(
        FittedProcess(
            name=process if feature is None else f"{process}, {feature}",
            points=points,
            forms=fits(points),
            best=best_fit(points),
        )
        for (process, feature), points in shop.items()
    )


def formula(model: ClosedForm) -> str:
    """Return a form with its parameters, the zone t in µm."""
    given = {field.name: float(getattr(model, field.name)) for field in fields(model)}
    power = f"/t^{given['exponent']:.4g}" if "exponent" in given else "" if "scale" in given else "/t"
    decay = f"·exp(−t/{given['scale']:.4g})" if "scale" in given else ""
    return f"{given['fixed']:.4g} + {given['factor']:.4g}{power}{decay}"


def fits_table(found: tuple[FittedProcess, ...]) -> pd.DataFrame:
    """Return every form of every process with its errors and its range."""
    return pd.DataFrame(
        [
            {
                "process": process.name,
                "form, t in µm [cost units]": formula(fit.model),
                "rms error [%]": fit.rms * 100,
                "largest error [%]": fit.largest_error * 100,
                "error at points left out [%]": fit.leave_one_out * 100,
                "valid from [µm]": fit.smallest,
                "valid to [µm]": fit.largest,
                "points [-]": len(process.points.zones),
                "taken": "yes" if type(fit.model) is type(process.best.model) else "no",
            }
            for process in found
            for fit in process.forms
        ]
    )


def _figure(found: tuple[FittedProcess, ...]) -> Figure:
    """Return points and taken curves."""
    series = []
    for process in found:
        zones = np.geomspace(process.best.smallest, process.best.largest, _DRAWN)
        series.append(
            Series(label=process.name, kind="points", x=list(process.points.zones), y=list(process.points.costs))
        )
        series.append(
            Series(
                label=f"{process.name}: {formula(process.best.model)}",
                kind="line",
                x=list(zones),
                y=list(process.best.model.value(zones)),
            )
        )
    return Figure(
        name="costs",
        title="What a zone costs: the shop's points and the forms through them",
        x_label="zone [µm]",
        y_label="cost [cost units]",
        series=tuple(series),
    )


def cost_fits_document(found: tuple[FittedProcess, ...], place: str) -> Document:
    """Return the report.

    Parameters
    ----------
    found
        The fits.
    place
        Name of the file of shop data.
    """
    table = fits_table(found)
    return Document(
        title=f"What a zone costs: {place}",
        subtitle=f"{len(found)} processes",
        answer=tuple(
            f"{process.name}: {formula(process.best.model)}, valid from {process.best.smallest:g} to "
            f"{process.best.largest:g} µm; {process.best.leave_one_out:.2%} off at points left out."
            for process in found
        ),
        warnings=(),
        sections=(Section(heading="Forms", figures=(_figure(found),), tables=(("fits", table),)),),
        assumptions=("the error of a cost is relative, and the same at all zones",),
        summary={"file": place, "fits": table.to_dict("records")},
    )

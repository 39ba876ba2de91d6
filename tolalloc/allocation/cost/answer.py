"""What a shop charges for a zone: closed forms through its points, how well they hold, and between which zones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.allocation.cost.closed_forms import ClosedForm
from tolalloc.allocation.cost.fit import best_fit, fits
from tolalloc.allocation.cost.points import Points, ShopPoints
from tolalloc.report.answer import Answer, Header
from tolalloc.report.document import Section
from tolalloc.report.figure import Figure, Series

if TYPE_CHECKING:
    import pandas as pd

_DRAWN = 80
"""Points of a drawn curve [-]."""


def formula(model: ClosedForm) -> str:
    """Return a form with its parameters, the zone t in µm."""
    given = {field.name: float(getattr(model, field.name)) for field in fields(model)}
    power = f"/t^{given['exponent']:.4g}" if "exponent" in given else "" if "scale" in given else "/t"
    decay = f"·exp(−t/{given['scale']:.4g})" if "scale" in given else ""
    return f"{given['fixed']:.4g} + {given['factor']:.4g}{power}{decay}"


@dataclass(frozen=True, kw_only=True)
class CostFitsAnswer(Answer):
    """What the zones of a shop's processes cost."""

    kind: ClassVar[str] = "costs"
    processes: Mapping[str, Points]  # Process, and the kind of callout if they are for one alone → zones [µm] and costs

    @classmethod
    def of(cls, shop: ShopPoints, place: str, currency: str = "") -> CostFitsAnswer:
        """Return the answer for the points of a file; what `fits` refuses is an InputError."""
        named = {
            process if feature is None else f"{process}, {feature}": points
            for (process, feature), points in shop.items()
        }
        for points in named.values():
            best_fit(points)
        return cls(header=Header(name=place, model="closed forms", currency=currency), processes=named)

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"What a zone costs: {self.header.name}"

    @property
    def subtitle(self) -> str:
        """How many processes the shop has."""
        return f"{len(self.processes)} processes"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The taken form of every process."""
        return tuple(
            f"{name}: {formula(best.model)}, valid from {best.smallest:g} to {best.largest:g} µm; "
            f"{best.leave_one_out:.2%} off at points left out."
            for name, best in ((name, best_fit(points)) for name, points in self.processes.items())
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the fits take for granted."""
        return ("the error of a cost is relative, and the same at all zones",)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The forms and their curves."""
        return (Section(heading="Forms", figures=(self._figure,), tables=(("fits", self.fits),)),)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Every form with its errors."""
        return {"file": self.header.name, "fits": self.fits.to_dict("records")}

    @cached_property
    def fits(self) -> pd.DataFrame:
        """Every form of every process with its errors and its range."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "process": name,
                    "form, t in µm [cost units]": formula(fit.model),
                    "rms error [%]": fit.rms * 100,
                    "largest error [%]": fit.largest_error * 100,
                    "error at points left out [%]": fit.leave_one_out * 100,
                    "valid from [µm]": fit.smallest,
                    "valid to [µm]": fit.largest,
                    "points [-]": len(points.zones),
                    "taken": "yes" if type(fit.model) is type(best_fit(points).model) else "no",
                }
                for name, points in self.processes.items()
                for fit in fits(points)
            ]
        )

    @property
    def _figure(self) -> Figure:
        """Points and taken curves."""
        return Figure(
            name="costs",
            title="What a zone costs: the shop's points and the forms through them",
            x_label="zone [µm]",
            y_label="cost [cost units]",
            series=tuple(series for name, points in self.processes.items() for series in _curves(name, points)),
        )


def _curves(name: str, points: Points) -> Iterable[Series]:
    """Return the points of a process and its taken curve."""
    best = best_fit(points)
    zones = np.geomspace(best.smallest, best.largest, _DRAWN)
    yield Series(label=name, kind="points", x=list(points.zones), y=list(points.costs))
    label = f"{name}: {formula(best.model)}"
    yield Series(label=label, kind="line", x=list(zones), y=list(best.model.value(zones)))

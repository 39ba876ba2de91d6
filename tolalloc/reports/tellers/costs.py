"""What a shop charges for a zone: closed forms through its points, how well they hold, and between which zones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from tolalloc.allocation.cost.model import ClosedForm
from tolalloc.allocation.cost.points import CostFit, ShopFit
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences

_DRAWN = 80
"""Points of a drawn curve [-]."""
_say = Sentences("costs")

_FITS: tuple[Column[tuple[ShopFit, CostFit]], ...] = (
    Column("process", lambda row: row[0].process, terminal=True),
    Column("form, t in µm [{cost}]", lambda row: formula(row[1].model), terminal=True),
    Column("rms error [%]", lambda row: row[1].rms * 100, terminal=True),
    Column("largest error [%]", lambda row: row[1].largest_error * 100),
    Column("error at points left out [%]", lambda row: row[1].leave_one_out * 100, terminal=True),
    Column("valid from [µm]", lambda row: row[1].smallest),
    Column("valid to [µm]", lambda row: row[1].largest),
    Column("points [-]", lambda row: len(row[0].points.zones)),
    Column("taken", lambda row: "yes" if type(row[1].model) is type(row[0].best.model) else "no", terminal=True),
)


def formula(model: ClosedForm) -> str:
    """Return a form with its parameters, the zone t in µm."""
    given = {field.name: float(getattr(model, field.name)) for field in fields(model)}
    power = f"/t^{given['exponent']:.4g}" if "exponent" in given else "" if "scale" in given else "/t"
    decay = f"·exp(−t/{given['scale']:.4g})" if "scale" in given else ""
    return f"{given['fixed']:.4g} + {given['factor']:.4g}{power}{decay}"


class CostsTeller(Teller[tuple[ShopFit, ...]]):
    """What is said of the prices of a shop."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", file=self.header.name)

    @property
    def subtitle(self) -> str:
        """How many processes the shop has."""
        return _say("subtitle", count=len(self.result))

    @property
    def sentences(self) -> tuple[str, ...]:
        """The taken form of every process."""
        return tuple(_say("taken", own=own, form=formula(own.best.model)) for own in self.result)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What the fits take for granted."""
        return (_say("assumption"),)

    @property
    def sections(self) -> tuple[Section, ...]:
        """The forms and their curves."""
        frame = self._fits.frame(self.header.cost_unit)
        return (Section(heading=_say("heading"), figures=(self._figure,), tables=((self._fits.name, frame),)),)

    @property
    def summary(self) -> dict[str, Any]:
        """Every form with its errors."""
        return {"file": self.header.name, self._fits.name: self._fits.records()}

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Every form with its errors."""
        return ((self._fits.terminal(self.header.cost_unit), _say("terminal", file=self.header.name)),)

    @cached_property
    def _fits(self) -> Table[tuple[ShopFit, CostFit]]:
        """Every form of every process with its errors and its range."""
        return Table(name="fits", columns=_FITS, rows=[(own, form) for own in self.result for form in own.forms])

    @property
    def _figure(self) -> Figure:
        """Points and taken curves."""
        series = tuple(series for own in self.result for series in _curves(own))
        return Figure("costs", _say("figure"), "zone [µm]", f"cost [{self.header.cost_unit}]", series=series)


def _curves(own: ShopFit) -> Iterable[Series]:
    """Return the points of a process and its taken curve."""
    best = own.best
    zones = np.geomspace(best.smallest, best.largest, _DRAWN)
    yield Series.points(own.process, own.points.zones, own.points.costs)
    label = f"{own.process}: {formula(best.model)}"
    yield Series.line(label, zones, best.model.value(zones))


TELLER = CostsTeller

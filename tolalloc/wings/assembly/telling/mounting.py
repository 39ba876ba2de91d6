"""Which measured part goes where: the fitter's list, and what choosing is worth beside chance."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tolalloc.reports.columns import Table, of_positions
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.wings.assembly.mounting import MountingResult

if TYPE_CHECKING:
    import pandas as pd

_say = Sentences("mounting", "tolalloc.wings.assembly")


class MountingTeller(Teller[MountingResult]):
    """What is said of mounted parts."""

    @property
    def title(self) -> str:
        """Whose parts are mounted."""
        return _say("title", parts=self.header.name)

    @property
    def subtitle(self) -> str:
        """In which reducer, under which torque."""
        count = len(self.result.found.stock.parts)
        return _say("subtitle", reducer=self.header.model, torque=self.result.torque, count=count)

    @cached_property
    def _fittings(self) -> Table[int]:
        """The fitter's list."""
        found, stock = self.result.found, self.result.found.stock
        part, turn = found.mountings.reshape(-1, 2).T
        places = stock.places * stock.units
        columns = {
            "unit [-]": np.repeat(np.arange(1, stock.units + 1), len(stock.places)),
            "place": [place.name for place in places],
            "part": [stock.parts[at].name for at in part],
            # Bores of a carrier or disc, teeth of the sun, against the part's own frame.
            "turned by, counter-clockwise [steps]": [
                place.turns[at].number for place, at in zip(places, turn, strict=True)
            ],
        }
        return of_positions("fittings", columns)

    @cached_property
    def _units(self) -> Table[int]:
        """What every unit does with its parts as they come, and as chosen."""
        found = self.result.found
        columns = {
            "unit [-]": np.arange(1, found.stock.units + 1),
            "peak-to-peak as the parts come [arcsec]": found.before,
            "peak-to-peak as mounted [arcsec]": found.after,
        }
        return of_positions("units", columns)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What choosing is worth."""
        found, chance = self.result.found, self.result.chance
        after, units, count = float(found.after.mean()), found.stock.units, len(chance.means)
        return (
            _say(
                "worth",
                whose=_say("of_one") if units == 1 else _say("of_several", units=units),
                after=after,
                below_mean=1 - after / chance.means.mean(),
                among=_say("among_all" if chance.every else "among_random", count=count),
                below_worst=1 - after / chance.means.max(),
                worst=chance.means.max(),
            ),
            _say("every") if chance.every else _say("local", best=chance.means.min()),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before mounting."""
        failed = self.result.found.failures + self.result.chance.failures
        return (_say("failed", failed=failed),) if failed else ()

    @property
    def sections(self) -> tuple[Section, ...]:
        """Which part goes where, and what that is worth beside chance."""
        chance = Figure(
            name="chance",
            title=_say("chance_figure"),
            x_label="mean peak-to-peak over the units [arcsec]",
            y_label="share of the mountings [%]",
            series=(Series(label="random mountings", kind="histogram", x=list(self.result.chance.means)),),
            vertical=((float(self.result.found.after.mean()), "as mounted"),),
        )
        tables = (("fittings", self._fittings.frame()), ("units", self._units.frame()))
        return (
            Section(heading=_say("fittings_heading"), paragraphs=(_say("steps"),), tables=tables),
            Section(heading=_say("chance_heading"), figures=(chance,)),
        )

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """The fitter's list, and every unit."""
        return (
            (self._fittings.frame(), _say("terminal_fittings", parts=self.header.name)),
            (self._units.frame(), _say("terminal_units")),
        )

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states, of the reducer and of how its parts are measured and mounted."""
        return (*self.header.assumptions, _say("assume_exact"), _say("assume_kept"))

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        found, chance = self.result.found, self.result.chance
        return {
            "parts": self.header.name,
            "reducer": self.header.model,
            "torque [N·m]": self.result.torque,
            "seed": self.header.seed,
            "units [-]": found.stock.units,
            "mean peak-to-peak as mounted [arcsec]": float(found.after.mean()),
            "mean of random mountings [arcsec]": float(chance.means.mean()),
            "worst random mounting [arcsec]": float(chance.means.max()),
            "every mounting tried": chance.every,
            "fittings": self._fittings.records(),
            "units": self._units.records(),
            "units solved [-]": found.evaluations,
            "units failed [-]": found.failures,
            "warnings": list(self.warnings),
        }

"""Single units of a design: any of the random ones again, and one of them with one error swept over its zone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.cli.live.design import LiveDesign
from tolalloc.cli.live.session import MOST, Session
from tolalloc.drawings.sources import Source, limited_measure
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.named_fields import is_number
from tolalloc.reading.units import unit_of
from tolalloc.reports.charts import chart, numbers
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.wording import short

_SWEPT = 9
"""Values of an error between the ends of its zone [-]."""


@dataclass(frozen=True, kw_only=True)
class LiveUnits:
    """The random units of a session, one at a time; unit 0 has exact parts, the others count from 1."""

    session: Session

    def unit(self, design: LiveDesign, number: int) -> dict[str, Any]:
        """Return outputs and pictures of a unit.

        Raises
        ------
        InputError
            There is no such unit.
        """
        x = self._columns(design, number)
        values = self._values(design, x[np.newaxis])[0]
        label = f"unit {number}" if number else "exact parts"
        figures = self.session.model(design).pictured({label: (np.array(design.settings), x)})
        return {
            "unit": number,
            "values": [
                {"name": short(name), "unit": unit_of(name), "value": value}
                for name, value in zip(self.session.outputs, numbers(values), strict=True)
            ],
            "figures": [chart(figure) for figure in figures],
        }

    def scene(self, design: LiveDesign, number: int, swept: tuple[str, float] | None = None) -> dict[str, Any]:
        """Return a unit as a moving picture needs it; nothing where the model has none.

        Parameters
        ----------
        design
            The design.
        number
            Number of the unit [-].
        swept
            A source and where its error stands in its zone, from -1 to 1; as the unit has it unless given [-].

        Raises
        ------
        InputError, UnknownNameError
            There is no such unit or source.
        SolveError
            It does not come to rest somewhere.
        """
        names = tuple(own.name for own in self.session.prepared.errors.active)
        x, label = self._columns(design, number), f"unit {number}" if number else "exact parts"
        if swept:
            source, share = swept
            if not (is_number(share) and abs(share) <= 1):
                raise InputError.at("page", "share", share, "a number from -1 to 1")
            x, label = self._at_shares(design, number, source, np.array([share]))[0], f"{label}, {source} moved"
        return {"scene": self.session.model(design).scene(np.array(design.settings), x, label, names)}

    def swept(self, design: LiveDesign, number: int, source: str) -> dict[str, Any]:
        """Return the leading output of a unit while one of its errors goes from one end of its zone to the other.

        Raises
        ------
        InputError, UnknownNameError
            There is no such unit or source.
        """
        shares = np.linspace(-1.0, 1.0, _SWEPT)
        tried = self._at_shares(design, number, source, shares)
        values = self._values(design, tried)[:, 0]
        model, settings = self.session.model(design), np.array(design.settings)
        labels = [f"{source} at {100 * share:.0f} % of its zone" for share in shares]
        curves = [model.pictured({label: (settings, row)}) for label, row in zip(labels, tried, strict=True)]
        leading = self.session.outputs[0]
        figure = Figure(
            name="sweep",
            title=f"{short(leading)} while {source} goes through its zone, all else of the unit as it is",
            x_label=f"{source} over its zone [-]",
            y_label=f"{short(leading)} [{unit_of(leading)}]",
            series=(Series(label=source, kind="line", x=list(shares), y=list(values)),),
        )
        known = values[np.isfinite(values)]
        return {
            "source": source,
            "figure": chart(figure),
            "spread": float(known.max() - known.min()) if known.size else None,
            "curves": [[chart(own) for own in figures] for figures in curves],
        }

    def _at_shares(
        self, design: LiveDesign, number: int, source: str, shares: Float[np.ndarray, " share"]
    ) -> Float[np.ndarray, "share column"]:
        """Return the deviations of a unit with one of its errors at places of its zone [m, angles rad]."""
        errors, sources = self.session.prepared.errors, {own.name: own for own in self.session.sources(design)}
        if source not in sources:
            raise UnknownNameError.among("page", "source", source, sources)
        own = np.array([name == source for name in errors.source_of_column])
        tried = np.tile(self._columns(design, number), (len(shares), 1))
        tried[:, own] = _middle(sources[source]) + np.outer(shares, self._full(sources[source], number, own))
        return tried

    def _columns(self, design: LiveDesign, number: int) -> Float[np.ndarray, " column"]:
        """Return the deviations of a unit [m, angles rad]."""
        if not (type(number) is int and 0 <= number <= MOST):
            raise InputError.at("page", "unit", number, f"a whole number up to {MOST}, 0 for exact parts")
        if number:
            return np.asarray(self.session.deviations(design, slice(number - 1, number))[0])
        errors, zones = self.session.prepared.errors, np.array([own.zone for own in self.session.sources(design)])
        return np.asarray(errors.deviations(np.zeros((1, len(errors.columns))), zones)[0])

    def _full(self, source: Source, number: int, at: np.ndarray) -> Float[np.ndarray, " own_column"]:
        """Return the deviations with which the source fills its zone, in the direction of the unit [m, angles rad]."""
        session = self.session
        zones = np.ones(len(session.prepared.errors.active))
        own = session.prepared.errors.deviations(session.standard[max(number, 1) - 1 : max(number, 1)], zones)[0, at]
        centred = own - _middle(source)
        measure = float(limited_measure(source, own[np.newaxis])[0]) or 1.0
        half = source.zone / 2 if source.feature is Feature.SIZE else source.zone
        return np.asarray(centred * half / measure)

    def _values(self, design: LiveDesign, x: Float[np.ndarray, "unit column"]) -> Float[np.ndarray, "unit output"]:
        evaluation = self.session.model(design).reading(self.session.outputs)(x)
        return np.where(evaluation.good[:, np.newaxis], evaluation.values, np.nan)


def _middle(source: Source) -> float:
    """Return where the columns of a source stand in the middle of its zone [m, angles rad]."""
    return source.middle / source.lever

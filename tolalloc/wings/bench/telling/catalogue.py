"""The factor on the bearings that gives the rigidity of the catalogue, and what one datum leaves open."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reports.document import Section
from tolalloc.reports.portraits.reducer import twist_table
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.wings.bench.catalogue import RIGIDITY_UNCERTAINTY, CatalogueResult

if TYPE_CHECKING:
    import pandas as pd

_say = Sentences("catalogue", "tolalloc.wings.bench")
_BELIEVED = 3
"""Factor, and one over it, beyond which it is warned of [-]."""


class CatalogueTeller(Teller[CatalogueResult]):
    """What is said of bearings that give the rigidity of the catalogue."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", reducer=self.header.model)

    @property
    def stiffness(self) -> IdentifiedStiffness:
        """What a stiffness file states."""
        return self.result.stiffness

    @cached_property
    def shares(self) -> pd.DataFrame:
        """Which part yields how much of the twist with the factor."""
        return twist_table(self.result.after)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The factor, what it does, and what it leaves open."""
        own, (first, last), largest = self.result, self.result.loops, self.shares.iloc[0]
        wanted, before = own.catalogue.torsional_rigidity * ARCMINUTE, float(first.torsional_stiffness[0] * ARCMINUTE)
        lost, allowed = float(last.lost_motion[0] / ARCMINUTE), own.catalogue.lost_motion / ARCMINUTE
        return (
            _say("factor", factor=own.factor, uncertainty=own.uncertainty, wanted=wanted, before=before),
            _say("lost_motion", after=lost, largest=allowed),
            _say("one_datum", slope=own.slope, share=largest.iloc[1], part=largest.iloc[0]),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        factor = self.result.factor
        return () if 1 / _BELIEVED <= factor <= _BELIEVED else (_say("warning", factor=factor),)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        said = (_say("assume_one_factor"), _say("assume_uncertainty", uncertainty=RIGIDITY_UNCERTAINTY))
        return (*self.header.assumptions, *said)

    @property
    def sections(self) -> tuple[Section, ...]:
        """Which part yields."""
        return (Section(heading=_say("heading"), paragraphs=(_say("shares"),), tables=(("twist", self.shares),)),)

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Which part yields."""
        return ((self.shares, _say("terminal", reducer=self.header.model)),)

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        own, (before, after) = self.result, self.result.loops
        return {
            "reducer": self.header.model,
            "factor on bearing stiffness [-]": own.factor,
            "relative standard uncertainty of the factor [-]": own.uncertainty,
            "torsional rigidity before [N·m/arcmin]": float(before.torsional_stiffness[0] * ARCMINUTE),
            "torsional rigidity after [N·m/arcmin]": float(after.torsional_stiffness[0] * ARCMINUTE),
            "torsional rigidity of the catalogue [N·m/arcmin]": own.catalogue.torsional_rigidity * ARCMINUTE,
            "lost motion before [arcmin]": float(before.lost_motion[0] / ARCMINUTE),
            "lost motion after [arcmin]": float(after.lost_motion[0] / ARCMINUTE),
            "largest lost motion of the catalogue [arcmin]": own.catalogue.lost_motion / ARCMINUTE,
            "rigidity feels bearings, relative over relative [-]": own.slope,
            "stiffness at rated torque [N/m]": dict(own.stiffness.values),
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

"""The one factor on the stiffness of the bearings with which a reducer has the rigidity of its catalogue."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import exp, isnan, log
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCMINUTE
from tolalloc.reducers.equivalent.hysteresis import HysteresisLoop
from tolalloc.reducers.equivalent.perfect import exact_loop, twist_shares
from tolalloc.reducers.reducer.bearings import RollingBearing
from tolalloc.reducers.reducer.design import Catalogue, Reducer, at_torque
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.header import Header

if TYPE_CHECKING:
    import pandas as pd

BEARINGS = ("crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")
"""Interfaces with rolling bearings, as fields of `tolalloc.reducers.reducer.stiffness.Stiffness`."""
RIGIDITY_UNCERTAINTY = 0.1
"""Relative standard uncertainty of a rigidity that a catalogue states without one; an assumption [-]."""
_FARTHEST = 1000.0
"""Factor on the stiffness up and down to which is searched [-]."""
_STEP = 0.05
"""Step of a difference by the logarithm of the factor [-]."""


def with_bearings(reducer: Reducer, factor: float) -> Reducer:
    """Return the reducer with rolling bearings so many times as stiff; other parts of their interfaces stay."""
    with_parts = {part.interface for part in reducer.parts}
    parts = tuple(
        replace(part, stiffer=part.stiffer * factor) if isinstance(part.yields, RollingBearing) else part
        for part in reducer.parts
    )
    own: dict[str, Any] = {
        name: factor * getattr(reducer.stiffness, name) for name in BEARINGS if name not in with_parts
    }
    changed = replace(reducer, parts=parts, stiffness=replace(reducer.stiffness, **own))
    return at_torque(changed, reducer.load.rated_torque)


def _rigidity(reducer: Reducer, factor: float) -> float:
    """Return the torsional stiffness with bearings so many times as stiff [N·m/rad]."""
    return float(exact_loop(with_bearings(reducer, factor)).torsional_stiffness[0])


@dataclass(frozen=True, kw_only=True)
class CatalogueAnswer(Answer):
    """The factor, and what one datum leaves open."""

    kind: ClassVar[str] = "stiffness from the catalogue"
    catalogue: Catalogue  # What was stated
    before: Reducer  # As its file says
    after: Reducer  # With the factor
    factor: float  # On the stiffness of every rolling bearing [-]
    slope: float  # d ln rigidity / d ln factor: how much the rigidity feels the bearings at all [-]

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"{self.header.model}: bearings that give the rigidity of the catalogue"

    @cached_property
    def _loops(self) -> tuple[HysteresisLoop, HysteresisLoop]:
        return exact_loop(self.before), exact_loop(self.after)

    @property
    def uncertainty(self) -> float:
        """Relative standard uncertainty of the factor, from that of the catalogue's rigidity [-]."""
        return RIGIDITY_UNCERTAINTY / self.slope

    @property
    def stiffness(self) -> IdentifiedStiffness:
        """The interfaces with rolling bearings at rated torque, to be reused by studies; one factor, so correlated."""
        values = {name: float(getattr(self.after.stiffness, name)) for name in BEARINGS}
        return IdentifiedStiffness(
            source=f"catalogue rigidity of {self.header.model}",
            values=values,
            standard_uncertainty={name: self.uncertainty * value for name, value in values.items()},
            correlation=np.ones((len(BEARINGS), len(BEARINGS))),
            notes=(
                "one datum, one factor on all rolling bearings; stiffness at rated torque, bodies in series included",
                f"standard uncertainty of the catalogue's rigidity {RIGIDITY_UNCERTAINTY:.0%} (assumption)",
            ),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        before, after = self._loops
        return {
            "reducer": self.header.model,
            "factor on bearing stiffness [-]": self.factor,
            "relative standard uncertainty of the factor [-]": self.uncertainty,
            "torsional rigidity before [N·m/arcmin]": float(before.torsional_stiffness[0] * ARCMINUTE),
            "torsional rigidity after [N·m/arcmin]": float(after.torsional_stiffness[0] * ARCMINUTE),
            "torsional rigidity of the catalogue [N·m/arcmin]": self.catalogue.torsional_rigidity * ARCMINUTE,
            "lost motion before [arcmin]": float(before.lost_motion[0] / ARCMINUTE),
            "lost motion after [arcmin]": float(after.lost_motion[0] / ARCMINUTE),
            "largest lost motion of the catalogue [arcmin]": self.catalogue.lost_motion / ARCMINUTE,
            "rigidity feels bearings, relative over relative [-]": self.slope,
            "stiffness at rated torque [N/m]": dict(self.stiffness.values),
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @property
    def sentences(self) -> tuple[str, ...]:
        """The factor, what it does, and what it leaves open."""
        found = self.summary
        largest = self.shares.iloc[0]
        return (
            f"With rolling bearings {self.factor:.3g} times as stiff (±{self.uncertainty:.0%}) the reducer without "
            f"errors has the {found['torsional rigidity of the catalogue [N·m/arcmin]']:.3g} N·m/arcmin of its "
            f"catalogue, instead of {found['torsional rigidity before [N·m/arcmin]']:.3g}.",
            f"Its lost motion becomes {found['lost motion after [arcmin]']:.2g}′, where the catalogue allows "
            f"{found['largest lost motion of the catalogue [arcmin]']:.2g}′.",
            f"One datum fixes one factor and no more: it says that the bearings are as stiff together, not which of "
            f"them. 1 % on all of them moves the rigidity by {self.slope:.2g} %; then the largest share of the twist, "
            f"{largest.iloc[1]:.0f} %, is that of: {largest.iloc[0]}. Loops of measured units tell them apart.",
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        if 1 / 3 <= self.factor <= 3:
            return ()
        return (
            f"A factor of {self.factor:.3g} is more than dimensions or clearances of bearings can be off by: look for "
            "another part, a unit or a printed stiffness that is wrong before it is used.",
        )

    @cached_property
    def shares(self) -> pd.DataFrame:
        """Which part yields how much of the twist with the factor."""
        return twist_shares(self.after)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs and tables."""
        words = "The twist of the perfect reducer under its rated torque, part by part, with the factor."
        return (Section(heading="Which part yields", paragraphs=(words,), tables=(("twist", self.shares),)),)


def identify_from_catalogue(reducer: Reducer) -> CatalogueAnswer:
    """Return the factor on the stiffness of all rolling bearings that gives the catalogue's torsional rigidity.

    Raises
    ------
    InputError
        The reducer states no catalogue, or no stiffness of its bearings gives that rigidity.
    """
    from scipy.optimize import brentq

    stated = reducer.catalogue
    if stated is None:
        raise InputError(f"{reducer.name}: it has no table [catalogue]; state torsional_rigidity_nm_per_arcmin there.")

    def off(exponent: float) -> float:
        return log(_rigidity(reducer, exp(exponent)) / stated.torsional_rigidity)

    near, far = 0.0, 0.0
    direction = 1.0 if off(0.0) < 0 else -1.0
    while (last := direction * off(far)) < 0:
        near, far = far, far + direction * log(2.0)
        if abs(far) > log(_FARTHEST) or isnan(off(far)):
            limit = exp(direction * last) * stated.torsional_rigidity * ARCMINUTE
            raise InputError.at(
                reducer.name,
                "[catalogue] torsional_rigidity_nm_per_arcmin",
                round(stated.torsional_rigidity * ARCMINUTE, 6),
                f"at {'most' if direction > 0 else 'least'} {limit:.3g}, with bearings of any stiffness",
            )
    exponent = near if near == far else float(brentq(off, near, far, xtol=1e-10))
    after = with_bearings(reducer, exp(exponent))
    return CatalogueAnswer(
        header=Header(
            name="catalogue",
            model=reducer.name,
            assumptions=(
                *reducer.assumptions,
                "one factor on the stiffness of all rolling bearings, at every load",
                f"standard uncertainty of the catalogue's rigidity {RIGIDITY_UNCERTAINTY:.0%}",
            ),
        ),
        catalogue=stated,
        before=reducer,
        after=after,
        factor=exp(exponent),
        slope=(off(exponent + _STEP) - off(exponent - _STEP)) / (2 * _STEP),
    )

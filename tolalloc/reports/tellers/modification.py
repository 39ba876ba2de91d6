"""The two modification amounts that were chosen, and what they do on the reducer."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import pandas as pd

from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers.modification import ModificationResult
from tolalloc.reports.document import Section
from tolalloc.reports.teller import Teller
from tolalloc.reports.tellers.contact import ContactTeller
from tolalloc.reports.templates import Sentences

_say = Sentences("modification")
_NONE = 1e-11  # clearance that counts as none [m]
_OFF = 0.3e-6
"""By how much exact distances may differ from what is wanted unsaid [m]."""
_UNPRINTED = {
    "clearances": ("clearances_closing",),
    "song2019": ("song2019_box", "song2019_clearance"),
    "li2018": ("li2018_reading", "li2018_interval"),
}
"""Method → sentences on what its source does not print."""


class ModificationTeller(Teller[ModificationResult]):
    """What is said of a finished choice."""

    @cached_property
    def _contact(self) -> ContactTeller:
        return ContactTeller(self.result.contact, self.header)

    @property
    def title(self) -> str:
        """What the answer is about."""
        return _say("title", model=self.header.model, method=self.header.name)

    @property
    def subtitle(self) -> str:
        """The problem, and the torque of the contact."""
        return _say("subtitle", problem=self.result.problem.name, torque=self.result.contact.torque)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The amounts, how a reducer file states them, and how the teeth carry."""
        best, (equidistant, shift) = self.result.best, self.result.best.amounts / MICROMETRE
        description, objective = self.result.problem.description, best.objective / MICROMETRE
        amounts = {"equidistant": equidistant, "shift": shift, "description": description}
        return (
            _say("amounts_wanted", **amounts) if self._wanted else _say("amounts", **amounts, objective=objective),
            *self._play(),
            _say("file", equidistant=f"{equidistant:.4f}", shift=f"{shift:.4f}"),
            *self._contact.sentences,
        )

    @property
    def _wanted(self) -> bool:
        """Whether clearances were wanted, which an amount follows from."""
        return self.result.problem.wanted is not None

    def _play(self) -> tuple[str, ...]:
        """Return the play that wanted clearances leave; one beyond the catalogue is a warning."""
        found = self.result
        if not self._wanted or found.exceeds_catalogue:
            return ()
        if not found.reducer.catalogue:
            return (_say("backlash", **self._contact.play),)
        allowed = found.allowed_lost_motion / ARCMINUTE
        return (_say("play", **self._contact.play, model=self.header.model, allowed=allowed),)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Play beyond a precision reducer's or the catalogue's, and those of the contact."""
        found, request, said = self.result, self.result.request, []
        if found.turns_far:
            said.append(_say("turns_far", rotation=request.rotation, play=request.rotation / ARCMINUTE))
        if found.exceeds_catalogue:
            key = "wanted_exceeds_catalogue" if self._wanted else "exceeds_catalogue"
            allowed = found.allowed_lost_motion / ARCMINUTE
            said.append(_say(key, **self._contact.play, model=self.header.model, allowed=allowed))
        if found.off > _OFF:
            flank, radial = found.delivered_flank / MICROMETRE, found.delivered_radial / MICROMETRE
            said.append(_say("not_delivered", flank=flank, radial=radial, description=found.problem.description))
        return (*said, *self._contact.warnings)

    @property
    def _unprinted(self) -> tuple[str, ...]:
        """What the source of the method does not print."""
        return tuple(_say(key) for key in _UNPRINTED[self.result.request.method])

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What neither the source of the method nor that of the reducer prints."""
        return (*self._unprinted, *self._contact.assumptions)

    @property
    def delivered(self) -> pd.DataFrame:
        """What was asked for beside what the exact distances show."""
        found, request = self.result.contact.assessment.exact_clearance, self.result.request
        lowest, asked = float(found.after.min()), self.result.problem.radial_clearance / MICROMETRE
        lowest = lowest if abs(lowest) > _NONE else 0.0
        radial, flank = "radial clearance at tip and root [µm]", f"{request.flank_clearance / MICROMETRE:g}"
        first = [(radial, f"{asked:g} or more", found.radial / MICROMETRE)]
        if self._wanted:
            first = [
                ("flank clearance [µm]", flank, self.result.delivered_flank / MICROMETRE),
                (radial, f"{asked:g}", self.result.delivered_radial / MICROMETRE),
            ]
        rows = [*first, ("smallest clearance after the first contact [µm]", "0", lowest / MICROMETRE)]
        return pd.DataFrame(rows, columns=["quantity", "asked", "delivered, exact distances"])

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """What the amounts deliver, and the contact."""
        found = self.result
        objective = _say("objective_wanted")
        if not self._wanted:
            objective = _say("objective", description=found.problem.description, evaluations=found.best.evaluations)
        tables = (("delivered", self.delivered),)
        delivered = Section(heading=_say("delivered_heading"), paragraphs=(objective,), tables=tables)
        return (delivered, *self._contact.sections)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The amounts and the contact, units of measurement in the names."""
        best = self.result.best
        return {
            "method": self.header.name,
            "objective": self.result.problem.description,
            "equidistant amount [µm]": best.amounts[0] / MICROMETRE,
            "shift amount [µm]": best.amounts[1] / MICROMETRE,
            "objective [µm]": best.objective / MICROMETRE,
            "status": best.status,
            "violation [µm]": best.violation / MICROMETRE,
            "backlash [arcmin]": self._contact.play["backlash"],
            "contact": self._contact.summary,
            "warnings": list(self.warnings),
            "assumptions": list(self._unprinted),
        }

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """What the amounts deliver."""
        title = _say("delivered_on_terminal", model=self.header.model, method=self.header.name)
        return ((self.delivered, title),)


TELLER = ModificationTeller

"""The two modification amounts that a method chooses, and what they do on the reducer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers.modification.problem import ModificationProblem, Optimum
from tolalloc.reducers.teeth.answer import ContactAnswer
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section

if TYPE_CHECKING:
    import pandas as pd

_NONE = 1e-11  # clearance that counts as none [m]


@dataclass(frozen=True, kw_only=True)
class ModificationAnswer(Answer):
    """A finished choice."""

    kind: ClassVar[str] = "modification"
    problem: ModificationProblem  # What was minimised, and what had to be kept
    best: Optimum  # The sure optimum
    contact: ContactAnswer  # What it does on the reducer
    cautions: tuple[str, ...] = ()  # What the method itself must warn of

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"{self.header.model}: tooth modification by {self.header.name}"

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        return f"{self.problem.name}; contact at {self.contact.torque:g} N·m on the carrier."

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer in a few sentences."""
        equidistant, shift = self.best.amounts / MICROMETRE
        return (
            f"Equidistant amount {equidistant:.4f} µm, shift amount {shift:.4f} µm (pin radius and pin circle radius "
            f"plus these at grinding): the least {self.problem.description}, {self.best.objective / MICROMETRE:.6g} "
            "µm.",
            f"In a reducer file: [modification] equidistant_um = {equidistant:.4f}, shift_um = {shift:.4f}, "
            'convention = "plus".',
            *self.contact.sentences,
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return (*self.cautions, *self.contact.warnings)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source prints."""
        return (*self.header.assumptions, *self.contact.assumptions)

    @cached_property
    def delivered(self) -> pd.DataFrame:
        """What was asked for beside what the exact distances show."""
        import pandas as pd

        found = self.contact.assessment.exact_clearance
        lowest, asked = float(found.after.min()), self.problem.radial_clearance / MICROMETRE
        return pd.DataFrame(
            [
                ("radial clearance at tip and root [µm]", f"{asked:g} or more", found.radial / MICROMETRE),
                (
                    "smallest clearance after the first contact [µm]",
                    "0",
                    (lowest if abs(lowest) > _NONE else 0.0) / MICROMETRE,
                ),
            ],
            columns=["quantity", "asked", "delivered, exact distances"],
        )

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Headings with their paragraphs, figures and tables."""
        return (
            Section(
                heading="What the amounts deliver",
                paragraphs=(
                    f"Objective: {self.problem.description}. A grid that is narrowed down around its best point, "
                    f"{self.best.evaluations} points in all, finds the optimum without chance.",
                ),
                tables=(("delivered", self.delivered),),
            ),
            *self.contact.sections,
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units of measurement in the names."""
        return {
            "method": self.header.name,
            "objective": self.problem.description,
            "equidistant amount [µm]": self.best.amounts[0] / MICROMETRE,
            "shift amount [µm]": self.best.amounts[1] / MICROMETRE,
            "objective [µm]": self.best.objective / MICROMETRE,
            "status": self.best.status,
            "violation [µm]": self.best.violation / MICROMETRE,
            "backlash [arcmin]": self.contact.assessment.clearance.backlash / ARCMINUTE,
            "contact": self.contact.summary,
            "warnings": list(self.warnings),
            "assumptions": list(self.header.assumptions),
        }

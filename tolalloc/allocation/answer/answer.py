"""The cheapest drawing that keeps every requirement: everything that a report on it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.allocation.answer.dimensions import dimensions_table
from tolalloc.allocation.answer.drawing import drawing_table, drawn_sources, sources_to_go_on_from, write_drawing
from tolalloc.allocation.answer.sections import sections
from tolalloc.allocation.answer.sentences import assumptions, sentences, warnings
from tolalloc.allocation.answer.tables import requirements_table
from tolalloc.allocation.cost.unit_price import QualityLoss, YieldLadder
from tolalloc.allocation.front.pareto_front import Fronts
from tolalloc.allocation.front.what_if import Robustness, SettingTrade
from tolalloc.allocation.search.candidates import Candidates
from tolalloc.allocation.search.discrete import GradedAllocation
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.requirement import Requirement
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.sources import Source
from tolalloc.models.model import Model
from tolalloc.reading.units import unit_of
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.portrait import Examination, portrait_of
from tolalloc.reports.wording import short
from tolalloc.sensitivity.sobol import SobolIndices

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class AllocationAnswer(Answer):
    """The cheapest drawing that keeps every requirement.

    Parameters
    ----------
    model
        The model at the sources of the tolerance table.
    requirements
        What must be kept, the leading one first.
    space
        Design variables with every setting free.
    fixed
        The allocation with the settings as they are, if the question asks for it and the model has any.
    free
        The allocation of tolerances and settings together.
    graded
        The same on ladders of zones, if the question asks for it.
    shares
        Sobol indices of the leading output at the zones of the drawing.
    shares_of_dimensions
        The same of the dimensions of the drawing: all members of a group exchanged together.
    trade
        Cost of the cheapest zones over the settings, if asked for.
    fronts
        What can be had at which cost, if asked for.
    robustness
        Answers under changed assumptions, if asked for.
    prices
        Price of a good unit over yield targets, if the question states what becomes of the others.
    loss
        What the leading output costs a user, if the question states it.
    error
        Probability up to which the answer may call a design met that misses a limit [-].
    examination
        What the model says of random units of the drawing, such as that they cannot be built.
    """

    kind: ClassVar[str] = "allocation"
    shown: ClassVar[tuple[str, ...]] = (
        *("dimension", "write [mm]", "part in the variance (total index) [%]", "cost [cost units]"),
        *("grade", "process"),
    )

    model: Model
    requirements: tuple[Requirement, ...]
    space: DesignSpace
    fixed: ZoneAllocation | None
    free: ZoneAllocation
    graded: GradedAllocation | None
    shares: SobolIndices
    shares_of_dimensions: SobolIndices
    trade: SettingTrade | None
    fronts: Fronts | None
    robustness: Robustness | None
    prices: YieldLadder | None
    loss: QualityLoss | None
    error: float
    examination: Mapping[str, float]

    @property
    def free_label(self) -> str:
        """What the search that frees everything may choose."""
        return f"tolerances and {portrait_of(self.model).settings_word}" if self.space.settings else "tolerances"

    @property
    def leading(self) -> str:
        """Name of the leading output, which the first requirement limits."""
        return self.requirements[0].output

    @property
    def candidates(self) -> Candidates:
        """What the searches found, among which the drawing is the cheapest."""
        return Candidates(fixed=self.fixed, free=self.free, graded=self.graded)

    @cached_property
    def chosen(self) -> VerifiedDesign:
        """What the drawing shall show: the cheapest of all that was shown to keep the limits."""
        return self.candidates.drawn

    @property
    def keeps_table(self) -> bool:
        """Whether nothing that was verified is cheaper than the tolerance table as it is."""
        return self.chosen is self.free.baseline

    @property
    def drawn(self) -> DesignSpace:
        """Design variables of the chosen design; groups share one zone where it is graded."""
        return self.chosen.space

    @property
    def met(self) -> bool:
        """Whether fresh units that no search has seen show every requirement to be kept, with the stated error."""
        return self.chosen.accepted

    @property
    def cost(self) -> float:
        """Cost of the drawing [cost units]."""
        return self.chosen.cost

    @property
    def bound(self) -> float | None:
        """Lower bound on the cost of drawings that keep the limits; none if a verified one undercuts it [cost units].

        For drawings near the verified ones, unless `bound_is_certified`; `LowerBound` says with which confidence.
        """
        return self.candidates.bound

    @property
    def bound_is_certified(self) -> bool:
        """Whether the bound holds for every allowed drawing with free zones rather than near the verified ones."""
        return self.candidates.unrestricted.lower_bound.certified

    @cached_property
    def drawn_sources(self) -> tuple[Source, ...]:
        """All sources of the tolerance table at the zones of the drawing, with process, grade and cost."""
        return drawn_sources(self)

    @cached_property
    def drawing(self) -> Drawing:
        """The drawing as the next study takes it, with the cost of every zone as it is made."""
        errors = replace(self.space.errors, sources=sources_to_go_on_from(self))
        return Drawing(name=f"{self.header.name}, allocated", errors=errors)

    @cached_property
    def drawing_table(self) -> pd.DataFrame:
        """The drawing in short: zone, grade, process, share of the variance and cost of every source."""
        return drawing_table(self)

    @cached_property
    def dimensions_table(self) -> pd.DataFrame:
        """The drawing with one line per dimension, which all members of a group share."""
        return dimensions_table(self)

    @cached_property
    def examined(self) -> Examination:
        """What is said of the random units of the chosen drawing."""
        return portrait_of(self.model.at(self.chosen.settings)).examination(self.examination)

    @cached_property
    def requirements_table(self) -> pd.DataFrame:
        """Every limited side with what each design was shown to keep, and what the limit costs."""
        return requirements_table(self)

    @property
    def title(self) -> str:
        """What the answer is about."""
        if not self.met:
            return f"No drawing shown to keep its limits, {self.header.model}: {self.header.name}"
        if self.examined.fault:
            return f"A drawing that keeps its limits but cannot be built, {self.header.model}: {self.header.name}"
        if self.keeps_table:
            return f"Keep the drawing of {self.header.model}: {self.header.name}"
        return f"The cheapest verified drawing of {self.header.model}: {self.header.name}"

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        count = len(self.requirements)
        conditions = [super().subtitle] if self.header.conditions else []
        return ", ".join([f"{count} requirement{'s' if count > 1 else ''}", *conditions, f"seed {self.header.seed}"])

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The answer in sentences, each no stronger than what was computed."""
        return sentences(self)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on the answer."""
        return warnings(self)

    @cached_property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        return assumptions(self)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The sections of the report."""
        return sections(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        chosen, free = self.chosen, self.free
        guarantee = self.requirements[0].guarantee
        limit = "limit [arcsec]" if unit_of(self.leading) == "arcsec" else f"limit of {self.leading}"
        answered = {
            "study": self.header.name,
            "study hash": self.header.digest,
            portrait_of(self.model).kind: self.header.model,
            **self.header.conditions,
            limit: free.limit,
            "yield target [-]": getattr(guarantee, "target", None),
            "seed": self.header.seed,
            "quick": self.header.quick,
            "met": self.met,
            "overall error of the verification [-]": self.error,
            "yield [-]": chosen.achieved.estimate,
            "yield interval 95 % [-]": [chosen.achieved.low, chosen.achieved.high],
            "yield lower bound, one-sided 95 % [-]": chosen.achieved.bound,
            "yield of all limits [-]": chosen.joint.estimate,
            f"{short(self.leading)} kept [{unit_of(self.leading)}]": chosen.quantile_bound,
            "cost [cost units]": chosen.cost,
            "cost of the tolerance table [cost units]": free.baseline.cost,
            "tolerance table met": free.baseline.met,
            "cost of proportional scaling [cost units]": free.proportional.cost,
            "proportional scaling met": free.proportional.met,
            "saving [-]": 1 - chosen.cost / free.proportional.cost,
            "saving at least [-]": self.least_saving,
            "cost of tolerances alone [cost units]": self.fixed.chosen.cost if self.fixed else None,
            f"cost of {self.free_label} [cost units]": free.chosen.cost,
            "cost on grades [cost units]": self.graded.chosen.cost if self.graded else None,
            "lower bound [cost units]": self.bound if self.met else None,
            "lower bound holds for every drawing": self.bound_is_certified if self.met else None,
            "gap of the convex program [-]": free.optimum.gap,
            "blocking requirement": None if self.met else chosen.blocking.requirement.output,
            "beyond its limit by [unit of the output]": None if self.met else -chosen.blocking.slack,
            "cannot be built because": self.examined.fault or None,
            **self.examined.figures,
            **portrait_of(self.model).amounts(chosen.settings),
            "requirements": _records(self.requirements_table),
            "drawing": _records(self.drawing_table),
            "zones that stay the same": [
                group for group, same in zip(self.robustness.groups, self.robustness.same, strict=True) if same
            ]
            if self.robustness
            else None,
            **portrait_of(self.model).facts,
            "statuses": dict(self.header.statuses),
            "warnings": list(self.warnings),
        }
        return {name: _known(value) for name, value in answered.items()}

    @property
    def least_saving(self) -> float:
        """Saving against proportional scaling that uses the limit to its last unit, as a share of its cost [-]."""
        return 1 - (1 - self.free.saving_at_least) * self.chosen.cost / self.free.chosen.cost

    def add_files(self, folder: Path) -> None:
        """Write ``allocation.csv``, which is read back, and ``drawing.xlsx``, which goes on calculating."""
        write_drawing(self, folder)


def _known(value: object) -> object:
    """Return a number, or null where it is none; JSON knows neither NaN nor infinity."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table for JSON."""
    return [{str(name): _known(value) for name, value in row.items()} for row in frame.to_dict("records")]

"""The answer on an assembly, and everything that it is made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.answer.cautions import assumptions, warnings
from tolalloc.assembly.answer.sections import sections
from tolalloc.assembly.answer.sentences import sentences
from tolalloc.assembly.answer.summary import summary
from tolalloc.assembly.answer.tables import characteristic_table
from tolalloc.assembly.gains import Gains, PrecisionSweep
from tolalloc.assembly.orientations import TransmissionEffect
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.tolerances import AngularAllocation, AngularVerification, PrecisionCost, RetunedAllocation
from tolalloc.assembly.trajectory import Trajectory
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class AdjustedParts:
    """Parts whose errors are known, and what is turned."""

    name: str  # Where the errors come from
    errors: Float[np.ndarray, "part 3"]  # Error of every part about its own axes [rad]
    sequence: Trajectory  # The assembly step by step
    unadjusted: Float[np.ndarray, "part 3"]  # Final state if nothing is turned [rad]
    exact: Float[np.ndarray, "part 3"]  # The same by finite rotations [rad]
    missed: Float[np.ndarray, "part 3"]  # Standard deviation of what the listed turns miss in the end [rad]
    norms: Float[np.ndarray, " precision"]  # Weighted norm of the final errors over the precisions of the sweep [rad]
    # Smallest precision tried at which they keep all limits; none if none of them does, or nothing is limited [-]
    keeping: float | None

    @property
    def adjusted(self) -> Float[np.ndarray, "part 3"]:
        """Final state [rad]."""
        return np.asarray(self.sequence.adjusted[-1].reshape(-1, 3))


@dataclass(frozen=True, kw_only=True)
class AngularTolerances:
    """Cheapest angular tolerances."""

    adjusted: AngularAllocation  # At the plan's precision, with the filter that expects the plan's tolerances
    unadjusted: AngularAllocation | str  # The same if nothing is turned, or why there are none
    retuned: RetunedAllocation  # With the filter tuned again to what was allocated
    verified: AngularAllocation  # The cheapest of them: with priced effort that at the best precision
    verification: AngularVerification  # Assemblies at random with it
    by_precision: PrecisionCost  # Costs over the precision, effort included


@dataclass(frozen=True, kw_only=True)
class AssemblyAnswer(Answer):
    """One assembly: what is turned, what it leaves, what that does, and what angular tolerances cost."""

    kind: ClassVar[str] = "assembly"
    plan: AssemblyPlan  # What was asked
    gains: Gains  # What is turned at every step, per angle, and what that leaves
    sweep: PrecisionSweep  # What is to be expected over the precision
    # Standard deviation of every angle after each step, step by step: with the part as mounted, and as adjusted [rad]
    expected: Float[np.ndarray, "step 2 state"]
    # Root of the sum of the variances of all final angles if every step turned the part that it mounts alone; none if
    # the plan does that [rad]
    fewer: float | None
    measured: AdjustedParts | None  # Parts whose errors are known, if any are
    transmission: TransmissionEffect | None  # What it does to the transmission, if the chain names a reducer
    # Cheapest angular tolerances, if the chain states limits and costs that some tolerances keep
    tolerances: AngularTolerances | None
    unreachable: str  # Why there are none; empty unless limits are out of reach

    @property
    def title(self) -> str:
        """What is assembled."""
        return f"Assembly of {self.plan.name}"

    @property
    def subtitle(self) -> str:
        """How many parts on which datum, at which precision, and which parts."""
        plan, parts = self.plan, self.measured.name if self.measured else "parts within the stated tolerances"
        return f"{len(plan.chain.names)} parts on {plan.chain.datum}, precision {plan.precision:g}, {parts}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """What adjusting is worth, each sentence no stronger than what was computed."""
        return sentences(self)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on it."""
        return warnings(self)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Steps, precision, transmission, tolerances, finite rotations."""
        return sections(self)

    @cached_property
    def characteristics(self) -> pd.DataFrame:
        """Tilt and rotation of every characteristic before and after adjusting."""
        return characteristic_table(self)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        return assumptions(self)

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program, units in the names."""
        return summary(self)

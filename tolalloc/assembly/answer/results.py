"""Everything a report on an assembly is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.assembly.angular.allocation import AngularAllocation, AngularVerification
from tolalloc.assembly.angular.tuning import PrecisionCost, RetunedAllocation
from tolalloc.assembly.gains import Gains
from tolalloc.assembly.orientations import TransmissionCurves
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.precision_sweep import PrecisionSweep
from tolalloc.assembly.trajectory import Trajectory
from tolalloc.rv.equivalent.line_load import ContactPattern
from tolalloc.rv.reducer.design import Reducer


@dataclass(frozen=True, kw_only=True)
class MeasuredParts:
    """Parts whose errors are known, and what is turned.

    Parameters
    ----------
    name
        Where the errors come from.
    errors
        Error of every part about its own axes [rad].
    sequence
        The assembly step by step.
    unadjusted
        Final state if nothing is turned [rad].
    exact
        The same by finite rotations [rad].
    missed
        Standard deviation of what the listed turns miss in the end [rad].
    norms
        Weighted norm of the final errors over the precisions of the sweep [rad].
    keeping
        Smallest precision tried at which they keep all limits; none if none of them does, or nothing is limited [-].
    """

    name: str
    errors: Float[np.ndarray, "part 3"]
    sequence: Trajectory
    unadjusted: Float[np.ndarray, "part 3"]
    exact: Float[np.ndarray, "part 3"]
    missed: Float[np.ndarray, "part 3"]
    norms: Float[np.ndarray, " precision"]
    keeping: float | None

    @property
    def adjusted(self) -> Float[np.ndarray, "part 3"]:
        """Final state [rad]."""
        return np.asarray(self.sequence.adjusted[-1].reshape(-1, 3))


@dataclass(frozen=True, kw_only=True)
class TransmissionEffect:
    """What the final angles do to the transmission, over the precision.

    Parameters
    ----------
    reducer
        The reducer that the parts belong to.
    test_torque
        Torque of the transmission error that is not said to be at rated torque [N·m].
    precisions
        Q [-].
    outputs
        Names of the outputs, units in them.
    perfect
        Outputs without any angular error [as the names say].
    values
        Outputs of the same assemblies at every precision; one assembly where the parts are measured
        [as the names say].
    good
        Which assemblies have all outputs at every precision.
    perfect_curves
        One output turn without any angular error, at rated torque.
    curves
        One output turn of the first good assembly at every precision, at rated torque.
    patterns
        Load of one of its discs on the pins at every precision, at rated torque: disc and carrier angle are those at
        which the line load is largest if nothing is turned.
    """

    reducer: Reducer
    test_torque: float
    precisions: Float[np.ndarray, " precision"]
    outputs: tuple[str, ...]
    perfect: Float[np.ndarray, " output"]
    values: Float[np.ndarray, "precision sample output"]
    good: Bool[np.ndarray, " sample"]
    perfect_curves: TransmissionCurves
    curves: TransmissionCurves
    patterns: tuple[ContactPattern, ...]


@dataclass(frozen=True, kw_only=True)
class AngularTolerances:
    """Cheapest angular tolerances.

    Parameters
    ----------
    adjusted
        At the plan's precision, with the filter that expects the plan's tolerances.
    unadjusted
        The same if nothing is turned, or why there are none.
    retuned
        With the filter tuned again to what was allocated.
    verified
        The cheapest of them: with priced effort that at the best precision.
    verification
        Assemblies at random with it.
    by_precision
        Costs over the precision, effort included.
    """

    adjusted: AngularAllocation
    unadjusted: AngularAllocation | str
    retuned: RetunedAllocation
    verified: AngularAllocation
    verification: AngularVerification
    by_precision: PrecisionCost


@dataclass(frozen=True, kw_only=True)
class AssemblyResults:
    """One assembly.

    Parameters
    ----------
    plan
        What was asked.
    gains
        What is turned at every step, per angle, and what that leaves.
    sweep
        What is to be expected over the precision.
    expected
        Standard deviation of every angle after each step, step by step: with the part as mounted, and as adjusted
        [rad].
    fewer
        Root of the sum of the variances of all final angles if every step turned the part that it mounts alone; none if
        the plan does that [rad].
    measured
        Parts whose errors are known, if any are.
    transmission
        What it does to the transmission, if the chain names a reducer.
    tolerances
        Cheapest angular tolerances, if the chain states limits and costs that some tolerances keep.
    unreachable
        Why there are none; empty unless limits are out of reach.
    seed
        Seed of the random numbers [-].
    statuses
        Outcome → number of solved units [-].
    """

    plan: AssemblyPlan
    gains: Gains
    sweep: PrecisionSweep
    expected: Float[np.ndarray, "step 2 state"]
    fewer: float | None
    measured: MeasuredParts | None
    transmission: TransmissionEffect | None
    tolerances: AngularTolerances | None
    unreachable: str
    seed: int
    statuses: Mapping[str, int]

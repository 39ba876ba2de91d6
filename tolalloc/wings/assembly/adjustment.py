"""From a datum flow chain to adjustments, what they leave, what that does to the transmission, and tolerances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.running.progress import RunRecord
from tolalloc.wings.assembly.control import regulator
from tolalloc.wings.assembly.gains import (
    Gains,
    StateWeightSweep,
    expected_angles,
    norms,
    state_weight_sweep,
    tuned_gains,
)
from tolalloc.wings.assembly.orientations import TransmissionEffect, transmission_effect
from tolalloc.wings.assembly.plan import LARGEST_STATE_WEIGHT, AssemblyPlan
from tolalloc.wings.assembly.tolerances import (
    AngularAllocation,
    AngularVerification,
    RetunedAllocation,
    StateWeightCost,
    allocate_angles,
    angular_limits,
    best_state_weight,
    retuned_allocation,
    verify_angles,
)
from tolalloc.wings.assembly.trajectory import Trajectory, foreseen

SWEPT = (
    *(0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0),
    *(10.0, 13.0, 16.0, 20.0, 30.0, 50.0, 100.0),
)
"""Precisions over which the expected errors are drawn [-]."""
SHOWN = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Precisions at which the transmission is solved; zhang2025 shows some of them [-]."""
TRIED = np.geomspace(0.01, LARGEST_STATE_WEIGHT, 161)
"""Precisions among which one that keeps all limits is looked for [-]."""


@dataclass(frozen=True, kw_only=True)
class AssemblyRequest:
    """Which assembly is asked about."""

    plan: AssemblyPlan  # The chain at the precision that was asked for
    name: str = ""  # Where the errors of the parts come from; empty if they are not measured
    errors: Float[np.ndarray, "part 3"] | None = None  # Measured errors of its parts, if there are any [rad]
    assemblies: int = 100_000  # Random assemblies that verify the tolerances [-]
    seed: int = 1  # Seed of every random number [-]


@dataclass(frozen=True, kw_only=True)
class AdjustedParts:
    """Parts whose errors are known, and what is turned."""

    name: str  # Where the errors come from
    errors: Float[np.ndarray, "part 3"]  # Error of every part about its own axes [rad]
    sequence: Trajectory  # The assembly step by step
    unadjusted: Float[np.ndarray, "part 3"]  # Final state if nothing is turned [rad]
    exact: Float[np.ndarray, "part 3"]  # The same by finite rotations [rad]
    missed: Float[np.ndarray, "part 3"]  # Standard deviation of what the listed turns miss in the end [rad]
    norms: Float[np.ndarray, " state_weight"]  # Weighted norm of the final errors over the sweep [rad]
    # Smallest precision tried at which they keep all limits; none if none of them does, or nothing is limited [-]
    keeping: float | None

    @property
    def adjusted(self) -> Float[np.ndarray, "part 3"]:
        """Final state [rad]."""
        return np.asarray(self.sequence.adjusted[-1].reshape(-1, 3))

    @property
    def finite_difference(self) -> float:
        """Largest difference that finite rotations make in an angle that nobody adjusts [rad]."""
        return float(np.abs(self.exact - self.unadjusted).max())


@dataclass(frozen=True, kw_only=True)
class AngularTolerances:
    """Cheapest angular tolerances."""

    adjusted: AngularAllocation  # At the plan's precision, with the filter that expects the plan's tolerances
    unadjusted: AngularAllocation | str  # The same if nothing is turned, or why there are none
    retuned: RetunedAllocation  # With the filter tuned again to what was allocated
    verified: AngularAllocation  # The cheapest of them: with priced effort that at the best precision
    verification: AngularVerification  # Assemblies at random with it
    by_state_weight: StateWeightCost  # Costs over the precision, effort included


@dataclass(frozen=True, kw_only=True)
class AssemblyResult:
    """One assembly: what is turned, what it leaves, what that does, and what angular tolerances cost."""

    plan: AssemblyPlan  # What was asked
    gains: Gains  # What is turned at every step, per angle, and what that leaves
    sweep: StateWeightSweep  # What is to be expected over the precision
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


def assemble(request: AssemblyRequest, record: RunRecord) -> AssemblyResult:
    """Return what is to be turned, what it leaves, what that does, and what tolerances cost."""
    plan, seeds = request.plan, SeedTree(request.seed).child("assembly")
    with record.stage("adjustment"):
        gains = tuned_gains(plan, plan.state_weight, plan.tolerances)
        swept = np.array(sorted({*SWEPT, plan.state_weight}))
        sweep, expected = state_weight_sweep(plan, swept), expected_angles(plan, gains)
        fewer = _fewer(plan)
        measured = None if request.errors is None else _measured(plan, request.name, request.errors, swept)
    with record.stage("tolerances"):
        tolerances, unreachable = _tolerances(plan, seeds.child("verification"), request.assemblies)
    with record.stage("transmission"):
        shown = np.array(sorted({*SHOWN, plan.state_weight}))
        transmission = None
        if plan.reducer:
            transmission = transmission_effect(plan, request.errors, shown, seeds.child("transmission"), record.observe)
    return AssemblyResult(
        plan=plan,
        gains=gains,
        sweep=sweep,
        expected=expected,
        fewer=fewer,
        measured=measured,
        transmission=transmission,
        tolerances=tolerances,
        unreachable=unreachable,
    )


def _measured(
    plan: AssemblyPlan,
    name: str,
    errors: Float[np.ndarray, "part 3"],
    state_weights: Float[np.ndarray, " state_weight"],
) -> AdjustedParts:
    sequence = foreseen(plan.space, regulator(plan.space, plan.final_weight()), errors.ravel())
    turned = plan.space.adjusting * (sequence.adjustments != 0)[:, np.newaxis]
    return AdjustedParts(
        name=name,
        errors=errors,
        sequence=sequence,
        # Nobody measures again after the turns as listed, so what they miss stays.
        missed=plan.adjustment_noise * np.sqrt((turned**2).sum(axis=(0, 2))).reshape(-1, 3),
        unadjusted=(plan.chain.transform @ errors.ravel()).reshape(-1, 3),
        exact=plan.chain.finite(errors),
        norms=norms(plan, errors.ravel(), state_weights),
        keeping=_smallest_keeping(plan, errors),
    )


def _smallest_keeping(plan: AssemblyPlan, errors: Float[np.ndarray, "part 3"]) -> float | None:
    """Return the smallest of the tried precisions at which the measured parts keep all limits, if any does."""
    if plan.requirements is None:
        return None
    limits = angular_limits(plan)
    for state_weight in TRIED:
        final = foreseen(plan.space, regulator(plan.space, plan.final_weight(float(state_weight))), errors.ravel())
        if (limits.counted @ final.adjusted[-1] ** 2 <= limits.values**2).all():
            return float(state_weight)
    return None


def _fewer(plan: AssemblyPlan) -> float | None:
    """Return the total that is left if every step turns the part that it mounts alone, unless it does anyway [rad]."""
    fewer = plan.turning_fewer
    if [step.adjust for step in fewer.steps] == [step.adjust for step in plan.steps]:
        return None
    gains = tuned_gains(fewer, fewer.state_weight, fewer.tolerances)
    return float(np.sqrt(np.trace(gains.errors.covariance(fewer.variances))))


def _tolerances(plan: AssemblyPlan, seeds: SeedTree, assemblies: int) -> tuple[AngularTolerances | None, str]:
    """Return the cheapest tolerances, if any are asked for, or why there are none."""
    if plan.requirements is None:
        return None, ""
    try:
        retuned, by_state_weight = retuned_allocation(plan), best_state_weight(plan)
    except InputError as error:  # who wants to know what to turn must not be kept from it
        return None, str(error)
    # Without a price on effort the best precision is the end of the range, which nobody asked for.
    verified = by_state_weight.best if plan.requirements.effort_price > 0 else retuned.best
    found = AngularTolerances(
        adjusted=retuned.allocations[0],
        unadjusted=_without_adjusting(plan),
        retuned=retuned,
        verified=verified,
        verification=verify_angles(plan, verified, seeds, assemblies),
        by_state_weight=by_state_weight,
    )
    return found, ""


def _without_adjusting(plan: AssemblyPlan) -> AngularAllocation | str:
    try:
        return allocate_angles(plan, 0.0)
    except InputError as error:
        return str(error)

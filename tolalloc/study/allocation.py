"""From a study to the cheapest drawing that keeps its requirements, with what proves it and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.by_hand import scale_by_hand
from tolalloc.allocation.cost.unit_price import YieldLadder, best_yield
from tolalloc.allocation.design_space import ClearanceRange, DesignSpace
from tolalloc.allocation.fronts import designs_around, exact_front
from tolalloc.allocation.graded import GradedAllocation, allocate_grades, group_ladders, with_shared_zones
from tolalloc.allocation.pareto.answers import Checkpoint
from tolalloc.allocation.pareto.design_problem import RADIAL_CLEARANCE
from tolalloc.allocation.pareto.front import pareto_front
from tolalloc.allocation.quantile import LocalQuantile, QuantileResponse
from tolalloc.allocation.robustness import Robustness, robustness
from tolalloc.allocation.search import Allocation, allocate, require_groups
from tolalloc.allocation.trade import ModificationTrade, modification_trade
from tolalloc.allocation.verification import Verifier
from tolalloc.allocation.yield_cost import cost_at_yield
from tolalloc.blas import one_blas_thread
from tolalloc.report.allocation.results import AllocationResults, Fronts
from tolalloc.response.kernel import PEAK_TO_PEAK, KernelResponse
from tolalloc.response.stiffness import StiffnessResponse
from tolalloc.sensitivity.sobol import Player, SobolEffort, sobol_indices
from tolalloc.sensitivity.sobol_analysis import SobolIndices
from tolalloc.study.definition import Prepared, Study, prepare
from tolalloc.study.effort import QUICK, AllocationEffort
from tolalloc.study.stages import Progress, Record
from tolalloc.uncertainty.seeds import SeedTree

_EXACT = (0.7, 1.4)
"""Ends of the exact front over the limit asked for [-]."""


@dataclass(frozen=True, kw_only=True)
class Searches:
    """The searches of one prepared study; each has a node of the seed tree of its own.

    Parameters
    ----------
    prepared
        The checked study.
    kernel
        Its real model, observed.
    """

    prepared: Prepared
    kernel: KernelResponse

    @property
    def effort(self) -> AllocationEffort:
        """How much may be computed."""
        return self.prepared.study.effort.allocation

    def _seeds(self, name: str) -> SeedTree:
        return SeedTree(self.prepared.study.seed).child("allocate", name)

    @property
    def as_it_is(self) -> DesignSpace:
        """Design variables with the modification locked."""
        stage, now, space = self.prepared.reducer.cycloid_stage, self.prepared.reducer.modification, self.prepared.space
        flank, radial = now.flank_clearance(stage), now.radial_clearance
        return replace(space, clearances=ClearanceRange(flank=(flank, flank), radial=(radial, radial)))

    def verifier(self, space: DesignSpace) -> Verifier:
        """Return what judges designs on fresh units, the same units for the same name."""
        study = self.prepared.study
        return Verifier(
            space=space,
            kernel=self.kernel,
            requirements=self.prepared.requirements,
            seeds=self._seeds("verification"),
            units=study.effort.verification_units,
            largest_failed_share=study.largest_failed_share,
        )

    def quantile(self, spread: float) -> QuantileResponse:
        """Return the quantile of designs on the kernel, common random numbers."""
        errors, units = self.prepared.space.errors, self.prepared.study.effort.shared_units
        shared = next(self._seeds("shared").uniform_chunks(units, len(errors.columns)))
        return QuantileResponse(
            space=self.prepared.space, kernel=self.kernel, standard=errors.standard_values(shared), spread=spread
        )

    def alone(self) -> Allocation:
        """Return the allocation of tolerances with the modification as it is, and by hand."""
        search, verifier = self.prepared.study.effort.search, self.verifier(self.as_it_is)
        by_hand = scale_by_hand(verifier, self.prepared.reducer.modification, search.steps)
        return allocate(verifier, by_hand, search)

    def joint(self, alone: Allocation) -> Allocation:
        """Return the allocation of tolerances and modification together, from where the tolerances alone ended."""
        return allocate(
            self.verifier(self.prepared.space), alone.hand_tried, self.prepared.study.effort.search, alone.chosen
        )

    def graded(self, joint: Allocation) -> GradedAllocation:
        """Return the allocation on ladders of zones."""
        return allocate_grades(self.verifier(self.prepared.space), joint.chosen, self.effort.graded_steps)

    def trade(self, joint: Allocation) -> ModificationTrade:
        """Return the cost of the cheapest zones over the two clearances."""
        flank, radial = (
            _denser_below(float(low), float(high), steps)
            for low, high, steps in zip(
                self.prepared.space.lower[-2:],
                self.prepared.space.upper[-2:],
                (self.effort.flank_steps, self.effort.radial_steps),
                strict=True,
            )
        )
        return modification_trade(self.quantile(joint.chosen.spread), joint, flank, radial)

    def fronts(self, joint: Allocation, checkpoint: Path | None) -> Fronts:
        """Return what can be had at which cost."""
        space, best, effort = self.prepared.space, joint.chosen, self.prepared.study.effort.search.front
        exact = exact_front(space, best, np.linspace(*_EXACT, self.effort.exact_points))
        few = exact.designs[np.unique(np.linspace(0, len(exact.designs) - 1, effort.points).astype(int))]
        found = [
            pareto_front(
                self.quantile(best.spread),
                LocalQuantile(side=best.sides[0]),
                designs_around(space, best.design, 2.5, effort.designs, self._seeds("designs")),
                few,
                self._seeds("pareto"),
                effort,
                further=further,
                checkpoint=Checkpoint(path=checkpoint, every=4) if checkpoint else None,
            )
            for further in ((), (RADIAL_CLEARANCE,))
        ]
        return Fronts(exact=exact, searched=found[0][0], with_clearance=found[1][0], surrogate=found[0][1])

    def robustness(self, joint: Allocation) -> Robustness:
        """Return the answers under changed assumptions."""
        verifier = replace(self.verifier(self.prepared.space), units=self.effort.stiffness_units)
        seeds = self._seeds("robustness")
        return robustness(verifier, joint, self._kernels(seeds), seeds, self.effort.changed_costs)

    def _kernels(self, seeds: SeedTree) -> tuple[KernelResponse, ...]:
        """Return kernels with stiffnesses drawn from what is not known of them, none if nothing is said of it."""
        source, identified = self.prepared.stiffness, self.prepared.identified
        if source is None or identified is None:
            return ()
        response = StiffnessResponse(kernel=self.kernel, stiffnesses=tuple(identified.values))
        shape = (self.effort.changed_stiffnesses, len(response.stiffnesses))
        draws = source.standard_values(seeds.child("stiffness").generator().random(shape))
        return tuple(response.changed(change) for change in draws)

    def prices(self, joint: Allocation) -> YieldLadder | None:
        """Return the price of a good unit over yield targets, if the study states what becomes of the others."""
        price = self.prepared.study.unit_price
        if price is None:
            return None
        return best_yield(lambda target: cost_at_yield(self.prepared.space, joint, target), price, self.effort.yields)

    def shares(self, space: DesignSpace, design: Float[np.ndarray, " variable"]) -> SobolIndices:
        """Return the indices of the peak-to-peak at the zones and the modification of a design."""
        errors, blocks = space.errors, self.effort.share_blocks
        return sobol_indices(
            self.kernel.with_modification(space.modification(design)),
            errors,
            space.zones(design),
            self._seeds("shares"),
            SobolEffort(start=blocks, limit=blocks, largest_failed_share=self.prepared.study.largest_failed_share),
            Player.BLOCK if errors.is_correlated else Player.SOURCE,
        ).of(PEAK_TO_PEAK)


def _denser_below(low: float, high: float, steps: int) -> Float[np.ndarray, " step"]:
    """Return clearances of a range, denser towards its lower end, where zones are cheap [µm]."""
    return np.unique(np.round(low + (high - low) * np.linspace(0.0, 1.0, steps) ** 2, 2))


def allocate_study(
    study: Study, progress: Progress, *, quick: bool = False, checkpoint: Path | None = None
) -> AllocationResults:
    """Return the cheapest drawing that keeps a study's requirements.

    Parameters
    ----------
    study
        What is asked for.
    progress
        Told how far the work has come.
    quick
        Replace the study's effort by a small one.
    checkpoint
        File that keeps the answers of the search for the front, so that an interrupted run goes on from them.

    Raises
    ------
    InputError, UnknownNameError
        The file, field and value that are not allowed.
    SolveError
        Too many units failed.
    """
    prepared, record = prepare(replace(study, effort=QUICK) if quick else study), Record(progress)
    require_groups(prepared.space, f"study {study.name}")
    if study.grades:
        group_ladders(with_shared_zones(prepared.space))  # before anything long runs
    searches = Searches(prepared=prepared, kernel=replace(prepared.kernel, observe=record.observe))
    with one_blas_thread():
        with record.stage("tolerances alone"):
            alone = searches.alone()
        with record.stage("with modification"):
            joint = searches.joint(alone)
        graded = None
        if study.grades:
            with record.stage("grades"):
                graded = searches.graded(joint)
        with record.stage("modification trade"):
            trade = searches.trade(joint)
        with record.stage("fronts"):
            fronts = searches.fronts(joint, checkpoint)
        with record.stage("robustness"):
            robust, prices = searches.robustness(joint), searches.prices(joint)
        with record.stage("shares of variance"):
            shares = searches.shares(graded.space if graded else prepared.space, (graded or joint).chosen.design)
    return AllocationResults(
        name=study.name,
        quick=quick,
        digest=prepared.hash,
        seed=study.seed,
        reducer=prepared.reducer,
        torque=prepared.kernel.torque,
        requirements=prepared.requirements,
        target=study.yield_target,
        alone=alone,
        joint=joint,
        space=prepared.space,
        graded=graded,
        shares=shares,
        trade=trade,
        fronts=fronts,
        robustness=robust,
        prices=prices,
        neglected=prepared.neglected,
        statuses=record.counts,
        stages=record.stages,
    )

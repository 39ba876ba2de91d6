"""From a study to the cheapest drawing that keeps its requirements, with what proves it and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.answer.results import AllocationResults, Fronts
from tolalloc.allocation.by_hand import scale_by_hand
from tolalloc.allocation.cost.unit_price import YieldLadder, best_yield
from tolalloc.allocation.design_space import ClearanceRange, DesignSpace
from tolalloc.allocation.fronts import exact_front, searched_front
from tolalloc.allocation.graded import GradedAllocation, allocate_grades, group_options, with_shared_zones
from tolalloc.allocation.pareto.answers import Checkpoint
from tolalloc.allocation.pareto.design_problem import RADIAL_CLEARANCE
from tolalloc.allocation.quantile import QuantileResponse
from tolalloc.allocation.robustness import Robustness, robustness
from tolalloc.allocation.search import Allocation, allocate, require_groups
from tolalloc.allocation.trade import ModificationTrade, modification_trade
from tolalloc.allocation.trust_region import kept_stacks
from tolalloc.allocation.verification import Verifier
from tolalloc.allocation.yield_cost import cost_at_yield
from tolalloc.blas import one_blas_thread
from tolalloc.capability.experiment import Experiment
from tolalloc.drawing.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.progress import Progress, Record
from tolalloc.rv.equivalent.status import OUTCOMES
from tolalloc.rv.response.kernel import PEAK_TO_PEAK, KernelResponse
from tolalloc.rv.response.stiffness import StiffnessResponse
from tolalloc.sensitivity.sobol import FactorGroup, SobolEffort, sobol_indices
from tolalloc.sensitivity.sobol_analysis import SobolIndices
from tolalloc.study.definition import Prepared, Study, prepare
from tolalloc.study.effort import QUICK, AllocationEffort

_EXACT = (0.85, 1.25)
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

    def require_enough_units(self) -> None:
        """Raise unless the fresh units of every stage can show what is asked of them.

        Raises
        ------
        InputError
            Too few units for a guarantee.
        """
        study = self.prepared.study
        asked = {"verification_units": study.effort.verification_units}
        if self.prepared.stiffness is not None:
            asked["allocation.stiffness_units"] = self.effort.stiffness_units
        for requirement in self.prepared.requirements:
            for name, units in asked.items():
                try:
                    requirement.guarantee.require_enough(units)
                except InputError as error:
                    raise InputError(f"study {study.name}, effort.{name} for {requirement.output}, {error}") from None

    @property
    def as_it_is(self) -> DesignSpace:
        """Design variables with the modification locked."""
        stage, now, space = self.prepared.reducer.cycloid_stage, self.prepared.reducer.modification, self.prepared.space
        flank, radial = now.flank_clearance(stage), now.radial_clearance
        return replace(space, clearances=ClearanceRange(flank=(flank, flank), radial=(radial, radial)))

    def verifier(self, search: str, space: DesignSpace) -> Verifier:
        """Return what judges the designs of one search on fresh units, other ones than those of any other search."""
        study = self.prepared.study
        return Verifier(
            space=space,
            kernel=self.kernel,
            requirements=self.prepared.requirements,
            seeds=self._seeds("verification").child(search),
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
        search, verifier = self.prepared.study.effort.search, self.verifier("alone", self.as_it_is)
        by_hand = scale_by_hand(verifier, self.prepared.reducer.modification, search.steps)
        return allocate(verifier, by_hand, search)

    def joint(self, alone: Allocation) -> Allocation:
        """Return the allocation of tolerances and modification together, from where the tolerances alone ended."""
        verifier = self.verifier("joint", self.prepared.space)
        return allocate(verifier, alone.hand_tried, self.prepared.study.effort.search, alone.chosen)

    def graded(self, joint: Allocation) -> GradedAllocation:
        """Return the allocation on ladders of zones."""
        return allocate_grades(self.verifier("graded", self.prepared.space), joint.chosen, self.effort.graded_steps)

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

    def fronts(self, found: Allocation | GradedAllocation, checkpoint: Checkpoint | None) -> Fronts:
        """Return what can be had at which cost, around the design that is drawn and on its ladders, if it has any.

        Parameters
        ----------
        found
            What is drawn.
        checkpoint
            Keeps the kernel's answers.
        """
        drawn, graded = found.chosen, found if isinstance(found, GradedAllocation) else None
        space, ladders = (graded.space, graded.scales) if graded else (self.prepared.space, {})
        effort = self.prepared.study.effort.search.front
        # Where the limit is out of reach, the front lies around what is kept instead.
        around = max(1.0, min(drawn.quantile_bound, float(drawn.sample.values.max())) / drawn.sides[0].limit)
        stacks, shares = kept_stacks(drawn, found.tried, margin=0.0), np.linspace(*_EXACT, self.effort.exact_points)
        exact = exact_front(space, stacks, around * drawn.sides[0].limit, shares)
        response = replace(self.quantile(drawn.spread), space=space)
        searched, with_clearance = (
            searched_front(response, drawn, stacks, exact, self._seeds("front"), effort, ladders, further, checkpoint)
            for further in ((), (RADIAL_CLEARANCE,))
        )
        return Fronts(exact=exact, searched=searched[0], with_clearance=with_clearance[0], surrogate=searched[1])

    def robustness(self, joint: Allocation) -> Robustness:
        """Return the answers under changed assumptions."""
        verifier = replace(self.verifier("robustness", self.prepared.space), units=self.effort.stiffness_units)
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
        """Return the price of a good unit over yield targets, if the study prices the others."""
        price = self.prepared.study.unit_price
        if price is None:
            return None
        return best_yield(lambda target: cost_at_yield(self.prepared.space, joint, target), price, self.effort.yields)

    def shares(self, space: DesignSpace, design: Float[np.ndarray, " variable"]) -> SobolIndices:
        """Return the indices of the peak-to-peak at the zones and the modification of a design."""
        errors, blocks = space.errors, self.effort.share_blocks
        return sobol_indices(
            Experiment(
                self.kernel.with_modification(space.modification(design)),
                errors,
                space.zones(design),
                self._seeds("shares"),
                self.prepared.study.largest_failed_share,
            ),
            SobolEffort(start=blocks, limit=blocks),
            FactorGroup.BLOCK if errors.is_correlated else FactorGroup.SOURCE,
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
    prepared, record = prepare(replace(study, effort=QUICK) if quick else study), Record(progress, OUTCOMES)
    require_groups(prepared.space, f"study {study.name}")
    if study.grades:
        group_options(with_shared_zones(prepared.space))  # before anything long runs
    searches = Searches(prepared=prepared, kernel=replace(prepared.kernel, observe=record.observe))
    searches.require_enough_units()
    kept = Checkpoint(path=checkpoint, every=4, question=prepared.hash) if checkpoint else None
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
        before = record.counts
        with record.stage("fronts"):
            fronts = searches.fronts(graded or joint, kept)
        # What a checkpoint knew is not solved again: these units tell how the run went and not what was found.
        searched = {outcome: count - before[outcome] for outcome, count in record.counts.items()}
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
        loss=study.quality_loss,
        neglected=prepared.neglected,
        statuses={outcome: count - searched[outcome] for outcome, count in record.counts.items()},
        stages=record.stages,
    )

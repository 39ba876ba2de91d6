"""Everything a report on an allocation is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from tolalloc.allocation.cost.unit_price import QualityLoss, YieldLadder
from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.fronts import ConvexFront
from tolalloc.allocation.graded import GradedAllocation
from tolalloc.allocation.pareto.front import Front
from tolalloc.allocation.requirement import Requirement
from tolalloc.allocation.robustness import Robustness
from tolalloc.allocation.search import Allocation
from tolalloc.allocation.trade import ModificationTrade
from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.rv.reducer.design import Modification, Reducer
from tolalloc.sensitivity.sobol_analysis import SobolIndices
from tolalloc.surrogate.regression import Surrogate


@dataclass(frozen=True, kw_only=True)
class Fronts:
    """What can be had at which cost.

    Parameters
    ----------
    exact
        The convex program's front around the chosen design, with its certificate.
    searched
        The front of NSGA-II on the corrected model, cost against quantile, with kernel runs along it.
    with_clearance
        The front of NSGA-III with the radial clearance as a third objective.
    surrogate
        What the searches ran on, with its Q².
    """

    exact: ConvexFront
    searched: Front
    with_clearance: Front
    surrogate: Surrogate


@dataclass(frozen=True, kw_only=True)
class AllocationResults:
    """The cheapest drawing that keeps every requirement.

    Parameters
    ----------
    name, quick
        Which study, and whether it was shortened.
    digest
        Of the study and of what its files hold.
    seed
        Its seed [-].
    reducer, torque
        The reducer, and the torque on its carrier [N·m].
    requirements
        What must be kept, the peak-to-peak first.
    target
        Share of units that must keep a limit, unless a requirement says otherwise [-].
    alone
        The allocation of tolerances with the modification as it is.
    joint
        The allocation of tolerances and modification together.
    space
        Design variables of the joint allocation.
    graded
        The same on ladders of zones, if the study asks for it.
    shares
        Sobol indices of the peak-to-peak at the zones of the drawing.
    trade
        Cost of the cheapest zones over the two clearances.
    fronts
        What can be had at which cost.
    robustness
        Answers under changed assumptions.
    prices
        Price of a good unit over yield targets, if the study states what becomes of the others.
    loss
        What a peak-to-peak costs a user, if the study states it.
    neglected
        Patterns of the sources that are taken as zero.
    statuses
        Outcome → number of units, over all stages but the fronts, which count their failed designs [-].
    stages
        Seconds and units of each stage.
    """

    name: str
    quick: bool
    digest: str
    seed: int
    reducer: Reducer
    torque: float
    requirements: tuple[Requirement, ...]
    target: float
    alone: Allocation
    joint: Allocation
    space: DesignSpace
    graded: GradedAllocation | None
    shares: SobolIndices
    trade: ModificationTrade
    fronts: Fronts
    robustness: Robustness
    prices: YieldLadder | None
    loss: QualityLoss | None
    neglected: tuple[str, ...]
    statuses: Mapping[str, int]
    stages: Mapping[str, Mapping[str, float]]

    @property
    def chosen(self) -> VerifiedDesign:
        """What the drawing shall show: the graded design where grades were asked for."""
        return self.graded.chosen if self.graded else self.joint.chosen

    @property
    def drawn(self) -> DesignSpace:
        """Design variables of the chosen design; groups share one zone where it is graded."""
        return self.graded.space if self.graded else self.space

    @cached_property
    def modification(self) -> Modification:
        """Modification amounts of the chosen design."""
        return self.drawn.modification(self.chosen.design)

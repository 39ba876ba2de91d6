"""Everything a report on the ranking is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tolalloc.capability.indices import Limits
from tolalloc.capability.monte_carlo import MonteCarlo
from tolalloc.capability.yield_at_limit import YieldAtLimit
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.drawing.seeds import SamplingDesign
from tolalloc.rv.reducer.design import Reducer
from tolalloc.sensitivity.classical import ClassicalEstimate
from tolalloc.sensitivity.derivatives import DerivativeMeasures, LocalDerivatives
from tolalloc.sensitivity.inverse import InverseSensitivity
from tolalloc.sensitivity.order_contribution import OrderContribution
from tolalloc.sensitivity.ranking import Reproduction
from tolalloc.sensitivity.screening import ElementaryEffects, MomentIndependent
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.sensitivity.sobol_analysis import SobolAnalysis
from tolalloc.sensitivity.target import TargetSensitivity
from tolalloc.surrogate.choice import Choice


@dataclass(frozen=True, kw_only=True)
class RankingResults:
    """What drives a reducer's outputs, and how sure that is.

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
    identified
        Whether identified stiffnesses replaced the reducer's own.
    errors
        Sources, their distributions and correlations.
    limits
        Output → limits; the peak-to-peak first.
    target
        Share of units that must keep a limit [-].
    outputs
        Names of the outputs that requirements may limit, in the order of the sample's columns.
    sample, spread
        Random units with all these outputs, and how they are spread.
    sobol
        Indices of these outputs and of the waves of chosen orders.
    reproduction
        How much of the ranking a second seed has shown.
    orders
        What each source adds to each order.
    shapley
        Effects of correlated sources; none where all are independent.
    classical
        What a hand calculation says.
    local, derivatives
        Derivatives by each source, and what they bound.
    effects, moments
        Measures beside Sobol's.
    reject
        What drives the units out of the limit.
    inverse
        How far each zone may open alone.
    beyond
        Probability of a peak-to-peak beyond the limit.
    choice
        Stand-ins for the kernel with their errors.
    neglected
        Patterns of the sources that are taken as zero.
    statuses
        Outcome → number of units, over the whole study [-].
    stages
        Seconds and units of each stage.
    """

    name: str
    quick: bool
    digest: str
    seed: int
    reducer: Reducer
    torque: float
    identified: bool
    errors: ErrorModel
    limits: Mapping[str, Limits]
    target: float
    outputs: tuple[str, ...]
    sample: MonteCarlo
    spread: SamplingDesign
    sobol: SobolAnalysis
    reproduction: Reproduction
    orders: OrderContribution
    shapley: ShapleyEffects | None
    classical: ClassicalEstimate
    local: LocalDerivatives
    derivatives: DerivativeMeasures
    effects: ElementaryEffects
    moments: MomentIndependent
    reject: TargetSensitivity
    inverse: InverseSensitivity
    beyond: YieldAtLimit
    choice: Choice
    neglected: tuple[str, ...]
    statuses: Mapping[str, int]
    stages: Mapping[str, Mapping[str, float]]

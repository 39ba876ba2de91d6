"""Everything a report is made of: one finished study."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.pareto import Front
from tolalloc.allocation.search import Allocation
from tolalloc.rv.cycloid.assessment import Assessment
from tolalloc.rv.cycloid.clearance import linear_model_warnings
from tolalloc.rv.equivalent.answers import Equilibria
from tolalloc.rv.equivalent.outputs import Orders
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness
from tolalloc.rv.reducer.unit_file import BuiltUnit
from tolalloc.rv.response.stiffness import StiffnessEffect
from tolalloc.sensitivity.classical import ClassicalEstimate
from tolalloc.sensitivity.sobol_analysis import SobolIndices
from tolalloc.surrogate.regression import Surrogate

_COMMON = (
    "identified stiffness: relative changes are jointly normal with the standard uncertainties and the correlation of "
    "its file, taken to first order, and common to all units of the reducer; they are part of the ranking alone, not "
    "of the allocation, the hand estimates or the verified yield, which hold for the identified values"
)


@dataclass(frozen=True, kw_only=True)
class ExampleUnit:
    """One unit whose curve the report shows.

    Parameters
    ----------
    label
        What it is.
    curves
        Its transmission error over one turn.
    orders
        Orders of that curve.
    """

    label: str
    curves: Equilibria
    orders: Orders


@dataclass(frozen=True, kw_only=True)
class StudyResults:
    """A finished study.

    Parameters
    ----------
    name, quick
        Which study, and whether it was shortened.
    seed
        Its seed [-].
    reducer, torque
        The reducer with the stiffness that was used, and the torque on its carrier [N·m].
    identified
        Identified stiffnesses that replaced the reducer's own, if any.
    torsional_stiffness
        Of the perfect reducer between 3 % and 100 % of rated torque [N·m/arcmin].
    space
        Design variables.
    limit
        Largest peak-to-peak allowed [arcsec].
    target
        Share of units that must keep it [-].
    sobol, classical
        Ranking at the zones of the tolerance table, and the hand estimate beside it.
    stiffness
        What not knowing the identified stiffnesses does to the peak-to-peak, if there are any.
    allocation
        What the search found.
    front, surrogate
        Pareto front of cost against the quantile of the peak-to-peak, and what it was searched on.
    unit
        The built unit that is shown, if any.
    neglected
        Patterns of the sources that are taken as zero.
    contacts
        How the exact teeth carry the rated torque before and after; none where the modification interferes.
    examples
        Units whose curves are shown.
    statuses
        Outcome → number of units, over the whole study [-].
    """

    name: str
    seed: int
    quick: bool
    reducer: Reducer
    torque: float
    identified: IdentifiedStiffness | None
    torsional_stiffness: float
    space: DesignSpace
    limit: float
    target: float
    sobol: SobolIndices
    classical: ClassicalEstimate
    stiffness: StiffnessEffect | None
    allocation: Allocation
    front: Front
    surrogate: Surrogate
    unit: BuiltUnit | None
    neglected: tuple[str, ...]
    contacts: tuple[Assessment | None, Assessment | None]
    examples: tuple[ExampleUnit, ...]
    statuses: dict[str, int]

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Everything in the answer that no source prints."""
        clearances = self.space.clearances
        return (
            *self.reducer.assumptions,
            *(self.unit.assumptions if self.unit else ()),
            "zones, distributions, Cp, costs, smallest and largest zones: as the tolerance table states them; its "
            "notes say where each comes from (list below)",
            (
                "sources correlated as their file states, the others independent"
                if self.space.errors.is_correlated
                else "all sources are independent of each other"
            ),
            "a cost falls as 1/zone",
            "tooth modification costs nothing and is exact; nominal clearance "
            f"{clearances.flank[0] * 1e6:g}…{clearances.flank[1] * 1e6:g} µm on the flank and "
            f"{clearances.radial[0] * 1e6:g}…{clearances.radial[1] * 1e6:g} µm at tip and root",
            *((_COMMON,) if self.stiffness else ()),
            "contact at rated torque: exact parts, Hertzian line contact, the most loaded disc by Li Lixing's share",
            *self._left_out,
        )

    @property
    def _left_out(self) -> tuple[str, ...]:
        """What the model could tell and this study does not ask for."""
        sources = self.space.errors.sources
        still = [source.name for source in sources if source.zone == 0.0]
        free = [name for name, value in asdict(self.reducer.clearances).items() if value == 0.0]
        return (
            *(
                (f"not in the tolerance table and taken as exact: {', '.join(self.neglected)}",)
                if self.neglected
                else ()
            ),
            *((f"in the tolerance table with zone 0 and taken as exact: {', '.join(still)}",) if still else ()),
            *((f"without clearance: {', '.join(free).replace('_', ' ')}",) if free else ()),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on the answer."""
        chosen, limit = self.allocation.chosen, self.limit
        found = []
        if self.quick:
            found.append("Quick run: small samples, wide intervals. Run without --quick before setting a drawing.")
        if not chosen.met:
            found.append(
                f"No design was verified to meet the limit of {limit:g}″ at {self.target:.2%} yield; "
                f"the least violating one keeps {chosen.quantile_bound:.1f}″. The peak-to-peak limit is what blocks."
            )
        if not self.allocation.by_hand.met:
            found.append("Uniform scaling was not verified to meet the limit, so the saving is against a miss.")
        if self.stiffness and self.stiffness.first_order.fails:
            error = self.stiffness.first_order
            found.append(
                f"The share of the identified stiffness is rough: at 2σ its first order is off by "
                f"{error.root_mean_square:.2g}″ where the effect is {error.effect:.2g}″."
            )
        found += [
            f"The modification {when} interferes with the pins, so its contact under load is not shown."
            for when, contact in zip(("before", "after"), self.contacts, strict=True)
            if contact is None
        ]
        stage, amounts = self.reducer.cycloid_stage, self.space.modification(chosen.design)
        found += linear_model_warnings(stage, amounts)
        if self.sobol.dropped:
            found.append(f"{self.sobol.dropped} Sobol blocks held a failed unit and were dropped whole.")
        failed = sum(count for outcome, count in self.statuses.items() if outcome != "equilibrium found")
        if failed:
            found.append(f"{failed} units have no equilibrium; they count as outside the limit.")
        for group, scale, low, high in zip(
            self.space.groups, chosen.design, self.space.lower, self.space.upper, strict=False
        ):
            if scale < low * 1.001 or scale > high * 0.999:
                found.append(
                    f"{group}: the zone stands on its {'smallest' if scale < low * 1.001 else 'largest'} allowed value."
                )
        return tuple(found)

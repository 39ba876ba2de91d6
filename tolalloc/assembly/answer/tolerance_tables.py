"""The tables of angular tolerances: what each may be, what it costs, which limit asks for it, and what proves it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.assembly.answer.tables import has_limits, rounded
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.assembly.tolerances import AngularAllocation, angular_problem
from tolalloc.reading.units import ARCSECOND

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AngularTolerances, AssemblyAnswer

_NOTHING = 1e-6
"""Share of the cost below which one filter is as cheap as another; solvers differ by less [-]."""


def limited_tolerances(answer: AssemblyAnswer) -> AngularTolerances | None:
    """Return the cheapest tolerances; where nothing is limited, none mean anything."""
    return answer.tolerances if has_limits(answer) else None


def is_priced(plan: AssemblyPlan) -> bool:
    """Return whether turning has a price."""
    return plan.requirements is not None and plan.requirements.effort_price > 0


def is_retuned(tolerances: AngularTolerances) -> bool:
    """Return whether a filter that is tuned to what is allocated gains anything."""
    return tolerances.retuned.best.total < tolerances.adjusted.total * (1 - _NOTHING)


def allocations(plan: AssemblyPlan, tolerances: AngularTolerances) -> dict[str, AngularAllocation]:
    """Return the allocations that differ, by what was adjusted; only priced effort makes one precision the best."""
    found = {} if isinstance(tolerances.unadjusted, str) else {"unadjusted": tolerances.unadjusted}
    found["adjusted"] = tolerances.adjusted
    if is_retuned(tolerances):
        found["re-tuned"] = tolerances.retuned.best
    if is_priced(plan):
        found["best precision"] = tolerances.by_precision.best
    return found


def verified_name(plan: AssemblyPlan, tolerances: AngularTolerances) -> str:
    """Return which of the allocations is verified."""
    made = allocations(plan, tolerances)
    # A filter tuned again that gains nothing leaves the adjusted tolerances.
    return next((name for name, each in made.items() if each is tolerances.verified), "adjusted")


def tolerance_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every tolerance and what it costs, part by part and axis by axis."""
    part, axis = zip(*product(plan.chain.names, "xyz"), strict=True)
    columns: dict[str, object] = {"part": part, "axis": axis, "stated, ± [arcsec]": plan.tolerances.ravel() / ARCSECOND}
    made = allocations(plan, tolerances)
    for name, each in made.items():
        columns[f"{name}, ± [arcsec]"] = each.tolerances.ravel() / ARCSECOND
    for name, each in made.items():
        features = angular_problem(plan, each.gains.errors).features
        columns[f"cost {name} [cost units]"] = [
            float(feature.processes[0].total(np.array(tolerance)))
            for feature, tolerance in zip(features, each.tolerances.ravel() / ARCSECOND, strict=True)
        ]
    return rounded(pd.DataFrame(columns))


def limit_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every limit: what fills it, what it costs, and what random assemblies keep."""
    found, verified = tolerances.verified, tolerances.verification
    limits, name = found.limits, verified_name(plan, tolerances)
    spreads = {f"{made}, 3σ [arcsec]": each.spread / ARCSECOND for made, each in allocations(plan, tolerances).items()}
    return rounded(
        pd.DataFrame(
            {
                "limit of": limits.names,
                "limit, 3σ [arcsec]": limits.values / ARCSECOND,
                **spreads,
                f"noise in the limit's square, {name} [%]": 100
                * (limits.noise(found.gains.errors) / limits.values) ** 2,
                f"saved by a wider limit, {name} [cost units/arcsec]": found.prices * ARCSECOND,
                f"verified, {name}, 3σ [arcsec]": verified.spread / ARCSECOND,
                "its standard error [arcsec]": verified.standard_error / ARCSECOND,
                "within [%]": [100 * share.estimate for share in verified.shares],
                "low 2.5 % [%]": [100 * share.low for share in verified.shares],
                "high 97.5 % [%]": [100 * share.high for share in verified.shares],
            }
        )
    )


def certificate_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs and lower bounds of the allocations."""
    rows = [
        {
            "allocation": name,
            "precision Q [-]": each.gains.precision,
            "tolerances [cost units]": each.cost,
            "effort [cost units]": each.effort_cost,
            "total [cost units]": each.total,
            "lower bound, own gains [cost units]": each.bound,
            "above the bound [%]": 100 * each.gap,
        }
        for name, each in allocations(plan, tolerances).items()
    ]
    return rounded(pd.DataFrame(rows))


def precision_table(tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs over the precision."""
    found = tolerances.by_precision
    return rounded(
        pd.DataFrame(
            {
                "precision Q [-]": found.precisions,
                "tolerances [cost units]": found.cost,
                "effort [cost units]": found.effort_cost,
                "total [cost units]": found.total,
            }
        )
    )

"""The tables of angular tolerances: what each may be, what it costs, which limit asks for it, and what proves it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd

from tolalloc.allocation.angular.allocation import AngularAllocation
from tolalloc.allocation.angular.program import angular_problem
from tolalloc.assembly.plan import AssemblyPlan
from tolalloc.report.assembly.results import AngularTolerances
from tolalloc.units import ARCSECOND


def allocations(tolerances: AngularTolerances) -> dict[str, AngularAllocation]:
    """Return the allocations that there are, by what was adjusted."""
    found = {"adjusted": tolerances.adjusted, "re-tuned": tolerances.retuned.best}
    if isinstance(tolerances.unadjusted, str):
        return found
    return {"unadjusted": tolerances.unadjusted, **found}


def tolerance_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every tolerance and what it costs, part by part and axis by axis."""
    part, axis = zip(*product(plan.chain.names, "xyz"), strict=True)
    columns: dict[str, object] = {"part": part, "axis": axis, "stated, ± [arcsec]": plan.tolerances.ravel() / ARCSECOND}
    made = allocations(tolerances)
    for name, each in made.items():
        columns[f"{name}, ± [arcsec]"] = each.tolerances.ravel() / ARCSECOND
    for name, each in made.items():
        features = angular_problem(plan, each.gains.errors).features
        columns[f"cost {name} [cost units]"] = [
            float(feature.processes[0].total(np.array(tolerance)))
            for feature, tolerance in zip(features, each.tolerances.ravel() / ARCSECOND, strict=True)
        ]
    return pd.DataFrame(columns)


def limit_table(tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every limit: what fills it, what it costs, and what random assemblies with re-tuned tolerances keep."""
    best, verified = tolerances.retuned.best, tolerances.verification
    limits = best.limits
    return pd.DataFrame(
        {
            "limit of": limits.names,
            "limit, 3σ [arcsec]": limits.values / ARCSECOND,
            "adjusted, 3σ [arcsec]": tolerances.adjusted.spread / ARCSECOND,
            "re-tuned, 3σ [arcsec]": best.spread / ARCSECOND,
            "noise in the limit's square [%]": 100 * (limits.noise(best.gains.errors) / limits.values) ** 2,
            "saved by a wider limit [cost units/arcsec]": best.prices * ARCSECOND,
            "verified, 3σ [arcsec]": verified.spread / ARCSECOND,
            "its standard error [arcsec]": verified.standard_error / ARCSECOND,
            "within [%]": [100 * share.estimate for share in verified.shares],
            "low 2.5 % [%]": [100 * share.low for share in verified.shares],
            "high 97.5 % [%]": [100 * share.high for share in verified.shares],
        }
    )


def certificate_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs and lower bounds of the allocations; only a priced effort makes one precision the best."""
    made = allocations(tolerances)
    if is_priced(plan):
        made["best precision"] = tolerances.by_precision.best
    return pd.DataFrame(
        [
            {
                "allocation": name,
                "precision Q [-]": each.gains.precision,
                "tolerances [cost units]": each.cost,
                "effort [cost units]": each.effort_cost,
                "total [cost units]": each.total,
                "lower bound, own gains [cost units]": each.bound,
                "above the bound [%]": 100 * each.gap,
            }
            for name, each in made.items()
        ]
    )


def precision_table(tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs over the precision."""
    found = tolerances.by_precision
    return pd.DataFrame(
        {
            "precision Q [-]": found.precisions,
            "tolerances [cost units]": found.cost,
            "effort [cost units]": found.effort_cost,
            "total [cost units]": found.total,
        }
    )


def is_priced(plan: AssemblyPlan) -> bool:
    """Return whether turning has a price."""
    return plan.requirements is not None and plan.requirements.effort_price > 0

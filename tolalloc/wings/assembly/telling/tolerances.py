"""Angular tolerances of an assembly: what each may be, what it costs, which limit asks for it, and what proves it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from tolalloc.reading.units import ARCSECOND
from tolalloc.reports.columns import Column, Table, of_positions
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import number
from tolalloc.wings.assembly.adjustment import AngularTolerances, AssemblyResult
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.telling.tables import PRECISION, has_limits, rounded
from tolalloc.wings.assembly.tolerances import AngularAllocation, angular_problem

if TYPE_CHECKING:
    import pandas as pd

_NOTHING = 1e-6
"""Share of the cost below which one filter is as cheap as another; solvers differ by less [-]."""
_say = Sentences("assembly", "tolalloc.wings.assembly")


def limited_tolerances(result: AssemblyResult) -> AngularTolerances | None:
    """Return the cheapest tolerances; where nothing is limited, none mean anything."""
    return result.tolerances if has_limits(result) else None


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
        found["best precision"] = tolerances.by_state_weight.best
    return found


def verified_name(plan: AssemblyPlan, tolerances: AngularTolerances) -> str:
    """Return which of the allocations is verified."""
    made = allocations(plan, tolerances)
    # A filter tuned again that gains nothing leaves the adjusted tolerances.
    return next((name for name, each in made.items() if each is tolerances.verified), "adjusted")


def tolerance_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every tolerance and what it costs, part by part and axis by axis."""
    part, axis = zip(*product(plan.chain.names, "xyz"), strict=True)
    made = allocations(plan, tolerances)

    def cost(each: AngularAllocation) -> list[float]:
        features = angular_problem(plan, each.gains.errors).features
        return [
            float(feature.processes[0].total(np.array(tolerance)))
            for feature, tolerance in zip(features, each.tolerances.ravel() / ARCSECOND, strict=True)
        ]

    columns = {
        "part": part,
        "axis": axis,
        "stated, ± [arcsec]": plan.tolerances.ravel() / ARCSECOND,
        **{f"{name}, ± [arcsec]": each.tolerances.ravel() / ARCSECOND for name, each in made.items()},
        **{f"cost {name} [{{cost}}]": cost(each) for name, each in made.items()},
    }
    return rounded(of_positions("angular tolerances", columns))


def limit_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return every limit: what fills it, what it costs, and what random assemblies keep."""
    found, verified = tolerances.verified, tolerances.verification
    limits, name = found.limits, verified_name(plan, tolerances)
    noise = 100 * (limits.noise(found.gains.errors) / limits.values) ** 2
    columns = {
        "limit of": limits.names,
        "limit, 3σ [arcsec]": limits.values / ARCSECOND,
        **{f"{made}, 3σ [arcsec]": each.spread / ARCSECOND for made, each in allocations(plan, tolerances).items()},
        f"noise in the limit's square, {name} [%]": noise,
        f"saved by a wider limit, {name} [{{cost}}/arcsec]": found.prices * ARCSECOND,
        f"verified, {name}, 3σ [arcsec]": verified.spread / ARCSECOND,
        "its standard error [arcsec]": verified.standard_error / ARCSECOND,
        "within [%]": [100 * share.estimate for share in verified.shares],
        "low 2.5 % [%]": [100 * share.low for share in verified.shares],
        "high 97.5 % [%]": [100 * share.high for share in verified.shares],
    }
    return rounded(of_positions("limits", columns))


_CERTIFICATES: tuple[Column[tuple[str, AngularAllocation]], ...] = (
    Column("allocation", lambda row: row[0]),
    Column(PRECISION, lambda row: row[1].gains.state_weight),
    Column("tolerances [{cost}]", lambda row: row[1].cost),
    Column("effort [{cost}]", lambda row: row[1].effort_cost),
    Column("total [{cost}]", lambda row: row[1].total),
    Column("lower bound, own gains [{cost}]", lambda row: row[1].bound),
    Column("above the bound [%]", lambda row: 100 * row[1].gap),
)


def certificate_table(plan: AssemblyPlan, tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs and lower bounds of the allocations."""
    return rounded(Table(name="certificates", columns=_CERTIFICATES, rows=list(allocations(plan, tolerances).items())))


def state_weight_table(tolerances: AngularTolerances) -> pd.DataFrame:
    """Return costs over the precision."""
    found = tolerances.by_state_weight
    columns = {
        PRECISION: found.state_weights,
        "tolerances [{cost}]": found.cost,
        "effort [{cost}]": found.effort_cost,
        "total [{cost}]": found.total,
    }
    return rounded(of_positions("cost by precision", columns))


def cost_sentences(plan: AssemblyPlan, tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return what the cheapest tolerances cost, with and without adjusting."""
    adjusted, best, found = tolerances.adjusted, tolerances.retuned.best, tolerances.by_state_weight
    without = (
        _say("no_tolerances_unadjusted")
        if isinstance(tolerances.unadjusted, str)
        else _say("cost_unadjusted", total=tolerances.unadjusted.total)
    )
    share, verified = tolerances.verification.share, tolerances.verified.gains.state_weight
    which = {"adjusted": "of_adjusted", "re-tuned": "of_retuned", "best precision": "of_best"}
    priced = _say(
        "cost_best" if found.interior else "cost_best_at_end",
        best=found.best.gains.state_weight,
        total=found.best.total,
        adjusted=adjusted.total,
        precision=plan.state_weight,
    )
    return (
        _say(
            "cost_adjusted",
            total=adjusted.total,
            precision=adjusted.gains.state_weight,
            without=without,
            bound=adjusted.bound,
            gap=max(adjusted.gap, 0.0),
        ),
        _say("cost_retuned", total=best.total, less=1 - best.total / adjusted.total)
        if is_retuned(tolerances)
        else _say("nothing_retuned"),
        *((priced,) if is_priced(plan) else ()),
        _say(
            "verified",
            assemblies=tolerances.verification.assemblies,
            which=_say(which[verified_name(plan, tolerances)], precision=verified),
            share=share.estimate,
            low=number(100 * share.low, ".2f"),
            high=number(100 * share.high, ".2f"),
        ),
    )


def tolerance_warnings(tolerances: AngularTolerances) -> tuple[str, ...]:
    """Return what is not proven of the allocations."""
    return (
        *((_say("warn_unadjusted", why=tolerances.unadjusted),) if isinstance(tolerances.unadjusted, str) else ()),
        *((_say("warn_retuned"),) if is_retuned(tolerances) else ()),
        *(() if tolerances.retuned.settled else (_say("warn_not_settled"),)),
    )


def tolerance_section(plan: AssemblyPlan, tolerances: AngularTolerances) -> Section:
    """Return the section on angular tolerances."""
    tuned = _say("section_retuned" if is_retuned(tolerances) else "section_nothing_retuned")
    best = f" {_say('section_best')}" if is_priced(plan) else ""
    return Section(
        heading=_say("tolerances_heading"),
        paragraphs=(
            _say("section_tolerances", tuned=f"{tuned}{best}"),
            _say("section_verified", which=verified_name(plan, tolerances)),
        ),
        figures=(_cost_figure(plan, tolerances),),
        tables=(
            ("angular tolerances", tolerance_table(plan, tolerances)),
            ("limits", limit_table(plan, tolerances)),
            ("certificates", certificate_table(plan, tolerances)),
            ("cost by precision", state_weight_table(tolerances)),
        ),
    )


def _cost_figure(plan: AssemblyPlan, tolerances: AngularTolerances) -> Figure:
    """Return what tolerances and effort cost over the precision."""
    found = tolerances.by_state_weight
    known, costs = np.isfinite(found.total), {"tolerances": found.cost}
    if is_priced(plan):
        costs |= {"effort": found.effort_cost, "both": found.total}
    series = [Series.line(label, found.state_weights[known], values[known]) for label, values in costs.items()]
    if is_priced(plan):
        series.append(Series.points("least of both", [found.best.gains.state_weight], [found.best.total]))
    return Figure(
        name="cost",
        title=_say("cost_figure"),
        x_label=PRECISION,
        y_label="cost [cost units]",
        series=tuple(series),
        logarithmic_x=True,
    )

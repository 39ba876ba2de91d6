"""The tables of an allocation, as frames with a unit in every header."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolalloc.allocation.search.candidates import ALONE, GRADES
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.problem import OneSidedConstraint, Solution
from tolalloc.allocation.space.requirement import AtYield, Check
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.reading.units import unit_of
from tolalloc.reports.wording import short

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer

_ROUNDING = 1e-6
"""Smallest share of the cost that a solver tells from nothing, however small its gap [-]."""


def solver_noise(solution: Solution) -> float:
    """Return the cost below which a price tells nothing of a solution [cost units]."""
    return max(solution.gap, _ROUNDING) * solution.cost


def designs(answer: AllocationAnswer) -> dict[str, VerifiedDesign]:
    """Return the designs that the report compares."""
    return answer.candidates.designs(answer.free_label)


def searches(answer: AllocationAnswer) -> dict[str, ZoneAllocation]:
    """Return the searches by what they were free to choose."""
    free = {answer.free_label: answer.free}
    return {ALONE: answer.fixed, **free} if answer.fixed else free


def limit_price(side: OneSidedConstraint, price: float) -> tuple[float, str]:
    """Return the price of a limit [cost units] and what it is per: its unit, or a tenth where the limit is below 1."""
    unit = unit_of(side.stack.name)
    return (price / 10, f"0.1 {unit}") if abs(side.limit) < 1 else (price, unit)


def unit_quantile(design: VerifiedDesign, check: Check) -> float:
    """Return the limit that just the target share of a design's units keeps [unit of the output].

    Parameters
    ----------
    design
        The verified design.
    check
        How it stands against a requirement.

    Returns
    -------
    float
        Not a number unless the requirement is a yield with one limit; two share the units beyond.
    """
    guarantee = check.requirement.guarantee
    if not isinstance(guarantee, AtYield) or len(check.constraints) > 1:
        return float("nan")
    side, confirming = check.constraints[0], design.independent
    if confirming and not confirming.units.near.all():
        excess = side.sign * (check.requirement.read(confirming.outputs) - side.limit)
        beyond = confirming.units.kept_excess(np.where(np.isfinite(excess), excess, np.inf), guarantee.target, 0.5)
        return float(side.limit + side.sign * beyond)
    sign, values = side.sign, check.requirement.read(design.outputs)
    turned = np.sort(np.where(np.isnan(values), np.inf, sign * values))
    return float(sign * turned[int(np.ceil(guarantee.target * turned.size)) - 1])


def designs_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return cost, yield and settings of the compared designs."""
    rows, drawn = [], answer.model.drawn_amounts
    for label, design in designs(answer).items():
        kept = short(answer.leading)
        rows.append(
            {
                "design": label,
                "cost [cost units]": design.cost,
                f"yield, {kept} [%]": design.achieved.estimate * 100,
                "low 95 % [%]": design.achieved.low * 100,
                "high 95 % [%]": design.achieved.high * 100,
                "yield, all limits [%]": design.joint.estimate * 100,
                **dict(zip(answer.space.shared.names, design.settings.tolist(), strict=True)),
                **dict(zip(drawn.names, (drawn.by_setting @ design.settings).tolist(), strict=True)),
                **_loss(answer, design),
                "units [-]": design.achieved.units,
                "OK": "yes" if design.met else "no",
            }
        )
    return pd.DataFrame(rows)


def _loss(answer: AllocationAnswer, design: VerifiedDesign) -> dict[str, float]:
    """Return the mean quality loss of a design, if the study states what a peak-to-peak costs its user."""
    if answer.loss is None:
        return {}
    values = design.sample.values
    lost = answer.loss.smaller_is_better(float(values.mean()), float(values.std(ddof=1)))
    return {"mean quality loss [cost units]": lost}


def requirements_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return every limited side with what each design was shown to keep, and what the limit costs."""
    prices, compared, noise = answer.free.prices, designs(answer), solver_noise(answer.free.optimum)
    rows = []
    for number, side in enumerate(answer.chosen.constraints):
        check = next(check for check in answer.chosen.checks if side in check.constraints)
        unit = unit_of(check.requirement.output)
        price = prices[side.stack.name]
        price, per = limit_price(side, price if price * side.scale > noise else 0.0)
        row: dict[str, object] = {
            "requirement": check.requirement.output,
            "limit": f"{'at most' if side.sign > 0 else 'at least'} {side.limit:g} {unit}",
            "shown for": check.requirement.guarantee.words,
            "quantile of the units [unit of the output]": unit_quantile(answer.chosen, check),
        }
        row |= {
            f"kept: {label} [unit of the output]": design.constraints[number].value
            for label, design in compared.items()
        }
        rows.append(
            {
                **row,
                "slack [unit of the output]": -side.excess,
                "standard error of it [unit of the output]": side.standard_error,
                "marginal price of the limit [cost units]": price,
                "for each": per,
                "OK": "yes" if side.excess <= 0 else "no",
            }
        )
    return pd.DataFrame(rows)


def verified_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return all designs that fresh units have judged, in order."""
    tried = {label: search.tried for label, search in searches(answer).items()}
    if answer.graded:
        tried[GRADES] = answer.graded.tried
    return pd.DataFrame(
        [
            {
                "search": search,
                "design": design.name,
                "cost [cost units]": design.cost,
                f"{short(answer.leading)} kept [{unit_of(answer.leading)}]": design.quantile_bound,
                "yield [%]": design.achieved.estimate * 100,
                "nearest limit": design.blocking.requirement.output,
                "met": "yes" if design.met else "no",
            }
            for search, designs in tried.items()
            for design in designs
        ]
    )


def work_table(answer: AllocationAnswer) -> pd.DataFrame:
    """Return what each stage took."""
    return pd.DataFrame(
        [
            {"stage": name, "units [-]": own["units"], "seconds [s]": own["seconds"]}
            for name, own in answer.header.stages.items()
        ]
    )

"""The tables of an allocation, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.guarantee import AtCpk, AtYield, Guarantee
from tolalloc.allocation.local_model import Side
from tolalloc.allocation.program.problem import Solution
from tolalloc.allocation.requirement import Check
from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.units import MICROMETRE

_ROUNDING = 1e-6
"""Smallest share of the cost that a solver tells from nothing, however small its gap [-]."""


def solver_noise(solution: Solution) -> float:
    """Return the cost below which a price tells nothing of a solution [cost units]."""
    return max(solution.gap, _ROUNDING) * solution.cost


def unit_of(name: str) -> str:
    """Return the unit in the name of an output."""
    return name.split("[")[-1].split("]")[0]


def designs(results: AllocationResults) -> dict[str, VerifiedDesign]:
    """Return the designs that the report compares."""
    found = {
        "tolerance table as it is": results.joint.baseline,
        "all zones scaled alike": results.joint.by_hand,
        "tolerances alone": results.alone.chosen,
        "tolerances and modification": results.joint.chosen,
    }
    return {**found, "grades": results.graded.chosen} if results.graded else found


def guarantee_text(guarantee: Guarantee) -> str:
    """Return what must be shown of a limit, in words."""
    if isinstance(guarantee, AtYield):
        return f"{guarantee.target:.2%} of units"
    if isinstance(guarantee, AtCpk):
        return f"Cpk {guarantee.target:g}"
    return "worst case found"


def limit_price(side: Side, price: float) -> tuple[float, str]:
    """Return the price of a limit [cost units] and what it is per: its unit, or a tenth where the limit is below 1."""
    unit = unit_of(side.stack.name)
    return (price / 10, f"0.1 {unit}") if abs(side.limit) < 1 else (price, unit)


def unit_quantile(design: VerifiedDesign, check: Check) -> float:
    """Return the limit that exactly the target share of a design's units keeps [unit of the output].

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
    if not isinstance(guarantee, AtYield) or len(check.sides) > 1:
        return float("nan")
    sign, values = check.sides[0].sign, design.outputs[check.requirement.output]
    turned = np.sort(np.where(np.isnan(values), np.inf, sign * values))
    return float(sign * turned[int(np.ceil(guarantee.target * turned.size)) - 1])


def designs_table(results: AllocationResults) -> pd.DataFrame:
    """Return cost, yield and clearances of the compared designs."""
    rows = []
    for label, design in designs(results).items():
        space = results.drawn if design is results.chosen else results.space
        amounts = space.modification(design.design)
        rows.append(
            {
                "design": label,
                "cost [cost units]": design.cost,
                "yield, peak-to-peak [%]": design.achieved.estimate * 100,
                "low 95 % [%]": design.achieved.low * 100,
                "high 95 % [%]": design.achieved.high * 100,
                "yield, all limits [%]": design.joint.estimate * 100,
                "flank clearance [µm]": float(design.design[-2]),
                "radial clearance [µm]": float(design.design[-1]),
                "equidistant Δr_rp [µm]": amounts.equidistant / MICROMETRE,
                "shift Δr_p [µm]": amounts.shift / MICROMETRE,
                **_loss(results, design),
                "units [-]": design.achieved.units,
                "OK": "yes" if design.met else "no",
            }
        )
    return pd.DataFrame(rows)


def _loss(results: AllocationResults, design: VerifiedDesign) -> dict[str, float]:
    """Return the mean quality loss of a design, if the study states what a peak-to-peak costs its user."""
    if results.loss is None:
        return {}
    values = design.sample.values
    lost = results.loss.smaller_is_better(float(values.mean()), float(values.std(ddof=1)))
    return {"mean quality loss [cost units]": lost}


def requirements_table(results: AllocationResults) -> pd.DataFrame:
    """Return every limited side with what each design was shown to keep, and what the limit costs."""
    prices, compared, noise = results.joint.prices, designs(results), solver_noise(results.joint.optimum)
    rows = []
    for number, side in enumerate(results.chosen.sides):
        check = next(check for check in results.chosen.checks if side in check.sides)
        unit = unit_of(check.requirement.output)
        price = prices[side.stack.name]
        price, per = limit_price(side, price if price * side.scale > noise else 0.0)
        row: dict[str, object] = {
            "requirement": check.requirement.output,
            "limit": f"{'at most' if side.sign > 0 else 'at least'} {side.limit:g} {unit}",
            "shown for": guarantee_text(check.requirement.guarantee),
            "quantile of the units [unit of the output]": unit_quantile(results.chosen, check),
        }
        row |= {f"kept: {label} [unit of the output]": design.sides[number].value for label, design in compared.items()}
        rows.append(
            {
                **row,
                "slack [unit of the output]": -side.excess,
                "standard error of it [unit of the output]": side.doubt,
                "marginal price of the limit [cost units]": price,
                "for each": per,
                "OK": "yes" if side.excess <= 0 else "no",
            }
        )
    return pd.DataFrame(rows)


def verified_table(results: AllocationResults) -> pd.DataFrame:
    """Return all designs that fresh units have judged, in order."""
    tried = {
        "tolerances alone": results.alone.tried,
        "tolerances and modification": results.joint.tried,
        "grades": results.graded.tried if results.graded else (),
    }
    return pd.DataFrame(
        [
            {
                "search": search,
                "design": design.name,
                "cost [cost units]": design.cost,
                "peak-to-peak kept [arcsec]": design.quantile_bound,
                "yield [%]": design.achieved.estimate * 100,
                "nearest limit": design.blocking.requirement.output,
                "met": "yes" if design.met else "no",
            }
            for search, designs in tried.items()
            for design in designs
        ]
    )


def work_table(results: AllocationResults) -> pd.DataFrame:
    """Return what each stage took."""
    return pd.DataFrame(
        [
            {"stage": name, "units [-]": own["units"], "seconds [s]": own["seconds"]}
            for name, own in results.stages.items()
        ]
    )

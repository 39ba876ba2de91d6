"""The tables of an allocation, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.guarantee import AtCpk, AtYield, Guarantee
from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.report.allocation.results import AllocationResults
from tolalloc.units import MICROMETRE

_ROUNDING = 1e-6
"""Price of a micrometre, over the cost, below which it is the solver's rounding [1/µm]."""


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
    """Return every limited side with what each design was shown to keep, and what one unit of the limit costs."""
    prices, compared = results.joint.prices, designs(results)
    rows = []
    for number, side in enumerate(results.chosen.sides):
        check = next(check for check in results.chosen.checks if side in check.sides)
        unit = unit_of(check.requirement.output)
        row: dict[str, object] = {
            "requirement": check.requirement.output,
            "limit": f"{'at most' if side.sign > 0 else 'at least'} {side.limit:g} {unit}",
            "shown for": guarantee_text(check.requirement.guarantee),
        }
        row |= {f"kept: {label} [unit of the output]": design.sides[number].value for label, design in compared.items()}
        rows.append(
            {
                **row,
                "slack [unit of the output]": -side.excess,
                "standard error of it [unit of the output]": side.doubt,
                "one unit of the limit costs [cost units]": prices[side.stack.name],
                "OK": "yes" if side.excess <= 0 else "no",
            }
        )
    return pd.DataFrame(rows)


def certificate_table(results: AllocationResults) -> pd.DataFrame:
    """Return cost, certified bound and gap of every search."""
    searches = {"tolerances alone": results.alone, "tolerances and modification": results.joint}
    rows = [
        {
            "search": label,
            "verified cost [cost units]": found.chosen.cost,
            "cheapest of the local models [cost units]": found.optimum.cost + found.locked_cost,
            "certified bound [cost units]": found.bound,
            "gap of the program [-]": found.optimum.gap,
            "gap of the verified design [%]": found.gap * 100,
            "designs verified [-]": len(found.tried),
        }
        for label, found in searches.items()
    ]
    graded = results.graded
    if graded:
        locked = graded.space.locked_cost
        rows.append(
            {
                "search": "grades",
                "verified cost [cost units]": graded.chosen.cost,
                "cheapest of the local models [cost units]": graded.solution.cost + locked,
                "certified bound [cost units]": graded.bound,
                "gap of the program [-]": graded.solution.gap,
                "gap of the verified design [%]": (graded.chosen.cost / graded.bound - 1) * 100,
                "designs verified [-]": len(graded.tried),
            }
        )
    return pd.DataFrame(rows)


def bounds_table(results: AllocationResults) -> pd.DataFrame:
    """Return what the smallest and the largest zones of the tolerance table cost."""
    space, found = results.space, results.joint
    zones, scales = space.first_zones / MICROMETRE, found.optimum.zones
    made = [feature.processes[at] for feature, at in zip(space.features, found.optimum.processes, strict=True)]
    prices = found.optimum.bound_prices / zones[:, np.newaxis]
    prices = np.where(prices > _ROUNDING * found.optimum.cost, prices, 0.0)
    return pd.DataFrame(
        {
            "group": space.groups,
            "process": [process.name for process in made],
            "smallest zone [µm]": [process.minimum for process in made] * zones,
            "zone [µm]": scales * zones,
            "largest zone [µm]": [process.maximum for process in made] * zones,
            "1 µm less of the smallest saves [cost units]": prices[:, 0],
            "1 µm more of the largest saves [cost units]": prices[:, 1],
        }
    )


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


def trade_table(results: AllocationResults) -> pd.DataFrame:
    """Return cost and price of a micrometre for every pair of clearances."""
    trade = results.trade
    flank, radial = np.meshgrid(trade.flank, trade.radial, indexing="ij")
    return pd.DataFrame(
        {
            "flank clearance [µm]": flank.ravel(),
            "radial clearance [µm]": radial.ravel(),
            "cost [cost units]": trade.cost.ravel(),
            "1 µm more on the flank costs [cost units]": trade.price_of_flank.ravel(),
            "1 µm more at tip and root costs [cost units]": trade.price_of_radial.ravel(),
        }
    )


def robustness_table(results: AllocationResults) -> pd.DataFrame:
    """Return how far every zone moves when an assumption is wrong."""
    found, zones = results.robustness, results.space.first_zones / MICROMETRE
    ratios, best = found.ratios, found.optimum * zones
    return pd.DataFrame(
        {
            "group": found.groups,
            "zone [µm]": best,
            "smallest under all changes [µm]": best * ratios.min(axis=0),
            "largest under all changes [µm]": best * ratios.max(axis=0),
            "same in all": ["yes" if same else "no" for same in found.same],
        }
    )


def variants_table(results: AllocationResults) -> pd.DataFrame:
    """Return the answers under changed assumptions, worst regret first among the costs."""
    rows = [
        {
            "assumption": variant.name,
            "cheapest then [cost units]": variant.cost + results.space.locked_cost,
            "chosen design costs more by [%]": variant.regret * 100,
            "chosen design keeps all": "yes" if variant.kept else "no",
        }
        for variant in results.robustness.variants
    ]
    return pd.DataFrame(rows)


def prices_table(results: AllocationResults) -> pd.DataFrame:
    """Return the price of a good unit over yield targets."""
    found = results.prices
    if found is None:
        return pd.DataFrame()
    return pd.DataFrame(
        {
            "yield target [%]": found.targets * 100,
            "cheapest unit made to it [cost units]": found.manufacturing,
            "price of a good unit [cost units]": found.prices,
        }
    )


def searched_table(results: AllocationResults) -> pd.DataFrame:
    """Return the front of the search with what the kernel says of it, its knee marked."""
    front = results.fronts.searched
    return pd.DataFrame(
        {
            "peak-to-peak kept, told [arcsec]": front.quantile,
            "on the kernel [arcsec]": front.on_kernel,
            "cost [cost units]": front.cost,
            "flank clearance [µm]": front.designs[:, -2],
            "radial clearance [µm]": front.designs[:, -1],
            "knee": ["yes" if at == front.knee else "" for at in range(front.cost.size)],
        }
    )


def clearance_front_table(results: AllocationResults) -> pd.DataFrame:
    """Return the front of cost, peak-to-peak and radial clearance, its knee marked."""
    front = results.fronts.with_clearance
    return pd.DataFrame(
        {
            "cost [cost units]": front.cost,
            "peak-to-peak kept, told [arcsec]": front.quantile,
            "on the kernel [arcsec]": front.on_kernel,
            "radial clearance [µm]": front.further[:, 0],
            "knee": ["yes" if at == front.knee else "" for at in range(front.cost.size)],
        }
    )


def front_table(results: AllocationResults) -> pd.DataFrame:
    """Return the exact front of the local models with its certified bound."""
    front = results.fronts.exact
    return pd.DataFrame(
        {
            "peak-to-peak limit [arcsec]": front.limits,
            "cost [cost units]": front.cost,
            "certified bound [cost units]": front.bound,
        }
    )


def work_table(results: AllocationResults) -> pd.DataFrame:
    """Return what each stage took."""
    return pd.DataFrame(
        [
            {"stage": name, "units [-]": own["units"], "seconds [s]": own["seconds"]}
            for name, own in results.stages.items()
        ]
    )

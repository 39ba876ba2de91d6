"""The tables of an allocation beside its drawing: limits, designs, how far from optimal, what would be otherwise."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.allocation.cost.unit_price import YieldLadder
from tolalloc.allocation.front.cost_front import CostFront
from tolalloc.allocation.front.uncertain_region import UncertainRegion
from tolalloc.allocation.front.what_if import Robustness, SettingTrade
from tolalloc.allocation.result import AllocationResult, limit_price, solver_noise, unit_quantile
from tolalloc.allocation.search.candidates import GRADES
from tolalloc.allocation.search.discrete import GradedAllocation
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.problem import OneSidedConstraint
from tolalloc.allocation.space.requirement import AtYield, Check
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.drawings.sources import length_unit
from tolalloc.reading.units import unit_of
from tolalloc.reports.columns import Column, Table
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.allocation_sentences import designs, searches
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity, short

_Limited = tuple[int, OneSidedConstraint, Check]
"""The place of a limited side among all of them, the side, and the requirement that limits it."""
_Named = tuple[str, VerifiedDesign]
"""What a design is called, and the design."""

_say = Sentences("allocation")


def requirements_table(result: AllocationResult) -> Table[_Limited]:
    """Return every limited side with what each design was shown to keep, and what the limit costs."""

    def price(row: _Limited) -> tuple[float, str]:
        return limit_price(row[1], row[2].requirement.limits, result.price_of(row[2], row[1]))

    def kept(label: str, design: VerifiedDesign) -> Column[_Limited]:
        header = f"kept: {label} [{unit}]"
        return Column(header, lambda row: design.limited_sides[row[0]][1].value)

    units = {unit_of(own.output) for own in result.requirements}
    unit = units.pop() if len(units) == 1 else "unit of the limit"
    columns: list[Column[_Limited]] = [
        Column("requirement", lambda row: row[2].requirement.output),
        Column("limit", _limit),
        Column("stated by", lambda row: row[2].requirement.stated_by),
        Column("shown for", lambda row: row[2].requirement.guarantee.words),
        Column(f"quantile of the units [{unit}]", lambda row: unit_quantile(result.chosen, row[2], row[1])),
        Column("units within [%]", lambda row: 100 * result.chosen.yield_of(row[2].requirement, row[1].sign).estimate),
        *(kept(label, design) for label, design in designs(result).items()),
        Column(f"slack [{unit}]", lambda row: -row[1].excess),
        Column(f"standard error of it [{unit}]", lambda row: row[1].standard_error),
        Column("marginal price of the limit [{cost}]", lambda row: price(row)[0]),
        Column("for each", lambda row: price(row)[1]),
        Column("OK", lambda row: "yes" if row[1].excess <= 0 else "no"),
    ]
    rows = [(number, side, check) for number, (check, side) in enumerate(result.chosen.limited_sides)]
    return Table(name="requirements", columns=columns, rows=rows)


def _limit(row: _Limited) -> str:
    """Return a limit in words."""
    _, side, check = row
    asked = check.requirement
    said = f"{'at most' if side.sign > 0 else 'at least'} {asked.told(side.limit)} {unit_of(asked.output)}"
    return said.removesuffix(" -")


def _moved_limit(before: OneSidedConstraint, drawn: OneSidedConstraint) -> str:
    """Return a limit as a table shows it: both, where it moves with the settings."""
    sign, limits = "≤" if drawn.sign > 0 else "≥", [f"{own.limit:.4g}" for own in (before, drawn)]
    return f"{sign} {' → '.join(dict.fromkeys(limits))}"


def today_frame(result: AllocationResult, cost_unit: str) -> pd.DataFrame:
    """Return cost, limits and amounts of the drawing as it is beside the drawing as drawn, and which limits bind.

    Beside a limit stands what was shown to be kept, which is compared with it, as in the workbook of the drawing.
    """
    before, after, portrait = result.free.baseline, result.chosen, portrait_of(result.model)
    rows: list[dict[str, object]] = [
        {"drawing": f"cost [{cost_unit}]", "as it is": before.cost, "as drawn": after.cost},
    ]
    sides = zip(before.limited_sides, after.limited_sides, strict=True)
    for (check, side), (own, drawn) in sides:
        asked = own.requirement
        if isinstance(asked, JointRequirement):
            continue
        rows.append(
            {
                "drawing": f"{portrait.display_name(asked.output)} [{unit_of(asked.output)}]",
                "shown for": "" if after.jointly else asked.guarantee.words,
                "limit": _moved_limit(side, drawn),
                "as it is": side.value,
                "as drawn": drawn.value,
                "yield [%]": 100 * before.yield_of(check.requirement, side.sign).estimate,
                "yield as drawn [%]": 100 * after.yield_of(asked, drawn.sign).estimate,
                "binds": "yes" if result.price_of(own, drawn) else "",
            }
        )
    if len(after.alone) > 1:
        together = after.jointly or len(after.checks) == 1
        asked_of_all = after.checks[-1].requirement.guarantee if together else None
        rows.append(
            {
                "drawing": "all limits at once",
                "limit": f"≥ {100 * asked_of_all.target:.4g} %" if isinstance(asked_of_all, AtYield) else "",
                "yield [%]": 100 * before.joint.estimate,
                "yield as drawn [%]": 100 * after.joint.estimate,
            }
        )
    said = {*result.model.drawn_amounts.names} - {*result.space.shared.names}  # with the zones, in a sentence
    beside = [own for own in result.amounts if own.name not in said]
    rows += [{"drawing": own.name, "as it is": own.before, "as drawn": own.value} for own in beside]
    words = ("shown for", "limit", "binds")
    frame = pd.DataFrame([{**dict.fromkeys(words, ""), **row} for row in rows])
    numbers = ("as it is", "as drawn", "yield [%]", "yield as drawn [%]")
    blank = [name for name in words if not frame[name].any()]
    return frame[["drawing", *words[:2], *numbers, words[2]]].drop(columns=blank)


def designs_table(result: AllocationResult) -> Table[_Named]:
    """Return cost, yield and settings of the compared designs."""
    drawn, loss = result.model.drawn_amounts, result.loss

    def lost(row: _Named) -> float:
        values = row[1].sample.values
        return loss.smaller_is_better(float(values.mean()), float(values.std(ddof=1))) if loss else float("nan")

    def setting(at: int, name: str) -> Column[_Named]:
        return Column(name, lambda row: row[1].settings.tolist()[at])

    def amount(at: int, name: str) -> Column[_Named]:
        return Column(name, lambda row: (drawn.by_setting @ row[1].settings).tolist()[at])

    columns: list[Column[_Named]] = [
        Column("design", lambda row: row[0]),
        Column("cost [{cost}]", lambda row: row[1].cost),
        Column(f"yield, {short(result.leading)} [%]", lambda row: row[1].achieved.estimate * 100),
        Column("low 95 % [%]", lambda row: row[1].achieved.low * 100),
        Column("high 95 % [%]", lambda row: row[1].achieved.high * 100),
        Column("yield, all limits [%]", lambda row: row[1].joint.estimate * 100),
        *(setting(at, name) for at, name in enumerate(result.space.shared.names)),
        *(amount(at, name) for at, name in enumerate(drawn.names)),
        *((Column("mean quality loss [{cost}]", lost),) if loss else ()),
        Column("units [-]", lambda row: row[1].achieved.units),
        Column("OK", lambda row: "yes" if row[1].met else "no"),
    ]
    return Table(name="designs", columns=columns, rows=list(designs(result).items()))


def tried_table(result: AllocationResult) -> Table[_Named]:
    """Return all designs that were tried, in order, each with the search that found it and the units that judged it."""
    tried = {label: search.tried for label, search in searches(result).items()}
    if result.graded:
        tried[GRADES] = result.graded.tried
    kept = f"{short(result.leading)} kept [{unit_of(result.leading)}]"
    columns: list[Column[_Named]] = [
        Column("search", lambda row: row[0]),
        Column("design", lambda row: row[1].name.replace("by hand", "scaled")),
        Column("cost [{cost}]", lambda row: row[1].cost),
        Column(kept, lambda row: row[1].quantile_bound),
        Column("yield [%]", lambda row: row[1].achieved.estimate * 100),
        Column("nearest limit", lambda row: row[1].blocking.requirement.output),
        Column("judged on", lambda row: "independent sample" if row[1].independent else "units of its search"),
        Column("met", lambda row: "yes" if row[1].met else "no"),
    ]
    rows = [(search, design) for search, designs in tried.items() for design in designs]
    return Table(name="tried designs", columns=columns, rows=rows)


def certificate_frame(result: AllocationResult, cost_unit: str) -> pd.DataFrame:
    """Return cost, lower bound and the cheapest design of the local model of every search."""
    found = list[tuple[str, ZoneAllocation | GradedAllocation, str, float, float, float]]()
    for label, own in searches(result).items():
        holds = "every drawing" if own.lower_bound.certified else "drawings near by"
        at_limits, inside = own.optimum.cost + own.locked_cost, own.inside.cost + own.locked_cost
        found.append((label, own, holds, at_limits, inside, own.optimum.gap))
    if graded := result.graded:
        at_limits = graded.solution.cost + graded.space.locked_cost
        found.append((GRADES, graded, "choices near by", at_limits, np.nan, graded.solution.gap))
    return pd.DataFrame(
        {
            "search": label,
            f"verified cost [{cost_unit}]": search.chosen.cost,
            f"lower bound, 95 % [{cost_unit}]": search.bound,
            "verified cost above the lower bound [%]": (search.chosen.cost / search.bound - 1) * 100,
            "lower bound holds for": holds,
            f"cheapest by the local model, at the limits [{cost_unit}]": at_limits,
            f"cheapest by the local model, inside [{cost_unit}]": inside,
            "gap of the convex program [-]": gap,
            "designs verified [-]": len(search.tried),
        }
        for label, search, holds, at_limits, inside, gap in found
    )


def bounds_frame(result: AllocationResult, cost_unit: str) -> pd.DataFrame:
    """Return what the smallest and the largest zones, of process and tolerance table together, cost free zones."""
    space, found = result.space, result.free
    unit, length = length_unit(space.errors.sources)
    zones, scales = space.first_zones / length, found.optimum.zones
    made = [feature.processes[at] for feature, at in zip(space.features, found.optimum.processes, strict=True)]
    saved = found.optimum.bound_prices * scales[:, np.newaxis]  # had the bound moved by its own size
    noise = solver_noise(found.optimum)
    prices = np.where(saved > noise, found.optimum.bound_prices, 0.0) / zones[:, np.newaxis]
    return pd.DataFrame(
        {
            "group": space.groups,
            "process": [process.name for process in made],
            f"smallest of process and table [{unit}]": [process.minimum for process in made] * zones,
            f"cheapest zone of the models [{unit}]": scales * zones,
            f"largest of process and table [{unit}]": [process.maximum for process in made] * zones,
            f"marginal price of the smallest [{cost_unit}/{unit}]": prices[:, 0],
            f"marginal price of the largest [{cost_unit}/{unit}]": prices[:, 1],
        }
    )


def front_frame(result: AllocationResult, front: CostFront, cost_unit: str) -> pd.DataFrame:
    """Return what limits of the leading output cost, with the settings of each drawing."""
    unit, points, here = unit_of(result.leading), front.points, front.drawn
    settings = zip(result.space.shared.names, np.array([own.design.settings for own in points]).T, strict=True)
    return pd.DataFrame(
        {
            f"{short(result.leading)} limit [{unit}]": [own.limit for own in points],
            f"kept by its units [{unit}]": [own.design.quantile_bound for own in points],
            f"cost [{cost_unit}]": [own.design.cost for own in points],
            **dict(settings),
            "drawing": [_say("front_here") if here and own.limit == here.limit else "" for own in points],
        }
    )


def trade_frame(trade: SettingTrade, cost_unit: str) -> pd.DataFrame:
    """Return cost and price of one more unit of each setting, for every choice of settings."""
    values = np.meshgrid(*trade.values, indexing="ij")
    frame = pd.DataFrame({name: own.ravel() for name, own in zip(trade.names, values, strict=True)})
    frame[f"cost [{cost_unit}]"] = trade.cost.ravel()
    for at, name in enumerate(trade.names):
        header = f"1 {unit_of(name)} more {quantity(name)} costs at the rate of [{cost_unit}/{unit_of(name)}]"
        frame[header] = trade.price(at).ravel()
    return frame


def robustness_frame(result: AllocationResult, found: Robustness) -> pd.DataFrame:
    """Return how far every free zone moves when an assumption is wrong."""
    unit, length = length_unit(result.space.errors.sources)
    ratios, best = found.ratios, found.optimum * (result.space.first_zones / length)
    frame = pd.DataFrame(
        {
            "group": found.groups,
            f"free zone [{unit}]": best,
            f"smallest under all changes [{unit}]": best * np.minimum(1.0, np.nanmin(ratios, axis=0)),
            f"largest under all changes [{unit}]": best * np.maximum(1.0, np.nanmax(ratios, axis=0)),
            "same from cost times [-]": [own.low for own in found.prices],
            "same to cost times [-]": [own.high for own in found.prices],
            "same in all": ["yes" if same else "no" for same in found.same],
        }
    )
    if found.graded:
        frame["graded same from cost times [-]"] = [own.low for own in found.graded]
        frame["graded same to cost times [-]"] = [own.high for own in found.graded]
    return frame


def variants_frame(found: Robustness, cost_unit: str) -> pd.DataFrame:
    """Return the answers under changed assumptions."""
    rows = [(own.name, own.cost, own.regret * 100, "yes" if own.kept else "no") for own in found.variants]
    more = "free zones cost more by [%]", "free zones keep all"
    return pd.DataFrame(rows, columns=["assumption", f"cheapest then [{cost_unit}]", *more])


def region_frame(found: UncertainRegion, met: bool) -> pd.DataFrame:
    """Return within which factors of what is uncertain, each alone, free zones stay the same and keep all limits.

    Of zones that miss a limit as it is nothing is said of limits.
    """
    rows = []
    for own in found.ranges:
        tried, same, kept = (np.exp(ends) for ends in (own.tried, own.same, own.kept))
        rows.append(
            {
                "uncertain": own.column,
                "tried from times [-]": tried[0],
                "tried to times [-]": tried[1],
                "zones same from times [-]": same[0],
                "zones same to times [-]": same[1],
                "first zone to change below": own.first[0] or "none",
                "first zone to change above": own.first[1] or "none",
                **({"limits kept from times [-]": kept[0], "limits kept to times [-]": kept[1]} if met else {}),
            }
        )
    return pd.DataFrame(rows)


def prices_frame(found: YieldLadder, cost_unit: str) -> pd.DataFrame:
    """Return the price of a good unit over yield targets."""
    return pd.DataFrame(
        {
            "yield target [%]": found.targets * 100,
            f"cheapest unit made to it [{cost_unit}]": found.manufacturing,
            f"price of a good unit [{cost_unit}]": found.prices,
        }
    )

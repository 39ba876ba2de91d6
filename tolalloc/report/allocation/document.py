"""The cheapest drawing: answer, warnings, sections and summary of one report."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tolalloc.allocation.robustness import COST_CHANGE, SAME
from tolalloc.cycloid.clearance import linear_model_warnings
from tolalloc.report.allocation import figures, tables
from tolalloc.report.allocation.drawing import drawing_table, full_drawing_table
from tolalloc.report.allocation.results import AllocationResults
from tolalloc.report.document import Document, Section
from tolalloc.units import MICROMETRE

_NOTHING = 1e-3
"""Price of a whole limit, over the cost, below which it costs nothing [-]."""
_SAME = 5e-4
"""Relative difference of costs below which they are printed alike [-]."""


def answer(results: AllocationResults) -> tuple[str, ...]:
    """Return the answer in sentences."""
    chosen, joint, hand = results.chosen, results.joint, results.joint.by_hand
    achieved = chosen.achieved
    found = [
        f"{'Met' if chosen.met else 'NOT met'}: {achieved.estimate:.2%} of {achieved.units} fresh units keep "
        f"{joint.limit:g}″ (95 % interval {achieved.low:.2%}…{achieved.high:.2%}).",
    ]
    if len(results.requirements) > 1:
        found.append(f"{chosen.joint.estimate:.2%} of them keep the limits of all requirements at once.")
    found.append(
        f"Cost {chosen.cost:.2f} cost units, {_against(chosen.cost, hand.cost)} all zones scaled alike "
        f"({hand.cost:.2f}){'' if hand.met else ', which missed a limit'}."
    )
    return (*found, *_certificate(results), *_modification(results), *_price(results), *_settled(results))


def _against(cost: float, other: float) -> str:
    """Return how a cost stands against another one, in words."""
    change = cost / other - 1
    if abs(change) < _SAME:
        return "as much as"
    return f"{abs(change):.1%} {'below' if change < 0 else 'above'}"


def _certificate(results: AllocationResults) -> tuple[str, ...]:
    """Return how far from optimal the answer can be."""
    joint, graded = results.joint, results.graded
    said = [
        f"No design with free zones that the local models let keep the limits as the verified one does costs less than "
        f"{joint.bound:.2f}; the verified one with free zones costs {max(joint.gap, 0.0):.2%} more."
    ]
    if not joint.chosen.met:
        said = []
    if graded:
        said.append(
            f"On grades and preferred numbers the cost is {graded.chosen.cost:.2f}, "
            f"{_against(graded.chosen.cost, joint.chosen.cost)} free zones ({joint.chosen.cost:.2f}); by its local "
            f"models no other choice of grades, processes and rounded amounts near by costs less than "
            f"{graded.bound:.2f}."
        )
    return tuple(said)


def _modification(results: AllocationResults) -> tuple[str, ...]:
    """Return what the modification buys."""
    alone, joint = results.alone.chosen, results.joint.chosen
    saving = 1 - joint.cost / alone.cost
    if not joint.met:
        return ()
    if not alone.met:
        return ("Tolerances alone keep no verified design within the limits; the modification makes the difference.",)
    if saving >= _SAME:
        return (
            f"The modification saves {alone.cost - joint.cost:.2f} cost units ({saving:.1%}) against tolerances alone "
            f"({alone.cost:.2f}).",
        )
    return (f"The modification saves nothing: with it as it is the zones cost {alone.cost:.2f}.",)


def _price(results: AllocationResults) -> tuple[str, ...]:
    """Return what the limits cost."""
    prices = results.joint.prices
    said = []
    for side in results.joint.chosen.sides if results.joint.chosen.met else ():
        price, unit = prices[side.stack.name], tables.unit_of(side.stack.name)
        if price * abs(side.limit) > _NOTHING * results.joint.chosen.cost:
            said.append(f"{side.stack.name}: one {unit} more room would save {price:.3g} cost units.")
    if results.prices and not np.isnan(results.prices.prices).all():
        best = results.prices
        said.append(
            f"The cheapest good unit is made to a yield of {best.best * 100:g}%: {np.nanmin(best.prices):.2f} cost "
            "units."
        )
    return tuple(said)


def _settled(results: AllocationResults) -> tuple[str, ...]:
    """Return which zones do not depend on what was assumed."""
    found = results.robustness
    same = [group for group, settled in zip(found.groups, found.same, strict=True) if settled]
    regrets = [variant.regret for variant in found.costs]
    said = [
        f"{len(same)} of {len(found.groups)} zones {'stays' if len(same) == 1 else 'stay'} within {SAME:.0%} under all "
        f"changed assumptions{': ' + ', '.join(same) if same else ''}.",
    ]
    if regrets:
        dearest = max(*regrets, 0.0)
        said.append(f"Costs off by up to {COST_CHANGE:.0%} each make the drawing at most {dearest:.2%} too dear.")
    return tuple(said)


def warnings(results: AllocationResults) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    chosen, found = results.chosen, []
    if results.quick:
        found.append("Quick run: small samples, wide intervals. Run without --quick before setting a drawing.")
    if not chosen.met:
        check = chosen.blocking
        side = check.tightest
        name, unit = check.requirement.output.split(" [")[0], tables.unit_of(check.requirement.output)
        found.append(
            f"No design was verified to meet all limits. This is the least violating one; what blocks is {name}, limit "
            f"{side.limit:g} {unit}: it keeps {side.value:.4g} {unit} (shown for "
            f"{tables.guarantee_text(check.requirement.guarantee)}), {side.excess:.3g} {unit} beyond."
        )
    if not results.joint.by_hand.met:
        found.append("Uniform scaling was not verified to meet the limits, so the saving is against a miss.")
    lost, drawn = sum(not variant.kept for variant in results.robustness.stiffness), len(results.robustness.stiffness)
    if lost and chosen.met:
        found.append(f"With {lost} of {drawn} drawn stiffnesses the drawing is no longer verified to keep every limit.")
    found += linear_model_warnings(results.reducer.cycloid_stage, results.modification)
    if not results.fronts.surrogate.earns_its_place:
        found.append("The corrected model of the front has not earned its place; its search ran on the kernel, short.")
    lost = results.fronts.searched.failed
    if lost:
        found.append(
            f"{lost} design{'' if lost == 1 else 's'} of the search for the front failed on the kernel; the front is "
            "without them."
        )
    failed = sum(count for outcome, count in results.statuses.items() if outcome != "equilibrium found")
    if failed:
        has, counts = ("unit has", "it counts") if failed == 1 else ("units have", "they count")
        found.append(f"{failed} {has} no equilibrium; {counts} as outside the limits.")
    return tuple(found)


def assumptions(results: AllocationResults) -> tuple[str, ...]:
    """Return what no source states."""
    priced = bool(results.space.processes)
    return (
        *results.reducer.assumptions,
        "zones, distributions, Cp, smallest and largest zones: as the tolerance table states them; its notes say where "
        "each comes from",
        "processes and costs as the process cost table states them; a process changes the cost and the range of a "
        "zone, not its distribution or Cp"
        if priced
        else "a cost falls as 1/zone, from the tolerance table's cost at its zone",
        "tooth modification costs nothing and is exact",
        "sources correlated as their file states; the certified bounds do not know of correlations"
        if results.space.errors.is_correlated
        else "all sources are independent of each other",
        *(
            (f"not in the tolerance table and taken as exact: {', '.join(results.neglected)}",)
            if results.neglected
            else ()
        ),
    )


def summary(results: AllocationResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    chosen, joint, amounts = results.chosen, results.joint, results.modification
    answered = {
        "study": results.name,
        "study hash": results.digest,
        "reducer": results.reducer.name,
        "torque [N·m]": results.torque,
        "limit [arcsec]": joint.limit,
        "yield target [-]": results.target,
        "seed": results.seed,
        "quick": results.quick,
        "met": chosen.met,
        "yield [-]": chosen.achieved.estimate,
        "yield interval 95 % [-]": [chosen.achieved.low, chosen.achieved.high],
        "yield lower bound, one-sided 95 % [-]": chosen.achieved.bound,
        "yield of all limits [-]": chosen.joint.estimate,
        "cost [cost units]": chosen.cost,
        "cost of uniform scaling [cost units]": joint.by_hand.cost,
        "saving [-]": 1 - chosen.cost / joint.by_hand.cost,
        "cost of tolerances alone [cost units]": results.alone.chosen.cost,
        "cost of tolerances and modification [cost units]": joint.chosen.cost,
        "cost on grades [cost units]": results.graded.chosen.cost if results.graded else None,
        "certified bound [cost units]": results.graded.bound if results.graded else joint.bound,
        "gap of the convex program [-]": joint.optimum.gap,
        "blocking requirement": None if chosen.met else chosen.blocking.requirement.output,
        "beyond its limit by [unit of the output]": None if chosen.met else -chosen.blocking.slack,
        "equidistant amount [µm]": amounts.equidistant / MICROMETRE,
        "shift amount [µm]": amounts.shift / MICROMETRE,
        "requirements": _records(tables.requirements_table(results)),
        "drawing": _records(drawing_table(results)),
        "zones that stay the same": [
            group for group, same in zip(results.robustness.groups, results.robustness.same, strict=True) if same
        ],
        "statuses": dict(results.statuses),
        "warnings": list(warnings(results)),
    }
    return {name: _known(value) for name, value in answered.items()}


def _known(value: object) -> object:
    """Return a number, or null where it is none; JSON knows neither NaN nor infinity."""
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table for JSON."""
    return [{str(name): _known(value) for name, value in row.items()} for row in frame.to_dict("records")]


def sections(results: AllocationResults) -> tuple[Section, ...]:
    """Return the sections of the report."""
    price = tables.prices_table(results)
    return (
        Section(
            heading="What to write on the drawing",
            figures=(figures.zones_figure(results),),
            tables=(("drawing", drawing_table(results)),),
            paragraphs=(
                "allocation.csv beside this report has the layout of the tolerance table and is read back by tolalloc; "
                "drawing.xlsx goes on calculating: change a zone there and see cost and limits.",
            ),
        ),
        Section(
            heading="Requirements",
            figures=(figures.units_figure(results),),
            tables=(
                ("requirements", tables.requirements_table(results)),
                ("designs", tables.designs_table(results)),
            ),
        ),
        Section(
            heading="How far from optimal",
            paragraphs=(
                "The bound is a Lagrange dual that takes no solver's word. It holds for the convex models around the "
                "verified design, not for designs far from it; the front below was searched with other means.",
            ),
            figures=(figures.front_figure(results),),
            tables=(
                ("certificate", tables.certificate_table(results)),
                ("front", tables.front_table(results)),
                ("searched front", tables.searched_table(results)),
                ("front with clearance", tables.clearance_front_table(results)),
                ("bounds of zones", tables.bounds_table(results)),
            ),
        ),
        Section(
            heading="Modification against tolerances",
            figures=(figures.trade_figure(results), figures.trade_map(results)),
            tables=(("modification", tables.trade_table(results)),),
        ),
        *((Section(heading="What a good unit costs", tables=(("unit price", price),)),) if len(price) else ()),
        Section(
            heading="When an assumption is wrong",
            figures=(figures.robustness_figure(results),),
            tables=(
                ("robustness", tables.robustness_table(results)),
                ("variants", tables.variants_table(results)),
            ),
        ),
        Section(
            heading="Work done",
            paragraphs=(
                ", ".join(
                    f"{count} unit{'' if count == 1 else 's'}: {outcome}"
                    for outcome, count in results.statuses.items()
                    if count
                )
                + ".",
            ),
            tables=(
                ("verified designs", tables.verified_table(results)),
                ("tolerances", full_drawing_table(results)),
                ("work", tables.work_table(results)),
            ),
        ),
    )


def allocation_document(results: AllocationResults) -> Document:
    """Return the report."""
    return Document(
        title=f"The cheapest drawing of {results.reducer.name}: {results.name}",
        subtitle=(
            f"{len(results.requirements)} requirement{'s' if len(results.requirements) > 1 else ''}, "
            f"{results.torque:g} N·m on the carrier, seed {results.seed}"
        ),
        answer=answer(results),
        warnings=warnings(results),
        sections=sections(results),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )

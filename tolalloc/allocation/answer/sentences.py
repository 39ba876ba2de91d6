"""The answer of an allocation in sentences, each no stronger than what was computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolalloc.allocation.answer.tables import limit_price
from tolalloc.allocation.front.what_if import COST_CHANGE, SAME
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.reading.units import unit_of
from tolalloc.reports.feature_frame import callout_assumptions
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.wording import QUICK_RUN, short, with_unit
from tolalloc.sensitivity.surrogate.regression import NEEDED_Q2

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer

_NOTHING = 1e-3
"""Price of a whole limit, over the cost, below which it costs nothing [-]."""
_WRITTEN = 0.005
"""Difference of two amounts below which they are written alike, in their units."""
_EVEN_ODDS = 0.5
_SAME_COST = 5e-4
"""Relative difference of costs below which they are printed alike [-]."""


def sentences(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return the answer in sentences."""
    chosen = answer.chosen
    achieved = chosen.achieved
    found = [
        *([answer.examined.fault] if answer.examined.fault else ()),
        f"{'Met' if answer.met else 'NOT met'}: {achieved.estimate:.2%} of {achieved.units:,} fresh units keep "
        f"{_limits(answer)} (95 % interval {achieved.low:.2%}…{achieved.high:.2%}).",
    ]
    found += [*drawn_amounts(answer), _cost(answer)]  # the first three stand in the headline of a report
    if len(answer.requirements) > 1:
        found.append(f"{chosen.joint.estimate:.2%} of the units keep the limits of all requirements at once.")
    if answer.met and answer.error < _EVEN_ODDS:
        found.append(
            "The search has not seen these units. "
            f"The chance that this method accepts any drawing that violates a limit is at most {answer.error:.0%}."
        )
    return (
        *found,
        *_solved(chosen),
        _compared(answer),
        *_certificate(answer),
        *_modification(answer),
        *_prices(answer),
        *_good_unit(answer),
        *_settled(answer),
        *portrait_of(answer.model.at(chosen.settings)).remarks,
    )


def drawn_amounts(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what must be made with the zones: the amounts of the settings, and what they were."""
    drawn = answer.model.drawn_amounts
    if not answer.space.settings:
        return ()
    today, chosen = (drawn.by_setting @ design.settings for design in (answer.free.baseline, answer.chosen))
    same = np.allclose(today, chosen, rtol=1e-6, atol=_WRITTEN)
    amounts = " and ".join(
        f"{short(name)} {with_unit(_signed(new), name)}{'' if same else f' (was {_signed(was)})'}"
        for name, was, new in zip(drawn.names, today, chosen, strict=True)
    )
    word = portrait_of(answer.model).settings_word
    return (f"The drawing holds with {'these' if word.endswith('s') else 'this'} {word} only: {amounts}.",)


def amounts_convention(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what the signs of these amounts mean, if that must be said."""
    convention = answer.model.drawn_amounts.convention
    return (f"Signs: {convention}.",) if convention and answer.space.settings else ()


def _signed(amount: float) -> str:
    """Return an amount with a true minus sign."""
    return f"{amount:.2f}".replace("-", "−")


def _solved(design: VerifiedDesign) -> tuple[str, ...]:
    """Return which of the fresh units were solved, where that were not all of them."""
    units = design.independent.units if design.independent else None
    if units is None or units.near.all():
        return ()
    return (
        f"Of the fresh units {units.near.size:,} were solved: all that a regression through other units calls near a "
        f"limit, and {units.drawn.whatever:,} whatever it says of them, so that the interval holds even where it is "
        "wrong.",
    )


def missed(design: VerifiedDesign) -> str:
    """Return which limit blocks a design that is not met, and by how much."""
    check = design.blocking
    side, unit = check.tightest, unit_of(check.requirement.output)
    kept = f"{check.requirement.output.split(' [')[0]}, limit {side.limit:g} {unit}: "
    shown = check.requirement.guarantee.words
    if not np.isfinite(side.value):
        return f"{kept}too many units have no answer to show any limit kept (shown for {shown})"
    return f"{kept}it keeps {side.value:.4g} {unit} (shown for {shown}), {side.excess:.3g} {unit} beyond"


def _limits(answer: AllocationAnswer) -> str:
    """Return the limits of the leading output."""
    limits = answer.requirements[0].limits
    if limits.upper is None:
        return f"at least {with_unit(f'{limits.lower:g}', answer.leading)}"
    if limits.lower is None:
        return with_unit(f"{limits.upper:g}", answer.leading)
    return f"{limits.lower:g} to {with_unit(f'{limits.upper:g}', answer.leading)}"


def _against(cost: float, other: float) -> str:
    """Return how a cost stands against another one, in words."""
    change = cost / other - 1
    if abs(change) < _SAME_COST:
        return "as much as"
    return f"{abs(change):.1%} {'below' if change < 0 else 'above'}"


def _cost(answer: AllocationAnswer) -> str:
    """Return what the drawing costs, and what proportional scaling does."""
    chosen, hand = answer.chosen, answer.free.proportional
    used = "" if hand.met else ", which missed a limit"
    as_it_is = f" with the {portrait_of(answer.model).settings_word} as it is" if answer.space.settings else ""
    if hand.met and answer.requirements[0].limits.lower is None:
        unit = unit_of(answer.leading).replace("arcsec", "arcsecond")
        least = chosen.cost / (1 - answer.least_saving)
        used = f", and {_against(chosen.cost, least)} that had it used the limit to its last {unit} ({least:.2f})"
    return (
        f"Cost {chosen.cost:.2f} cost units, {_against(chosen.cost, hand.cost)} all zones scaled alike"
        f"{as_it_is} ({hand.cost:.2f}){used}."
    )


def _compared(answer: AllocationAnswer) -> str:
    """Return what every verified drawing costs, and which one is drawn."""
    costs = [
        f"{name} {own.cost:.2f}{'' if own.met else ' (misses a limit)'}"
        for name, own in answer.candidates.designs(answer.free_label).items()
    ]
    listed = f"Found by the searches, of which the drawing alone is confirmed: {'; '.join(costs)}."
    if answer.met and answer.keeps_table:
        return f"Keep the drawing: nothing that may be drawn and keeps every limit was found cheaper. {listed}"
    return listed


def _certificate(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return how far from optimal the answer can be."""
    if answer.met and answer.bound is None:
        return (
            "One verified drawing costs less than the lower bound by the local model around another one, so no lower "
            "bound is given.",
        )
    return (*_free(answer), *_graded(answer))


def _free(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return how far free zones can be from optimal; nothing where they miss a limit."""
    found = answer.candidates.unrestricted
    if not found.chosen.met:
        return ()
    bound, cost = found.lower_bound, found.chosen.cost
    below = f"{max(1 - bound.cost / cost, 0.0):.1%} below {cost:.2f}"
    zones = "free zones" if answer.graded else "zones"
    if bound.certified:
        return (
            f"No drawing with {zones} inside their ranges that keeps the limits costs less than {bound.cost:.2f} "
            f"({below}), with {bound.confidence:.0%} confidence: every limited value is linear in the deviations, as "
            "far as all units tell.",
        )
    return (
        f"Lower bound by the local model around the {'free zones' if answer.graded else 'drawing'}: {bound.cost:.2f} "
        f"({below}), with {bound.confidence:.0%} confidence against the errors of the units. The model is not "
        "certified for drawings that differ much from this one.",
    )


def _graded(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return how far grades can be from optimal, if they were asked for."""
    graded, free = answer.graded, answer.candidates.unrestricted.chosen
    if not graded:
        return ()
    cost = f"On grades and preferred numbers the cost is {graded.chosen.cost:.2f}"
    if free.met:
        cost += f", {_against(graded.chosen.cost, free.cost)} free zones"
    if not graded.chosen.met:
        return (f"{cost}, and a limit is missed.",)
    return (
        f"{cost}. Lower bound by the local model for grades, processes and rounded amounts near by: "
        f"{graded.bound:.2f}.",
    )


def _modification(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what the modification buys."""
    if answer.fixed is None:
        return () if answer.free.chosen.met else (f"No design was verified: {missed(answer.free.chosen)}.",)
    alone, joint, freed = answer.fixed.chosen, answer.free.chosen, portrait_of(answer.model).settings_word
    if not joint.met:
        said = (f"With {answer.free_label} free no design was verified: {missed(joint)}.",)
        return said if alone.met else (*said, f"Nor with tolerances alone: {missed(alone)}.")
    if not alone.met:
        return (f"Tolerances alone were not verified: {missed(alone)}; the {freed} makes the difference.",)
    saving = 1 - joint.cost / alone.cost
    if saving < _SAME_COST:
        return (f"Nothing cheaper was found with the {freed} free: as it is, the zones cost {alone.cost:.2f}.",)
    doubt = ""
    if max(answer.fixed.gap, answer.free.gap) > saving:
        doubt = "; this is less than what the lower bounds leave open, so it may be due to the search"
    return (
        f"The {freed} saves {alone.cost - joint.cost:.2f} cost units ({saving:.1%}) against tolerances alone "
        f"({alone.cost:.2f}){doubt}.",
    )


def _prices(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what the limits cost, to first order."""
    joint, said = answer.free, []
    for side in joint.chosen.constraints if joint.chosen.met else ():
        price = joint.prices[side.stack.name]
        if price * abs(side.limit) > _NOTHING * joint.chosen.cost:
            cost, per = limit_price(side, price)
            said.append(
                f"{side.stack.name.split(' [')[0]}: at its limit of {side.limit:g} {unit_of(side.stack.name)}, a "
                f"tighter one costs at the rate of {cost:.3g} cost units per {per}, a wider one saves at the same."
            )
    return tuple(said)


def _good_unit(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return the yield with the cheapest good unit, if the study states what becomes of the others."""
    found = answer.prices
    if found is None:
        return ()
    if not found.priced.size:
        return ("No good unit has a price: no yield that was tried is both in reach and shown by so many units.",)
    ends = {float(found.priced.max()): "or above ", float(found.priced.min()): "or below "}
    said = f"Of the yields that were tried a good unit is cheapest at {ends.get(found.best, '')}{found.best * 100:g}%"
    if found.priced.size == 1:
        said = f"Of the yields that were tried only {found.best * 100:g}% has a price for a good unit"
    return (
        f"{said}: {np.nanmin(found.prices):.2f} cost units by the local models, not verified; units beyond the "
        f"{short(answer.leading)} limit alone count as bad.",
    )


def _settled(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return which zones do not depend on what was assumed."""
    found = answer.robustness
    if found is None:
        return ()
    same = [group for group, settled in zip(found.groups, found.same, strict=True) if settled]
    said = [
        f"{len(same)} of {len(found.groups)} free zones {'stays' if len(same) == 1 else 'stay'} within {SAME:.0%} "
        f"under all changed assumptions{': ' + ', '.join(same) if same else ''}.",
    ]
    if found.costs:
        dearest = max(0.0, *(variant.regret for variant in found.costs))
        corners = f"{len(found.costs)} random corner{'' if len(found.costs) == 1 else 's'}"
        said.append(
            f"In {corners} of ±{COST_CHANGE * 100:g} % on every cost the free zones are at most {dearest:.2%} dearer "
            "than the cheapest ones there."
        )
    return tuple(said)


def warnings(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    chosen, found = answer.chosen, []
    if answer.header.quick:
        found.append(QUICK_RUN)
    if answer.error >= _EVEN_ODDS:
        found.append("A quick run accepts a design that lies exactly on a limit half of the time.")
    if not answer.met:
        found.append(
            "No design was verified to meet all limits. This is the least violating one; what blocks is "
            f"{missed(chosen)}."
        )
    if not answer.free.proportional.met:
        found.append("Proportional scaling was not verified to meet the limits, so the saving is against a miss.")
    uncertain = answer.robustness.uncertain if answer.robustness else ()
    lost = sum(not variant.kept for variant in uncertain)
    if lost and answer.free.chosen.met:
        found.append(
            f"With {lost} of {len(uncertain)} drawn {answer.model.uncertain[0].name.split(' (')[0]} values the free "
            "zones are no longer shown to keep every limit."
        )
    found += [f"{own.sentence}." for own in answer.space.settings if own.strays]
    found += portrait_of(answer.model).cautions(chosen.settings)
    found += _fronts(answer)
    return (*found, *_failed(answer))


def _fronts(answer: AllocationAnswer) -> list[str]:
    """Return what a reader must know of the searched fronts."""
    if answer.fronts is None:
        return []
    found, lost = [], answer.fronts.searched.failed
    if not answer.fronts.score.q2 >= NEEDED_Q2:
        found.append("The stand-in for the front was not exact enough: fewer designs were tried, on the model itself.")
    if lost:
        found.append(
            f"{lost} design{'' if lost == 1 else 's'} of the search for the front failed on the kernel; the front is "
            "without them."
        )
    return found


def _failed(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return how many units have no answer, and who counts them."""
    failed = answer.header.failed
    if not failed:
        return ()
    has, them = ("unit has", "it") if failed == 1 else ("units have", "them")
    return (f"{failed} {has} no answer; a yield counts {them} as outside the limits, a Cpk leaves {them} out.",)


def assumptions(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return what no source states."""
    priced = bool(answer.space.processes)
    return (
        *answer.header.assumptions,
        "zones, distributions, Cp, smallest and largest zones: as the tolerance table states them; its notes say where "
        "each comes from",
        "processes and costs as the process cost table states them; a process changes the cost and the range of a "
        "zone, not its distribution or Cp"
        if priced
        else "a cost falls as 1/zone, from the tolerance table's cost at its zone",
        *(("what is chosen beside the zones costs nothing and is exact",) if answer.space.settings else ()),
        "sources correlated as their file states; the bounds of the models do not know of correlations"
        if answer.space.errors.is_correlated
        else "all sources are independent of each other",
        *callout_assumptions(tuple(source for source in answer.space.errors.sources if source.zone > 0.0)),
    )

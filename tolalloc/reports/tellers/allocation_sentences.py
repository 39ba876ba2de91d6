"""An allocation in sentences, each no stronger than what was computed; their texts are in ``allocation.toml``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from tolalloc.allocation.front.cost_front import CostFront
from tolalloc.allocation.front.price_region import COST_CHANGE, SAME
from tolalloc.allocation.front.uncertain_region import COVERED, UncertainRegion
from tolalloc.allocation.result import AllocationResult, limit_price, limit_step, unit_quantile
from tolalloc.allocation.search.candidates import ALONE
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.joint_yield import JointRequirement
from tolalloc.allocation.space.requirement import AtYield, Check, Guarantee, OwnLimit, WorstCase
from tolalloc.allocation.verify.verification import VerifiedDesign
from tolalloc.capability.indices import capability
from tolalloc.capability.monte_carlo import Yield
from tolalloc.drawings.sources import Source
from tolalloc.reading.file_content import is_file
from tolalloc.reading.units import MICROMETRE
from tolalloc.reports.feature_frame import callout_assumptions
from tolalloc.reports.header import Header
from tolalloc.reports.portrait import Examination, portrait_of
from tolalloc.reports.tellers.allocation_assembly import assembly_cost_sentences
from tolalloc.reports.tellers.allocation_population import assumed_alone, population_sentences
from tolalloc.reports.tellers.check import MORE_PARTS, few_parts, interval_gaps
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import QUICK_RUN, enumerated, number, quantity, short, with_unit

_NOTHING = 1e-3
"""Price of a whole limit, over the cost, below which it costs nothing [-]."""
_WRITTEN = 0.005
"""Difference of two amounts below which they are written alike, in their units."""
_EVEN_ODDS = 0.5
_ALIKE = 0.005
"""Relative change of a zone below which it stays [-]."""
_MOST_CHANGED = 2
"""Zones that are named of those tightened, and of those opened, most [-]."""
_SAME_COST = 5e-4
"""Relative difference of costs below which they are printed alike [-]."""

_say = Sentences("allocation")

_LEAST_PRICE = 0.005
"""Factor of a cost that is said as 0 [-]."""


def free_label(result: AllocationResult) -> str:
    """Return what the search that frees everything may choose."""
    return f"tolerances and {portrait_of(result.model).settings_word}" if result.space.settings else "tolerances"


def designs(result: AllocationResult) -> dict[str, VerifiedDesign]:
    """Return the designs that a report compares, by what they are called."""
    return result.candidates.designs(free_label(result))


def searches(result: AllocationResult) -> dict[str, ZoneAllocation]:
    """Return the searches by what they were free to choose."""
    return {**({ALONE: result.fixed} if result.fixed else {}), free_label(result): result.free}


def examined(result: AllocationResult) -> Examination:
    """Return what is said of random units of the drawing, such as that they cannot be built."""
    return portrait_of(result.model.at(result.chosen.settings)).examination(result.examination)


def title(result: AllocationResult, header: Header) -> str:
    """Return what the answer is about."""
    key = "title_kept" if result.keeps_table else "title"
    if not result.met:
        key = "title_missed"
    elif examined(result).fault:
        key = "title_fault"
    return _say(key, asked=header.asked)


def verdict(result: AllocationResult) -> tuple[str, ...]:
    """Return why the drawing cannot be built, if so, and how many units keep its limits."""
    fault = examined(result).fault
    return (fault, _verdict(result)) if fault else (_verdict(result),)


def promise(result: AllocationResult) -> tuple[str, ...]:
    """Return the verdict and, in one paragraph with it, for which parts it holds."""
    *fault, found = verdict(result)
    return (*fault, " ".join((found, *population_sentences(result))))


def headline(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return the verdict and the cost."""
    costs = (_cost(result, cost_unit), *assembly_cost_sentences(result, cost_unit))
    return (*promise(result), *costs)


def sentences(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return the answer in sentences; the first ones stand in the headline of a report."""
    chosen = result.chosen
    found = [
        *assumed_alone(result),
        *promise(result),
        *drawn_amounts(result),
        *zones_changed(result),
        _cost(result, cost_unit),
    ]
    certificate = _certificate(result)
    found += (*assembly_cost_sentences(result, cost_unit), *certificate[:1])
    if len(result.requirements) > 1 and not chosen.jointly:
        found.append(_say("all_limits", share=chosen.joint.estimate))
    found += _few_parts(result, cost_unit)
    sampled = not isinstance(chosen.checks[0].requirement.guarantee, WorstCase)
    if result.met and result.error < _EVEN_ODDS and sampled:
        found.append(_say("error", error=result.error))
    return (
        *found,
        *certificate[1:],
        *_solved(chosen),
        _compared(result),
        *_modification(result, cost_unit),
        *_prices(result, cost_unit),
        *_good_unit(result, cost_unit),
        *_settled(result),
        *portrait_of(result.model.at(chosen.settings)).remarks,
    )


def _verdict(result: AllocationResult) -> str:
    """Return whether the drawing keeps its limits, and the yield that shows it: of all limits where that was asked."""
    chosen, check = result.chosen, result.chosen.checks[0]
    if isinstance(check.requirement.guarantee, WorstCase):
        return _worst(result, check)
    key, achieved, said = "met", chosen.achieved, {"stay": _stay(result)}
    if chosen.jointly:
        key, achieved, check = "met_jointly", chosen.joint, chosen.checks[-1]
        said = {}
    return _say(
        key,
        verdict=_verdict_word(result, check.requirement.guarantee, achieved),
        simulated=portrait_of(result.model).simulated,
        required=_required(result, check.requirement.guarantee, achieved),
        **interval_gaps(achieved),
        **said,
    )


def _worst(result: AllocationResult, check: Check) -> str:
    """Return whether the worst units inside the zones keep the limits."""
    asked, sides = check.requirement, check.constraints
    worst = enumerated(with_unit(f"{side.value:.4g}", asked.output) for side in sides)
    limits = enumerated(
        f"{'at most' if side.sign > 0 else 'at least'} {with_unit(asked.told(side.limit), asked.output)}"
        for side in sides
    )
    word = _say("verdict_met" if result.met else "verdict_missed")
    return _say("met_worst", verdict=word, output=quantity(asked.output), worst=worst, limits=limits)


def _verdict_word(result: AllocationResult, guarantee: Guarantee, achieved: Yield) -> str:
    """Return whether the limits are kept; of units of which too few keep them, what shows it nevertheless."""
    if not result.met:
        return _say("verdict_missed")
    is_quick = result.error >= _EVEN_ODDS
    if not isinstance(guarantee, AtYield) or achieved.estimate >= guarantee.target:
        return _say("verdict_met_quick" if is_quick else "verdict_met")
    has_laws = len(result.chosen.laws) == len(result.yields)
    return _say("verdict_open" if is_quick and not has_laws else "verdict_known")


def zones_changed(result: AllocationResult) -> tuple[str, ...]:
    """Return which zones change most, and how many stay; nothing where the drawing is the table."""
    before = {own.name: own.zone for own in result.space.errors.sources}
    changes = [
        (members[0].zone / before[members[0].name], result.line_name((name, members)), members[0])
        for name, members in result.lines
    ]
    changed = sorted((own for own in changes if abs(own[0] - 1) > _ALIKE), key=lambda own: own[0])
    if not changed or not result.met:
        return ()

    def named(rows: list[tuple[float, str, Source]]) -> str:
        zones = ((name, before[own.name] / MICROMETRE, own.zone / MICROMETRE) for _, name, own in rows)
        return ", ".join(_say("zone_changed", name=name, before=old, zone=new) for name, old, new in zones)

    tighter = [own for own in changed if own[0] < 1][:_MOST_CHANGED]
    wider = [own for own in reversed(changed) if own[0] > 1][:_MOST_CHANGED]
    left = len(changes) - len(changed)
    said = [_say("zones_tightened", names=named(tighter))] if tighter else []
    said += [_say("zones_opened", names=named(wider))] if wider else []
    said += [_say("zones_kept", count=left, all=len(changes))] if left else []
    return (_say("zones_changed", changed="; ".join(said)),)


def today_values(result: AllocationResult) -> tuple[str, ...]:
    """Return what the numbers beside the limits are, and how many units keep the drawing as it is."""
    today = result.free.baseline
    several = len(result.requirements) > 1
    kept = today.joint if several else today.achieved
    names = [short(own.output) for own in result.requirements if isinstance(own, OwnLimit)]
    own_limit = "own_limit_moves" if result.space.settings else "own_limit"
    said = _say(
        "today_values",
        simulated=portrait_of(result.model).simulated,
        **interval_gaps(kept),
        limits=_say("today_all" if several else "today_one"),
        own=_say(own_limit, names=" and ".join(names), word=portrait_of(result.model).settings_word) if names else "",
    )
    return (said.rstrip(),)


def _few_parts(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return what few measured parts do to the interval and to the zones, and what 100 parts would bring."""
    chosen, check = result.chosen, result.chosen.checks[0]
    interval = few_parts(chosen.joint if chosen.jointly else chosen.achieved)
    asked, doubt = check.requirement, chosen.uncertainties.get(check.requirement.output)
    if doubt is None or not isinstance(asked.guarantee, AtYield):
        return interval
    ways = {"margin": doubt, "less": doubt.with_parts(MORE_PARTS)}
    margins = {name: own.margin(asked.limits, 1 - asked.guarantee.target) for name, own in ways.items()}
    gaps = {name: with_unit(f"{margin:.3g}", asked.output) for name, margin in margins.items()}
    said = [_say("margin", output=quantity(asked.output), **gaps)]
    if min(doubt.parts) < MORE_PARTS:
        price = sum(result.free.prices.get(side.stack.name, 0.0) for side in check.constraints)
        saved = price * (margins["margin"] - margins["less"])
        key = "margin_saves" if saved > _NOTHING * chosen.cost else "margin_less"
        said.append(_say(key, more=MORE_PARTS, saved=saved, cost_unit=cost_unit, **gaps))
    return (*interval, " ".join(said))


def drawn_amounts(result: AllocationResult) -> tuple[str, ...]:
    """Return what must be made with the zones: the amounts of the settings, and what they were."""
    drawn = result.model.drawn_amounts
    if not result.space.settings:
        return ()
    before, chosen = (drawn.by_setting @ design.settings for design in (result.free.baseline, result.chosen))
    amount = "amount" if np.allclose(before, chosen, rtol=1e-6, atol=_WRITTEN) else "amount_changed"
    amounts = enumerated(
        _say(amount, name=short(name), value=with_unit(number(new, ".2f"), name), before=number(was, ".2f"))
        for name, was, new in zip(drawn.names, before, chosen, strict=True)
    )
    word = portrait_of(result.model).settings_word
    return (_say("amounts_many" if word.endswith("s") else "amounts_one", word=word, amounts=amounts),)


def amounts_convention(result: AllocationResult) -> tuple[str, ...]:
    """Return what the signs of these amounts mean, if that must be said."""
    convention = result.model.drawn_amounts.convention
    return (_say("convention", convention=convention),) if convention and result.space.settings else ()


def _stay(result: AllocationResult) -> str:
    """Return what units that keep the limits of the leading output do."""
    limits, leading = result.requirements[0].limits, result.leading
    if limits.upper is None:
        return _say("stay_lower", lower=with_unit(f"{limits.lower:g}", leading))
    upper = with_unit(f"{limits.upper:g}", leading)
    key = "stay_upper" if limits.lower is None else "stay_both"
    return _say(key, lower=limits.lower, upper=upper)


def _required(result: AllocationResult, guarantee: Guarantee, achieved: Yield) -> str:
    """Return what was required beside what was achieved."""
    if not isinstance(guarantee, AtYield):
        return _say("required_other", words=guarantee.words)
    near = result.met and achieved.low < guarantee.target <= achieved.high
    return _say("required_near" if near else "required_yield", target=guarantee.target)


def _against(cost: float, other: float) -> str:
    """Return how a cost stands against another one, in words."""
    change = cost / other - 1
    if abs(change) < _SAME_COST:
        return _say("against_same")
    return _say("against_below" if change < 0 else "against_above", change=abs(change))


def _cost(result: AllocationResult, cost_unit: str) -> str:
    """Return what the drawing costs, and what proportional scaling does where its units come close to the limits."""
    chosen, alike, before = result.chosen, result.free.proportional, result.free.baseline.cost
    word, settings = portrait_of(result.model).settings_word, ""
    if result.space.settings:
        settings = _say("cost_settings_many" if word.endswith("s") else "cost_settings", word=word)
    key = "cost_tighter" if alike.cost > before * (1 + _SAME_COST) else "cost_scaled"
    said = _say(key, settings=settings, alike=alike.cost) if result.free.proportional_settled else ""
    same = abs(chosen.cost / before - 1) < _SAME_COST
    told = _say("cost_same" if same else "cost", before=before, cost=chosen.cost, cost_unit=cost_unit, alike=said)
    return told.rstrip()


def capability_change(result: AllocationResult) -> tuple[str, ...]:
    """Return mean, standard deviation, Ppk and share beyond the limit of the leading output, as it is and as drawn.

    Nothing where the output does not vary.
    """
    limits, leading = result.requirements[0].limits, result.leading
    gaps: dict[str, Any] = {"output": short(leading).capitalize(), "simulated": portrait_of(result.model).simulated}
    for after, design in (("_before", result.free.baseline), ("", result.chosen)):
        values = design.sample.values
        if not np.ptp(known := values[np.isfinite(values)]):
            return ()
        found = capability(known, limits)
        gaps |= {
            f"mean{after}": with_unit(f"{found.mean:.3g}", leading),
            f"sigma{after}": with_unit(f"{found.deviation_overall:.3g}", leading),
            f"ppk{after}": found.ppk,
            f"pp{after}": found.pp,
            f"beyond{after}": 1 - design.achieved.estimate,
        }
    before, after = gaps.pop("pp_before"), gaps.pop("pp")
    centred = "" if None in (before, after) else _say("pp", before=before, after=after)  # one limit has no middle
    return (_say("capability", **gaps, pp=f"{centred} " if centred else ""),)


def _solved(design: VerifiedDesign) -> tuple[str, ...]:
    """Return which of the verifying units were solved, where that were not all of them."""
    units = design.independent.units if design.independent else None
    if units is None or units.near.all():
        return ()
    return (_say("solved", units=units.near.size, all=design.achieved.units, whatever=units.drawn.whatever),)


def missed(design: VerifiedDesign) -> str:
    """Return which limit blocks a design that is not met, and by how much."""
    check, side = design.blocking, design.blocking.tightest
    if isinstance(check.requirement, JointRequirement):
        return _say("missed_jointly", share=design.joint.estimate, shown=check.requirement.guarantee.words)
    return _say(
        "missed" if np.isfinite(side.value) else "missed_unanswered",
        output=quantity(check.requirement.output),
        limit=with_unit(check.requirement.told(side.limit), check.requirement.output),
        shown=check.requirement.guarantee.words,
        value=with_unit(f"{side.value:.4g}", check.requirement.output),
        excess=with_unit(f"{side.excess:.3g}", check.requirement.output),
    )


def _compared(result: AllocationResult) -> str:
    """Return what every verified drawing costs, and which one is drawn."""
    costs = (
        _say("design" if own.met else "design_missed", name=name, cost=own.cost)
        for name, own in designs(result).items()
    )
    listed = _say("found", designs="; ".join(costs))
    return _say("kept", found=listed) if result.met and result.keeps_table else listed


def _certificate(result: AllocationResult) -> tuple[str, ...]:
    """Return how far from optimal the answer can be: first what was proven, if that was asked for."""
    if result.met and result.bound is None:
        return (*_proven(result), _say("no_bound"))
    return (*_proven(result), *_free(result), *_graded(result))


def _proven(result: AllocationResult) -> tuple[str, ...]:
    """Return what no drawing costs less than on the real model, if that was asked for."""
    found, free = result.proven, result.free.chosen
    if found is None:
        return ()
    gaps = {
        "found": found,
        "allowed": " or ".join(dict.fromkeys(str(own) for own in found.allowed)),
        "counted": ", ".join(short(own) for own in found.counted),
        "rests": f", provided that {found.rests_on} hold" if found.rests_on else "",
    }
    answer = _say("answer_free" if result.graded else "answer_drawing", cost=free.cost)
    key = ("proven" if free.met else "proven_alone") if found.says_more else "proven_nothing"
    return (_say(key, answer=answer, below=1 - found.cost / free.cost, **gaps),)


def _free(result: AllocationResult) -> tuple[str, ...]:
    """Return how far free zones can be from optimal; nothing where they miss a limit."""
    found = result.candidates.unrestricted
    if not found.chosen.met:
        return ()
    bound, cost, graded = found.lower_bound, found.chosen.cost, result.graded
    answer = _say("answer_free" if graded else "answer_drawing", cost=cost)
    gaps = {"answer": answer, "below": max(1 - bound.cost / cost, 0.0), "zones": "free zones" if graded else "zones"}
    said = _say("bound_certified" if bound.certified else "bound_local", bound=bound, **gaps)
    return (said, *_rounding(found.chosen))


def _rounding(design: VerifiedDesign) -> tuple[str, ...]:
    """Return how much of the distance from the lower bound is due to whole steps, if they cost anything."""
    if design.unrounded_cost is None or (rounding := design.cost - design.unrounded_cost) < _WRITTEN:
        return ()
    return (_say("rounding", rounding=rounding, unrounded=design.unrounded_cost),)


def _graded(result: AllocationResult) -> tuple[str, ...]:
    """Return how far grades can be from optimal, if they were asked for."""
    graded, free = result.graded, result.candidates.unrestricted.chosen
    if not graded:
        return ()
    compared = _say("graded_compared", against=_against(graded.chosen.cost, free.cost)) if free.met else ""
    said = _say("graded", cost=graded.chosen.cost, compared=compared)
    pairs = zip(result.space.errors.sources, result.drawn_sources, strict=True)
    off = dict.fromkeys(new.dimension for old, new in pairs if new.grade and new.middle and new.zone != old.zone)
    letters = (_say("graded_letters", names=enumerated(off)),) if off else ()
    if not graded.chosen.met:
        return (_say("graded_missed", graded=said), *letters)
    return (_say("graded_bound", graded=said, bound=graded.bound), *letters)


def _modification(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return what the settings buy."""
    joint, word = result.free.chosen, portrait_of(result.model).settings_word
    if result.fixed is None:
        return () if joint.met else (_say("none_verified", missed=missed(joint)),)
    alone = result.fixed.chosen
    if not joint.met:
        said = _say("none_free", free=free_label(result), missed=missed(joint))
        return (said,) if alone.met else (said, _say("none_alone", missed=missed(alone)))
    if not alone.met:
        return (_say("alone_missed", missed=missed(alone), word=word),)
    saving = 1 - joint.cost / alone.cost
    if saving < _SAME_COST:
        key = "nothing_cheaper_many" if word.endswith("s") else "nothing_cheaper"
        return (_say(key, word=word, cost=alone.cost, cost_unit=cost_unit),)
    if result.chosen is alone:
        return (_say("not_confirmed", word=word, cost=joint.cost, alone=alone.cost, cost_unit=cost_unit),)
    doubt = _say("saves_doubt") if max(result.fixed.gap, result.free.gap) > saving else ""
    gaps = {"saved": alone.cost - joint.cost, "share": saving, "alone": alone.cost, "doubt": doubt}
    return (_say("saves", word=word, cost_unit=cost_unit, **gaps),)


def _prices(result: AllocationResult, cost_unit: str) -> Iterator[str]:
    """Yield what the limits that the drawing touches cost, to first order."""
    for check, side in result.chosen.limited_sides if result.free.chosen.met else ():
        if price := result.price_of(check, side):
            limits = check.requirement.limits
            cost, _ = limit_price(side, limits, price)
            told = check.requirement.told(side.limit), f"{limit_step(side, limits):g}"
            limit, step = (with_unit(own, side.stack.name) for own in told)
            gaps = {"output": quantity(side.stack.name), "limit": limit, "step": step}
            yield _say("price", price=cost, cost_unit=cost_unit, **gaps)


def _good_unit(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return the yield with the cheapest good unit, if the study states what becomes of the others."""
    found = result.prices
    if found is None:
        return ()
    if not found.priced.size:
        return (_say("good_none"),)
    ends = {float(found.priced.max()): "good_above", float(found.priced.min()): "good_below"}
    key = "good_only" if found.priced.size == 1 else ends.get(found.best, "good_inside")
    said, price = _say(key, target=found.best * 100), np.nanmin(found.prices)
    return (_say("good", yield_=said, price=price, cost_unit=cost_unit, output=short(result.leading)),)


def _settled(result: AllocationResult) -> Iterator[str]:
    """Yield which zones do not depend on what was assumed."""
    found = result.robustness
    if found is None:
        return
    same = [group for group, settled in zip(found.groups, found.same, strict=True) if settled]
    names = f" ({', '.join(same)})" if same else ""
    key = "same_one" if len(same) == 1 else "same_many"
    yield _say(key, same=len(same), count=len(found.groups), most=SAME, change=COST_CHANGE, names=names)
    worst, cost = found.worst, result.free.chosen.cost
    yield _say("worst_prices", change=COST_CHANGE, most=worst.most, share=worst.most / cost, lost=worst.lost)
    ranges = zip(found.groups, found.prices, strict=True)
    ending = [one for one in ranges if one[1].low > _LEAST_PRICE or one[1].high < np.inf]
    if ending:
        group, own = min(ending, key=lambda one: one[1].nearest)
        both = "price_range" if own.low > _LEAST_PRICE else "price_range_below"
        key = "price_range_above" if own.high == np.inf else both
        yield _say(key, group=group, low=own.low, high=own.high, same=SAME)
    if found.graded:
        steady = [group for group, one in zip(found.groups, found.graded, strict=True) if one.holds_change]
        gaps = {"same": len(steady), "count": len(found.groups), "change": COST_CHANGE}
        yield _say("graded_prices", names=f" ({', '.join(steady)})" if steady else "", **gaps)
    if found.uncertain and result.free.chosen.met:
        yield from _region(found.uncertain)


def _region(found: UncertainRegion) -> Iterator[str]:
    """Yield within which changes of what is uncertain of the model the answer holds."""
    moving = [own for own in found.ranges if own.moves_a_zone]
    breaking = [own for own in found.ranges if own.breaks_a_limit]
    low, high = (np.array([own.tried[side] for own in found.ranges]) for side in (0, 1))
    unanswered = [own.column for own in found.ranges if 0.0 in own.tried]
    if unanswered:
        yield _say("region_unanswered", columns=", ".join(unanswered))
    elif not moving and not breaking:
        yield _say("region_holds", what=found.name, low=np.exp(low.max()), high=np.exp(high.min()), same=SAME)
    if moving:
        own = min(moving, key=lambda one: one.same[1] - one.same[0])
        below, above = own.first
        first = below if below and (not above or -own.same[0] < own.same[1]) else above
        low, high = np.exp(own.same)
        yield _say("region_moves", column=own.column, low=low, high=high, same=SAME, group=first)
    for own in breaking:
        low, high = np.exp(own.kept)
        yield _say("region_breaks", column=own.column, low=low, high=high)


def warnings(result: AllocationResult, header: Header) -> Iterator[str]:
    """Yield what a reader must know before acting on the answer."""
    if header.quick:
        yield QUICK_RUN
    if result.error >= _EVEN_ODDS:
        yield _say("even_odds")
    if not result.met:
        yield _say("not_verified", missed=missed(result.chosen))
    if not result.free.proportional.met:
        yield _say("alike_missed")
    region = result.robustness.uncertain if result.robustness else None
    worst = region.least_favourable if region else None
    if region and worst and not worst.kept and result.free.chosen.met:
        yield _say("uncertain", what=region.name, covered=COVERED)
    yield from (f"{own.sentence}." for own in result.space.settings if own.out_of_bounds)
    fault, cautions = examined(result).fault, portrait_of(result.model).cautions(result.chosen.settings)
    present = np.array([own.value for own in result.space.settings])
    key = "present" if np.allclose(result.chosen.settings, present) else "as_drawn"
    yield from (_say(key, caution=own) if present.size else own for own in cautions if own not in fault)
    if failed := header.failed:
        yield _say("failed_one" if failed == 1 else "failed_many", count=failed)


def front(result: AllocationResult, found: CostFront) -> Iterator[str]:
    """Yield how the costs of other limits were found."""
    units = next((own.design.joint.units for own in found.points if own.design is not result.chosen), 0)
    if units:
        yield _say("front", units=units, simulated=portrait_of(result.model).simulated)
    if units and found.drawn:
        yield _say("front_drawn")
    if found.missed:
        missed = ", ".join(with_unit(f"{own:.4g}", result.leading) for own in found.missed)
        yield _say("front_missed", limits=missed)


def assumptions(result: AllocationResult, header: Header) -> tuple[str, ...]:
    """Return what no source states."""
    space = result.space
    keys = (
        "assumed_zones",
        "assumed_processes" if space.processes else "assumed_costs",
        *(("assumed_settings",) if space.settings else ()),
        "assumed_correlated" if space.errors.is_correlated else "assumed_independent",
        *(("assumed_chosen",) if result.assembled else ()),
    )
    drawn = tuple(source for source in space.errors.sources if source.zone > 0.0)
    return (*header.assumptions, *map(_say, keys), *callout_assumptions(drawn, portrait_of(result.model).kind_of))


def files(result: AllocationResult) -> str:
    """Return which files stand beside the report, the user's own table first."""
    own = result.space.errors.file
    is_returned = own is not None and is_file(own.path) and own.is_own
    return _say("files", returned=f"{_say('returned', name=own.returned_name)} " if own and is_returned else "")


def quantiles(result: AllocationResult) -> Iterator[str]:
    """Yield how much safer than asked the drawing is, since its units are few."""
    chosen, simulated = result.chosen, portrait_of(result.model).simulated
    for check in chosen.checks:
        side, asked = check.constraints[0], check.requirement
        kept = unit_quantile(chosen, check, side) if asked.limits.width is None else np.nan
        # What near units and derivatives say may be safer than the plain units; then these have nothing to add.
        if isinstance(asked.guarantee, AtYield) and side.sign * (side.value - kept) >= 0.0:
            key = "quantile_upper" if side.sign > 0 else "quantile_lower"
            safer, value = (with_unit(f"{own:.4g}", asked.output) for own in (kept, side.value))
            gaps = {"target": asked.guarantee.target, "kept": safer, "value": value, "confidence": chosen.confidence}
            yield _say(key, output=quantity(asked.output), simulated=simulated, **gaps)


def cheapest_settings(result: AllocationResult, cost_unit: str) -> tuple[str, ...]:
    """Return where the zones are cheapest among the settings that were tried."""
    trade = result.trade
    if trade is None or not np.isfinite(trade.cheapest).all():
        return (_say("trade_none"),)
    error = ""
    if np.isfinite(trade.error):
        error = _say("trade_error", error=with_unit(f"{trade.error:.2g}", result.leading))
    settings = enumerated(
        f"{quantity(name)} {with_unit(f'{value:.3g}', name)}"
        for name, value in zip(trade.names, trade.cheapest, strict=True)
    )
    cost, drawn = float(np.nanmin(trade.cost)), result.free.chosen
    gaps = {"settings": settings, "cost": cost, "cost_unit": cost_unit, "error": error}
    if drawn.met and drawn.cost < cost:
        return (_say("trade_dearer", drawn=drawn.cost, **gaps),)
    return (_say("trade", **gaps),)

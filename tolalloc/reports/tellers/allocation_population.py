"""What an answer rests on: the parts that it is promised for, what lines demand of them, and how numbers are known."""

from __future__ import annotations

from collections.abc import Sequence

from tolalloc.allocation.result import AllocationResult
from tolalloc.allocation.space.requirement import WorstCase
from tolalloc.drawings.distributions import Distribution
from tolalloc.drawings.population import demand, demanded_capabilities
from tolalloc.drawings.provenance import ASSUMED, CELLS
from tolalloc.drawings.sources import Source
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.check import interval_gaps
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import enumerated

_say = Sentences("allocation")


def demands(result: AllocationResult, members: Sequence[Source]) -> str:
    """Return what a line demands of its parts beside the zone: of all its members, where they differ.

    Nothing where the worst unit inside the zones is promised.
    """
    if all(isinstance(own.guarantee, WorstCase) for own in result.requirements):
        return _say("population_none")
    return "; ".join(dict.fromkeys(map(demand, members)))


def _capability(result: AllocationResult) -> str:
    """Return what all lines demand in short."""
    found = demanded_capabilities(result.drawn_sources)
    if found is None:
        return _say("population_stated")
    low, high = found
    return _say("population_cp" if low == high else "population_cps", low=low, high=high)


def population_sentences(result: AllocationResult) -> tuple[str, ...]:
    """Return for which parts the yield is promised, and what becomes of parts that only keep their zones."""
    if not result.met:
        return ()
    if result.evenly is None:
        return (_say("population_evenly"),) if _are_even(result.drawn_sources) else ()
    several = len(result.requirements) > 1
    return (
        _say(
            "population",
            capability=_capability(result),
            simulated=portrait_of(result.model).simulated,
            limits=_say("today_all" if several else "today_one"),
            **interval_gaps(result.evenly.joint),
        ),
    )


def _are_even(sources: Sequence[Source]) -> bool:
    """Return whether all lines are promised for parts that are evenly spread."""
    return all(own.distribution is Distribution.UNIFORM for own in sources if own.zone > 0.0)


def assumed_alone(result: AllocationResult) -> tuple[str, ...]:
    """Return that every number of the table is assumed, if so: the first thing to know of the answer."""
    known = [own.known_from for own in result.drawn_sources if own.zone > 0.0]
    every = all(own.get(cell) == ASSUMED for own in known for cell in CELLS)
    return (_say("assumed_all"),) if known and every else ()


def assumed_sentences(result: AllocationResult) -> tuple[str, ...]:
    """Return how many zones, ranges and costs are assumed, and how much of the changes of cost rests on them."""
    drawn, before = [own for own in result.drawn_sources if own.zone > 0.0], result.space.errors.sources
    costs = {own.name: own.cost for own in before}
    found = {cell: [own for own in drawn if own.known_from.get(cell) == ASSUMED] for cell in CELLS}
    if assumed_alone(result) or not any(found.values()):
        return ()
    moved = {own.name: abs(own.cost - costs[own.name]) for own in drawn}
    changed, share = sum(moved.values()), ""
    if changed > 0.0 and found["cost"]:
        share = _say("assumed_share", share=sum(moved[own.name] for own in found["cost"]) / changed)
    cells = enumerated(
        _say("assumed_cells", count=len(own), all=len(drawn), cell=cell) for cell, own in found.items() if own
    )
    return (_say("assumed_some", cells=cells, share=share),)


def population_note(result: AllocationResult) -> tuple[str, ...]:
    """Return what the drawing itself says of the population that its zones stand for."""
    if result.evenly is None:
        return ()
    return (_say("population_note", capability=_capability(result), share=result.evenly.joint.estimate),)

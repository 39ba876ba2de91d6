"""What a drawing promises for the parts that the shop makes, and what each of its lines demands of them for that."""

from __future__ import annotations

from collections.abc import Sequence

from tolalloc.allocation.result import AllocationResult
from tolalloc.drawings.population import demand, demanded_capabilities
from tolalloc.drawings.sources import Source
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.check import interval_gaps
from tolalloc.reports.templates import Sentences

_say = Sentences("allocation")


def demands(members: Sequence[Source]) -> str:
    """Return what a line demands of its parts beside the zone: of all its members, where they differ."""
    return "; ".join(dict.fromkeys(map(demand, members)))


def _capability(result: AllocationResult) -> str:
    """Return what all lines demand in short."""
    low, high = demanded_capabilities(result.drawn_sources)
    if not high:
        return _say("population_stated")
    return _say("population_cp" if low == high else "population_cps", low=low, high=high)


def population_sentences(result: AllocationResult) -> tuple[str, ...]:
    """Return for which parts the yield is promised, and what becomes of parts that only keep their zones."""
    if result.evenly is None or not result.met:
        return ()
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


def population_note(result: AllocationResult) -> tuple[str, ...]:
    """Return what the drawing itself says of the population that its zones stand for."""
    if result.evenly is None:
        return ()
    return (_say("population_note", capability=_capability(result), share=result.evenly.joint.estimate),)

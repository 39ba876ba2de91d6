"""What a reader of an allocation must know before acting on it: warnings, and what no source states."""

from __future__ import annotations

from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.answer.sentences import missed
from tolalloc.rv.cycloid.clearance import linear_model_warnings


def warnings(results: AllocationResults) -> tuple[str, ...]:
    """Return what a reader must know before acting on the answer."""
    chosen, found = results.chosen, []
    if results.quick:
        found.append("Quick run: small samples, wide intervals. Run without --quick before setting a drawing.")
    if not chosen.met:
        found.append(
            "No design was verified to meet all limits. This is the least violating one; what blocks is "
            f"{missed(chosen)}."
        )
    if not results.joint.by_hand.met:
        found.append("Uniform scaling was not verified to meet the limits, so the saving is against a miss.")
    stiffness = results.robustness.stiffness
    lost = sum(not variant.kept for variant in stiffness)
    if lost and results.joint.chosen.met:
        found.append(
            f"With {lost} of {len(stiffness)} drawn stiffnesses the free zones are no longer shown to keep every limit."
        )
    found += linear_model_warnings(results.reducer.cycloid_stage, results.modification)
    if not results.fronts.surrogate.earns_its_place:
        found.append("The corrected model of the front has not earned its place; its search ran on the kernel, short.")
    lost = results.fronts.searched.failed
    if lost:
        found.append(
            f"{lost} design{'' if lost == 1 else 's'} of the search for the front failed on the kernel; the front is "
            "without them."
        )
    return (*found, *_failed(results))


def _failed(results: AllocationResults) -> tuple[str, ...]:
    """Return how many units have no answer, and who counts them."""
    failed = sum(count for outcome, count in results.statuses.items() if outcome != "equilibrium found")
    if not failed:
        return ()
    has, them = ("unit has", "it") if failed == 1 else ("units have", "them")
    return (f"{failed} {has} no equilibrium; a yield counts {them} as outside the limits, a Cpk leaves {them} out.",)


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

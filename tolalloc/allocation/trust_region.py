"""Verified steps towards the cheapest design: the convex program where the local models can be trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.program.problem import Stack
from tolalloc.allocation.programs import SETTLED, Programs
from tolalloc.allocation.verification import VerifiedDesign, Verifier

_SIMILAR = (1.25, 1.0)
"""Ratio of scales, and difference of settings over ten steps of theirs, up to which designs share their models [-]."""
_REPAIRS = 3
"""Steps more where the last design does not quite keep the limits and is cheaper than any that does [-]."""
_EXPLAINED = 2.0
"""Standard errors by which a verified value may be off its prediction for the region to keep its size [-]."""


def aimed(last: VerifiedDesign, tried: list[VerifiedDesign], margin: float = 1.0) -> tuple[Stack, ...]:
    """Return the local models of a design with the budget to aim at.

    Parameters
    ----------
    last
        The design.
    tried
        It and all designs before it.
    margin
        How far inside each limit the aim is [standard errors].

    Notes
    -----
    The values of a few thousand units are uncertain by a percent or two, so a search aims one standard error inside
    each limit. Where the models of the last design also explain other ones near by, their mean deviation from them
    corrects them, each with the weight of its units, so the noise averages out. The law of a linear output has none.
    """
    similar = [item for item in tried if _is_similar(item, last)]
    stacks = []
    for at, side in enumerate(last.sides):
        found = [float(item.sides[at].predicted(item.design) - side.predicted(item.design)) for item in similar]
        deviation = 0.0 if side.law else float(np.average(found, weights=[item.achieved.units for item in similar]))
        stacks.append(replace(side.stack, budget=side.stack.budget - margin * side.standard_error - deviation))
    return tuple(stacks)


def _is_similar(first: VerifiedDesign, second: VerifiedDesign) -> bool:
    ratio, distance = _SIMILAR
    scales = np.abs(np.log(first.scales / second.scales)).max(initial=0.0)
    moved = np.abs(first.settings - second.settings) / (10 * first.space.setting_steps)
    return bool(scales <= np.log(ratio) and moved.max(initial=0.0) <= distance)


def kept_stacks(chosen: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float) -> tuple[Stack, ...]:
    """Return the models of a design whose budget is what is aimed at, or what the design itself takes of it.

    Parameters
    ----------
    chosen
        The design.
    tried
        All designs of its search, which tell how lucky its own sample was.
    margin
        How far inside each limit the aim is; 0 for the limits themselves [standard errors].
    """
    loads = [float(side.stack.load(chosen.scales, chosen.settings)) for side in chosen.sides]
    stacks = aimed(chosen, list(tried), margin)
    return tuple(replace(stack, budget=max(stack.budget, load)) for stack, load in zip(stacks, loads, strict=True))


def step_from(
    last: VerifiedDesign, tried: tuple[VerifiedDesign, ...], margin: float, reach: float
) -> Float[np.ndarray, " variable"]:
    """Return the cheapest design near a verified one that its models let keep the limits, made by the same processes.

    Parameters
    ----------
    last
        The verified design.
    tried
        Designs beside it that correct its models.
    margin
        How far inside each limit the aim is [standard errors].
    reach
        Factor by which a variable may change [-].
    """
    processes = last.space.process_positions(last.design)
    return Programs(last.space, len(last.sides)).step(
        aimed(last, [*tried, last], margin), processes, last.design, reach
    )


def step_to_optimum(verifier: Verifier, start: VerifiedDesign, steps: int, reach: float) -> tuple[VerifiedDesign, ...]:
    """Return the designs of a trust-region sequence; each is verified on fresh units before the next is made.

    Parameters
    ----------
    verifier
        Judges the designs and gives the convex models around each.
    start
        A verified design to start from.
    steps
        Largest number of verified designs, but for up to three that mend the last one [-].
    reach
        Factor by which a variable may change in the first step [-].

    Notes
    -----
    Where fresh units are further from the prediction than chance explains, the next step reaches less.
    """
    space, tried = verifier.space, [start]
    programs, processes = Programs(space, len(start.sides)), space.process_positions(start.design)
    for step in range(steps + _REPAIRS):
        last = tried[-1]
        if step >= steps and not _is_worth_mending(tried):
            break
        stacks = aimed(last, tried)
        processes = programs.choose(stacks, processes)
        found = programs.step(stacks, processes, last.design, reach)
        settled = space.cost(found) > (1 - SETTLED) * last.cost if last.met else np.allclose(found, last.design)
        if step > 0 and settled:
            break
        tried.append(verifier.verify(found, f"convex {step + 1}"))
        if not _explains(last, tried[-1]):
            reach = max(1.25, float(np.sqrt(reach)))
    return tuple(tried[1:])


def _is_worth_mending(tried: list[VerifiedDesign]) -> bool:
    """Return whether the last design keeps not all limits and is cheaper than every one that does."""
    kept = [own.cost for own in tried if own.met]
    return not tried[-1].met and tried[-1].cost < (1 - SETTLED) * min(kept, default=np.inf)


def _explains(last: VerifiedDesign, new: VerifiedDesign) -> bool:
    """Return whether the models of a design predicted what fresh units said of the next one."""
    return all(
        abs(now.excess - before.predicted(new.design))
        <= _EXPLAINED * np.hypot(before.standard_error, now.standard_error)
        for before, now in zip(last.sides, new.sides, strict=True)
    )

"""Whether the drawing stays the same when costs, the model or processes are not what was assumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.cost.model import Weighted
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.zone_allocation import ZoneAllocation
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Solution
from tolalloc.allocation.verify.verification import VerifiedDesign, Verifier
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Model

COST_CHANGE = 0.2
"""Relative change of every cost, up or down, in the corners that are tried [-]."""
SAME = 0.1
"""Relative difference up to which two zones are called the same; neighbours of a ladder differ by a quarter [-]."""


@dataclass(frozen=True, kw_only=True)
class Variant:
    """The answer under one changed assumption."""

    name: str  # What was changed
    scales: Float[np.ndarray, " group"]  # Scale of every group [-]
    cost: float  # Its cost under the changed assumption, with the locked zones at their own [cost units]
    # What the undisturbed answer costs more than this one under the changed assumption, as a share of its cost; not a
    # number where the chosen design no longer keeps a requirement [-]
    regret: float
    kept: bool  # Whether the chosen design still keeps every requirement, judged by the change that the same units show


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """Answers under changed assumptions."""

    groups: tuple[str, ...]  # Names of the groups
    optimum: Float[np.ndarray, " group"]  # The undisturbed answer of the same local models [-]
    costs: tuple[Variant, ...]  # In random corners of the box in which every cost changes by `COST_CHANGE`
    # With what is uncertain in the model drawn from what is known of it; none where nothing is
    uncertain: tuple[Variant, ...]
    second_best: Variant | None  # With the second-best set of processes, none where there is no other

    @property
    def variants(self) -> tuple[Variant, ...]:
        """All of them."""
        return (*self.costs, *self.uncertain, *((self.second_best,) if self.second_best else ()))

    @property
    def ratios(self) -> Float[np.ndarray, "variant group"]:
        """Scale under the changed assumption over the undisturbed one [-]."""
        return np.array([variant.scales / self.optimum for variant in self.variants]).reshape(-1, len(self.groups))

    @property
    def same(self) -> Bool[np.ndarray, " group"]:
        """Which zones stay the same under all changes; none where nothing was changed, as that shows nothing."""
        return np.asarray((np.abs(np.log(self.ratios)) <= np.log(1 + SAME)).all(axis=0) & bool(self.variants))


def robustness(
    verifier: Verifier, allocation: ZoneAllocation, models: Sequence[Model], seeds: SeedTree, draws: int
) -> Robustness:
    """Return the answers under changed costs, models and processes.

    Parameters
    ----------
    verifier
        Judges the chosen design again with every changed model.
    allocation
        What was found.
    models
        The model with what is uncertain in it changed, such as its stiffnesses.
    seeds
        Node of the seed tree.
    draws
        Random corners of the costs [-].

    Notes
    -----
    Costs and processes are changed in the local models of the chosen design. What is lost is largest where every cost
    is wrong by all of its change, so corners are drawn and not what lies between them. A changed model takes local
    models around the same design. How far it moves what is compared with a limit is the difference between two
    models on the same units, added to what the verification of the chosen design found: the luck of a second sample,
    often smaller and so less able to show a yield, tells nothing of the change.
    """
    problem, optimum, locked = verifier.space.problem(allocation.stacks), allocation.inside, allocation.locked_cost
    corners = seeds.child("costs").generator().choice([1 - COST_CHANGE, 1 + COST_CHANGE], (draws, optimum.zones.size))
    return Robustness(
        groups=verifier.space.groups,
        optimum=optimum.zones,
        costs=tuple(
            _with_costs(problem, optimum, own, locked, f"corner {at} of the costs")
            for at, own in enumerate(corners, start=1)
        ),
        uncertain=_with_models(verifier, allocation, models),
        second_best=_second_best(problem, optimum, locked),
    )


def _with_costs(
    problem: AllocationProblem, optimum: Solution, factors: Float[np.ndarray, " group"], locked: float, name: str
) -> Variant:
    """Return the answer where every cost is multiplied by a factor of its own."""
    features = tuple(_priced(feature, float(factor)) for feature, factor in zip(problem.features, factors, strict=True))
    changed = replace(problem, features=features)
    found = process_choice.allocate(changed)
    cost, before = (changed.cost(own.zones, own.processes) + locked for own in (found, optimum))
    return Variant(name=name, scales=found.zones, cost=cost, regret=before / cost - 1, kept=True)


def _priced(feature: PricedFeature, factor: float) -> PricedFeature:
    processes = tuple(
        replace(made, cost=Weighted(model=made.cost, weight=factor), change=factor * made.change)
        for made in feature.processes
    )
    return replace(feature, processes=processes)


def _with_models(verifier: Verifier, allocation: ZoneAllocation, models: Sequence[Model]) -> tuple[Variant, ...]:
    """Return the answers of changed models."""
    if not models:
        return ()
    name = verifier.model.uncertain[0].name.split(" (")[0]
    undisturbed = verifier.verify(allocation.chosen.design, "robustness")
    return tuple(
        _with_model(replace(verifier, model=model), allocation, undisturbed, f"{name} {at}")
        for at, model in enumerate(models, start=1)
    )


def _with_model(verifier: Verifier, allocation: ZoneAllocation, undisturbed: VerifiedDesign, name: str) -> Variant:
    """Return the answer of a changed model."""
    chosen, optimum, stacks = allocation.chosen, allocation.inside, []
    judged = verifier.verify(chosen.design, undisturbed.name)  # of the same name, so on the same units
    rises = [
        float(now.predicted(chosen.design) - before.predicted(chosen.design))
        for now, before in zip(judged.constraints, undisturbed.constraints, strict=True)
    ]
    for constraint, aimed, rise in zip(judged.constraints, allocation.stacks, rises, strict=True):
        loads = [float(stack.load(chosen.scales, chosen.settings)) for stack in (constraint.stack, aimed)]
        stacks.append(replace(constraint.stack, budget=loads[0] - (loads[1] - aimed.budget) - rise))
    problem = verifier.space.problem(tuple(stacks))
    found = process_choice.allocate(problem)
    cost = problem.cost(found.zones, found.processes) + allocation.locked_cost
    before = optimum.cost + allocation.locked_cost
    kept = all(constraint.excess + rise <= 0 for constraint, rise in zip(chosen.constraints, rises, strict=True))
    kept = kept and all(
        np.isfinite(constraint.value) for constraint in judged.constraints
    )  # or so many units fail that none shows it
    return Variant(name=name, scales=found.zones, cost=cost, regret=before / cost - 1 if kept else np.nan, kept=kept)


def _second_best(problem: AllocationProblem, optimum: Solution, locked: float) -> Variant | None:
    """Return the answer made by the second-best set of processes, none if there is no other."""
    if all(len(feature.processes) == 1 for feature in problem.features):
        return None
    found = process_choice.second_best(problem, optimum)
    if found is None:
        return None
    changed = [
        f"{feature.name} by {feature.processes[now].name}"
        for feature, now, before in zip(problem.features, found.processes, optimum.processes, strict=True)
        if now != before
    ]
    return Variant(
        name=f"second-best processes: {', '.join(changed)}",
        scales=found.zones,
        cost=found.cost + locked,
        regret=(optimum.cost + locked) / (found.cost + locked) - 1,
        kept=True,
    )

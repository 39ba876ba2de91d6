"""A tolerance stack whose exact front of cost against spread has a closed form, as a problem for the Pareto search."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from tolalloc.allocation.cost.model import Process, Reciprocal
from tolalloc.allocation.front.pareto_problem import Genes, Objective, Objectives
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack

LOWER, UPPER = 0.2, 5.0


@dataclass(frozen=True)
class StackProblem:
    """Genes are logarithms of the zones; features on a ladder have its positions instead."""

    allocation: AllocationProblem
    ladder: np.ndarray
    on_ladder: int = 0
    budget: float = np.inf

    objectives = (Objective(name="cost [cost units]"), Objective(name="spread [arcsec]"))

    @property
    def constraints(self):
        return () if np.isinf(self.budget) else ("budget",)

    @cached_property
    def genes(self):
        count = len(self.allocation.features)
        integer = np.arange(count) < self.on_ladder
        return Genes(
            names=tuple(feature.name for feature in self.allocation.features),
            lower=np.where(integer, 0.0, np.log(LOWER)),
            upper=np.where(integer, self.ladder.size - 1.0, np.log(UPPER)),
            integer=integer,
        )

    def zones(self, designs):
        on_ladder = self.ladder[designs[:, : self.on_ladder].astype(int)]
        return np.concatenate([on_ladder, np.exp(designs[:, self.on_ladder :])], axis=1)

    def __call__(self, designs):
        zones = self.zones(designs)
        costs = [feature.processes[0].total(zones[:, at]) for at, feature in enumerate(self.allocation.features)]
        load = self.allocation.stacks[0].load(zones, np.empty((len(zones), 0)))
        violation = np.empty((len(zones), 0)) if np.isinf(self.budget) else (load / self.budget - 1)[:, np.newaxis]
        return Objectives(
            values=np.column_stack([np.sum(costs, axis=0), load]),
            violation=violation,
            status=np.zeros(len(zones), np.uint8),
        )

    @cached_property
    def factors(self):
        return np.array([feature.processes[0].cost.factor for feature in self.allocation.features])

    @cached_property
    def weights(self):
        return self.allocation.stacks[0].root_sum_square

    def _at_price(self, price):
        """Zones that minimise Σ b/t + price·Σ w²t²/2 between the bounds, feature by feature."""
        return np.clip((self.factors / (price * self.weights**2)) ** (1 / 3), LOWER, UPPER)

    def _price(self, budget):
        def excess(logarithm):
            return np.linalg.norm(self.weights * self._at_price(np.exp(logarithm))) - budget

        return np.exp(brentq(excess, -30, 30, xtol=1e-13, rtol=1e-15))

    def optimum(self, budget):
        """Zones of least cost whose spread is the budget."""
        return self._at_price(self._price(budget))

    def cost_bound(self, budget):
        """The dual function at the optimal price: no zones between the bounds that keep the budget cost less."""
        price = self._price(budget)
        zones = self._at_price(price)
        return np.sum(self.factors / zones + price * (self.weights * zones) ** 2 / 2) - price * budget**2 / 2


def stack_problem(features=12, seed=5, **options) -> StackProblem:
    generator = np.random.default_rng(seed)
    made = tuple(
        PricedFeature(
            name=f"feature {at}",
            processes=(Process(name="any", cost=Reciprocal(factor=float(factor)), minimum=LOWER, maximum=UPPER),),
        )
        for at, factor in enumerate(generator.uniform(0.5, 8, features))
    )
    stack = Stack(
        name="spread", worst_case=np.zeros(features), root_sum_square=generator.uniform(1, 20, features), budget=np.inf
    )
    options = {"ladder": np.array([0.5, 0.8, 1.25, 2.0]), **options}
    return StackProblem(AllocationProblem(features=made, stacks=(stack,)), **options)

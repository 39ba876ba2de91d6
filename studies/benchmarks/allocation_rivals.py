"""What else finds zones: pymoo's NSGA-II and CMA-ES on the same model, and the units on which all designs are compared.

A design is compared by its largest excess over all limits on fresh units, which are the same for all designs of a
study: the limits are the same, and so is the luck.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.termination import NoTermination

from tolalloc.allocation.search.discrete import group_options, with_shared_zones
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.requirement import Sampled
from tolalloc.capability.near_limit import SolvedUnits
from tolalloc.drawings.seeds import SeedTree
from tolalloc.study.prepared import Prepared

SEARCH_UNITS = 512
"""Common random units of a rival's search [-]."""
_PENALTY = 20.0
"""Costs of the table that CMA-ES pays for an excess as large as the limit [-]."""
_EVEN_ODDS = 0.5
SETTLED = 2e-4
"""How far inside its limits a design may lie that is said to just keep them, relative to the limit [-]."""
_STEPS = 7
"""Largest number of common scales that are tried until a design just keeps its limits [-]."""
_FIRST_STEP, _LARGEST_STEP = 0.05, 0.4
"""Change of the logarithm of the scale [-]."""


@dataclass(frozen=True, kw_only=True)
class Compared:
    """How far designs lie beyond the limits, all on the same units."""

    prepared: Prepared
    seeds: SeedTree
    units: int

    @cached_property
    def _standard(self) -> Float[np.ndarray, "unit column"]:
        errors = self.prepared.errors
        uniform = np.concatenate([*self.seeds.uniform_chunks(self.units, len(errors.columns))])
        return np.asarray(errors.standard_values(uniform))

    def excess(self, space: DesignSpace, design: Float[np.ndarray, " variable"]) -> float:
        """Return the largest excess of a design over its limits, each relative to the limit [-]."""
        requirements, errors = self.prepared.requirements, self.prepared.errors
        outputs = tuple(dict.fromkeys(own.output for own in requirements))
        response = self.prepared.model.at(space.settings_of(design)).reading(outputs)
        found = response(errors.deviations(self._standard, space.zones(design)))
        values, excess = np.where(found.good[:, np.newaxis], found.values, np.nan), -np.inf
        units = SolvedUnits.all_of(self.units)
        for own in requirements:
            if not isinstance(own.guarantee, Sampled):
                raise TypeError(f"{own.output}: units do not show {own.guarantee.words}")
            of_output = values[:, outputs.index(own.output)]
            sample = LimitedSample(values=of_output, units=units, limits=own.limits)
            for level in own.guarantee.bounds(sample, _EVEN_ODDS):
                excess = max(excess, level.excess / abs(level.limit))
        return float(excess)

    def settled(
        self, space: DesignSpace, design: Float[np.ndarray, " variable"], bounded: bool = True
    ) -> tuple[Float[np.ndarray, " variable"], float]:
        """Return the design with all free zones scaled alike until these units just keep the limits, and its excess.

        Parameters
        ----------
        bounded
            Whether the zones stay between what they may be; those of proportional scaling need not.
        """
        groups = len(space.groups)
        low = space.lower[:groups] if bounded else 0.0
        high = space.upper[:groups] if bounded else np.inf

        def scaled(factor: float) -> Float[np.ndarray, " variable"]:
            return np.concatenate([np.clip(factor * design[:groups], low, high), design[groups:]])

        known = list[tuple[float, float]]()  # logarithms of factors and their excesses
        at = 0.0
        for _ in range(_STEPS):
            known.append((at, self.excess(space, scaled(np.exp(at)))))
            if -SETTLED < known[-1][1] <= 0:
                break
            at = _next(known)
        inside = [own for own in known if own[1] <= 0]
        at, excess = max(inside) if inside else min(known, key=lambda own: own[1])
        return scaled(np.exp(at)), excess


def _next(known: list[tuple[float, float]]) -> float:
    """Return where the excess, which grows with the factor, should lie just inside the limits: a guarded secant."""
    low = max((own for own in known if own[1] <= 0), default=None)
    high = min((own for own in known if own[1] > 0), default=None)
    nearest = sorted(known, key=lambda own: abs(own[1]))[:2]
    (first, its), (second, other) = nearest if len(nearest) == 2 else (nearest[0], nearest[0])
    if its == other:
        found = first - _FIRST_STEP * np.sign(its)
    else:
        found = first - (its + SETTLED / 2) * (second - first) / (other - its)
    if low and high:
        return found if low[0] < found < high[0] else (low[0] + high[0]) / 2
    return float(np.clip(found, first - _LARGEST_STEP, first + _LARGEST_STEP))


@dataclass(frozen=True, kw_only=True)
class Rival:
    """A plain search over all zones and settings: one cost, one largest excess on common random units.

    On ladders every gene is the position of a step; the settings stay continuous, which is to the rival's advantage.
    """

    compared: Compared  # Common random units of the search
    graded: bool
    calls: int  # Largest number of units that it may solve [-]
    seconds: float  # Processor time after which it ends [s]
    asked: list[tuple[float, float, Float[np.ndarray, " variable"]]] = field(default_factory=list)

    @cached_property
    def space(self) -> DesignSpace:
        """The design variables, groups sharing one zone on ladders."""
        own = self.compared.prepared.space
        return with_shared_zones(own) if self.graded else own

    @cached_property
    def _ladders(self) -> tuple[Float[np.ndarray, " step"], ...]:
        return tuple(np.unique([option.zone for option in options]) for options in group_options(self.space))

    @cached_property
    def bounds(self) -> tuple[Float[np.ndarray, " gene"], Float[np.ndarray, " gene"]]:
        """Smallest and largest genes: logarithms of scales, or positions on ladders; then the settings."""
        space, groups = self.space, len(self.space.groups)
        if self.graded:
            low, high = np.full(groups, -0.49), np.array([own.size - 0.51 for own in self._ladders])
        else:
            low, high = np.log(space.lower[:groups]), np.log(space.upper[:groups])
        return np.append(low, space.shared.lower), np.append(high, space.shared.upper)

    def design(self, genes: Float[np.ndarray, " gene"]) -> Float[np.ndarray, " variable"]:
        """Return the design of genes."""
        groups = len(self.space.groups)
        own, low, high = genes[:groups], *(end[:groups] for end in self.bounds)
        own = np.clip(own, low, high)
        if self.graded:
            scales = [ladder[round(float(at))] for ladder, at in zip(self._ladders, own, strict=True)]
        else:
            scales = list(np.exp(own))
        return np.array([*scales, *np.clip(genes[groups:], self.space.shared.lower, self.space.shared.upper)])

    @cached_property
    def first(self) -> Float[np.ndarray, " gene"]:
        """Genes of the table as it is, or the nearest steps."""
        settings = [own.value for own in self.space.settings]
        low, high = self.bounds
        if self.graded:
            scales = [float(np.abs(np.log(ladder)).argmin()) for ladder in self._ladders]
        else:
            scales = [0.0] * len(self.space.groups)
        return np.asarray(np.clip([*scales, *settings], low, high))

    def evaluate(self, genes: Float[np.ndarray, " gene"]) -> tuple[float, float]:
        """Return cost and excess of a design, and remember both."""
        design = self.design(genes)
        cost, excess = float(self.space.cost(design)), self.compared.excess(self.space, design)
        self.asked.append((cost, excess, design))
        return cost, excess

    def search(self, algorithm: str, seed: int) -> list[tuple[float, float, Float[np.ndarray, " variable"]]]:
        """Return all designs that the algorithm asked for: cost, excess on its units, design."""
        self.asked.clear()
        is_genetic, stop = algorithm == "NSGA-II", time.process_time() + self.seconds
        problem = _Problem(self, penalty=0.0 if is_genetic else _PENALTY * self._scale)
        solver = self._nsga2(seed) if is_genetic else _SeededCMAES(x0=self.first, sigma=0.15, restarts=9)
        solver.setup(problem, termination=NoTermination(), seed=seed, verbose=False)
        size = self.compared.units
        while solver.has_next() and time.process_time() < stop and (len(self.asked) + 1) * size <= self.calls:
            solver.next()
        return self.asked

    @property
    def _scale(self) -> float:
        return float(self.space.cost(self.space.uniform(1.0)))

    def _nsga2(self, seed: int) -> NSGA2:
        low, high = self.bounds
        random, size = np.random.default_rng(seed), 24
        spread = self.first + 0.25 * (high - low) * random.standard_normal((size - 1, low.size))
        return NSGA2(pop_size=size, sampling=np.vstack([self.first, np.clip(spread, low, high)]))


class _Problem(ElementwiseProblem):  # type: ignore[misc]
    """The rival's design as pymoo sees it; an excess is a constraint, or costs a penalty where one is given."""

    def __init__(self, rival: Rival, penalty: float) -> None:
        self.rival, self.penalty = rival, penalty
        low, high = rival.bounds
        super().__init__(n_var=low.size, n_obj=1, n_ieq_constr=0 if penalty else 1, xl=low, xu=high)

    def _evaluate(self, x: Float[np.ndarray, " gene"], out: dict[str, object], *_: object, **__: object) -> None:
        cost, excess = self.rival.evaluate(x)
        out["F"] = [cost + self.penalty * max(excess, 0.0)]
        if not self.penalty:
            out["G"] = [excess]


class _SeededCMAES(CMAES):  # type: ignore[misc]
    """CMA-ES on pymoo's generator; left alone it takes NumPy's global one."""

    def _setup(self, problem: ElementwiseProblem, **kwargs: object) -> None:
        super()._setup(problem, **kwargs)
        self.options |= {"seed": np.nan, "randn": lambda *shape: self.random_state.standard_normal(shape)}

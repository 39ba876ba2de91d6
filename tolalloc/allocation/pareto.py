"""The Pareto front of cost against the quantile, by NSGA-II over zones and modification together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from scipy.stats import qmc

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.quantile import LocalQuantile, QuantileResponse
from tolalloc.response.interface import Response
from tolalloc.surrogate.regression import Surrogate, fit_surrogate, gaussian_process
from tolalloc.uncertainty.seeds import SeedTree


@dataclass(frozen=True, kw_only=True)
class Front:
    """Designs of which none is better in both cost and quantile, cheapest last.

    Parameters
    ----------
    designs
        Scales [-] and clearances [µm].
    cost
        Cost [cost units].
    quantile
        Quantile of the peak-to-peak that the search was told [arcsec].
    on_kernel
        The same on the real kernel where it was run, NaN elsewhere [arcsec].
    """

    designs: Float[np.ndarray, "design variable"]
    cost: Float[np.ndarray, " design"]
    quantile: Float[np.ndarray, " design"]
    on_kernel: Float[np.ndarray, " design"]

    @property
    def rms_error(self) -> float:
        """Root-mean-square difference between what the search was told and the kernel, along the front [arcsec]."""
        return float(np.sqrt(np.nanmean((self.quantile - self.on_kernel) ** 2)))


class _Allocation(Problem):  # type: ignore[misc]
    """Genes are the logarithms of the scales, and the clearances."""

    def __init__(self, space: DesignSpace, response: Response) -> None:
        self.space, self.response = space, response
        super().__init__(n_var=len(space.columns), n_obj=2, xl=to_genes(space.lower), xu=to_genes(space.upper))

    def _evaluate(
        self, x: Float[np.ndarray, "design variable"], out: dict[str, object], *_: object, **__: object
    ) -> None:
        designs = from_genes(x)
        evaluation = self.response(designs)
        # A failed design must lose against every good one; NaN would break the sorting.
        quantile = np.where(evaluation.good, evaluation.values[:, 0], 1e6)
        out["F"] = np.column_stack([self.space.cost(designs), quantile])


def to_genes(designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs variable"]:
    """Return the genes of designs."""
    return np.concatenate([np.log(designs[..., :-2]), designs[..., -2:]], axis=-1)


def from_genes(genes: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs variable"]:
    """Return the designs of genes."""
    return np.concatenate([np.exp(genes[..., :-2]), genes[..., -2:]], axis=-1)


@dataclass(frozen=True, kw_only=True)
class FrontEffort:
    """How much the search for the front may spend.

    Parameters
    ----------
    population, generations
        Size of the NSGA-II search on the surrogate [-].
    population_on_kernel, generations_on_kernel
        The same where the surrogate does not earn its place and the kernel itself runs [-].
    designs
        Designs around the chosen one that the first surrogate learns from [-].
    rounds
        Searches, each followed by kernel runs along its front that improve the next surrogate [-].
    points
        Kernel runs along the front after each search [-].
    """

    population: int = 80
    generations: int = 100
    population_on_kernel: int = 20
    generations_on_kernel: int = 3
    designs: int = 36
    rounds: int = 2
    points: int = 12


def _search(
    space: DesignSpace,
    response: Response,
    known: Float[np.ndarray, "design variable"],
    seeds: SeedTree,
    population: int,
    generations: int,
) -> Front:
    """Return the front that one NSGA-II run finds, started from known designs and a space-filling rest."""
    lower, upper = to_genes(space.lower), to_genes(space.upper)
    first = np.clip(to_genes(known), lower, upper)[:population]
    fill = qmc.LatinHypercube(lower.size, rng=seeds.child("fill").generator()).random(population - len(first))
    result = minimize(
        _Allocation(space, response),
        NSGA2(pop_size=population, sampling=np.concatenate([first, lower + fill * (upper - lower)])),
        ("n_gen", generations),
        seed=seeds.child("nsga2").integer(),
        save_history=False,
        verbose=False,
    )
    order = np.argsort(result.F[:, 1])
    return Front(
        designs=from_genes(result.X)[order],
        cost=result.F[order, 0],
        quantile=result.F[order, 1],
        on_kernel=np.full(order.size, np.nan),
    )


def pareto_front(
    response: QuantileResponse,
    baseline: LocalQuantile,
    designs: Float[np.ndarray, "design variable"],
    convex_front: Float[np.ndarray, "design variable"],
    seeds: SeedTree,
    effort: FrontEffort,
) -> tuple[Front, Surrogate]:
    """Return the front and the surrogate it was found on, improved by kernel runs along the front.

    Parameters
    ----------
    response
        Quantile of a design on the real kernel.
    baseline
        Convex model of the quantile, which the surrogate corrects.
    designs
        First designs to run on the kernel.
    convex_front
        Designs of the convex program, run on the kernel too and part of every first population.
    seeds
        Node of the seed tree.
    effort
        How much may be spent.
    """
    designs = np.concatenate([designs, convex_front])
    evaluation = response(designs)
    designs, quantiles = designs[evaluation.good], evaluation.values[evaluation.good, 0]
    for number in range(effort.rounds):
        own = seeds.child(str(number))
        shuffled = own.child("surrogate").generator().permutation(quantiles.size)
        surrogate = fit_surrogate(
            gaussian_process(len(response.columns)),
            response.columns,
            response.outputs[0],
            designs[shuffled],
            quantiles[shuffled],
            held_out=quantiles.size // 5,
            baseline=lambda x: np.maximum(baseline(x), 1.0),
        )
        trusted = surrogate.earns_its_place
        front = _search(
            response.space,
            surrogate if trusted else response,
            convex_front,
            own,
            effort.population if trusted else effort.population_on_kernel,
            effort.generations if trusted else effort.generations_on_kernel,
        )
        picked = np.unique(np.linspace(0, front.cost.size - 1, min(effort.points, front.cost.size)).astype(int))
        evaluation = response(front.designs[picked])
        front.on_kernel[picked] = np.where(evaluation.good, evaluation.values[:, 0], np.nan)
        designs = np.concatenate([designs, front.designs[picked][evaluation.good]])
        quantiles = np.concatenate([quantiles, evaluation.values[evaluation.good, 0]])
    return front, surrogate

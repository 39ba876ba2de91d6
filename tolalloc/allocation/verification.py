"""A design counts only after fresh units on the real kernel have judged it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.design_space import DesignSpace
from tolalloc.allocation.quantile import LocalQuantile, local_quantile
from tolalloc.capability.monte_carlo import LARGEST_FAILED_SHARE, MonteCarlo, Yield, require_few_failures
from tolalloc.response.kernel import KernelResponse, WithDerivatives
from tolalloc.uncertainty.seeds import SeedTree
from tolalloc.units import MICROMETRE


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """Upper limit on the peak-to-peak transmission error and the share of units that must keep it.

    Parameters
    ----------
    limit
        Largest peak-to-peak allowed, output side, one turn [arcsec].
    target
        Yield asked for [-].
    """

    limit: float
    target: float


@dataclass(frozen=True, kw_only=True)
class VerifiedDesign:
    """A design with the fresh Monte Carlo run that judged it.

    Parameters
    ----------
    name
        Which search made it, and its number there.
    design
        Scales [-] and clearances [µm].
    cost
        Cost [cost units].
    sample
        The fresh units on the real kernel.
    achieved
        Yield within the limit.
    met
        Whether the one-sided 95 % lower bound of the yield reaches the target.
    quantile_bound
        Smallest limit that the sample shows to be kept at the target yield with that confidence [arcsec].
    by_zone
        Change of the quantile with the zone of each active source [arcsec/m].
    local
        Convex model of the quantile bound around this design.
    """

    name: str
    design: Float[np.ndarray, " variable"]
    cost: float
    sample: MonteCarlo
    achieved: Yield
    met: bool
    quantile_bound: float
    by_zone: Float[np.ndarray, " source"]
    local: LocalQuantile

    @property
    def spread(self) -> float:
        """Distance of the quantile bound from the mean of the sample over its standard deviation [-]."""
        values = self.sample.values
        return float((self.quantile_bound - values.mean()) / values.std(ddof=1))


@dataclass(frozen=True, kw_only=True)
class Verifier:
    """Judges designs on fresh units.

    Parameters
    ----------
    space
        The design variables.
    kernel
        The real kernel.
    requirement
        Limit and target yield.
    seeds
        Node of the seed tree; every verification takes its own child.
    units
        Units per verification [-].
    largest_failed_share
        Share of them that may fail [-].
    """

    space: DesignSpace
    kernel: KernelResponse
    requirement: Requirement
    seeds: SeedTree
    units: int
    largest_failed_share: float = LARGEST_FAILED_SHARE

    def verify(self, design: Float[np.ndarray, " variable"], name: str) -> VerifiedDesign:
        """Return the design judged by fresh units of its own.

        Raises
        ------
        SolveError
            More units failed.
        """
        errors, zones = self.space.errors, self.space.zones(design)
        uniform = np.concatenate(list(self.seeds.child(name).uniform_chunks(self.units, len(errors.columns))))
        standard = errors.standard_values(uniform)
        response = self.kernel.with_modification(self.space.modification(design))
        x = errors.deviations(standard, zones)
        answers = response.with_derivatives(x)
        sample = MonteCarlo(x=x, evaluation=answers.evaluation)
        require_few_failures(sample, name, self.largest_failed_share)
        bound = sample.quantile_bound(self.requirement.target)
        by_zone, by_clearance = self._gradient(standard, answers, min(bound, float(sample.values.max())))
        by_scale = np.bincount(
            self.space.group_of_source + 1,
            weights=by_zone * errors.zones,
            minlength=len(self.space.groups) + 1,
        )[1:]
        achieved = sample.within(self.requirement.limit)
        return VerifiedDesign(
            name=name,
            design=design,
            cost=float(self.space.cost(design)),
            sample=sample,
            achieved=achieved,
            met=achieved.bound >= self.requirement.target,
            quantile_bound=bound,
            by_zone=by_zone,
            local=local_quantile(design, bound, np.concatenate([by_scale, by_clearance])),
        )

    def _gradient(
        self, standard: Float[np.ndarray, "unit column"], answers: WithDerivatives, quantile: float
    ) -> tuple[Float[np.ndarray, " source"], Float[np.ndarray, " 2"]]:
        """Return ∂quantile by the zones [arcsec/m] and by the clearances [arcsec/µm].

        The quantile is mean + spread·σ of the sample, so its derivative is mean(D) + spread·cov(Y, D)/σ with D the
        exact derivative of each unit's peak-to-peak; theory page, equation (24).
        """
        good = answers.evaluation.good
        values = answers.evaluation.values[good, 0]
        names = self.space.errors.source_of_column
        starts = [names.index(source.name) for source in self.space.errors.active]
        by_zone = np.add.reduceat(answers.by_column[good] * standard[good], starts, axis=1)
        by_clearance = answers.by_modification[good] @ self.space.modification_by_clearance * MICROMETRE
        derivative = np.concatenate([by_zone, by_clearance], axis=1)
        mean, deviation = values.mean(), values.std()
        weights = (1.0 + (quantile - mean) / deviation * (values - mean) / deviation) / values.size
        gradient = weights @ derivative
        return gradient[:-2], gradient[-2:]


def answer(tried: tuple[VerifiedDesign, ...]) -> VerifiedDesign:
    """Return the cheapest met design, or the least violating one where none is met."""
    met = [design for design in tried if design.met]
    return min(met, key=lambda design: design.cost) if met else min(tried, key=lambda design: design.quantile_bound)

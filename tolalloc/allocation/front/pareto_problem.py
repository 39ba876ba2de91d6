"""What is searched for a Pareto front, and what was found: genes in, objectives and constraints out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.problem import OneSidedConstraint
from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.models.model import Response


@dataclass(frozen=True, kw_only=True)
class Genes:
    """What the search may change."""

    names: tuple[str, ...]  # Names of the genes
    # Their bounds [unit of the gene]
    lower: Float[np.ndarray, " gene"]
    upper: Float[np.ndarray, " gene"]
    integer: Bool[np.ndarray, " gene"]  # Which genes are positions on a ladder of choices, counted from 0 [-]

    def __post_init__(self) -> None:
        for name, lower, upper in zip(self.names, self.lower, self.upper, strict=True):
            if not -np.inf < lower <= upper < np.inf:
                raise InputError.at(
                    "genes", f"range of {name}", (float(lower), float(upper)), "two finite numbers, the smaller first"
                )

    def rounded(self, designs: Float[np.ndarray, "design gene"]) -> Float[np.ndarray, "design gene"]:
        """Return the nearest designs inside the bounds whose integer genes are whole numbers."""
        rounded = np.where(self.integer, np.rint(designs), designs)
        return np.asarray(np.clip(rounded, self.lower, self.upper) + 0.0)  # which makes −0 a 0, with its bits


@dataclass(frozen=True, kw_only=True)
class Objective:
    """One thing to be made small or large."""

    name: str  # Its name with its unit
    better: Literal["small", "large"] = "small"  # Which end is the good one

    @property
    def sign(self) -> float:
        """What makes small good when the objective is multiplied by it [-]."""
        return 1.0 if self.better == "small" else -1.0


@dataclass(frozen=True, kw_only=True)
class Objectives:
    """Answers of a problem."""

    values: Float[np.ndarray, "design objective"]  # Objectives [as their names state]
    # By how much each constraint is violated, as a share of what it allows; 0 or below is kept [-]
    violation: Float[np.ndarray, "design constraint"]
    # 0 for a good design; anything else is a failed one, whose numbers must not be used [-]
    status: UInt8[np.ndarray, " design"]

    @property
    def good(self) -> Bool[np.ndarray, " design"]:
        """Which designs may be used."""
        finite = np.isfinite(self.values).all(axis=1) & np.isfinite(self.violation).all(axis=1)
        return np.asarray((self.status == 0) & finite)

    @property
    def total_violation(self) -> Float[np.ndarray, " design"]:
        """Sum of all violations, infinite for a failed design, which so loses against every good one [-]."""
        return np.asarray(np.where(self.good, np.maximum(self.violation, 0.0).sum(axis=1), np.inf))

    @property
    def kept(self) -> Bool[np.ndarray, " design"]:
        """Which designs keep every constraint."""
        return np.asarray(self.total_violation <= 0)


@runtime_checkable
class ParetoProblem(Protocol):
    """Anything that maps designs to objectives and constraint violations, many designs at once."""

    @property
    def genes(self) -> Genes:
        """What the search may change."""
        ...

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """What is traded off, two objectives or more."""
        ...

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints, possibly none."""
        ...

    def __call__(self, designs: Float[np.ndarray, "design gene"]) -> Objectives:
        """Return the objectives of every design."""
        ...


COST = Objective(name="cost [cost units]")

Ladders = Mapping[str, Float[np.ndarray, " position"]]
"""Group → the scales that it may have, rising [-]."""


def to_genes(designs: Float[np.ndarray, "*designs variable"], groups: int) -> Float[np.ndarray, "*designs variable"]:
    """Return designs with the logarithms of their scales, of which there are as many as groups.

    gene = ln(scale) for scales above 0, so that equal steps are equal ratios (own derivation).

    Examples
    --------
    >>> to_genes(np.array([np.e, 5.0]), 1).tolist()
    [1.0, 5.0]
    """
    return np.concatenate([np.log(designs[..., :groups]), designs[..., groups:]], axis=-1)


def from_genes(genes: Float[np.ndarray, "*designs variable"], groups: int) -> Float[np.ndarray, "*designs variable"]:
    """Return the designs whose scales have these logarithms.

    scale = exp(gene), the inverse of `to_genes` (own derivation).

    Examples
    --------
    >>> from_genes(np.array([0.0, 5.0]), 1).tolist()
    [1.0, 5.0]
    """
    return np.concatenate([np.exp(genes[..., :groups]), genes[..., groups:]], axis=-1)


@dataclass(frozen=True, kw_only=True)
class DesignProblem:
    """Cost against the quantile of the leading output, and whatever else is asked for."""

    space: DesignSpace  # The design variables
    quantile: Response  # Quantile of designs: the real kernel or what stands in for it
    # Group → the scales that it may have, rising; other groups have every scale within their bounds [-]
    ladders: Ladders = field(default_factory=dict)
    large: tuple[str, ...] = ()  # Settings that shall be large, further objectives
    others: tuple[OneSidedConstraint, ...] = ()  # Limits of other requirements, kept by their local models

    def __post_init__(self) -> None:
        for group, ladder in self.ladders.items():
            if group not in self.space.groups:
                raise UnknownNameError.among("ladders", "group", group, self.space.groups)
            at = self.space.groups.index(group)
            lower, upper = float(self.space.lower[at]), float(self.space.upper[at])
            if not (ladder.size and lower <= ladder[0] and ladder[-1] <= upper and np.all(np.diff(ladder) > 0)):
                raise InputError.at(
                    f"ladder of {group}", "scales", ladder.tolist(), f"rising numbers from {lower:.4g} to {upper:.4g}"
                )

    @cached_property
    def objectives(self) -> tuple[Objective, ...]:
        """What is traded off."""
        large = (Objective(name=setting, better="large") for setting in self.large)
        return (COST, Objective(name=self.quantile.outputs[0]), *large)

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the other limits."""
        return tuple(constraint.stack.name for constraint in self.others)

    @cached_property
    def genes(self) -> Genes:
        """Logarithms of scales or positions on ladders, and the settings."""
        groups = len(self.space.groups)
        lower, upper = to_genes(self.space.lower, groups), to_genes(self.space.upper, groups)
        names, integer = list(self.space.columns), np.zeros(lower.size, bool)
        for at, ladder in self._ladders:
            names[at] = f"position of {names[at]} on {ladder.tolist()}"
            integer[at], lower[at], upper[at] = True, 0.0, ladder.size - 1.0
        return Genes(names=tuple(names), lower=lower, upper=upper, integer=integer)

    @property
    def _ladders(self) -> list[tuple[int, Float[np.ndarray, " position"]]]:
        return [(self.space.groups.index(group), ladder) for group, ladder in self.ladders.items()]

    def genes_of(self, designs: Float[np.ndarray, "design variable"]) -> Float[np.ndarray, "design gene"]:
        """Return the genes of designs; on a ladder the nearest step counts."""
        genes = to_genes(designs, len(self.space.groups))
        for at, ladder in self._ladders:
            genes[:, at] = np.abs(genes[:, at, np.newaxis] - np.log(ladder)).argmin(axis=1)
        return self.genes.rounded(genes)

    def designs_of(self, genes: Float[np.ndarray, "design gene"]) -> Float[np.ndarray, "design variable"]:
        """Return the designs that have these genes."""
        genes = genes.copy()
        for at, ladder in self._ladders:
            genes[:, at] = np.log(ladder)[genes[:, at].astype(int)]
        return from_genes(genes, len(self.space.groups))

    def __call__(self, designs: Float[np.ndarray, "design gene"]) -> Objectives:
        """Return the objectives of every design."""
        designs = self.designs_of(designs)
        evaluation = self.quantile(designs)
        settings = [designs[:, self.space.columns.index(setting)] for setting in self.large]
        values = np.column_stack([self.space.cost(designs), evaluation.values[:, 0], *settings])
        violation = np.array([constraint.predicted(designs) / constraint.scale for constraint in self.others]).T
        return Objectives(values=values, violation=violation.reshape(len(designs), -1), status=evaluation.status)


def normalised(
    losses: Float[np.ndarray, "design objective"], front: Float[np.ndarray, "point objective"]
) -> Float[np.ndarray, "design objective"]:
    """Return losses where 0 is the best and 1 the worst value on a front, (loss − ideal)/(nadir − ideal) [-].

    As by Das 1999, Struct. Optim. 18, 107–115; an objective that is the same on the whole front is only shifted.

    >>> normalised(np.array([[2.0, 3.0]]), np.array([[1.0, 5.0], [3.0, 1.0]]))
    array([[0.5, 0.5]])
    """
    ideal, nadir = front.min(axis=0), front.max(axis=0)
    return np.asarray((losses - ideal) / np.where(nadir > ideal, nadir - ideal, 1.0))


def knee(losses: Float[np.ndarray, "design objective"]) -> int:
    """Return the position of the knee: the design farthest below the plane through the ends of the front.

    Parameters
    ----------
    losses
        Losses of a front.

    Notes
    -----
    The ends of a normalised front of two objectives are (0, 1) and (1, 0), so the distance grows as the sum of the
    objectives falls; with more of them the plane is that through the unit points. Unlike the bend angle it depends on
    the whole front, not on the noise and the spacing of three neighbours. A front that bends nowhere gives one of its
    ends.

    References
    ----------
    Das 1999, Struct. Optim. 18:107–115.

    Examples
    --------
    >>> knee(np.array([[0.0, 10.0], [1.0, 3.0], [4.0, 2.0], [9.0, 1.0]]))
    1
    """
    return int(np.argmin(normalised(losses, losses).sum(axis=1)))


def spread_over(count: int, number: int) -> list[int]:
    """Return at most so many positions among ``count``, evenly spread, the first and the last among them.

    Position k is ⌊k·(count − 1)/(number − 1)⌋ (own derivation).

    >>> spread_over(10, 4)
    [0, 3, 6, 9]
    """
    return [int(at) for at in np.unique(np.linspace(0, count - 1, min(number, count)).astype(int))]


@dataclass(frozen=True, kw_only=True)
class SearchedDesigns:
    """Designs with their answers."""

    problem: ParetoProblem  # What was searched
    designs: Float[np.ndarray, "design gene"]  # Genes [unit of the gene]
    answers: Objectives  # Objectives and violations

    @property
    def losses(self) -> Float[np.ndarray, "design objective"]:
        """Objectives with the sign that makes small good [as their names state]."""
        return np.asarray(self.answers.values * np.array([objective.sign for objective in self.problem.objectives]))

    @property
    def failed(self) -> int:
        """Designs that failed [-]."""
        return int(np.count_nonzero(~self.answers.good))

    @property
    def least_violating(self) -> int:
        """Position of the design whose violations sum up to the least; where every design failed, a `SolveError`."""
        at = int(np.argmin(self.answers.total_violation))
        if not self.answers.good[at]:
            raise SolveError(f"Pareto search: all of {len(self.designs)} designs failed.")
        return at

    def at(self, which: Int[np.ndarray, " kept"]) -> SearchedDesigns:
        """Return the designs at some positions."""
        answers = self.answers
        return SearchedDesigns(
            problem=self.problem,
            designs=self.designs[which],
            answers=Objectives(
                values=answers.values[which], violation=answers.violation[which], status=answers.status[which]
            ),
        )

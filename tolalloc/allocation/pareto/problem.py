"""What is searched for a Pareto front: genes in, objectives and constraints out, whatever computes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class Genes:
    """What the search may change.

    Parameters
    ----------
    names
        Names of the genes.
    lower, upper
        Their bounds [unit of the gene].
    integer
        Which genes are positions on a ladder of choices, counted from 0 [-].

    Raises
    ------
    InputError
        Bounds that contradict each other.
    """

    names: tuple[str, ...]
    lower: Float[np.ndarray, " gene"]
    upper: Float[np.ndarray, " gene"]
    integer: Bool[np.ndarray, " gene"]

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
    """One thing to be made small or large.

    Parameters
    ----------
    name
        Its name with its unit.
    better
        Which end is the good one.
    """

    name: str
    better: Literal["small", "large"] = "small"

    @property
    def sign(self) -> float:
        """What makes small good when the objective is multiplied by it [-]."""
        return 1.0 if self.better == "small" else -1.0


@dataclass(frozen=True, kw_only=True)
class Objectives:
    """Answers of a problem.

    Parameters
    ----------
    values
        Objectives [as their names state].
    violation
        By how much each constraint is violated, as a share of what it allows; 0 or below is kept [-].
    status
        0 for a good design; anything else is a failed one, whose numbers must not be used [-].
    """

    values: Float[np.ndarray, "design objective"]
    violation: Float[np.ndarray, "design constraint"]
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

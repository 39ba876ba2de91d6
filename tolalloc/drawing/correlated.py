"""A source that no drawing limits: several columns that are jointly normal, common to all units of a reducer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri


@dataclass(frozen=True, kw_only=True, eq=False)
class CorrelatedSource:
    """Columns with mean zero and a covariance of their own; independent of every other source.

    Parameters
    ----------
    name
        What a report calls it.
    columns
        Names of the columns that it moves.
    covariance
        Covariance of the columns, singular or zero if need be [column²].
    """

    name: str
    columns: tuple[str, ...]
    covariance: Float[np.ndarray, "column column"]

    @cached_property
    def factor(self) -> Float[np.ndarray, "column column"]:
        """The symmetric root of the covariance; Cholesky's does not exist where columns are fully correlated."""
        values, vectors = np.linalg.eigh(self.covariance)
        return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return correlated columns for independent uniform numbers in (0, 1)."""
        return np.asarray(ndtri(uniform) @ self.factor.T)

    @property
    def mapping(self) -> str:
        """Sentence that says which distribution it has."""
        deviation = np.sqrt(np.diag(self.covariance))
        spread = ", ".join(f"{value:.2g} ({name})" for name, value in zip(self.columns, deviation, strict=True))
        return f"jointly normal, σ = {spread}; the same for all units of a reducer"

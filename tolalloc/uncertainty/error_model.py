"""The error model: all sources of a reducer together, and the random columns that they give."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from tolalloc.uncertainty.correlated import CorrelatedSource
from tolalloc.uncertainty.correlation import Correlation
from tolalloc.uncertainty.sources import Source

_BELOW_ONE = float(np.nextafter(1.0, 0.0))
"""Largest uniform number whose normal deviate is finite [-]."""


@dataclass(frozen=True)
class ErrorModel:
    """All sources of a reducer: each random column is its zone times a standard value.

    Parameters
    ----------
    sources
        The rows of the tolerance table.
    joint
        What varies besides and stands on no drawing, such as a stiffness that is not known; its columns come last and
        its zone is 1. Rankings take it; allocation, tolerance tables and hand estimates have none.
    correlation
        Correlations between the sources of the table; a joint source is independent of all others.

    Raises
    ------
    InputError, UnknownNameError
        Correlations that name no source or cannot hold together.
    """

    sources: tuple[Source, ...]
    joint: tuple[CorrelatedSource, ...] = ()
    correlation: Correlation = field(default_factory=Correlation)

    def __post_init__(self) -> None:
        self.correlation.require_sound(self.sources)

    @cached_property
    def active(self) -> tuple[Source, ...]:
        """Sources with a zone above zero, the ones that vary."""
        return tuple(source for source in self.sources if source.zone > 0.0)

    @property
    def _varying(self) -> tuple[Source | CorrelatedSource, ...]:
        return (*self.active, *self.joint)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Columns of the active sources, then of the joint ones."""
        return tuple(column for source in self._varying for column in source.columns)

    @cached_property
    def still(self) -> dict[str, float]:
        """Columns of the sources with zone zero, which stay in the middle of it [m]."""
        return {
            column: source.middle / source.lever
            for source in self.sources
            if source.zone == 0.0
            for column in source.columns
        }

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of all spectra, ascending [-]."""
        return tuple(sorted({order for source in self.sources for order, _ in source.spectrum}))

    @cached_property
    def source_of_column(self) -> tuple[str, ...]:
        """Name of the source of each column."""
        return tuple(source.name for source in self._varying for _ in source.columns)

    @cached_property
    def blocks(self) -> tuple[tuple[str, ...], ...]:
        """Names of what varies, in sets that are independent of each other."""
        return (*self.correlation.blocks(self.sources), *((source.name,) for source in self.joint))

    @property
    def is_correlated(self) -> bool:
        """Whether some sources of the table depend on each other."""
        return any(len(block) > 1 for block in self.blocks)

    @cached_property
    def normal_correlation(self) -> Float[np.ndarray, "column column"]:
        """Correlation of the standard normal numbers behind the columns [-]."""
        matrix, where = np.eye(len(self.columns)), np.array(self.source_of_column)
        for pair in self.correlation.among(self.sources):
            one, other = np.flatnonzero(where == pair.one), np.flatnonzero(where == pair.other)
            matrix[one, other] = matrix[other, one] = pair.correlation
        return matrix

    @cached_property
    def _factor(self) -> Float[np.ndarray, "column column"]:
        """Symmetric root of the correlation; Cholesky's does not exist where columns are fully correlated [-]."""
        values, vectors = np.linalg.eigh(self.normal_correlation)
        return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)

    @cached_property
    def zones(self) -> Float[np.ndarray, " source"]:
        """Zones of the active sources [m], then 1 for every joint one [-]."""
        return np.array([*(source.zone for source in self.active), *(1.0 for _ in self.joint)])

    def standard_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return all deviations per unit of zone for independent uniform numbers in (0, 1)."""
        return self.marginal_values(self.dependent(uniform))

    def dependent(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return uniform numbers with the correlation of the sources from independent ones in (0, 1) [-]."""
        if not self.is_correlated:
            return uniform
        return np.asarray(np.clip(ndtr(ndtri(uniform) @ self._factor), np.finfo(float).tiny, _BELOW_ONE))

    def marginal_values(self, uniform: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample column"]:
        """Return all deviations per unit of zone for uniform numbers that already have their correlation."""
        parts, start = [], 0
        for source in self._varying:
            own = uniform[:, start : start + len(source.columns)]
            parts.append(source.standard_values(own))
            start += len(source.columns)
        return np.concatenate(parts, axis=1)

    def deviations(
        self, standard: Float[np.ndarray, "sample column"], zones: Float[np.ndarray, " source"]
    ) -> Float[np.ndarray, "sample column"]:
        """Return the columns [m, angles rad] that the standard values give at the zones [m]."""
        counts = [len(source.columns) for source in self._varying]
        middles = [*(source.middle / source.lever for source in self.active), *(0.0 for _ in self.joint)]
        middle = np.repeat(middles, counts)
        return np.asarray(standard * np.repeat(zones, counts) + middle)

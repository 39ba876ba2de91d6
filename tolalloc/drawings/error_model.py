"""The error model: all sources of a reducer together, and the random columns that they give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.compensators import Compensator, Standing
from tolalloc.drawings.correlation import CorrelatedSource, Correlation, symmetric_root
from tolalloc.drawings.distributions import ABOVE_ZERO, BELOW_ONE, ndtr, ndtri
from tolalloc.drawings.returned_table import TableFile
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.exceptions import InputError, UnknownNameError

Columns = Float[np.ndarray, "sample column"]
Zones = Float[np.ndarray, " source"]


@dataclass(frozen=True)
class ErrorModel:
    """All sources of a reducer: each random column is its zone times a standard value.

    Correlated ones by theory page equation (43), a Gaussian copula: each source keeps its own distribution. Vectors
    that are not normal have nearly the stated correlation on both axes.
    """

    sources: tuple[Source, ...]  # The rows of the tolerance table
    # What varies besides and stands on no drawing, such as a stiffness that is not known; its columns come last and its
    # zone is 1. Rankings take it; allocation, tolerance tables and hand estimates have none.
    joint: tuple[CorrelatedSource, ...] = ()
    # Correlations between the sources of the table; a joint source is independent of all others
    correlation: Correlation = field(default_factory=Correlation)
    # Table that the sources come from, as its user named it, for messages alone; empty where there is none
    table: str = field(default="", compare=False, repr=False)
    # What is chosen at assembly for the units that are drawn, of those that act
    compensators: tuple[Compensator, ...] = ()
    # What its user's table calls the columns, head → column, so that it is written again as it was
    called: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    # Where this table stands, if it is a user's, so that it can be returned with other zones
    file: TableFile | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        self.correlation.require_sound(self.sources)
        correlated = {name for pair in self.correlation.among(self.sources) for name in (pair.one, pair.other)}
        for own in self.compensators:
            for name in own.independent:
                if name in correlated:
                    raise InputError.at(own.called, "source", name, "one that is correlated with no other")

    def at_places(self, names: Sequence[str]) -> ErrorModel:
        """Return the model with, of a row for several like places, each of these names without a row of its own."""
        found: dict[str, tuple[Source, ...]] = {own.name: (own,) for own in self.sources}
        for row in (own for own in self.sources if own.is_of_places):
            place = f"tolerance table {self.table} ({row.own_id or row.name})"
            taken = {own.name for name, members in found.items() for own in members if name != row.name}
            if not (like := row.at_places(names)):
                raise UnknownNameError.among(place, "source", row.name, names)
            left = [own for own in like if own.name not in taken]
            if not left or row.places not in (0, len(left)):
                which = ", ".join(own.name for own in left) or "none"
                allowed = f"{len(left)}, as many as {row.name} means that have no other row: {which}"
                raise InputError.at(place, "places", row.places or "not stated", allowed)
            found[row.name] = tuple(replace(own, places=len(left)) for own in left)
        pairs = tuple(
            replace(pair, one=one.name, other=other.name)
            for pair in self.correlation.pairs
            for one in found[pair.one]
            for other in found[pair.other]
        )
        sources = tuple(own for members in found.values() for own in members)
        return replace(self, sources=sources, correlation=replace(self.correlation, pairs=pairs))

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
    def fixed(self) -> dict[str, float]:
        """Columns of the sources with zone zero, which stay where it is or at their systematic waves [m]."""
        return {
            column: float(middle)
            for source in self.sources
            if source.zone == 0.0
            for column, middle in zip(source.columns, source.middles, strict=True)
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
        tied = [pair for own in self.compensators for pair in own.tied]
        return (*self.correlation.blocks(self.sources, tied), *((source.name,) for source in self.joint))

    @property
    def block_of_column(self) -> tuple[str, ...]:
        """Name of the block of each column: its source, or correlated sources joined by " + "."""
        block_of = {name: " + ".join(block) for block in self.blocks for name in block}
        return tuple(block_of[name] for name in self.source_of_column)

    @property
    def dimension_of_column(self) -> tuple[str, ...]:
        """Name of the drawing dimension of each column: its group, or several joined by " + " where they correlate."""
        found = {name: name for block in self.blocks for name in block}
        found |= {source.name: source.dimension for source in self.active}
        for block in self.blocks:
            met = dict.fromkeys(found[name] for name in block)
            if len(met) > 1:
                found = {name: " + ".join(met) if own in met else own for name, own in found.items()}
        return tuple(found[name] for name in self.source_of_column)

    @property
    def is_correlated(self) -> bool:
        """Whether some sources of the table are correlated."""
        return bool(self._correlated_blocks)

    @cached_property
    def _correlated_blocks(self) -> tuple[tuple[int, ...], ...]:
        """Positions of the sources that are correlated with each other."""
        names, blocks = [source.name for source in self._varying], self.correlation.blocks(self.sources)
        return tuple(tuple(names.index(name) for name in block) for block in blocks if len(block) > 1)

    @cached_property
    def source_correlation(self) -> Float[np.ndarray, "source source"]:
        """Correlation of the standard normal numbers behind like columns of what varies [-]."""
        matrix = np.eye(len(self._varying))
        matrix[: len(self.active), : len(self.active)] = self.correlation.source_matrix(self.sources)
        return matrix

    @cached_property
    def normal_correlation(self) -> Float[np.ndarray, "column column"]:
        """Correlation of the standard normal numbers behind all columns [-]."""
        matrix, blocks = np.eye(len(self.columns)), self._correlated_blocks
        for one, other in ((one, other) for block in blocks for one in block for other in block):
            own = np.eye(len(self._varying[one].columns)) * self.source_correlation[one, other]
            matrix[self.columns_of_source[one], self.columns_of_source[other]] = own
        return matrix

    @cached_property
    def _factor(self) -> Float[np.ndarray, "source source"]:
        """Root of the correlation [-]."""
        return symmetric_root(self.source_correlation)

    @cached_property
    def columns_of_source(self) -> tuple[slice, ...]:
        """Where the columns of each source stand."""
        ends = np.cumsum([len(source.columns) for source in self._varying]).tolist()
        return tuple(slice(start, end) for start, end in zip([0, *ends], ends, strict=False))

    @cached_property
    def _known(self) -> dict[str, Standing]:
        """Where the columns of each source of the table stand, by its name."""
        return {own.name: Standing(own, at) for own, at in zip(self.active, self.columns_of_source, strict=False)}

    @cached_property
    def zones(self) -> Zones:
        """Zones of the active sources [m], then 1 for every joint one [-]."""
        return np.array([*(source.zone for source in self.active), *(1.0 for _ in self.joint)])

    def standard_values(self, uniform: Columns) -> Columns:
        """Return all deviations per unit of zone for independent uniform numbers in (0, 1)."""
        return self.marginal_values(self.dependent(uniform))

    def dependent(self, uniform: Columns) -> Columns:
        """Return uniform numbers as sources depend on each other, by correlation and then by mated classes [-]."""
        found = self.mixed(uniform, self._factor) if self._correlated_blocks or self.compensators else uniform
        for own in self.compensators:
            own.sorted(found, self._known)
        return found

    def mixed(
        self, uniform: Float[np.ndarray, "*sample column"], factor: Float[np.ndarray, "*#sample source source"]
    ) -> Float[np.ndarray, "*sample column"]:
        """Return independent uniform numbers in (0, 1) made dependent by F, with F·Fᵀ the `source_correlation` [-].

        A source that depends on no other keeps its numbers. The sums run source by source, so that no bit of a sample
        depends on how many samples stand beside it, as it would in a library's product of matrices.
        """
        mixed = uniform.copy()
        for block in self._correlated_blocks:
            normal = [ndtri(uniform[..., self.columns_of_source[source]]) for source in block]
            for source in block:
                own = np.zeros_like(normal[0])
                for other, numbers in zip(block, normal, strict=True):
                    own += factor[..., source, other, np.newaxis] * numbers
                mixed[..., self.columns_of_source[source]] = np.clip(ndtr(own), ABOVE_ZERO, BELOW_ONE)
        return mixed

    def marginal_values(self, uniform: Columns) -> Columns:
        """Return all deviations per unit of zone [-] for uniform numbers that already have their correlation [-]."""
        values = np.empty_like(uniform)
        for source, columns in zip(self._varying, self.columns_of_source, strict=True):
            values[:, columns] = source.standard_values(uniform[:, columns])
        return values

    def deviations(self, standard: Columns, zones: Zones) -> Columns:
        """Return the columns [m, angles rad] that the standard values give at the zones [m], sizes chosen for them."""
        found = self._arranged(standard, zones)
        for own in self.compensators:
            own.fitted(found, self._known)
        return found

    def by_zone(self, standard: Columns, zones: Zones) -> Columns:
        """Return the derivatives of the columns by the zones of their sources, with what is chosen in force [-].

        Unless deviations are arranged they are the standard values, else the deviations as arranged over the zones.
        """
        if not any(own.arranges for own in self.compensators):
            return standard
        return np.asarray((self._arranged(standard, zones) - self.middles) / np.repeat(zones, self._counts))

    def _arranged(self, standard: Columns, zones: Zones) -> Columns:
        """Return the columns that the standard values give before sizes are chosen [m, rad]."""
        found = np.asarray(standard * np.repeat(zones, self._counts))
        found += self.middles
        of_sources = {own.name: float(zone) for own, zone in zip(self.active, zones, strict=False)}
        for own in self.compensators:
            own.arranged(found, of_sources, self._known)
        return found

    @property
    def _counts(self) -> list[int]:
        return [len(source.columns) for source in self._varying]

    @property
    def middles(self) -> Float[np.ndarray, " column"]:
        """Where the columns stand without what is random [m, rad]."""
        return np.concatenate(
            [*(source.middles for source in self.active), *(np.zeros(len(source.columns)) for source in self.joint), []]
        )

    def random_units(self, units: int, seeds: SeedTree) -> Columns:
        """Return the columns of random units at the zones of the drawing [m, angles rad]."""
        chunks = seeds.uniform_chunks(units, len(self.columns))
        return np.concatenate([self.deviations(self.standard_values(uniform), self.zones) for uniform in chunks])

    def deviations_of_normal(self, numbers: Columns, zones: Zones) -> Columns:
        """Return the columns [m, angles rad] that are as probable as independent standard normal numbers.

        Beyond 8.2 standard deviations the uniform numbers reach 1 as closely as they can, and the deviations stay.
        """
        return self.deviations(self.standard_values(np.clip(ndtr(numbers), ABOVE_ZERO, BELOW_ONE)), zones)

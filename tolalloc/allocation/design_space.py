"""What the allocation may change: one scale per drawing group, and the two modification amounts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from tolalloc.reducer.design import CycloidStage, Modification
from tolalloc.uncertainty.error_model import ErrorModel
from tolalloc.uncertainty.sources import Source
from tolalloc.units import MICROMETRE

FLANK = "flank clearance [µm]"
RADIAL = "radial clearance [µm]"


@dataclass(frozen=True, kw_only=True)
class ClearanceRange:
    """Nominal clearances that the modification may leave between pins and teeth.

    Parameters
    ----------
    flank
        Smallest and largest gap on the flank, the narrowest place [m].
    radial
        Smallest and largest gap at tooth tip and root [m].
    """

    flank: tuple[float, float]
    radial: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class DesignSpace:
    """Design variables: the scale of each group's zones and the two clearances.

    Parameters
    ----------
    errors
        The sources at their zones in the tolerance table; a scale of 1 is that zone.
    stage
        Cycloid stage of the reducer.
    clearances
        Range of the clearances.

    Notes
    -----
    A design is a vector: the scale of every group [-], then flank and radial clearance [µm]. Clearances and
    amounts map to each other one to one, `tolalloc.reducer.design.Modification.from_clearances`.
    """

    errors: ErrorModel
    stage: CycloidStage
    clearances: ClearanceRange

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that may change."""
        return tuple(dict.fromkeys(source.group for source in self.errors.active if not source.locked))

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the design variables."""
        return (*(f"scale of {group} [-]" for group in self.groups), FLANK, RADIAL)

    @cached_property
    def group_of_source(self) -> Int[np.ndarray, " source"]:
        """Position of each active source's group; −1 for locked sources."""
        return np.array(
            [-1 if source.locked else self.groups.index(source.group) for source in self.errors.active], dtype=int
        )

    @cached_property
    def costs(self) -> Float[np.ndarray, " group"]:
        """Cost of each group at scale 1 [cost units]."""
        return np.array([sum(source.cost for source in self._members(group)) for group in self.groups])

    @cached_property
    def locked_cost(self) -> float:
        """Cost of the zones that may not change [cost units]."""
        return float(sum(source.cost for source in self.errors.active if source.locked))

    @cached_property
    def lower(self) -> Float[np.ndarray, " variable"]:
        """Smallest value of every variable."""
        scales = [max(s.minimum / s.zone for s in self._members(group)) for group in self.groups]
        return np.array([*scales, self.clearances.flank[0] / MICROMETRE, self.clearances.radial[0] / MICROMETRE])

    @cached_property
    def upper(self) -> Float[np.ndarray, " variable"]:
        """Largest value of every variable."""
        scales = [min(s.maximum / s.zone for s in self._members(group)) for group in self.groups]
        return np.array([*scales, self.clearances.flank[1] / MICROMETRE, self.clearances.radial[1] / MICROMETRE])

    def _members(self, group: str) -> list[Source]:
        return [source for source in self.errors.active if not source.locked and source.group == group]

    def zones(self, design: Float[np.ndarray, " variable"]) -> Float[np.ndarray, " source"]:
        """Return the zones of the active sources [m]."""
        scales = np.append(design[: len(self.groups)], 1.0)
        return np.asarray(self.errors.zones * scales[self.group_of_source])

    def modification(self, design: Float[np.ndarray, " variable"]) -> Modification:
        """Return the modification amounts."""
        return Modification.from_clearances(design[-2] * MICROMETRE, design[-1] * MICROMETRE, self.stage)

    @cached_property
    def modification_by_clearance(self) -> Float[np.ndarray, "2 2"]:
        """Change of equidistant and shift amount (rows) with flank and radial clearance (columns) [-]."""
        columns = [Modification.from_clearances(*clearances, self.stage) for clearances in ((1.0, 0.0), (0.0, 1.0))]
        return np.array([[column.equidistant for column in columns], [column.shift for column in columns]])

    def cost(self, designs: Float[np.ndarray, "*designs variable"]) -> Float[np.ndarray, "*designs"]:
        """Return the cost, reciprocal in every zone [cost units]."""
        return np.asarray((self.costs / designs[..., : len(self.groups)]).sum(axis=-1) + self.locked_cost)

    def uniform(self, scale: float, modification: Modification) -> Float[np.ndarray, " variable"]:
        """Return the design with all zones scaled alike and the given modification, whatever the bounds."""
        clearances = [modification.flank_clearance(self.stage), modification.radial_clearance]
        return np.array([*([scale] * len(self.groups)), *(value / MICROMETRE for value in clearances)])

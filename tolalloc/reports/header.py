"""What every answer says of its run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tolalloc.reading.units import COST_UNITS


@dataclass(frozen=True, kw_only=True)
class Header:
    """What every answer says of its run."""

    name: str  # Name of the study, or of what was measured
    model: str  # Name of the model, such as the reducer's
    seed: int | None = None  # Seed of the random numbers; none if nothing is random [-]
    quick: bool = False  # Whether the effort was shortened
    digest: str = ""  # Of what was asked and of what its files hold; empty where nothing is compared later
    # Under which conditions the model answered, units in the names, such as the torque on the carrier
    conditions: Mapping[str, float | str] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()  # What no source of the model states
    statuses: Mapping[str, int] = field(default_factory=dict)  # Outcome → number of solved units [-]
    stages: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # Seconds and units of each stage
    currency: str = ""  # What costs are in by the user's own files, such as EUR; empty where they are cost units
    # Drawing number, revision and author, as far as the study states them
    title_block: Mapping[str, str] = field(default_factory=dict)

    @property
    def asked(self) -> str:
        """Which model, in which study, once where both are called alike."""
        return self.model if self.model == self.name else f"{self.model}: {self.name}"

    @property
    def cost_unit(self) -> str:
        """What costs are counted in, for people; programs read ``cost units`` whatever it is."""
        return self.currency or COST_UNITS

    @property
    def failed(self) -> int:
        """Number of units without an answer; the first outcome is the good one [-]."""
        return sum(list(self.statuses.values())[1:])

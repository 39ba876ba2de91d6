"""What every answer says of its run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tolalloc.reading.units import COST_UNITS


@dataclass(frozen=True, kw_only=True)
class Header:
    """What every answer says of its run.

    Parameters
    ----------
    name
        Name of the study, or of what was measured.
    model
        Name of the model, such as the reducer's.
    seed
        Seed of the random numbers; none if nothing is random [-].
    quick
        Whether the effort was shortened.
    digest
        Of what was asked and of what its files hold; empty where nothing is compared later.
    conditions
        Under which conditions the model answered, units in the names, such as the torque on the carrier.
    assumptions
        What no source of the model states.
    statuses
        Outcome → number of solved units [-].
    stages
        Seconds and units of each stage.
    currency
        What costs are in by the user's own files, such as EUR; empty where they are cost units.
    title_block
        Drawing number, revision and author, as far as the study states them.
    """

    name: str
    model: str
    seed: int | None = None
    quick: bool = False
    digest: str = ""
    conditions: Mapping[str, float | str] = field(default_factory=dict)
    assumptions: tuple[str, ...] = ()
    statuses: Mapping[str, int] = field(default_factory=dict)
    stages: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    currency: str = ""
    title_block: Mapping[str, str] = field(default_factory=dict)

    @property
    def cost_unit(self) -> str:
        """What costs are counted in, for people; programs read ``cost units`` whatever it is."""
        return self.currency or COST_UNITS

    @property
    def failed(self) -> int:
        """Number of units without an answer; the first outcome is the good one [-]."""
        return sum(list(self.statuses.values())[1:])

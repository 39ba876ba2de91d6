"""Masses and moments of inertia of the moving parts."""

from __future__ import annotations

from dataclasses import dataclass, fields

from tolalloc.exceptions import InputError


@dataclass(frozen=True, kw_only=True)
class Masses:
    """Mass and moment of inertia about the own centre of each moving part.

    Parameters
    ----------
    crank_mass, disc_mass, carrier_mass
        Of one crankshaft with its planet gear, one disc, the carrier [kg].
    crank_inertia, disc_inertia
        Of one crankshaft with its planet gear, one disc [kg·m²].
    carrier_inertia
        Of the carrier with all that the output drives [kg·m²].

    Raises
    ------
    InputError
        One of them is not above 0.
    """

    crank_mass: float
    crank_inertia: float
    disc_mass: float
    disc_inertia: float
    carrier_mass: float
    carrier_inertia: float

    def __post_init__(self) -> None:
        for part in fields(self):
            value = getattr(self, part.name)
            if not 0.0 < value < float("inf"):
                raise InputError.at("virtual prototype", part.name, value, "a number above 0")

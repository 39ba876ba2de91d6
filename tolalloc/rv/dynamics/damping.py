"""Viscous damping of the deviations from the nominal motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tolalloc.exceptions import InputError
from tolalloc.rv.equivalent.springs import SpringGroup


@dataclass(frozen=True, kw_only=True)
class Damping:
    """Damping in proportion to masses and to stiffness; pin contacts and interfaces with play have none of the latter.

    Parameters
    ----------
    mass_proportional
        Damping per mass of every coordinate [1/s].
    stiffness_proportional
        Damping per stiffness of every interface without play [s].
    interfaces
        Further damping per stiffness of single interfaces, by their field of `tolalloc.rv.reducer.stiffness.Stiffness`
        [s].

    Raises
    ------
    InputError
        A factor that is negative or not finite.

    Notes
    -----
    A mode of angular frequency ω that strains one damped interface alone has the damping ratio
    mass_proportional/(2ω) + (stiffness_proportional + its own)·ω/2.
    """

    mass_proportional: float = 0.0
    stiffness_proportional: float = 0.0
    interfaces: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        general = {name: getattr(self, name) for name in ("mass_proportional", "stiffness_proportional")}
        for name, value in {**general, **self.interfaces}.items():
            if not 0.0 <= value < np.inf:
                raise InputError.at("damping", name, value, "0 or a positive number")

    def per_stiffness(self, interface: str) -> float:
        """Return the damping per stiffness of an interface without play [s]."""
        return self.stiffness_proportional + self.interfaces.get(interface, 0.0)

    def check(self, groups: list[SpringGroup]) -> None:
        """Make sure that every interface with damping of its own is there and has no play.

        Raises
        ------
        InputError
            One that is not.
        """
        allowed = [group.stiffness_name for group in groups if group.contact == "bilateral"]
        for name in self.interfaces:
            if name not in allowed:
                raise InputError.at("damping", "interface", name, f"one without play: {', '.join(allowed)}")

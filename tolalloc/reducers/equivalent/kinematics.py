"""Where every part stands at a carrier angle, and which coordinate of the model is which."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.reducers.reducer.design import Reducer

HARMONICS = (1, 2, 4)
"""Orders of the pitch and run-out deviations that liu2020 prints in Table 4."""


@dataclass(frozen=True)
class Coordinates:
    """Index of every displacement in the vector q: 2 + 3·cranks + 3·discs + 3 of them."""

    crank_count: int
    disc_count: int

    @property
    def count(self) -> int:
        """Number of coordinates, 17 for two cranks and two discs."""
        return 5 + 3 * self.crank_count + 3 * self.disc_count

    @property
    def sun(self) -> int:
        """First of the sun's two, Xs and Ys [m]."""
        return 0

    def planet(self, crank: int) -> int:
        """First of a planet's three, Xp and Yp [m] and θp [rad]."""
        return 2 + 3 * crank

    def disc(self, disc: int) -> int:
        """First of a disc's three, xd and yd [m] and θd [rad]."""
        return 2 + 3 * self.crank_count + 3 * disc

    @property
    def carrier(self) -> int:
        """First of the carrier's three, Xca and Yca [m] and θca [rad]."""
        return 2 + 3 * self.crank_count + 3 * self.disc_count


@dataclass(frozen=True)
class Positions:
    """Directions of all parts of a reducer at the given carrier angles.

    Theory page, equations (1)–(4). Counts start at 0 here and at 1 in names.
    """

    reducer: Reducer  # The nominal design
    carrier_angle: Float[np.ndarray, " angle"]  # θc, counter-clockwise positive; one output turn is 0 … 2π [rad]
    # Orders of the harmonic deviations of pitch and run-out, per turn of their part [-]
    orders: tuple[int, ...] = HARMONICS

    @cached_property
    def coordinates(self) -> Coordinates:
        """The layout of q."""
        return Coordinates(self.reducer.crank_count, self.reducer.disc_count)

    @cached_property
    def crank_angle(self) -> Float[np.ndarray, " angle"]:
        """β = −zc·θc [rad]."""
        return -self.reducer.cycloid_stage.disc_teeth * self.carrier_angle

    def disc_direction(self, disc: int) -> Float[np.ndarray, " angle"]:
        """β_j = β + ψ_j, the direction of a disc's centre [rad]."""
        return self.crank_angle + 2 * np.pi * disc / self.reducer.disc_count

    def crank_position(self, crank: int) -> Float[np.ndarray, " angle"]:
        """P_i = θc + φ_i, the direction of a crank axis on the carrier [rad]."""
        return self.carrier_angle + 2 * np.pi * crank / self.reducer.crank_count

    def plane(self, disc: int) -> float:
        """z_j − z_0, height of a disc's middle plane above the middle of all discs [m]."""
        return (disc - (self.reducer.disc_count - 1) / 2) * self.reducer.cycloid_stage.disc_spacing

    @cached_property
    def sun_angle(self) -> Float[np.ndarray, " angle"]:
        """θs = i·θc [rad]."""
        return self.reducer.ratio * self.carrier_angle

    @cached_property
    def pin_direction(self) -> Float[np.ndarray, " pin"]:
        """φ_k, the direction of a pin in the housing [rad]."""
        count = self.reducer.cycloid_stage.pin_count
        return 2 * np.pi * np.arange(count) / count

"""What goes between the model and its compiled solvers: settings in, arrays to fill; nothing here is compiled."""

from __future__ import annotations

from math import pi
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.reducer.design import Reducer

CONVERGED, NOT_CONVERGED, NOT_RESISTED, NOT_FINITE, OUT_OF_RANGE = range(5)
"""How an equilibrium ended; `tolalloc.reducers.equivalent.model.Status` has the words."""
Given = tuple[Any, Any, Any, Any, Any]
"""What every solver takes next to the tables: layout, map and design, errors and torque of the samples."""
MARGIN = 2
"""Nodes beyond the coarse angles before and behind the turn that the cubic interpolation needs [-]."""


class SolverDesign(NamedTuple):
    """What a reducer is to the solvers, next to its tables."""

    law: int  # `tolalloc.reducers.cycloid.solvers.LAWS` [-]
    face_width: float  # Loaded width of a disc [m]


def design_of(reducer: Reducer) -> SolverDesign:
    """Return a reducer as the solvers take it."""
    return SolverDesign(LAWS[reducer.stiffness.pin_contact_law], reducer.cycloid_stage.face_width)


class AngleSearch(NamedTuple):
    """At which carrier angles the extremes are looked for.

    With the defaults the peak-to-peak of 99 % of random RV-20E units lies within 0.05″ of the finest search;
    `tests/verification/test_extremes.py` measures it.
    """

    coarse: int = 936  # Equally spaced angles of the turn at which every sample is solved [-]
    nodes_per_coarse: int = 4  # Tabulated angles per coarse one; between them the tables are interpolated [-]
    levels: int = 10  # Halvings of the coarse step around a candidate [-]
    safety: float = 1.5  # A candidate is followed while this many times its flank's rise could make it the extreme [-]

    def turn_of_crank(self, teeth: int) -> int:
        """Return how many coarse angles a crank's turn has where a disc has so many teeth; 0 if no whole number [-]."""
        return 0 if self.coarse % teeth else self.coarse // teeth

    @property
    def first(self) -> int:
        """Node of the turn's first angle; as many nodes stand before it and behind the turn [-]."""
        return self.nodes_per_coarse + MARGIN

    @property
    def node_step(self) -> float:
        """Distance between tabulated angles [rad]."""
        return 2 * pi / (self.coarse * self.nodes_per_coarse)

    @property
    def node_angle(self) -> Float[np.ndarray, " node"]:
        """Tabulated angles, from before the turn to behind it [rad]."""
        return self.node_step * np.arange(-self.first, self.coarse * self.nodes_per_coarse + self.first + 1)


class SolvedTurn(NamedTuple):
    """Equilibria of samples over angles, filled in by the solvers."""

    rotation: Float[np.ndarray, "sample angle"]  # Carrier rotation [rad]
    retained: Float[np.ndarray, "sample angle coordinate"]  # Retained coordinates at equilibrium [m]
    # Outcome, residual over the largest force, pins in contact [-]
    status: UInt8[np.ndarray, "sample angle"]
    residual: Float[np.ndarray, "sample angle"]
    touching: UInt16[np.ndarray, "sample angle"]


class SolvedExtremes(NamedTuple):
    """Extremes of samples, filled in by `solve_extremes`."""

    extreme: Float[np.ndarray, "sample 2"]  # Largest and smallest carrier rotation [rad]
    position: Float[np.ndarray, "sample 2"]  # Where they are, counted in nodes [-]
    left_over: Float[np.ndarray, " sample"]  # What finer angles may add to their difference [rad]
    solves: Int[np.ndarray, " sample"]  # Equilibria solved [-]
    # Worst outcome, and largest residual over the largest force [-]
    status: UInt8[np.ndarray, " sample"]
    residual: Float[np.ndarray, " sample"]
    curve: Float[
        np.ndarray, "sample angle"
    ]  # Carrier rotation at the first coarse angles, as many as there is room for [rad]


class SolvedDerivatives(NamedTuple):
    """Derivatives, filled in by the solvers."""

    # What is derived: the carrier rotation, for a peak-to-peak the weighted branches together [rad]
    rotation: Float[np.ndarray, " sample"]
    # By every value of `tolalloc.reducers.equivalent.columns.Layout` [rad/m, rad/(N·m), rad/rad]
    by_value: Float[np.ndarray, "sample value"]
    # By the stiffness of every bilateral row, then of every element with play [rad/(N/m)]
    by_row: Float[np.ndarray, "sample row"]
    by_pin: Float[np.ndarray, " sample"]  # By the relative change of all pin contact stiffnesses together [rad]
    status: UInt8[np.ndarray, " sample"]  # Worst outcome of the equilibria [-]

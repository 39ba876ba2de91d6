"""What the kernel answers: how a solution ended, equilibria over a turn, extremes, derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int, Integer, UInt8, UInt16

from tolalloc.reducers.equivalent.columns import Columns
from tolalloc.reducers.equivalent.condensation import CondensedAngles
from tolalloc.reducers.equivalent.solvers.records import (
    CONVERGED,
    NOT_CONVERGED,
    NOT_FINITE,
    NOT_RESISTED,
    OUT_OF_RANGE,
)
from tolalloc.reducers.reducer.design import Reducer


class Status(IntEnum):
    """Outcome of an equilibrium; the larger, the worse."""

    CONVERGED = CONVERGED
    NOT_CONVERGED = NOT_CONVERGED
    NOT_RESISTED = NOT_RESISTED
    NOT_FINITE = NOT_FINITE
    OUT_OF_RANGE = OUT_OF_RANGE

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return {
            Status.CONVERGED: "equilibrium found",
            Status.NOT_CONVERGED: "no equilibrium within the allowed number of Newton steps",
            Status.NOT_RESISTED: "no pin resists the torque in its direction",
            Status.NOT_FINITE: "an error value is not a finite number",
            Status.OUT_OF_RANGE: "an output error beyond a tenth of the pin pitch, too far for small displacements",
        }[self]


OUTCOMES: Mapping[int, str] = {int(item): item.sentence for item in Status}
"""Status → outcome in words."""


def count_statuses(status: Integer[np.ndarray, "..."]) -> Mapping[str, int]:
    """Return how often each outcome occurred, by its sentence; every outcome is listed."""
    return {item.sentence: int(np.count_nonzero(status == item)) for item in Status}


@dataclass(frozen=True, kw_only=True)
class Equilibria:
    """Equilibria of samples at carrier angles: what every output is read from."""

    # The nominal design, its error columns and the values that they move, its condensed tables at the angles
    reducer: Reducer
    columns: Columns
    tables: CondensedAngles
    errors: Float[np.ndarray, "sample column"]  # Deviations in the order of the model's columns [m, angles rad]
    torque: float  # Torque on the carrier [N·m]
    carrier_angle: Float[np.ndarray, " angle"]  # θc [rad]
    transmission_error: Float[np.ndarray, "sample angle"]  # Carrier rotation beyond θc, output side [rad]
    # Coordinates that pins and play touch, the discs' x, y, r_d·θ first [m]
    retained: Float[np.ndarray, "sample angle coordinate"]
    status: UInt8[np.ndarray, "sample angle"]  # Values of `tolalloc.reducers.equivalent.answers.Status` [-]
    residual: Float[np.ndarray, "sample angle"]  # Largest component of the unbalanced force over the largest force [-]
    pins_in_contact: UInt16[np.ndarray, "sample angle"]  # Number of pins that carry load, all discs [-]


@dataclass(frozen=True, kw_only=True)
class Extremes:
    """Largest and smallest transmission error of each sample over one output turn."""

    # Extremes of the transmission error, output side [rad]
    largest: Float[np.ndarray, " sample"]
    smallest: Float[np.ndarray, " sample"]
    carrier_angle: Float[np.ndarray, "sample 2"]  # Where they occur [rad]
    remaining: Float[np.ndarray, " sample"]  # What still finer angles may add to the peak-to-peak, an estimate [rad]
    # Equilibria solved; worst status and largest residual over the largest force of the sample's angles [-]
    solves: Int[np.ndarray, " sample"]
    status: UInt8[np.ndarray, " sample"]
    residual: Float[np.ndarray, " sample"]

    @property
    def peak_to_peak(self) -> Float[np.ndarray, " sample"]:
        """Peak-to-peak transmission error [rad]."""
        return np.asarray(self.largest - self.smallest)


@dataclass(frozen=True, kw_only=True)
class Derivatives:
    """Exact derivatives of an output, sample by sample or angle by angle."""

    # By every error column, modification included; by the torque [rad/m, rad/rad; rad/(N·m)]
    by_error: Float[np.ndarray, "item column"]
    by_torque: Float[np.ndarray, " item"]
    # By the relative change of each stiffness of `tolalloc.reducers.reducer.stiffness.Stiffness` [rad]
    by_stiffness: dict[str, Float[np.ndarray, " item"]]
    status: UInt8[np.ndarray, " item"]  # Worst status of the equilibria behind them [-]

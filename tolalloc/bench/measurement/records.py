"""What was measured on finished reducers, clean and in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.rv.reducer.unit_file import BuiltUnit


@dataclass(frozen=True, kw_only=True)
class MeasuredCurve:
    """Transmission error of one unit over the output angle."""

    unit: int  # Position in `Measurements.units` [-]
    torque: float  # Torque on the carrier, negative against the rotation [N·m]
    carrier_angle: Float[np.ndarray, " reading"]  # Angles of the readings, ascending [rad]
    transmission_error: Float[np.ndarray, " reading"]  # Readings without their mean, output side [rad]
    # Standard deviation of one reading as it stands here, None where the file does not state it [rad]
    noise: float | None = None
    repairs: tuple[str, ...] = ()  # What was mended, prefixed by the file


@dataclass(frozen=True, kw_only=True)
class MeasuredLoop:
    """Twist of the carrier of one unit against torque, the sun held."""

    unit: int  # Position in `Measurements.units` [-]
    carrier_angle: float  # Angle at which the loop was measured [rad]
    torque: Float[np.ndarray, " level"]  # Torques on the carrier, ascending, none of them 0 [N·m]
    twist: Float[np.ndarray, " level"]  # Readings without their mean, output side [rad]
    # As of a curve [rad]
    noise: float | None = None
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredPeakToPeak:
    """Largest minus smallest transmission error over one output turn, one value per unit."""

    unit: Int[np.ndarray, " n"]  # Positions in `Measurements.units` [-]
    values: Float[np.ndarray, " n"]  # Peak-to-peaks, output side [rad]
    torque: float  # Torque on the carrier, negative against the rotation [N·m]
    noise: float | None = None  # Standard deviation of one value, None where the file does not state it [rad]
    repairs: tuple[str, ...] = ()  # What was mended, prefixed by the file


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measured errors of the parts of some units, and what the finished units did."""

    # What was measured, and where
    name: str
    source: str
    units: tuple[BuiltUnit, ...]  # Errors of the parts, unit by unit
    peak_to_peak: MeasuredPeakToPeak | None = None  # One value per unit, None where there is no such table
    # Any number per unit
    curves: tuple[MeasuredCurve, ...] = ()
    loops: tuple[MeasuredLoop, ...] = ()
    assumptions: tuple[str, ...] = ()  # What was not measured

    @property
    def repairs(self) -> tuple[str, ...]:
        """Everything that was mended, each prefixed by its file."""
        table = self.peak_to_peak.repairs if self.peak_to_peak else ()
        curves = tuple(repair for curve in self.curves for repair in curve.repairs)
        return table + curves + tuple(repair for loop in self.loops for repair in loop.repairs)

"""What was measured on finished reducers, clean and in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from tolalloc.rv.reducer.unit_file import BuiltUnit


@dataclass(frozen=True, kw_only=True)
class MeasuredCurve:
    """Transmission error of one unit over the output angle.

    Parameters
    ----------
    unit
        Position in `Measurements.units` [-].
    torque
        Torque on the carrier, negative against the rotation [N·m].
    carrier_angle
        Angles of the readings, ascending [rad].
    transmission_error
        RawReadings without their mean, output side [rad].
    noise
        Standard deviation of one reading as it stands here, None where the file does not state it [rad].
    repairs
        What was mended, prefixed by the file.
    """

    unit: int
    torque: float
    carrier_angle: Float[np.ndarray, " reading"]
    transmission_error: Float[np.ndarray, " reading"]
    noise: float | None = None
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredLoop:
    """Twist of the carrier of one unit against torque, the sun held.

    Parameters
    ----------
    unit
        Position in `Measurements.units` [-].
    carrier_angle
        Angle at which the loop was measured [rad].
    torque
        Torques on the carrier, ascending, none of them 0 [N·m].
    twist
        RawReadings without their mean, output side [rad].
    noise, repairs
        As of a curve [rad].
    """

    unit: int
    carrier_angle: float
    torque: Float[np.ndarray, " level"]
    twist: Float[np.ndarray, " level"]
    noise: float | None = None
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredPeakToPeak:
    """Largest minus smallest transmission error over one output turn, one value per unit.

    Parameters
    ----------
    unit
        Positions in `Measurements.units` [-].
    values
        Peak-to-peaks, output side [rad].
    torque
        Torque on the carrier, negative against the rotation [N·m].
    noise
        Standard deviation of one value, None where the file does not state it [rad].
    repairs
        What was mended, prefixed by the file.
    """

    unit: Int[np.ndarray, " n"]
    values: Float[np.ndarray, " n"]
    torque: float
    noise: float | None = None
    repairs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measured errors of the parts of some units, and what the finished units did.

    Parameters
    ----------
    name, source
        What was measured, and where.
    units
        Errors of the parts, unit by unit.
    peak_to_peak
        One value per unit, None where there is no such table.
    curves, loops
        Any number per unit.
    assumptions
        What was not measured.
    """

    name: str
    source: str
    units: tuple[BuiltUnit, ...]
    peak_to_peak: MeasuredPeakToPeak | None = None
    curves: tuple[MeasuredCurve, ...] = ()
    loops: tuple[MeasuredLoop, ...] = ()
    assumptions: tuple[str, ...] = ()

    @property
    def repairs(self) -> tuple[str, ...]:
        """Everything that was mended, each prefixed by its file."""
        table = self.peak_to_peak.repairs if self.peak_to_peak else ()
        curves = tuple(repair for curve in self.curves for repair in curve.repairs)
        return table + curves + tuple(repair for loop in self.loops for repair in loop.repairs)

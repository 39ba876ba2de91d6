"""Measured units with known stiffness: what the instruments would have read, with noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.unit_file import BuiltUnit
from tolalloc.wings.bench.measurements import MeasuredCurve, MeasuredLoop, MeasuredPeakToPeak, Measurements
from tolalloc.wings.bench.prediction import CURVE, LOOP, PEAK_TO_PEAK, KernelPredictor, data_of

_ANY = ("*",)


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What is measured on every unit, and how well.

    Parameters
    ----------
    peak_to_peak_torque, peak_to_peak_noise
        Torque, 0 if no peak-to-peak is measured [N·m], and standard deviation of one [rad].
    curve_torques, curve_angles, curve_noise
        Torques of the curves [N·m], their angles [rad], standard deviation of one reading [rad].
    loop_angles, loop_torques, loop_noise
        Angles of the loops [rad], their torques [N·m], standard deviation of one reading [rad].
    """

    peak_to_peak_torque: float = 0.0
    peak_to_peak_noise: float = 0.0
    curve_torques: tuple[float, ...] = ()
    curve_angles: Float[np.ndarray, " reading"]
    curve_noise: float = 0.0
    loop_angles: tuple[float, ...] = ()
    loop_torques: Float[np.ndarray, " level"]
    loop_noise: float = 0.0


def random_units(errors: ErrorModel, count: int, seeds: SeedTree, scale: float = 1.0) -> tuple[BuiltUnit, ...]:
    """Return units with random errors inside their zones; what the tolerance table does not list is exact.

    Parameters
    ----------
    errors
        The sources.
    count
        Number of units [-].
    seeds
        Node of the seed tree.
    scale
        Zones over those of the sources [-].
    """
    uniform = np.concatenate(list(seeds.uniform_chunks(count, len(errors.columns))))
    rows = errors.deviations(errors.standard_values(uniform), scale * errors.zones)
    return tuple(
        BuiltUnit(
            name=str(number + 1),
            source="simulated",
            deviations={**errors.fixed, **dict(zip(errors.columns, map(float, row), strict=True))},
            neglected=_ANY,
        )
        for number, row in enumerate(rows)
    )


@dataclass(frozen=True)
class SimulatedBench:
    """Readings without noise, ready to be measured as often as wanted.

    Parameters
    ----------
    measurements
        The readings that a perfect instrument would give.
    """

    measurements: Measurements

    def measured(self, seeds: SeedTree) -> Measurements:
        """Return the readings with fresh normal noise."""
        exact, generator = self.measurements, seeds.generator()

        def noisy(values: Float[np.ndarray, " reading"], noise: float | None) -> Float[np.ndarray, " reading"]:
            return np.asarray(values + generator.normal(0.0, noise or 0.0, values.size))

        return replace(
            exact,
            peak_to_peak=exact.peak_to_peak
            and replace(exact.peak_to_peak, values=noisy(exact.peak_to_peak.values, exact.peak_to_peak.noise)),
            curves=tuple(
                replace(curve, transmission_error=noisy(curve.transmission_error, curve.noise))
                for curve in exact.curves
            ),
            loops=tuple(replace(loop, twist=noisy(loop.twist, loop.noise)) for loop in exact.loops),
        )


def simulated_bench(reducer: Reducer, units: tuple[BuiltUnit, ...], bench: Bench) -> SimulatedBench:
    """Return what a perfect instrument would read of units of this reducer.

    Parameters
    ----------
    reducer
        Nominal design with the true stiffness.
    units
        Their errors.
    bench
        What is measured.
    """
    blank = _blank(units, bench)
    data = data_of(blank, "simulated units")
    values = KernelPredictor(reducer, (), blank, data)(np.empty(0)).values
    found: dict[tuple[str, int], Float[np.ndarray, " reading"]] = {
        (block.kind, block.number): values[block.rows] for block in data.blocks
    }
    return SimulatedBench(
        replace(
            blank,
            peak_to_peak=blank.peak_to_peak and replace(blank.peak_to_peak, values=found[PEAK_TO_PEAK, 0]),
            curves=tuple(replace(curve, transmission_error=found[CURVE, at]) for at, curve in enumerate(blank.curves)),
            loops=tuple(replace(loop, twist=found[LOOP, at]) for at, loop in enumerate(blank.loops)),
        )
    )


def _blank(units: tuple[BuiltUnit, ...], bench: Bench) -> Measurements:
    """Return the bench's readings, all of them 0."""
    numbers = np.arange(len(units))
    return Measurements(
        name=f"{len(units)} simulated units",
        source="simulated on the equivalent model",
        units=units,
        peak_to_peak=MeasuredPeakToPeak(
            unit=numbers,
            values=np.zeros(numbers.size),
            torque=bench.peak_to_peak_torque,
            noise=bench.peak_to_peak_noise,
        )
        if bench.peak_to_peak_torque
        else None,
        curves=tuple(
            MeasuredCurve(
                unit=int(unit),
                torque=torque,
                carrier_angle=bench.curve_angles,
                transmission_error=np.zeros(bench.curve_angles.size),
                noise=bench.curve_noise,
            )
            for unit in numbers
            for torque in bench.curve_torques
        ),
        loops=tuple(
            MeasuredLoop(
                unit=int(unit),
                carrier_angle=angle,
                torque=bench.loop_torques,
                twist=np.zeros(bench.loop_torques.size),
                noise=bench.loop_noise,
            )
            for unit in numbers
            for angle in bench.loop_angles
        ),
        assumptions=("units and readings are simulated",),
    )

"""Readings of all units in one row, and what the model says should have been read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.equivalent.model import Derivatives, EquivalentModel
from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.sensitivity.surrogate.regression import BoxPolynomial, fit_box_polynomial
from tolalloc.wings.bench.measurements import MeasuredCurve, MeasuredLoop, Measurements
from tolalloc.wings.bench.parameters import BIAS, TORQUE, Parameter, box, values_at

PEAK_TO_PEAK, CURVE, LOOP = "peak-to-peak", "curve", "loop"
"""Kinds of readings."""

_SAMPLES_AT_ONCE = 16
"""Curves solved together; each takes some 3 kB an angle for its derivatives [-]."""

LARGE_DRIFT = 0.3
"""Distance of polynomials' and model's least objective over the standard deviation that makes profiles doubtful [-]."""

_DEGREES = {1: 8, 2: 6, 3: 4, 4: 3, 5: 3}
"""Parameters → total degree; beyond them 2 [-]."""


@dataclass(frozen=True, kw_only=True)
class ReadingBlock:
    """Readings that belong together."""

    kind: str  # `PEAK_TO_PEAK`, `CURVE` or `LOOP`
    number: int  # Which of the measured curves or loops; 0 for the peak-to-peaks [-]
    rows: slice  # Its readings among all
    centred: bool  # Whether its mean has been removed, from readings and model alike

    def shape_of(self, measured: Measurements) -> MeasuredCurve | MeasuredLoop:
        """Return the curve or loop that was read."""
        return measured.curves[self.number] if self.kind == CURVE else measured.loops[self.number]


@dataclass(frozen=True, kw_only=True)
class AllReadings:
    """All readings of all units in one row."""

    measured: Float[np.ndarray, " datum"]  # Readings [rad]
    noise: Float[np.ndarray, " datum"]  # Standard deviation of each; one arcsecond where nobody stated it [rad]
    unit: Int[np.ndarray, " datum"]  # Position of the unit that each belongs to [-]
    blocks: tuple[ReadingBlock, ...]  # Where they came from, in order
    noise_stated: bool  # Whether the noise was stated; if not, it is estimated from what the fit leaves

    @property
    def units(self) -> Int[np.ndarray, " unit"]:
        """Positions of the units that have readings."""
        return np.unique(self.unit)

    @property
    def peak_to_peak(self) -> slice | None:
        """Where the peak-to-peaks stand; none if there are none."""
        return next((block.rows for block in self.blocks if block.kind == PEAK_TO_PEAK), None)

    @property
    def only_peak_to_peak(self) -> bool:
        """Whether there is nothing else."""
        return all(block.kind == PEAK_TO_PEAK for block in self.blocks)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of readings that there are."""
        return tuple(dict.fromkeys(block.kind for block in self.blocks))

    def rows(self, kind: str) -> Int[np.ndarray, " row"]:
        """Return where the readings of one kind stand."""
        return np.concatenate(
            [np.arange(self.measured.size)[block.rows] for block in self.blocks if block.kind == kind]
        )


def centred(values: Float[np.ndarray, "..."], blocks: tuple[ReadingBlock, ...]) -> Float[np.ndarray, "..."]:
    """Return values, readings along the first axis, without the means of the blocks that have none."""
    found = np.array(values)
    for block in blocks:
        if block.centred:
            found[block.rows] -= found[block.rows].mean(axis=0)
    return found


def data_of(measurements: Measurements, place: str) -> AllReadings:
    """Return the readings of all units in one row; the place where they were read stands in errors."""
    parts = list(_parts(measurements))
    stated = [noise for *_, noise in parts]
    if len({part[0] for part in parts}) > 1 or any(noise is not None for noise in stated):
        without = [f"{kind} {number + 1}" for kind, number, _, _, noise in parts if noise is None]
        if without:
            raise InputError(
                f"{place}: noise_arcsec of {without[0]} is missing; readings of several kinds, or with and without "
                "it, cannot be weighed against each other."
            )
    blocks, start = [], 0
    for kind, number, values, _, _ in parts:
        rows = slice(start, start + values.size)
        blocks.append(ReadingBlock(kind=kind, number=number, rows=rows, centred=kind != PEAK_TO_PEAK))
        start = rows.stop
    noise = [np.full(values.size, ARCSECOND if own is None else own) for _, _, values, _, own in parts]
    return AllReadings(
        measured=centred(np.concatenate([values for _, _, values, _, _ in parts]), tuple(blocks)),
        noise=np.concatenate(noise),
        unit=np.concatenate([unit for _, _, _, unit, _ in parts]),
        blocks=tuple(blocks),
        noise_stated=all(noise is not None for noise in stated),
    )


_Part = tuple[str, int, Float[np.ndarray, " reading"], Int[np.ndarray, " reading"], float | None]


def _parts(measurements: Measurements) -> Iterator[_Part]:
    """Yield kind, number, readings, units and noise of everything that was measured."""
    found = measurements.peak_to_peak
    if found is not None:
        yield PEAK_TO_PEAK, 0, found.values, found.unit, found.noise
    for number, curve in enumerate(measurements.curves):
        values = curve.transmission_error
        yield CURVE, number, values, np.full(values.size, curve.unit), curve.noise
    for number, loop in enumerate(measurements.loops):
        yield LOOP, number, loop.twist, np.full(loop.twist.size, loop.unit), loop.noise


_Answer = tuple[tuple[ReadingBlock, ...], Float[np.ndarray, " reading"], Float[np.ndarray, "reading parameter"]]

UnitObserver = Callable[[int], None]
"""Told how many units have been answered for: a progress bar, a counter."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """What should have been read, at one point."""

    # Readings, their means removed as in the data; not a number where there is no equilibrium [rad]
    values: Float[np.ndarray, " datum"]
    by_coordinate: Float[np.ndarray, "datum parameter"]  # Their derivatives by the coordinates of the parameters [rad]


@runtime_checkable
class Predictor(Protocol):
    """Answers for all readings at one point, or at many without derivatives."""

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        """Return readings and derivatives at one point."""
        ...

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        """Return the readings at many points [rad]."""
        ...


@dataclass(frozen=True)
class KernelPredictor:
    """The equivalent model itself.

    A stiffness that is a parameter is the same under every torque. Others keep theirs, which under every torque, as it
    was stated, is that of the parts if the reducer has them.
    """

    reducer: Reducer  # Nominal design
    parameters: tuple[Parameter, ...]  # The unknowns, in the order of the coordinates
    measurements: Measurements  # Units, angles and torques
    data: AllReadings  # The same readings in one row
    observe: UnitObserver = lambda _: None  # Told how many units have been answered for

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        """Return readings and derivatives at one point."""
        stiffness, bias, factor = values_at(self.parameters, coordinates)
        orders = sorted({order for unit in self.measurements.units for order in unit.orders})
        others = tuple(part for part in self.reducer.parts if part.interface not in stiffness)
        reducer = replace(self.reducer, stiffness=replace(self.reducer.stiffness, **stiffness), parts=others)
        model = EquivalentModel(reducer, orders=tuple(orders) or HARMONICS)
        deviations = reducer.modification.deviations
        errors = np.concatenate([unit.errors(model.columns, deviations) for unit in self.measurements.units])
        values = np.empty(self.data.measured.size)
        slopes = np.empty((values.size, len(self.parameters)))
        for blocks, found, by_coordinate in self._answers(model, errors, factor):
            rows = np.concatenate([np.arange(block.rows.start, block.rows.stop) for block in blocks])
            values[rows], slopes[rows] = found, by_coordinate
        rows_with_bias = self.data.peak_to_peak or slice(0)
        values[rows_with_bias] += bias
        for at, item in enumerate(self.parameters):
            if item.name == BIAS:
                slopes[rows_with_bias, at] = ARCSECOND
        self.observe(self.data.units.size)
        return Prediction(values=centred(values, self.data.blocks), by_coordinate=centred(slopes, self.data.blocks))

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        """Return the readings at many points [rad]."""
        return np.stack([self(point).values for point in coordinates])

    def _answers(
        self, model: EquivalentModel, errors: Float[np.ndarray, "unit column"], factor: float
    ) -> Iterator[_Answer]:
        """Yield blocks with the same angles, their readings one after another, and the derivatives."""
        measured = self.measurements
        for blocks in _with_same_angles(self.data.blocks, measured):
            if blocks[0].kind == PEAK_TO_PEAK:
                assert measured.peak_to_peak is not None
                stated = measured.peak_to_peak.torque
                own, torque = model.at_torque(stated), factor * stated
                extremes, found = own.peak_to_peak_derivatives(errors[measured.peak_to_peak.unit], torque)
                yield blocks, extremes.peak_to_peak, self._by_coordinate(found, torque)
            else:
                shapes = [block.shape_of(measured) for block in blocks]
                torques = [np.atleast_1d(shape.torque) for shape in shapes]
                rows = np.repeat([shape.unit for shape in shapes], [own.size for own in torques])
                angles = np.atleast_1d(shapes[0].carrier_angle)
                # The instrument measures the torques of a loop itself.
                own_factor = factor if blocks[0].kind == CURVE else None
                yield blocks, *self._rotations(model, errors[rows], np.concatenate(torques), angles, own_factor)

    def _rotations(
        self,
        model: EquivalentModel,
        errors: Float[np.ndarray, "row column"],
        torques: Float[np.ndarray, " row"],
        angles: Float[np.ndarray, " angle"],
        factor: float | None,
    ) -> tuple[Float[np.ndarray, " item"], Float[np.ndarray, "item parameter"]]:
        """Return the rotations at all angles of every row and their derivatives; no factor where none is on the torque.

        Rows are solved together that have the stiffness of one torque: all, if the reducer has no parts.
        """
        rotation = np.empty((torques.size, angles.size))
        slopes = np.empty((rotation.size, len(self.parameters)))
        level = np.abs(torques) if model.reducer.parts else np.zeros_like(torques)
        for size in np.unique(level):
            own = level == size
            carried = torques[own] * (1.0 if factor is None else factor)
            rotation[own], found = model.at_torque(float(size)).rotation_derivatives(errors[own], carried, angles)
            by_factor = 0.0 if factor is None else np.repeat(carried, angles.size)
            slopes[np.repeat(own, angles.size)] = self._by_coordinate(found, by_factor)
        return rotation.ravel(), slopes

    def _by_coordinate(
        self, found: Derivatives, torque: float | Float[np.ndarray, " item"]
    ) -> Float[np.ndarray, "item parameter"]:
        """Return derivatives by the coordinates; by the torque's factor it is the torque times that by the torque."""
        slopes = np.zeros((found.by_torque.size, len(self.parameters)))
        for at, item in enumerate(self.parameters):
            if item.is_stiffness:
                slopes[:, at] = found.by_stiffness[item.name]
            elif item.name == TORQUE:
                slopes[:, at] = torque * found.by_torque
        return slopes


def _with_same_angles(blocks: tuple[ReadingBlock, ...], measured: Measurements) -> list[tuple[ReadingBlock, ...]]:
    """Return the blocks in groups that share their carrier angles, and so their tables."""
    groups: dict[tuple[str, bytes], list[ReadingBlock]] = {}
    for block in blocks:
        angles = np.empty(0) if block.kind == PEAK_TO_PEAK else block.shape_of(measured).carrier_angle
        groups.setdefault((block.kind, np.asarray(angles).tobytes()), []).append(block)
    return [
        tuple(group[start : start + _SAMPLES_AT_ONCE])
        for group in groups.values()
        for start in range(0, len(group), _SAMPLES_AT_ONCE)
    ]


@dataclass(frozen=True)
class Surrogate:
    """The readings as polynomials of the coordinates inside the bounds; the bias is added exactly."""

    # The unknowns, in the order of the coordinates; those that the polynomial has and this lacks stay at their start
    parameters: tuple[Parameter, ...]
    fitted: tuple[Parameter, ...]  # Parameters of the polynomial
    polynomial: BoxPolynomial  # The fitted polynomial of all readings
    data: AllReadings  # The readings
    # Added to every reading, so that they are the model's at one point; 0 unless `anchored` [rad]
    offset: float | Float[np.ndarray, " datum"] = 0.0

    def anchored(self, coordinates: Float[np.ndarray, " parameter"], model: Prediction) -> Surrogate:
        """Return the surrogate moved onto what the model predicts at one point."""
        return replace(self, offset=model.values - self.values(coordinates[np.newaxis])[0])

    def __call__(self, coordinates: Float[np.ndarray, " parameter"]) -> Prediction:
        """Return readings and derivatives at one point."""
        slopes = np.zeros((self.data.measured.size, len(self.parameters)))
        by_fitted = self.polynomial.derivatives(self._inside(coordinates[np.newaxis])[0])
        for at, item in enumerate(self.parameters):
            if item.name == BIAS:
                slopes[self.data.peak_to_peak or slice(0), at] = ARCSECOND
            else:
                slopes[:, at] = by_fitted[:, self._place[item.name]]
        return Prediction(values=self.values(coordinates[np.newaxis])[0], by_coordinate=slopes)

    def values(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point datum"]:
        """Return the readings at many points [rad]."""
        found = self.polynomial(self._inside(coordinates))
        for at, item in enumerate(self.parameters):
            if item.name == BIAS:
                bias = (item.start + coordinates[:, at]) * ARCSECOND
                found[:, self.data.peak_to_peak or slice(0)] += bias[:, np.newaxis]
        return np.asarray(found + self.offset)

    @property
    def _place(self) -> dict[str, int]:
        return {item.name: at for at, item in enumerate(self.fitted)}

    def _inside(self, coordinates: Float[np.ndarray, "point parameter"]) -> Float[np.ndarray, "point fitted"]:
        """Return the coordinates of the polynomial's own parameters."""
        found = np.zeros((coordinates.shape[0], len(self.fitted)))
        for at, item in enumerate(self.parameters):
            if item.name != BIAS:
                found[:, self._place[item.name]] = coordinates[:, at]
        return found


def fit_surrogate(kernel: KernelPredictor, seeds: SeedTree) -> Surrogate:
    """Return polynomials of all readings inside the bounds, their error measured on runs that the fit did not see."""
    fitted = tuple(item for item in kernel.parameters if item.name != BIAS)
    polynomial = fit_box_polynomial(
        replace(kernel, parameters=fitted).values, *box(fitted), _DEGREES.get(len(fitted), 2), seeds
    )
    return Surrogate(kernel.parameters, fitted, polynomial, kernel.data)

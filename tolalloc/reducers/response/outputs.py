"""The equivalent model as a response with several outputs: all that requirements limit, and the waves of its orders.

Exact derivatives there are of what is read off torque against twist, without torque, and at tip and root.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float, UInt8

from tolalloc.exceptions import InputError
from tolalloc.models.model import Evaluation, Response, Samples
from tolalloc.reading.plugins import plugins
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, MEGAPASCAL, MICROMETRE, MILLIMETRE
from tolalloc.reducers import (
    BACKLASH,
    EFFICIENCY,
    FRICTION_TORQUE,
    HYSTERESIS_LOSS,
    LOST_MOTION,
    LOST_MOTION_WITH_FRICTION,
    PEAK_TO_PEAK,
    PRELOAD,
    RADIAL_CLEARANCE,
    TORSIONAL_STIFFNESS,
)
from tolalloc.reducers.equivalent import hysteresis
from tolalloc.reducers.equivalent.friction import friction_loop
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES, HysteresisLoop, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import (
    Solved,
    fitted_waves,
    outputs_of,
    radial_clearance,
    radial_clearance_derivatives,
)
from tolalloc.reducers.equivalent.perfect import friction_torque_derivatives, pin_force_derivatives, preload
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.load_case import OverLoadCases
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.response.kernel import Answer, KernelResponse

Errors = Float[np.ndarray, "chunk all_columns"]
WITH_FRICTION = (EFFICIENCY, LOST_MOTION_WITH_FRICTION, HYSTERESIS_LOSS)
"""Outputs of the loop with friction."""
Derived = tuple[Float[np.ndarray, " chunk"], Float[np.ndarray, "chunk all_columns"], UInt8[np.ndarray, " chunk"]]
"""An output of a chunk, its derivatives by all error columns of the model, and the worst status of every sample."""
Width = tuple[Float[np.ndarray, " chunk"], Float[np.ndarray, "chunk all_columns"]]
"""Twist between both directions of a torque, mean over the turn, and its derivatives [rad, rad/m]."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """One solve and the outputs that are read off it."""

    outputs: tuple[str, ...]  # Names of the outputs with their units
    # From the kernel and errors in the order of its model's columns, the outputs and the status of every sample
    read: Callable[[KernelResponse, Float[np.ndarray, "chunk all_columns"]], Answer]


@dataclass(frozen=True)
class _Brought:
    """The reading of another package: what its code does wrong is one sentence."""

    own: Reading

    def __call__(self, kernel: KernelResponse, errors: Errors) -> Answer:
        place, units = f"output {self.own.outputs[0]} of another package", len(errors)
        try:
            values, status = map(np.asarray, self.own.read(kernel, errors))
        except Exception as error:
            why = f"{type(error).__name__}: {error}".partition("\n")[0]
            raise InputError(f"{place}: its code fails ({why}).") from error
        shapes = (units, len(self.own.outputs)), (units,)
        if (values.shape, status.shape) != shapes:
            raise InputError.at(place, "shape of values and status", (values.shape, status.shape), f"{shapes}")
        return values, status


def _loop(kernel: KernelResponse, errors: Errors) -> Answer:
    return _found(_read_off(hysteresis_loop(kernel.model, errors, TURN_ANGLES)))


def _friction_loop(kernel: KernelResponse, errors: Errors) -> Answer:
    loop = friction_loop(kernel.model, errors, TURN_ANGLES)
    own = [100.0 * loop.rated.efficiency, loop.lost_motion / ARCMINUTE, loop.hysteresis_loss / ARCMINUTE]
    return _found([*_read_off(loop.plain), *own])


def _read_off(loop: HysteresisLoop) -> list[Float[np.ndarray, " chunk"]]:
    """Return lost motion, backlash [arcmin] and torsional stiffness [N·m/arcmin]."""
    return [loop.lost_motion / ARCMINUTE, loop.backlash / ARCMINUTE, loop.torsional_stiffness * ARCMINUTE]


def _found(columns: list[Float[np.ndarray, " chunk"]]) -> Answer:
    values = np.stack(columns, axis=1)
    # A loop keeps no statuses: an angle without an equilibrium is not a number in it.
    status = np.where(np.isfinite(values).all(axis=1), Status.CONVERGED, Status.NOT_CONVERGED)
    return values, status.astype(np.uint8)


def _under_load(reducer: Reducer) -> tuple[str, ...]:
    """Return the outputs of one solve that a requirement may limit under the rated torque."""
    forces = (f"largest {own.called} force" for own in family_of(reducer).limited)
    return ("largest pin force", *forces, "share of the pin force on the most loaded disc")


def _load(kernel: KernelResponse, errors: Errors) -> Answer:
    model, torque = kernel.model, kernel.load_torque
    solved = Solved.of(model.at_torque(torque).equilibria(errors, torque, TURN_ANGLES))
    every = outputs_of(model.reducer)
    own = [every[name][1](solved) for name in _under_load(model.reducer)]
    # At the deeper end of a tooth whose disc is tilted; the force spreads evenly where no disc is.
    own += [
        solved.line_load.max(axis=(1, 2, 3)) * MILLIMETRE,
        solved.pressure.max(axis=(1, 2, 3)) / MEGAPASCAL,
    ]
    return np.stack(own, axis=1), np.asarray(solved.equilibria.status.max(axis=1))


def _preload(kernel: KernelResponse, errors: Errors) -> Answer:
    found = preload(kernel.model, errors)
    return np.stack([found.pin_force, found.friction_torque], axis=1), found.status


def _radial_clearance(kernel: KernelResponse, errors: Errors) -> Answer:
    clearance = radial_clearance(kernel.model, errors)[:, np.newaxis] / MICROMETRE
    status = np.where(np.isfinite(clearance[:, 0]), Status.CONVERGED, Status.NOT_FINITE)
    return clearance, status.astype(np.uint8)


_PEAK_TO_PEAK = Reading(outputs=(PEAK_TO_PEAK,), read=KernelResponse.peak_to_peak)
_LOOP = Reading(outputs=(LOST_MOTION, BACKLASH, TORSIONAL_STIFFNESS), read=_loop)
_FRICTION_LOOP = Reading(outputs=(*_LOOP.outputs, *WITH_FRICTION), read=_friction_loop)


def requirements_of(reducer: Reducer) -> tuple[Reading, ...]:
    """Return what a requirement may limit without friction."""
    every = outputs_of(reducer)
    under_load = (
        *(f"{name}, rated torque [{every[name][0]}]" for name in _under_load(reducer)),
        "largest line load, rated torque [N/mm]",
        "peak pressure, rated torque [MPa]",
    )
    shipped = (
        _PEAK_TO_PEAK,
        _LOOP,
        Reading(outputs=under_load, read=_load),
        Reading(outputs=(PRELOAD, FRICTION_TORQUE), read=_preload),
        Reading(outputs=(RADIAL_CLEARANCE,), read=_radial_clearance),
    )
    names = (*WITH_FRICTION, *(name for own in shipped for name in own.outputs))
    brought = plugins("outputs", names, (), "outputs", kind=Reading).values()
    return (*shipped, *(Reading(outputs=tuple(own.outputs), read=_Brought(own)) for own in brought))


def limited_outputs(reducer: Reducer) -> tuple[str, ...]:
    """Return what a requirement may limit; what friction decides only where the reducer's file says enough for it."""
    own = tuple(name for reading in requirements_of(reducer) for name in reading.outputs)
    return own if reducer.friction_dimensions.unknown else (*own, *WITH_FRICTION)


def readings_of(reducer: Reducer, outputs: tuple[str, ...]) -> tuple[Reading, ...]:
    """Return the readings that give the outputs; one with friction gives the loop without it too."""
    loop = _LOOP if {*WITH_FRICTION}.isdisjoint(outputs) else _FRICTION_LOOP
    every = (loop if own is _LOOP else own for own in requirements_of(reducer))
    return tuple(own for own in every if not {*own.outputs}.isdisjoint(outputs))


def wave_outputs(order: float) -> tuple[str, str]:
    """Return the names of the outputs that hold the cosine and the sine of an order of the output turn."""
    return (f"order {order:g} cosine [arcsec]", f"order {order:g} sine [arcsec]")


def _waves(
    orders: tuple[float, ...], transmission_error: Float[np.ndarray, "chunk angle"]
) -> Float[np.ndarray, "chunk output"]:
    """Return cosine and sine of every order [arcsec]."""
    angle = 2.0 * np.pi * np.arange(transmission_error.shape[1]) / transmission_error.shape[1]
    # An unconverged angle is NaN and would spread over all waves; the status keeps the sample out.
    wave = fitted_waves(angle, np.nan_to_num(transmission_error), np.array(orders)) / ARCSECOND
    return np.stack([wave.real, -wave.imag], axis=2).reshape(wave.shape[0], -1)


def orders_reading(orders: tuple[float, ...]) -> Reading:
    """Return the reading of the waves of the transmission error, cosine and sine of every order [arcsec].

    The waves are those of `tolalloc.reducers.equivalent.outputs.fitted_waves`, own derivation.
    """

    def read(kernel: KernelResponse, errors: Errors) -> Answer:
        found = kernel.model.equilibria(errors, kernel.torque)
        return _waves(orders, found.transmission_error), found.status.max(axis=1)

    return Reading(outputs=tuple(name for order in orders for name in wave_outputs(order)), read=read)


def with_orders(readings: tuple[Reading, ...], orders: tuple[float, ...]) -> tuple[Reading, ...]:
    """Return the readings and that of the waves, which are read off the curve that a peak-to-peak is searched on.

    As `orders_reading`, own derivation; the curve's angles are those of the coarse search.
    """

    def read(kernel: KernelResponse, errors: Errors) -> Answer:
        found, curve = kernel.model.extremes_and_curve(errors, kernel.torque)
        return np.hstack([found.peak_to_peak[:, np.newaxis] / ARCSECOND, _waves(orders, curve)]), found.status

    apart = orders_reading(orders)
    if _PEAK_TO_PEAK not in readings:
        return (*readings, apart)
    others = tuple(own for own in readings if own is not _PEAK_TO_PEAK)
    return (Reading(outputs=(PEAK_TO_PEAK, *apart.outputs), read=read), *others)


@dataclass(frozen=True, kw_only=True)
class OutputsResponse:
    """All outputs of several readings, one row per sample."""

    kernel: KernelResponse  # Model, torque, columns, and who observes
    readings: tuple[Reading, ...]  # What is read
    chosen: tuple[str, ...] = ()  # Outputs of the readings that are answered, all of them if empty

    @property
    def columns(self) -> tuple[str, ...]:
        """The kernel's columns."""
        return self.kernel.columns

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs with their units."""
        return self.chosen or self._read

    @property
    def _read(self) -> tuple[str, ...]:
        return tuple(name for reading in self.readings for name in reading.outputs)

    def __call__(self, x: Samples) -> Evaluation:
        """Return the outputs of every sample; a sample fails where one of its readings does."""
        values, status = np.empty((x.shape[0], len(self._read))), np.empty(x.shape[0], np.uint8)
        self.kernel.fill(self.alone.read, x, values, status)
        if self.chosen:
            values = values[:, [self._read.index(name) for name in self.chosen]]
        return Evaluation(values=values, status=status)

    @property
    def alone(self) -> OutputsResponse:
        """The response without what must stay in this process."""
        return replace(self, kernel=self.kernel.alone)

    def read(self, x: Float[np.ndarray, "chunk column"]) -> Answer:
        """Return the outputs of one chunk and the worst status of every sample."""
        errors = self.kernel.errors(x)
        answers = [reading.read(self.kernel, errors) for reading in self.readings]
        worst = np.max([status for _, status in answers], axis=0)
        return np.concatenate([values for values, _ in answers], axis=1), np.asarray(worst)


@dataclass(frozen=True, kw_only=True)
class LoadCasesResponse:
    """Outputs under several load cases, and what is made of them, one row per sample."""

    responses: tuple[Response, ...]  # Of each load case, whose units are counted under the first alone
    # Outputs of the responses together, in their order, as they are named under their load cases
    read: tuple[str, ...]
    outputs: tuple[str, ...]  # What is answered, of `read` or `combined`
    combined: Mapping[str, OverLoadCases]

    @property
    def columns(self) -> tuple[str, ...]:
        """Those of every load case."""
        return self.responses[0].columns

    def __call__(self, x: Samples) -> Evaluation:
        """Return the outputs of every sample; a sample fails where one of its load cases does."""
        found = [response(x) for response in self.responses]
        values, place = np.hstack([own.values for own in found]), {name: at for at, name in enumerate(self.read)}

        def answered(name: str) -> Float[np.ndarray, " sample"]:
            if name in place:
                return values[:, place[name]]
            own = values[:, [place[part] for part in self.combined[name].of]]
            return np.asarray((self.combined[name].weights(own) * own).sum(axis=1))

        status = np.max([own.status for own in found], axis=0)
        return Evaluation(values=np.stack([answered(name) for name in self.outputs], axis=1), status=np.asarray(status))


def _loop_derivatives(output: str, kernel: KernelResponse, errors: Errors) -> Derived:
    model = kernel.model
    if output != TORSIONAL_STIFFNESS:
        share = hysteresis.LOST_MOTION if output == LOST_MOTION else hysteresis.BACKLASH
        (width, slope), status = _width(model, errors, share)
        return width / ARCMINUTE, slope / ARCMINUTE, status
    (low, by_low), first = _width(model, errors, hysteresis.LOST_MOTION)
    (high, by_high), second = _width(model, errors, 1.0)
    rated = model.reducer.load.rated_torque
    stiffness = 2.0 * (1.0 - hysteresis.LOST_MOTION) * rated / (high - low) * ARCMINUTE
    by_error = -(stiffness / (high - low))[:, np.newaxis] * (by_high - by_low)
    return stiffness, by_error, np.maximum(first, second)


def _width(model: EquivalentModel, errors: Errors, share: float) -> tuple[Width, UInt8[np.ndarray, " chunk"]]:
    """Return the width of the loop at a share of the rated torque."""
    torque = share * model.reducer.load.rated_torque
    width, slope = np.zeros(len(errors)), np.zeros(errors.shape)
    status = np.full(len(errors), Status.CONVERGED, np.uint8)
    for side in (1, -1):
        twist, found = model.at_torque(side * torque).rotation_derivatives(errors, side * torque, TURN_ANGLES)
        width += side * twist.mean(axis=1)
        slope += side * found.by_error.reshape(*twist.shape, -1).mean(axis=1)
        np.maximum(status, found.status.reshape(twist.shape).max(axis=1), out=status)
    return (width, slope), status


def _clearance_derivatives(kernel: KernelResponse, errors: Errors) -> Derived:
    clearance, status = _radial_clearance(kernel, errors)
    return clearance[:, 0], radial_clearance_derivatives(kernel.model, errors) / MICROMETRE, status


_DERIVED: dict[str, Callable[[KernelResponse, Float[np.ndarray, "chunk all_columns"]], Derived]] = {
    **{name: partial(_loop_derivatives, name) for name in (LOST_MOTION, BACKLASH, TORSIONAL_STIFFNESS)},
    PRELOAD: lambda kernel, errors: pin_force_derivatives(kernel.model, errors),
    FRICTION_TORQUE: lambda kernel, errors: friction_torque_derivatives(kernel.model, errors),
    RADIAL_CLEARANCE: _clearance_derivatives,
}

DIFFERENTIABLE = tuple(_DERIVED)
"""Outputs that `output_derivatives` takes."""


def output_derivatives(
    kernel: KernelResponse, output: str, x: Samples
) -> tuple[Evaluation, Float[np.ndarray, "sample all_columns"]]:
    """Return one of `DIFFERENTIABLE` of every sample, and its derivatives by all error columns of the model.

    What is read off torque against twist takes two to four times as long as the output alone, the adjoint of the
    equilibrium at every angle and torque; what presses without torque hardly longer, one adjoint.

    Theory page equation (23), own derivation: the width of a loop is θ(T) − θ(−T), its derivative the difference of the
    adjoints'; of K = 2·0.97·T/(w₁ − w₃) [N·m/arcmin] it is −K/(w₁ − w₃)·∂(w₁ − w₃). They hold while the same pins
    carry.
    """
    values, status = np.empty(len(x)), np.empty(len(x), np.uint8)
    slopes = np.empty((len(x), len(kernel.model.columns)))
    kernel.fill(partial(_derived, kernel.alone, output), x, values, slopes, status)
    return Evaluation(values=values[:, np.newaxis], status=status), slopes


def _derived(kernel: KernelResponse, output: str, x: Float[np.ndarray, "chunk column"]) -> Derived:
    return _DERIVED[output](kernel, kernel.errors(x))

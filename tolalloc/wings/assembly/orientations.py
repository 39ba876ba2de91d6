"""What the final orientations of an assembly do to the transmission, over the precision weight too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import ANGULAR, is_angular
from tolalloc.exceptions import InputError, SolveError
from tolalloc.models.model import Evaluation, Observer
from tolalloc.reading.units import ARCSECOND, MEGAPASCAL, MILLIMETRE
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reducers.cycloid.solvers import LAWS, LINEAR
from tolalloc.reducers.equivalent.columns import source_name
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import ContactPattern, Solved, contact_pattern
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.kernel import Answer, KernelResponse
from tolalloc.reducers.response.outputs import OutputsResponse, Reading
from tolalloc.wings.assembly.chain import DatumFlowChain
from tolalloc.wings.assembly.control import regulator
from tolalloc.wings.assembly.gains import assembled, tuned_gains
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.trajectory import foreseen, random_numbers

_DRAWS = 50
"""Random assemblies whose transmission is solved where the parts are not measured [-]."""
_AT_ONCE = 64
"""Samples whose pins are read at all angles of a turn together, some 40 MB per quantity [-]."""


@dataclass(frozen=True, kw_only=True)
class TransmissionCurves:
    """Transmission of samples over one output turn at one torque."""

    carrier_angle: Float[np.ndarray, " angle"]  # θc [rad]
    transmission_error: Float[np.ndarray, "sample angle"]  # Carrier rotation beyond θc, output side [rad]
    pin_force: Float[np.ndarray, "sample angle"]  # Largest force between a pin and a tooth [N]
    disc_force: Float[np.ndarray, "sample angle"]  # Largest sum of the pin forces of one disc [N]
    line_load: Float[np.ndarray, "sample angle"]  # Largest line load of pins and teeth [N/m]
    pressure: Float[np.ndarray, "sample angle"]  # Largest Hertz pressure of pins and teeth [Pa]
    pins_in_contact: Float[np.ndarray, "sample angle"]  # Pins that carry load, all discs [-]
    status: UInt8[np.ndarray, "sample angle"]  # Values of `tolalloc.reducers.equivalent.model.Status` [-]


def transmission_curves(
    model: EquivalentModel, errors: Float[np.ndarray, "sample column"], torque: float
) -> TransmissionCurves:
    """Return the transmission of a few samples over one output turn, at the coarse angles of the model's search.

    Errors are in the order of the model's columns, `OrientationResponse.errors` [m, angles rad]; a negative torque on
    the carrier resists the rotation [N·m].
    """
    solved = Solved.of(model.equilibria(errors, torque))
    found, pins = solved.equilibria, solved.forces.pins
    return TransmissionCurves(
        carrier_angle=found.carrier_angle,
        transmission_error=found.transmission_error,
        pin_force=pins.max(axis=(2, 3)),
        disc_force=pins.sum(axis=3).max(axis=2),
        line_load=solved.line_load.max(axis=(2, 3)),
        pressure=solved.pressure.max(axis=(2, 3)),
        pins_in_contact=found.pins_in_contact.astype(float),
        status=found.status,
    )


def _unloaded(kernel: KernelResponse, errors: Float[np.ndarray, "chunk all_columns"]) -> Answer:
    found, curves = kernel.extremes(errors), kernel.model.equilibria(errors, kernel.torque)
    values = np.stack([found.peak_to_peak, curves.transmission_error.mean(axis=1)], axis=1) / ARCSECOND
    return values, np.maximum(found.status, curves.status.max(axis=1))


def _loaded(kernel: KernelResponse, errors: Float[np.ndarray, "chunk all_columns"]) -> Answer:
    rated = kernel.load_torque
    model = kernel.model.at_torque(rated)
    found = model.extremes(errors, rated)
    values, status = [], []
    for first in range(0, errors.shape[0], _AT_ONCE):
        curves = transmission_curves(model, errors[first : first + _AT_ONCE], rated)
        largest = [
            curves.pin_force.max(axis=1),
            curves.disc_force.max(axis=1),
            curves.line_load.max(axis=1) * MILLIMETRE,
            curves.pressure.max(axis=1) / MEGAPASCAL,
        ]
        values.append(np.stack([*largest, curves.pins_in_contact.mean(axis=1)], axis=1))
        status.append(curves.status.max(axis=1))
    peak_to_peak = found.peak_to_peak[:, np.newaxis] / ARCSECOND
    return np.hstack([peak_to_peak, np.concatenate(values)]), np.maximum(found.status, np.concatenate(status))


RATED_PEAK_TO_PEAK = "peak-to-peak transmission error, rated torque [arcsec]"
PIN_FORCE = "largest pin force, rated torque [N]"
DISC_FORCE = "largest sum of pin forces of a disc, rated torque [N]"
LINE_LOAD = "largest line load, rated torque [N/mm]"
PRESSURE = "peak pressure, rated torque [MPa]"
_RATED = (RATED_PEAK_TO_PEAK, PIN_FORCE, DISC_FORCE, LINE_LOAD, PRESSURE, "pins in contact, mean, rated torque [-]")
TRANSMISSION = (
    Reading(outputs=(PEAK_TO_PEAK, "mean transmission error [arcsec]"), read=_unloaded),
    Reading(outputs=_RATED, read=_loaded),
)
"""What orientations change: at the test torque, and at rated torque at every coarse angle of the model's search."""


@dataclass(frozen=True, kw_only=True)
class TransmissionEffect:
    """What the final angles do to the transmission, over the precision."""

    reducer: Reducer  # The reducer that the parts belong to
    test_torque: float  # Torque of the transmission error that is not said to be at rated torque [N·m]
    state_weights: Float[np.ndarray, " state_weight"]  # Q [-]
    outputs: tuple[str, ...]  # Names of the outputs, units in them
    perfect: Float[np.ndarray, " output"]  # Outputs without any angular error [as the names say]
    # Outputs of the same assemblies at every precision; one assembly where the parts are measured [as the names say]
    values: Float[np.ndarray, "state_weight sample output"]
    good: Bool[np.ndarray, " sample"]  # Which assemblies have all outputs at every precision
    perfect_curves: TransmissionCurves  # One output turn without any angular error, at rated torque
    curves: TransmissionCurves  # One output turn of the first good assembly at every precision, at rated torque
    # Load of one of its discs on the pins at every precision, at rated torque: disc and carrier angle are those at
    # which the line load is largest if nothing is turned
    patterns: tuple[ContactPattern, ...]


@dataclass(frozen=True, kw_only=True)
class OrientationResponse:
    """Transmission of a reducer over the final orientations of its parts; every other error is zero."""

    model: EquivalentModel  # The reducer
    chain: DatumFlowChain  # Its parts, and which columns of the model their orientations move
    torque: float  # Test torque on the carrier; negative resists the rotation [N·m]
    observe: Observer = KernelResponse.observe  # Told the statuses of each chunk
    readings: tuple[Reading, ...] = TRANSMISSION  # What is read

    def __post_init__(self) -> None:
        reducer, law = self.model.reducer, self.model.reducer.stiffness.pin_contact_law
        place, moved = f"datum flow chain of {reducer.name}", self._moved(np.zeros((1, len(self.columns))))
        if not moved:
            raise InputError.at(place, "columns that its parts move", [], "at least one column of the reducer's model")
        tilts = [f"disc{disc + 1}.tilt" for disc in range(reducer.disc_count)]
        for name in moved:
            if name in self.model.columns:
                if not is_angular(source_name(name)):
                    raise InputError.at(place, "column", name, f"an angle, whose source ends in {' or '.join(ANGULAR)}")
                continue
            if LAWS[law] != LINEAR and name.rpartition(".")[0] in tilts:
                linear = " or ".join(known for known in LAWS if LAWS[known] == LINEAR)
                raise InputError.at(place, f"law of the pin contact, with {name},", law, linear)
            size = f"{reducer.disc_count} discs and {reducer.crank_count} crankshafts"
            raise InputError.at(place, "column", name, f"an error column of a reducer with {size}")

    @property
    def columns(self) -> tuple[str, ...]:
        """Rotation of every part about the datum's axes, in the order of the states [rad]."""
        return tuple(f"{part}.{axis}" for part in self.chain.names for axis in "xyz")

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of all outputs with their units."""
        return tuple(name for reading in self.readings for name in reading.outputs)

    def __call__(self, x: Float[np.ndarray, "sample column"]) -> Evaluation:
        """Return the transmission of every sample of orientations [rad]."""
        return OutputsResponse(kernel=self._kernel, readings=self.readings)(self._deviations(x))

    def errors(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample all_columns"]:
        """Return the deviations in the order of the model's columns [m, angles rad] for orientations [rad]."""
        return self._kernel.errors(self._deviations(x))

    @property
    def _kernel(self) -> KernelResponse:
        names = tuple(self._moved(np.zeros((1, len(self.columns)))))
        others = {name: 0.0 for name in self.model.columns if name not in names}
        fixed = others | self.model.reducer.modification.deviations
        return KernelResponse(model=self.model, torque=self.torque, columns=names, fixed=fixed, observe=self.observe)

    def _moved(self, x: Float[np.ndarray, "sample column"]) -> dict[str, Float[np.ndarray, " sample"]]:
        return self.chain.columns(x.reshape(-1, len(self.chain.parts), 3))

    def _deviations(self, x: Float[np.ndarray, "sample column"]) -> Float[np.ndarray, "sample moved"]:
        return np.stack(list(self._moved(x).values()), axis=1)


def transmission_effect(
    plan: AssemblyPlan,
    errors: Float[np.ndarray, "part 3"] | None,
    state_weights: Float[np.ndarray, " state_weight"],
    seeds: SeedTree,
    observe: Observer,
) -> TransmissionEffect:
    """Return what the final angles do to the transmission, at every precision Q [-] of a plan that names a reducer.

    Unless errors of the parts were measured [rad], parts are drawn from the plan's tolerances.
    """
    reducer = load_reducer(plan.reducer)
    torque = reducer.load.test_torque
    model = EquivalentModel(at_torque(reducer, torque))
    response = OrientationResponse(model=model, chain=plan.chain, torque=torque, observe=observe)
    final = _final_angles(plan, errors, state_weights, seeds)
    perfect = response(np.zeros((1, final.shape[2])))
    found = response(final.reshape(-1, final.shape[2]))
    good = np.asarray(found.good.reshape(final.shape[:2]).all(axis=0))
    if not (perfect.good.all() and good.any() and (~good).mean() <= LARGEST_FAILED_SHARE):
        raise SolveError(
            f"{plan.name}: {int((~good).sum())} of {good.size} assemblies have no equilibrium at some angle."
        )
    shown = response.errors(np.concatenate([np.zeros((1, final.shape[2])), final[:, np.argmax(good)]]))
    rated = float(np.copysign(reducer.load.rated_torque, torque))
    discs = [contact_pattern(model, shown[1], rated, disc + 1) for disc in range(reducer.disc_count)]
    worst = max(discs, key=lambda pattern: float(pattern.line_load.max()))
    return TransmissionEffect(
        reducer=reducer,
        test_torque=torque,
        state_weights=state_weights,
        outputs=response.outputs,
        perfect=perfect.values[0],
        values=found.values.reshape(*final.shape[:2], -1),
        good=good,
        perfect_curves=transmission_curves(model, shown[:1], rated),
        curves=transmission_curves(model, shown[1:], rated),
        patterns=tuple(contact_pattern(model, each, rated, worst.disc, worst.carrier_angle) for each in shown[1:]),
    )


def _final_angles(
    plan: AssemblyPlan,
    errors: Float[np.ndarray, "part 3"] | None,
    state_weights: Float[np.ndarray, " state_weight"],
    seeds: SeedTree,
) -> Float[np.ndarray, "state_weight sample state"]:
    """Return final angles of the measured parts, or of the same random assemblies at every precision [rad]."""
    space = plan.space
    if errors is not None:
        own = errors.ravel()[np.newaxis]
        weights = (plan.final_weight(float(state_weight)) for state_weight in state_weights)
        return np.array([foreseen(space, regulator(space, weight), own).adjusted[:, -1] for weight in weights])
    standard = seeds.generator().standard_normal((_DRAWS, random_numbers(space)))
    gains = (tuned_gains(plan, float(state_weight), plan.tolerances) for state_weight in state_weights)
    return np.array([assembled(plan, own, plan.tolerances, standard).adjusted[:, -1] for own in gains])

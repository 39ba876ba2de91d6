"""A reducer through a speed and a torque profile, beside the static model at the same angles."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float, Int

from tolalloc.exceptions import InputError, SolveError, UnknownNameError
from tolalloc.reading.named_fields import NamedFields, number, or_none
from tolalloc.reading.units import ARCSECOND, RPM
from tolalloc.reducers.equivalent.model import EquivalentModel, Status
from tolalloc.reducers.equivalent.outputs import forces
from tolalloc.reducers.equivalent.springs import HARMONICS
from tolalloc.reducers.reducer.design import Reducer, at_torque
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import BuiltUnit, load_unit
from tolalloc.running.progress import Progress
from tolalloc.wings.motion.motion import (
    Damping,
    Inertia,
    Motion,
    SpeedProfile,
    generalised_alpha,
    inertia_of,
    motion_of,
    newmark,
)
from tolalloc.wings.motion.prototype import RIGID, TimeCourse, TimeSteps, part_errors, simulate_prototype
from tolalloc.wings.motion.prototype import engine as multibody_engine
from tolalloc.wings.motion.speeds import modes
from tolalloc.wings.motion.stepping import simulate as simulate_model

SPECTRAL_RADIUS = 0.9
INTEGRATORS = {"newmark": newmark(), "generalised-alpha": generalised_alpha(SPECTRAL_RADIUS)}
"""Integrators of the equivalent model by name."""
ENGINES = (*INTEGRATORS, "exudyn")
"""What can simulate: the equivalent model by either integrator, or the virtual prototype."""
MOST_STEPS = 200_000
"""Time steps beyond which the forces of all pins would fill the memory [-]."""
OWN_MASS_DAMPING = 500.0
"""Damping over mass of the carrier without a load, unless another is asked for: about 2 % at 2 kHz [1/s]."""
FEWEST_STEPS = 4
"""Time steps per pin pass below which a run says nothing [-]."""
LARGEST_TORQUE = 10.0
"""Largest torque over the rated one [-]."""
LOAD_TIME = 0.5
"""Time in which the load rises after the speed has, over the time of the speed: 1.0 to 1.5 s in xi2015 [-]."""
ALTERNATING = 0.05
"""Amplitude from step to step over the static peak-to-peak, above which it is not the reducer's [-]."""
UNCLOSED = 1e-3
"""Power that leaves over power that enters, less one, above which the run has not settled or the engine errs [-]."""
UNSETTLED = 0.1
"""Change of the deviation from the static model between both halves, over the larger, above which it decays [-]."""
ANSWERED = ("output_speed", "output_acceleration", "transmission_error", "input_torque", "pin_forces")
"""What an engine answers over time beside what drives it, fields of `TimeSeries`."""
Answered = dict[str, Float[np.ndarray, "time ..."]]
READ = 0.02 * ARCSECOND
"""Deviation that is too small to matter [rad]."""
TURNING_BACK = -0.45
"""Correlation of successive changes below which a quantity turns back at every step; −0.5 has noise [-]."""
MOST_ANGLES = 5000
"""Angles at which the static model is asked beside the simulation [-]."""
MODE_ANGLES = 200
"""Angles at which natural frequencies are looked for [-]."""


_Positive = Annotated[float, number("a number above 0", above=0)]
_NotNegative = Annotated[float, number("0 or a positive number", least=0)]


@dataclass(frozen=True, kw_only=True)
class SimulationRequest(NamedFields):
    """What is to be simulated; as it stands, the run of xi2015."""

    called: ClassVar[str] = "simulation"
    are_arguments: ClassVar[bool] = True

    reducer: str = "rv40e"  # Preset or TOML file
    unit: str = "exact"  # Shipped unit or TOML file
    speed_rpm: _Positive = 525.0  # Input speed that is reached [rpm]
    # Torque on the carrier, negative as it resists the rotation; minus the rated one unless given [N·m]
    torque_nm: float | None = None
    engine: str = "generalised-alpha"  # One of `ENGINES`
    duration: _Positive = 2.0  # Simulated time [s]
    ramp: _Positive = 1.0  # Time in which the speed rises; the load rises in half of it afterwards [s]
    step: _Positive = 5e-5  # Time step [s]
    output_inertia: _NotNegative = 0.0  # Moment of inertia that the carrier turns besides its own [kg·m²]
    damping: _NotNegative = 1e-5  # Damping over stiffness of meshes and bearings [s]
    # Damping over mass of every part, in the prototype of the carrier's rotation alone; 500 1/s are a damping ratio of
    # 2 % at 2 kHz [1/s]
    mass_damping: Annotated[float | None, or_none(number("0 or a positive number", least=0))] = None
    # Stiffness of every pin contact in place of the reducer's own law [N/m]
    pin_stiffness: Annotated[float | None, or_none(number("a number above 0", above=0))] = None

    def __post_init__(self) -> None:
        UnknownNameError.require("simulation", "engine", self.engine, ENGINES)
        super().__post_init__()
        if not self.duration / MOST_STEPS <= self.step <= self.duration:
            allowed = f"{self.duration / MOST_STEPS:.3g} s to the duration of {self.duration:g} s"
            raise InputError.of_argument("simulation", "step", self.step, allowed)


@dataclass(frozen=True, kw_only=True)
class PreparedSimulation:
    """A checked simulation."""

    asked: SimulationRequest  # What was asked
    reducer: Reducer  # Design with the pin contacts that were asked for
    unit: BuiltUnit  # Its errors
    torque: float  # Torque on the carrier; negative resists the rotation [N·m]

    @property
    def speed(self) -> float:
        """Input speed that is reached [rad/s]."""
        return self.asked.speed_rpm * RPM

    @property
    def loaded(self) -> float:
        """When the load has risen [s]."""
        return (1.0 + LOAD_TIME) * self.asked.ramp

    @property
    def crank_turn(self) -> float:
        """Time of one turn of the cranks against the housing [s]."""
        return 2 * np.pi * self.reducer.ratio / (self.speed * self.reducer.cycloid_stage.disc_teeth)

    @property
    def crank_turns(self) -> int:
        """Whole crank turns under full speed and load [-]."""
        return int((self.asked.duration - self.loaded) / self.crank_turn + 1e-9)

    @property
    def mass_damping(self) -> float:
        """Damping over mass [1/s]."""
        if self.asked.mass_damping is not None:
            return self.asked.mass_damping
        return OWN_MASS_DAMPING * inertia_of(self.reducer).carrier_moment / self.inertia.carrier_moment

    @property
    def inertia(self) -> Inertia:
        """Of the parts."""
        return inertia_of(self.reducer, output_inertia=self.asked.output_inertia)

    @cached_property
    def motion(self) -> Motion:
        """Nominal motion and load."""
        asked = self.asked
        speed = SpeedProfile((0.0, asked.ramp), (0.0, self.speed), "step")
        torque = SpeedProfile((asked.ramp, self.loaded), (0.0, self.torque), "step")
        return motion_of(self.reducer, speed, torque, asked.duration, round(asked.duration / asked.step))

    @cached_property
    def model(self) -> EquivalentModel:
        """The equivalent model."""
        return EquivalentModel(at_torque(self.reducer, self.torque), orders=self.unit.orders or HARMONICS)

    @cached_property
    def errors(self) -> Float[np.ndarray, "1 column"]:
        """Deviations in the order of the model's columns [m, angles rad]."""
        return self.unit.errors(self.model.columns, self.reducer.modification.deviations)

    @property
    def prototype_errors(self) -> dict[str, float]:
        """Deviations other than the modification [m]."""
        modification = self.reducer.modification.deviations
        return {name: value for name, value in self.unit.deviations.items() if value and name not in modification}


def prepare_simulation(asked: SimulationRequest) -> PreparedSimulation:
    """Return a simulation with its files read and checked."""
    unit, designed = load_unit(asked.unit), load_reducer(asked.reducer)
    _ = inertia_of(designed)  # a single stage or a centre gear, of which no masses are known, is refused first
    reducer = unit.as_built(designed)
    if asked.engine == "exudyn":
        multibody_engine()
        # The prototype takes the unit's own modification from the teeth.
        reducer = replace(with_ideal_gears(reducer), modification=unit.modification(reducer))
    if asked.pin_stiffness is not None:
        own: dict[str, Any] = {"pin_contact": asked.pin_stiffness, "pin_contact_law": "constant", "pin_bending": inf}
        reducer = replace(reducer, stiffness=replace(reducer.stiffness, **own))
    torque = -reducer.load.rated_torque if asked.torque_nm is None else asked.torque_nm
    if not -LARGEST_TORQUE * reducer.load.rated_torque <= torque < 0.0:
        lowest = -LARGEST_TORQUE * reducer.load.rated_torque
        allowed = f"{lowest:g} N·m to below 0, which resists the rotation; a load that drives it is not simulated"
        raise InputError.of_argument("simulation", "torque_nm", torque, allowed)
    prepared = PreparedSimulation(asked=asked, reducer=reducer, unit=unit, torque=torque)
    if prepared.crank_turns < 1:
        least = prepared.loaded + prepared.crank_turn
        allowed = f"{least:.4g} s or more, which the ramps of speed and load and one crank turn take"
        raise InputError.of_argument("simulation", "duration", asked.duration, allowed)
    longest = prepared.crank_turn / reducer.cycloid_stage.pin_count / FEWEST_STEPS
    if asked.step > longest:
        allowed = f"up to {longest:.3g} s, {FEWEST_STEPS} steps per pin pass"
        raise InputError.of_argument("simulation", "step", asked.step, allowed)
    _ = prepared.errors  # an error that an engine does not know is said before anything runs
    if asked.engine == "exudyn":
        part_errors(reducer, prepared.prototype_errors)
    return prepared


def with_ideal_gears(reducer: Reducer) -> Reducer:
    """Return the reducer with a first stage that does not yield, as the prototype has it.

    Own derivation: K_sp = K_s = 1e13 N/m.

    >>> with_ideal_gears(load_reducer("rv40e_xi2015")).stiffness.gear_mesh  # `RIGID` [N/m]
    10000000000000.0
    """
    return replace(reducer, stiffness=replace(reducer.stiffness, gear_mesh=RIGID, sun_support=RIGID))


@dataclass(frozen=True, kw_only=True)
class TimeSeries:
    """A reducer over time."""

    time: Float[np.ndarray, " time"]  # Equally spaced times [s]
    carrier_angle: Float[np.ndarray, " time"]  # θc of the nominal motion [rad]
    # Of the sun gear, as prescribed [rad/s, rad/s²]
    input_speed: Float[np.ndarray, " time"]
    input_acceleration: Float[np.ndarray, " time"]
    # Of the carrier [rad/s, rad/s²]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]  # Carrier rotation beyond θc, output side [rad]
    input_torque: Float[np.ndarray, " time"]  # On the sun gear, positive where it drives [N·m]
    output_torque: Float[np.ndarray, " time"]  # On the carrier; negative resists the rotation [N·m]
    pin_forces: Float[np.ndarray, "time disc pin"]  # Normal force between every pin and every disc [N]

    @property
    def pins_in_contact(self) -> Int[np.ndarray, "time disc"]:
        """Pins that carry, on each disc [-]."""
        return np.asarray((self.pin_forces > 0).sum(axis=2))


@dataclass(frozen=True, kw_only=True)
class AtRest:
    """The static model at carrier angles of the steady part, under its torque."""

    steps: Int[np.ndarray, " angle"]  # Numbers of the time steps with these angles [-]
    transmission_error: Float[np.ndarray, " angle"]  # Carrier rotation beyond θc, output side [rad]
    pin_forces: Float[np.ndarray, "angle disc pin"]  # Normal force between every pin and every disc [N]
    seconds: float  # Computing time [s]


@dataclass(frozen=True, kw_only=True)
class SimulationResult:
    """A simulated reducer: what an engine leaves over time, and the numbers of its steady part."""

    prepared: PreparedSimulation  # What was asked
    series: TimeSeries  # Over the whole time
    steady: slice  # Time steps of the last whole crank turns under constant speed and load
    at_rest: AtRest  # The static model beside it
    # Lowest natural frequency over the steady part; none where springs are not linear [Hz]
    natural_frequency: float | None
    seconds: float  # Computing time of the simulation [s]

    @property
    def engine(self) -> str:
        """Who integrated, one of `ENGINES`."""
        return self.prepared.asked.engine

    @property
    def step(self) -> float:
        """Time step [s]."""
        return float(self.series.time[1] - self.series.time[0])

    @property
    def pin_pass(self) -> float:
        """How often per second a disc passes a pin [Hz]."""
        stage = self.prepared.reducer.cycloid_stage
        return self._output_turns * stage.disc_teeth * stage.pin_count

    @property
    def _output_turns(self) -> float:
        """How often per second the output turns [Hz]."""
        return self.prepared.speed / (2 * np.pi) / self.prepared.reducer.ratio

    @property
    def span(self) -> float:
        """Carrier angle over which the steady part goes [rad]."""
        return self.prepared.crank_turns * 2 * np.pi / self.prepared.reducer.cycloid_stage.disc_teeth

    @property
    def output_speed(self) -> float:
        """Mean speed of the carrier in the steady part [rad/s]."""
        return float(self.series.output_speed[self.steady].mean())

    @property
    def ratio(self) -> float:
        """Mean input speed over mean output speed in the steady part [-]."""
        return float(self.series.input_speed[self.steady].mean() / self.output_speed)

    @property
    def input_power(self) -> float:
        """Mean power that the sun gear brings in [W]."""
        return float((self.series.input_torque * self.series.input_speed)[self.steady].mean())

    @property
    def output_power(self) -> float:
        """Mean power that the carrier gives away [W]."""
        return float(-(self.series.output_torque * self.series.output_speed)[self.steady].mean())

    @property
    def transmission_error(self) -> Float[np.ndarray, " angle"]:
        """Transmission error where the static model has its own [rad]."""
        return np.asarray(self.series.transmission_error[self.at_rest.steps])

    @property
    def peak_to_peak(self) -> tuple[float, float]:
        """Peak-to-peak transmission error in motion and at rest, at the same angles [rad]."""
        return float(np.ptp(self.transmission_error)), float(np.ptp(self.at_rest.transmission_error))

    @property
    def difference(self) -> Float[np.ndarray, " angle"]:
        """What motion adds to the transmission error [rad]."""
        return np.asarray(self.transmission_error - self.at_rest.transmission_error)

    @property
    def largest_force(self) -> tuple[float, float]:
        """Largest force of a pin in motion and at rest, at the same angles [N]."""
        return float(self.series.pin_forces[self.at_rest.steps].max()), float(self.at_rest.pin_forces.max())

    @property
    def contacts(self) -> tuple[tuple[int, int], ...]:
        """Least and most pins that carry in the steady part, disc by disc [-]."""
        return _least_and_most(self.series.pins_in_contact[self.steady])

    @property
    def contacts_at_rest(self) -> tuple[tuple[int, int], ...]:
        """The same in the static model [-]."""
        return _least_and_most((self.at_rest.pin_forces > 0).sum(axis=2))

    @property
    def excitations(self) -> dict[str, float]:
        """How often per second the strong orders of the output turn and of the pin pass come by [Hz]."""
        stage, turn = self.prepared.reducer.cycloid_stage, self._output_turns
        orders = {1, stage.disc_teeth, stage.pin_count, 2 * stage.disc_teeth, 2 * stage.pin_count}
        found = {f"order {order}": order * turn for order in sorted(orders)}
        return found | {f"{times} times the pin pass": times * self.pin_pass for times in (1, 2, 3)}

    @property
    def is_unsettled(self) -> bool:
        """Whether what motion adds still decays, or power does not close."""
        first, second = np.array_split(self.difference, 2)
        one, other = (np.ptp(half) for half in (first, second))
        decays = abs(one - other) > max(UNSETTLED * max(one, other), READ)
        return bool(decays) or abs(self.output_power / self.input_power - 1) > UNCLOSED

    @property
    def ringing(self) -> Literal["", "transmission error", "output acceleration"]:
        """What vibrates too fast for the time step; empty if nothing does."""
        error = self.series.transmission_error[self.steady]
        change = np.diff(self.series.output_acceleration[self.steady])
        if rms(np.diff(error, 2)) / 4 > ALTERNATING * self.peak_to_peak[1]:
            return "transmission error"
        turns_back = (change[1:] * change[:-1]).sum() < TURNING_BACK * (change**2).sum()
        return "output acceleration" if turns_back else ""


def _least_and_most(counts: Int[np.ndarray, "time disc"]) -> tuple[tuple[int, int], ...]:
    return tuple(zip(counts.min(axis=0).tolist(), counts.max(axis=0).tolist(), strict=True))


def rms(values: Float[np.ndarray, "..."]) -> float:
    """Return the root of the mean square, √(Σx²/n), in the unit of the values.

    >>> rms(np.array([3.0, 4.0, 0.0, 0.0]))
    2.5
    """
    return float(np.sqrt(np.mean(values**2)))


def simulate(prepared: PreparedSimulation, progress: Progress) -> SimulationResult:
    """Return what a reducer does over time, and the static model at the same angles.

    The simulated milliseconds are told as progress.
    """
    asked, motion = prepared.asked, prepared.motion
    progress.begin(f"in motion, {asked.engine}", int(1e3 * asked.duration + 1e-6), "ms")
    start = time.perf_counter()
    simulated = _prototype if asked.engine == "exudyn" else _equivalent
    ratio = prepared.reducer.ratio
    series = TimeSeries(
        time=motion.time,
        carrier_angle=motion.carrier_angle,
        input_speed=motion.carrier_speed * ratio,
        input_acceleration=motion.carrier_acceleration * ratio,
        output_torque=motion.torque,
        **simulated(prepared, motion, _milliseconds(asked.duration, progress)),
    )
    seconds = time.perf_counter() - start
    count = round(prepared.crank_turns * prepared.crank_turn / motion.step)
    steady = slice(motion.time.size - count, motion.time.size)
    progress.begin("at rest")
    return SimulationResult(
        prepared=prepared,
        series=series,
        steady=steady,
        at_rest=_at_rest(prepared, motion, steady),
        natural_frequency=_natural_frequency(prepared, motion, steady),
        seconds=seconds,
    )


def _milliseconds(duration: float, progress: Progress) -> Callable[[float], None]:
    """Return what turns the share of the time that is simulated into further milliseconds."""
    told = 0

    def tell(share: float) -> None:
        nonlocal told
        new = int(1e3 * duration * share + 1e-6) - told
        if new > 0:
            progress.advance(new)
            told += new

    return tell


def _damping(prepared: PreparedSimulation) -> Damping:
    return Damping(mass_proportional=prepared.mass_damping, stiffness_proportional=prepared.asked.damping)


def _equivalent(prepared: PreparedSimulation, motion: Motion, tell: Callable[[float], None]) -> Answered:
    """Simulate the equivalent model."""
    asked, every = prepared.asked, np.arange(motion.time.size)
    given = (prepared.inertia, _damping(prepared), INTEGRATORS[asked.engine])
    found = simulate_model(prepared.model, prepared.errors, motion, *given, every, tell)
    failed = np.flatnonzero(found.status[0] != Status.CONVERGED)
    if failed.size:
        outcome = Status(int(found.status[0, failed[0]])).sentence
        raise SolveError(f"unit {prepared.unit.name}: no motion from {motion.time[failed[0]]:.4g} s on: {outcome}.")
    return {name: getattr(found, name)[0] for name in ANSWERED}


def _prototype(prepared: PreparedSimulation, motion: Motion, tell: Callable[[float], None]) -> Answered:
    """Simulate the virtual prototype."""
    asked = prepared.asked
    found = simulate_prototype(
        prepared.reducer,
        prepared.inertia,
        _damping(prepared),
        TimeCourse.step(prepared.speed, 0.0, asked.ramp),
        TimeCourse.step(prepared.torque, asked.ramp, prepared.loaded),
        TimeSteps(duration=asked.duration, step=motion.step, output_step=motion.step),
        prepared.prototype_errors,
        tell,
    )
    if found.time.size != motion.time.size:
        raise SolveError(f"virtual prototype: {found.time.size} answers in {motion.time.size} time steps.")
    return {name: getattr(found, name) for name in ANSWERED}


def _at_rest(prepared: PreparedSimulation, motion: Motion, steady: slice) -> AtRest:
    """Return the static model at some angles of the steady part."""
    steps = np.arange(motion.time.size)[steady]
    steps = steps[:: -(-steps.size // MOST_ANGLES)]
    start = time.perf_counter()
    found = prepared.model.equilibria(prepared.errors, prepared.torque, motion.carrier_angle[steps])
    pins, worst = forces(found).pins[0], Status(int(found.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {prepared.unit.name}: no equilibrium at rest at some angle: {worst.sentence}.")
    seconds = time.perf_counter() - start
    return AtRest(steps=steps, transmission_error=found.transmission_error[0], pin_forces=pins, seconds=seconds)


def _natural_frequency(prepared: PreparedSimulation, motion: Motion, steady: slice) -> float | None:
    """Return the lowest natural frequency over the steady part [Hz]."""
    angle = motion.carrier_angle[steady]
    angle = angle[:: -(-angle.size // MODE_ANGLES)]
    try:
        found = modes(prepared.model, prepared.errors[0], prepared.torque, prepared.inertia, angle)
    except InputError:  # springs that are not linear have no natural frequency
        return None
    return float(found.frequency.min())

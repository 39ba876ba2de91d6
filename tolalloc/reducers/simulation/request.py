"""Which reducer is to be simulated, under which speed and load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import RPM
from tolalloc.reducers.dynamics.motion import (
    Inertia,
    Motion,
    SpeedProfile,
    generalised_alpha,
    inertia_of,
    motion_of,
    newmark,
)
from tolalloc.reducers.dynamics.prototype import RIGID, part_errors
from tolalloc.reducers.dynamics.prototype import engine as multibody_engine
from tolalloc.reducers.equivalent.kinematics import HARMONICS
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.series import at_torque
from tolalloc.reducers.reducer.unit_file import BuiltUnit, load_unit

SPECTRAL_RADIUS = 0.9
INTEGRATORS = {"newmark": newmark(), "generalised-alpha": generalised_alpha(SPECTRAL_RADIUS)}
"""Integrators of the equivalent model by name."""
ENGINES = (*INTEGRATORS, "exudyn")
"""What can simulate: the equivalent model by either integrator, or the virtual prototype."""
MOST_STEPS = 200_000
"""Time steps beyond which the forces of all pins would fill the memory [-]."""
OWN_MASS_DAMPING = 500.0
"""Damping over mass of the carrier without a load, unless another is asked for: about 2 % at 2 kHz [1/s]."""
PROTOTYPE_RADIUS = 0.5
"""Spectral radius of the prototype's integrator; at 0.9 stiff bearings and part errors lock it into alternation [-]."""
FEWEST_STEPS = 4
"""Time steps per pin pass below which a run says nothing [-]."""
LARGEST_TORQUE = 10.0
"""Largest torque over the rated one [-]."""
LOAD_TIME = 0.5
"""Time in which the load rises after the speed has, over the time of the speed: 1.0 to 1.5 s in xi2015 [-]."""


@dataclass(frozen=True, kw_only=True)
class SimulationRequest:
    """What is to be simulated; as it stands, the run of xi2015.

    Raises
    ------
    InputError, UnknownNameError
        A number out of range or an unknown engine.
    """

    reducer: str = "rv40e"  # Preset or TOML file
    unit: str = "exact"  # Shipped unit or TOML file
    speed_rpm: float = 525.0  # Input speed that is reached [rpm]
    # Torque on the carrier, negative as it resists the rotation; minus the rated one unless given [N·m]
    torque_nm: float | None = None
    engine: str = "generalised-alpha"  # One of `ENGINES`
    duration: float = 2.0  # Simulated time [s]
    ramp: float = 1.0  # Time in which the speed rises; the load rises in half of it afterwards [s]
    step: float = 5e-5  # Time step [s]
    output_inertia: float = 0.0  # Moment of inertia that the carrier turns besides its own [kg·m²]
    damping: float = 1e-5  # Damping over stiffness of meshes and bearings [s]
    # Damping over mass of every part, in the prototype of the carrier's rotation alone; 500 1/s are a damping ratio of
    # 2 % at 2 kHz [1/s]
    mass_damping: float | None = None
    pin_stiffness: float | None = None  # Stiffness of every pin contact in place of the reducer's own law [N/m]

    def __post_init__(self) -> None:
        if self.engine not in ENGINES:
            raise UnknownNameError.among("simulation", "engine", self.engine, ENGINES)
        for name, value in (
            ("speed_rpm", self.speed_rpm),
            ("duration", self.duration),
            ("ramp", self.ramp),
            ("step", self.step),
            ("pin_stiffness", 1.0 if self.pin_stiffness is None else self.pin_stiffness),
        ):
            if not 0.0 < value < inf:
                raise InputError.of_argument("simulation", name, value, "a number above 0")
        for name, value in (
            ("output_inertia", self.output_inertia),
            ("damping", self.damping),
            ("mass_damping", self.mass_damping or 0.0),
        ):
            if not 0.0 <= value < inf:
                raise InputError.of_argument("simulation", name, value, "0 or a positive number")
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
    """Return a simulation with its files read and checked.

    Raises
    ------
    InputError, UnknownNameError
        The file, field or argument that is not allowed, or an engine that is not installed.
    """
    reducer, unit = load_reducer(asked.reducer), load_unit(asked.unit)
    if asked.engine == "exudyn":
        multibody_engine()
        reducer = _with_modification_of(unit, with_ideal_gears(reducer))
    if asked.pin_stiffness is not None:
        constant = replace(
            reducer.stiffness, pin_contact=asked.pin_stiffness, pin_contact_law="constant", pin_bending=inf
        )
        reducer = replace(reducer, stiffness=constant)
    torque = -reducer.load.rated_torque if asked.torque_nm is None else asked.torque_nm
    if not -LARGEST_TORQUE * reducer.load.rated_torque <= torque < 0.0:
        lowest = f"{-LARGEST_TORQUE * reducer.load.rated_torque:g}"
        allowed = f"{lowest} N·m to below 0, which resists the rotation; a load that drives it is not simulated"
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


def _with_modification_of(unit: BuiltUnit, reducer: Reducer) -> Reducer:
    """Return the reducer with the unit's own modification, which the prototype takes from the teeth."""
    stated = {**reducer.modification.deviations, **unit.deviations}
    equidistant, shift = (stated[column] for column in reducer.modification.deviations)
    return replace(reducer, modification=replace(reducer.modification, equidistant=equidistant, shift=shift))


def with_ideal_gears(reducer: Reducer) -> Reducer:
    """Return the reducer with a first stage that does not yield, as the prototype has it."""
    return replace(reducer, stiffness=replace(reducer.stiffness, gear_mesh=RIGID, sun_support=RIGID))

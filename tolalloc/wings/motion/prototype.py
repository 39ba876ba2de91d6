"""The virtual prototype of a reducer: rigid bodies with exact teeth.

It is the only door to the multibody engine, an optional extra.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.units import MICRORADIAN
from tolalloc.reducers.cycloid.loaded_contact import contact_stiffness
from tolalloc.reducers.cycloid.solvers import LAWS
from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
from tolalloc.reducers.equivalent.springs import Coordinates, Positions
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.wings.motion.motion import Damping, Inertia
from tolalloc.wings.motion.solvers.pin_forces import Mesh, fill_forces, fill_pin_forces
from tolalloc.wings.motion.stepping import Progress, untold

_KNOTS = 513  # of a smooth step: its straight pieces miss the cubic by less than a millionth of the step
_TABULATED = 1801  # angles of the contact's stiffness along a tooth
_FORM_ANGLES = 720  # of the form in one tooth space, and around a pin
RIGID = 1e13
"""Stiffness of a bearing that yields 0.01 arcsec at the output of an RV-40E under its rated torque, and whose force is
still far above its own rounding [N/m]."""
_RESIDUAL = 1e-2
"""Unbalanced force or moment at which a time step is solved, above the rounding in the stiffest bearings [N, N·m]."""


@dataclass(frozen=True, kw_only=True)
class TimeCourse:
    """A quantity over time: straight between its knots, constant before the first and after the last."""

    time: Float[np.ndarray, " knot"]  # Knots, rising [s]
    value: Float[np.ndarray, " knot"]  # Speed or torque at the knots [rad/s or N·m]

    def __post_init__(self) -> None:
        finite = np.isfinite(self.time).all() and np.isfinite(self.value).all()
        if not (self.time.size and finite and (np.diff(self.time) > 0).all()):
            raise InputError("course over time: its knots are not rising, finite numbers; allowed are only such.")

    @classmethod
    def step(cls, value: float, start: float, end: float) -> TimeCourse:
        """Return a smooth rise from 0 to a value, 3s² − 2s³ between two times [s]."""
        share = np.linspace(0.0, 1.0, _KNOTS)
        return cls(time=start + (end - start) * share, value=value * share**2 * (3.0 - 2.0 * share))

    @cached_property
    def _pieces(self) -> tuple[list[float], list[float], list[float], list[float]]:
        """Knots, values, slopes after the knots, integrals up to them, as plain numbers: they are asked one by one."""
        step = np.diff(self.time)
        slope = np.append(np.diff(self.value) / step, 0.0)
        integral = np.concatenate([[0.0], np.cumsum(step * (self.value[1:] + self.value[:-1]) / 2)])
        return self.time.tolist(), self.value.tolist(), slope.tolist(), integral.tolist()

    def at(self, time: float) -> float:
        """Return the value at a time [s]."""
        return float(np.interp(time, self.time, self.value))

    def integral(self, time: float) -> float:
        """Return the integral from the first knot to a time [s]."""
        knots, values, slopes, integrals = self._pieces
        at = max(bisect_right(knots, time) - 1, 0)
        after = time - knots[at]
        return integrals[at] + after * (values[at] + (after * slopes[at] / 2 if after > 0 else 0.0))


@dataclass(frozen=True, kw_only=True)
class PartErrors:
    """Deviations of points of the parts, in the frames of the parts as they stand at the carrier angle 0."""

    journal: Float[np.ndarray, "crank disc 2"]  # Of crank journals, turning with the crankshaft [m]
    disc_bore: Float[np.ndarray, "disc crank 2"]  # Of the bores in the discs [m]
    carrier_bore: Float[np.ndarray, "crank 2"]  # Of the bores in the carrier [m]
    carrier: Float[np.ndarray, " 2"]  # Of the carrier's bearing in the housing [m]
    pin: Float[np.ndarray, "pin 2"]  # Of pins, radially outward and tangentially [m]
    pin_radius: Float[np.ndarray, " pin"]  # Of the effective radius of pins [m]


def part_errors(reducer: Reducer, errors: Mapping[str, float]) -> PartErrors:
    """Return the deviations that columns of the equivalent model stand for [m].

    Known are ``crank{i}.journal{j}.eccentricity``, ``disc{j}.bore{i}.position``, ``carrier.bore{i}.position``,
    ``carrier.assembly``, ``each_pin.position.{k}`` (x radial, y tangential), ``each_pin.diameter.{k}``,
    ``pin.diameter`` and ``housing.groove.radius``.
    """
    cranks, discs, pins = reducer.crank_count, reducer.disc_count, reducer.cycloid_stage.pin_count
    found = PartErrors(
        journal=np.zeros((cranks, discs, 2)),
        disc_bore=np.zeros((discs, cranks, 2)),
        carrier_bore=np.zeros((cranks, 2)),
        carrier=np.zeros(2),
        pin=np.zeros((pins, 2)),
        pin_radius=np.zeros(pins),
    )
    places = {
        "crank{i}.journal{j}.eccentricity": (found.journal, 1.0),
        "disc{j}.bore{i}.position": (found.disc_bore, 1.0),
        "carrier.bore{i}.position": (found.carrier_bore, 1.0),
        "carrier.assembly": (found.carrier, 1.0),
        "each_pin.position": (found.pin, 1.0),
        "each_pin.diameter": (found.pin_radius, 1.0),
        "pin.diameter": (found.pin_radius, 1.0),
        "housing.groove.radius": (found.pin_radius, -1.0),  # a larger groove lets the pins sink
    }
    moving = [(kind, *places[kind.name]) for kind in family_of(reducer).sources.kinds if kind.name in places]
    for name, value in errors.items():
        for kind, place, sign in moving:
            at = kind.index(name)
            if at is not None and all(0 <= index < size for index, size in zip(at, place.shape, strict=False)):
                place[at] += sign * value
                break
        else:
            allowed = "one of a journal, bore, carrier or pin"
            raise InputError.at(f"virtual prototype of {reducer.name}", "error column", name, allowed)
    return found


def _forms(reducer: Reducer) -> tuple[Float[np.ndarray, "disc angle"], Float[np.ndarray, "pin direction"]]:
    """Return the form of discs and pins at equally spaced angles; no angles where the reducer has none [m]."""
    discs, stage, form = range(reducer.disc_count), reducer.cycloid_stage, reducer.form
    if form is None:
        return np.empty((len(discs), 0)), np.empty((stage.pin_count, 0))
    around = 2 * np.pi * np.arange(_FORM_ANGLES * stage.disc_teeth) / _FORM_ANGLES
    direction = 2 * np.pi * np.arange(_FORM_ANGLES) / _FORM_ANGLES - np.pi
    pins = form.of_pins(np.repeat(direction[:, np.newaxis], stage.pin_count, axis=1)).T
    return np.stack([form.of_flank(disc, around) for disc in discs]), np.ascontiguousarray(pins)


def mesh_of(reducer: Reducer, errors: PartErrors) -> Mesh:
    """Return the teeth and pins of a reducer whose pins deviate."""
    stiffness, stage = reducer.stiffness, reducer.cycloid_stage
    if turned := round(reducer.modification.rotation / MICRORADIAN, 6):
        raise InputError.at(f"virtual prototype of {reducer.name}", "rotation modification [µrad]", turned, "0")
    ground = ToothProfile(stage=stage, modification=reducer.modification).ground
    angle = Positions(reducer, np.zeros(1)).pin_direction
    deviation = errors.pin[:, 0] + 1j * errors.pin[:, 1]
    contact, log_length = contact_stiffness(stage, stiffness, np.linspace(0.0, np.pi, _TABULATED))
    flanks, pins = _forms(reducer)
    return Mesh(
        teeth=float(stage.disc_teeth),
        circle=ground.pin_circle_radius,
        pin=ground.pin_radius,
        eccentricity=stage.eccentricity,
        # Teeth stand so that each disc fits the pins where its own journal points.
        offset=-2 * np.pi * np.arange(reducer.disc_count) / reducer.disc_count / stage.disc_teeth,
        place=(stage.pin_circle_radius + deviation) * np.exp(1j * angle),
        angle=angle,
        radius=stage.pin_radius + errors.pin_radius,
        law=LAWS[stiffness.pin_contact_law],
        stiffness=contact,
        log_length=log_length,
        flank_form=flanks,
        pin_form=pins,
    )


def engine() -> Any:
    """Return the module of the multibody engine."""
    try:
        return import_module("exudyn")
    except ImportError as missing:
        raise InputError(
            "virtual prototype: the multibody engine needs the optional extra: pip install -e '.[multibody]'."
        ) from missing


@dataclass(frozen=True)
class System:
    """A system of the engine, and where its answers are read once it is assembled."""

    engine: Any  # Module of the engine
    content: Any  # What the engine solves
    parts: tuple[tuple[Any, Any], ...] = ()  # Sensors of places and of speeds: carrier, cranks, discs
    carrier_acceleration: Any = None  # Sensor of the carrier's accelerations
    gears: tuple[Any, ...] = ()  # Sensors of the moments that the first stage puts on the cranks

    def body(self, place: Float[np.ndarray, " 2"], mass: float, inertia: float) -> tuple[Any, Any]:
        """Add a rigid body with its centre at a place; return its node and itself."""
        items = self.engine.itemInterface
        node = self.content.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*place, 0.0]))
        return node, self.content.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))

    def bearing(self, ends: list[tuple[Any, Float[np.ndarray, " 2"]]], stiffness: float, damping: float) -> None:
        """Join points of two bodies, given in their own frames."""
        items = self.engine.itemInterface
        markers = [
            self.content.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[*place, 0.0]))
            for body, place in ends
        ]
        self.content.AddObject(
            items.ObjectConnectorCartesianSpringDamper(
                markerNumbers=markers,
                stiffness=[stiffness, stiffness, 0.0],
                damping=[stiffness * damping, stiffness * damping, 0.0],
            )
        )

    def rotation(self, node: Any) -> Any:
        """Return a marker of a body's rotation."""
        return self.content.AddMarker(self.engine.itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))

    def first_stage(self, reducer: Reducer, crank: Any, carrier: Any, speed: TimeCourse) -> Any:
        """Tie a crank's rotation to the sun's and the carrier's as gears without error or compliance do.

        Z2·(β − θc) = −Z1·(θs − θc), whether or not the planet stands in its place on the carrier. Without the
        derivative of the offset the engine would let the output stop.
        """
        gears = reducer.gears.sun_teeth / reducer.gears.planet_teeth
        return self.content.AddObject(
            self.engine.itemInterface.ObjectConnectorCoordinate(
                markerNumbers=[crank, carrier],
                factor1=1.0 + gears,
                offsetUserFunction=lambda _system, time, _item, _offset: gears * speed.integral(time),
                offsetUserFunction_t=lambda _system, time, _item, _offset: gears * speed.at(time),
            )
        )

    def pin_contacts(self, discs: list[Any], places: Float[np.ndarray, " coordinate"], mesh: Mesh) -> None:
        """Let the pins push the discs, whose nodes are given with their reference coordinates."""
        count = places.size
        force, stiffness = np.empty(count), np.empty((count, count))

        def pushes(_system: Any, _time: float, _item: int, moved: Any, _speed: Any) -> Any:
            fill_forces(mesh, places + moved, force, stiffness)
            return force

        def derivative(
            _system: Any, _time: float, _item: int, moved: Any, _speed: Any, by_place: float, _by_speed: float
        ) -> Any:
            fill_forces(mesh, places + moved, force, stiffness)
            return stiffness * by_place

        self.content.AddObject(
            self.engine.itemInterface.ObjectGenericODE2(
                nodeNumbers=discs,
                massMatrix=np.zeros((count, count)),
                forceUserFunction=pushes,
                jacobianUserFunction=derivative,
            )
        )

    def output(self, reducer: Reducer, carrier: Any, speed: TimeCourse, torque: TimeCourse, damping: float) -> None:
        """Load the carrier, whose rotation is marked, and damp how its speed leaves the nominal one [N·m·s/rad]."""
        items = self.engine.itemInterface
        self.content.AddLoad(
            items.LoadCoordinate(markerNumber=carrier, loadUserFunction=lambda _system, time, _load: torque.at(time))
        )
        fixed = self.content.AddNode(items.NodePointGround())
        self.content.AddObject(
            items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[
                    self.content.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0)),
                    carrier,
                ],
                springForceUserFunction=lambda _system, time, _item, _moved, turning, *_: (
                    damping * (turning - speed.at(time) / reducer.ratio)
                ),
            )
        )

    def sensor(self, kind: str, variable: str, **of: Any) -> Any:
        """Return a sensor of a kind, of displacements, speeds or accelerations of a node or of what an object bears."""
        answered = getattr(self.engine.OutputVariableType, variable)
        new = getattr(self.engine.itemInterface, kind)
        return self.content.AddSensor(new(outputVariableType=answered, writeToFile=False, storeInternal=True, **of))


def with_rigid_bearings(reducer: Reducer) -> Reducer:
    """Return the reducer with bearings that do not yield, as joints of a rigid-body model do not.

    Own derivation: K → 1e13 N/m.
    """
    rigid = replace(reducer.stiffness, crank_disc_bearing=RIGID, crank_carrier_bearing=RIGID, carrier_bearing=RIGID)
    return replace(reducer, stiffness=rigid)


def _reference_places(reducer: Reducer) -> Float[np.ndarray, "body 2"]:
    """Return the centres of carrier, cranks and discs at the carrier angle 0 [m].

    Own derivation: a_sp·e^(iP) of the cranks and e·e^(iβ) of the discs, at θc = 0.
    """
    at = Positions(reducer, np.zeros(1))
    turns = [at.crank_position(crank)[0] for crank in range(reducer.crank_count)]
    turns += [at.disc_direction(disc)[0] for disc in range(reducer.disc_count)]
    radius = [reducer.crank_circle_radius] * reducer.crank_count
    radius += [reducer.cycloid_stage.eccentricity] * reducer.disc_count
    return np.array([(0.0, 0.0), *((r * np.cos(a), r * np.sin(a)) for r, a in zip(radius, turns, strict=True))])


def _assemble(
    reducer: Reducer,
    inertia: Inertia,
    damping: Damping,
    errors: PartErrors,
    mesh: Mesh,
    speed: TimeCourse,
    torque: TimeCourse,
) -> System:
    """Return a reducer in the engine, at rest at the carrier angle 0."""
    exudyn, bearings = engine(), damping.stiffness_proportional
    new = System(exudyn, exudyn.SystemContainer().AddSystem())
    stiffness, places = reducer.stiffness, _reference_places(reducer)
    ground = new.content.AddObject(exudyn.itemInterface.ObjectGround())
    carrier = new.body(places[0], inertia.carrier, inertia.carrier_moment)
    first_disc = 1 + reducer.crank_count
    cranks = [new.body(place, inertia.planet, inertia.planet_moment) for place in places[1:first_disc]]
    discs = [new.body(place, inertia.disc, inertia.disc_moment) for place in places[first_disc:]]
    support = [(carrier[1], np.zeros(2)), (ground, errors.carrier)]
    new.bearing(support, stiffness.carrier_bearing, bearings)
    carrier_rotation, gears = new.rotation(carrier[0]), []
    for i, crank in enumerate(cranks):
        axis = places[1 + i]
        pair = [(crank[1], np.zeros(2)), (carrier[1], axis + errors.carrier_bore[i])]
        new.bearing(pair, stiffness.crank_carrier_bearing, bearings)
        for j, disc in enumerate(discs):
            journal = places[first_disc + j] + errors.journal[i, j]
            pair = [(crank[1], journal), (disc[1], axis + errors.disc_bore[j, i])]
            new.bearing(pair, stiffness.crank_disc_bearing, bearings)
        gear = new.first_stage(reducer, new.rotation(crank[0]), carrier_rotation, speed)
        gears.append(new.sensor("SensorObject", "Force", objectNumber=gear))
    reference = np.column_stack([places[first_disc:], np.zeros(len(discs))]).ravel()
    new.pin_contacts([node for node, _ in discs], reference, mesh)
    new.output(reducer, carrier_rotation, speed, torque, damping.mass_proportional * inertia.carrier_moment)
    nodes = [node for node, _ in (carrier, *cranks, *discs)]
    standing, moving = (
        [new.sensor("SensorNode", variable, nodeNumber=node) for node in nodes]
        for variable in ("Coordinates", "Coordinates_t")
    )
    acceleration = new.sensor("SensorNode", "Coordinates_tt", nodeNumber=carrier[0])
    new.content.Assemble()
    return replace(
        new, parts=tuple(zip(standing, moving, strict=True)), carrier_acceleration=acceleration, gears=tuple(gears)
    )


@dataclass(frozen=True, kw_only=True)
class PrototypeAnswer:
    """What the virtual prototype does."""

    time: Float[np.ndarray, " time"]  # Times of the answers [s]
    # Of the sun, as prescribed [rad/s, rad]
    input_speed: Float[np.ndarray, " time"]
    input_angle: Float[np.ndarray, " time"]
    # Of the carrier [rad/s, rad/s², rad]
    output_speed: Float[np.ndarray, " time"]
    output_acceleration: Float[np.ndarray, " time"]
    output_angle: Float[np.ndarray, " time"]
    transmission_error: Float[np.ndarray, " time"]  # Carrier angle beyond the sun's over the ratio [rad]
    input_torque: Float[np.ndarray, " time"]  # On the sun, positive where it drives [N·m]
    output_torque: Float[np.ndarray, " time"]  # On the carrier, as prescribed [N·m]
    pin_forces: Float[np.ndarray, "time disc pin"]  # Normal force of every pin [N]
    kinetic_energy: Float[np.ndarray, " time"]  # Of all bodies but the sun [J]


@dataclass(frozen=True, kw_only=True)
class TimeSteps:
    """Times of a simulation.

    At a spectral radius of 0.9 a start with parts that do not fit by 1 µm left strongly damped rigid bearings swinging
    from step to step for good; at 0.5 and below it did not.
    """

    duration: float  # Simulated time [s]
    step: float = 1e-4  # Step of the integration [s]
    output_step: float = 1e-3  # Time between answers [s]
    spectral_radius: float = 0.5  # What the generalised-α method leaves of the fastest vibrations in one step [-]

    def __post_init__(self) -> None:
        if not 0 < self.step <= self.output_step <= self.duration < float("inf"):
            raise InputError(
                f"virtual prototype: step {self.step!r} s, output step {self.output_step!r} s and duration "
                f"{self.duration!r} s are not in this order; allowed are numbers above 0 that do not fall."
            )
        if not 0.0 <= self.spectral_radius <= 1.0:
            raise InputError.at("virtual prototype", "spectral radius", self.spectral_radius, "0 to 1")


def _settings(steps: TimeSteps) -> Any:
    settings = engine().SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = steps.duration
    integration.numberOfSteps = max(round(steps.duration / steps.step), 1)
    # The engine's own tolerances lie below the rounding of the forces in stiff bearings, so that it would never stop.
    integration.newton.relativeTolerance = 1e-6
    integration.newton.absoluteTolerance = _RESIDUAL
    integration.generalizedAlpha.spectralRadius = steps.spectral_radius
    integration.verboseMode = 0
    settings.show.computationTime = False
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = steps.output_step
    return settings


def _run(prototype: System, steps: TimeSteps, progress: Progress) -> None:
    def before_step(_system: Any, time: float) -> bool:
        progress(min(time / steps.duration, 1.0))
        return True

    prototype.content.SetPreStepUserFunction(before_step)
    exudyn = engine()
    exudyn.config.printToConsole = False  # its remarks are for those who build its models
    try:
        prototype.content.SolveDynamic(_settings(steps), showHints=False)
    except exudyn.SolverError as failed:
        raise SolveError(
            "virtual prototype: the multibody engine found no solution of a time step; a shorter step may help."
        ) from failed
    finally:
        exudyn.config.printToConsole = True
    progress(1.0)


def _answer(
    prototype: System, reducer: Reducer, inertia: Inertia, mesh: Mesh, sun_speed: TimeCourse, load: TimeCourse
) -> PrototypeAnswer:
    stored = prototype.content.GetSensorStoredData
    time = stored(prototype.carrier_acceleration)[:, 0]
    moved, speed = (np.stack([stored(part[kind])[:, 1:] for part in prototype.parts], axis=1) for kind in (0, 1))
    first_disc = 1 + reducer.crank_count
    moved[:, :, :2] += _reference_places(reducer)
    pin_forces = np.empty((time.size, reducer.disc_count, mesh.place.size))
    fill_pin_forces(mesh, moved[:, first_disc:].reshape(time.size, -1), pin_forces)
    # As the coordinates of the equivalent model stand, sun first and carrier last; here the carrier stands first.
    weight = np.roll(inertia.diagonal(Coordinates.of(reducer))[2:].reshape(-1, 3), 1, axis=0)
    input_angle = np.array([sun_speed.integral(at) for at in time])
    gears = reducer.gears.sun_teeth / reducer.gears.planet_teeth
    on_cranks = sum(stored(gear)[:, 1] for gear in prototype.gears)
    return PrototypeAnswer(
        time=time,
        input_speed=np.array([sun_speed.at(at) for at in time]),
        input_angle=input_angle,
        output_speed=speed[:, 0, 2],
        output_acceleration=stored(prototype.carrier_acceleration)[:, 3],
        output_angle=moved[:, 0, 2],
        transmission_error=moved[:, 0, 2] - input_angle / reducer.ratio,
        input_torque=-gears * np.asarray(on_cranks),
        output_torque=np.array([load.at(at) for at in time]),
        pin_forces=pin_forces,
        kinetic_energy=np.asarray((weight * speed**2).sum(axis=(1, 2)) / 2),
    )


def simulate_prototype(
    reducer: Reducer,
    inertia: Inertia,
    damping: Damping,
    speed: TimeCourse,
    torque: TimeCourse,
    steps: TimeSteps,
    errors: Mapping[str, float] | None = None,
    progress: Progress = untold,
) -> PrototypeAnswer:
    """Return what the virtual prototype of a reducer does, from rest at the carrier angle 0.

    Of the nominal design count the stiffness of bearings and pin contacts and the modification; its first stage is
    ideal gears, so that the sun's mass does not count. Damping is that of all bearings alike, and by the carrier's
    inertia of how its speed leaves the nominal one; contacts of pins and teeth have none. The speed is the sun's
    [rad/s], the torque that on the carrier, negative against the rotation [N·m]. Errors are columns of
    `tolalloc.wings.motion.prototype.part_errors` [m]; progress is told which share is done.

    Rigid bodies in the plane with large rotations; pins push along the normal of the exact profile, by the reducer's
    contact law. Generalised-α method of Chung and Hulbert (1993). The first stage is exact, so that the mean output
    speed is the input's over the ratio: 6.4815 rpm at 525 rpm in an RV-40E.
    """
    engine()
    if damping.interfaces:
        raise InputError.at("virtual prototype", "interface with its own damping", [*damping.interfaces], "none")
    found = part_errors(reducer, errors or {})
    mesh = mesh_of(reducer, found)
    prototype = _assemble(reducer, inertia, damping, found, mesh, speed, torque)
    _run(prototype, steps, progress)
    answer = _answer(prototype, reducer, inertia, mesh, speed, torque)
    if not np.isfinite(answer.transmission_error).all():
        raise SolveError("virtual prototype: the simulation left finite numbers; a shorter step may help.")
    return answer

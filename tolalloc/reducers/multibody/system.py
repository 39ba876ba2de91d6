"""The only door to the multibody engine, an optional extra, and parts and interfaces of a reducer in its words."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.reducers.multibody.drive import TimeCourse
from tolalloc.reducers.multibody.solvers.pin_forces import Mesh, fill_forces
from tolalloc.reducers.reducer.design import Reducer


def engine() -> Any:
    """Return the module of the multibody engine.

    Raises
    ------
    InputError
        It is not installed.
    """
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
        gears = reducer.first_stage.sun_teeth / reducer.first_stage.planet_teeth
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

    def sensor(self, node: Any, variable: str) -> Any:
        """Return a sensor of a node's displacements, speeds or accelerations."""
        kind = getattr(self.engine.OutputVariableType, variable)
        return self.content.AddSensor(
            self.engine.itemInterface.SensorNode(
                nodeNumber=node, outputVariableType=kind, writeToFile=False, storeInternal=True
            )
        )

    def moment_sensor(self, gears: Any) -> Any:
        """Return a sensor of the moment that the first stage puts on a crank."""
        kind = self.engine.OutputVariableType.Force
        return self.content.AddSensor(
            self.engine.itemInterface.SensorObject(
                objectNumber=gears, outputVariableType=kind, writeToFile=False, storeInternal=True
            )
        )

"""A reducer through a speed and a torque profile."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tolalloc.reading.units import RPM
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiry import Inquiry, RatedTorque, ReducerName, UnitName, Word

if TYPE_CHECKING:
    from tolalloc.wings.motion.simulation import PreparedSimulation, SimulationResult


@dataclass(frozen=True, kw_only=True)
class Simulate(Inquiry["PreparedSimulation"]):
    """Simulate speeds, accelerations, transmission error and pins in contact over time, beside the static model."""

    word: ClassVar[str] = "simulate"
    example: ClassVar[str] = "tolalloc simulate --reducer rv40e --out motion"
    counted: ClassVar[str] = "ms"
    kernel: ClassVar[Literal["", "equivalent"]] = "equivalent"

    reducer: ReducerName = None
    unit: UnitName = "exact"
    speed: Annotated[float, Word("Final input speed [rpm].")] = 525.0
    torque: RatedTorque = None
    engine: Annotated[
        str, Word("generalised-alpha or newmark (equivalent model), exudyn (exact profile, optional extra).")
    ] = "generalised-alpha"
    duration: Annotated[float, Word("Simulated time [s].")] = 2.0
    ramp: Annotated[float, Word("Time in which the speed rises [s]; then the load rises in half that time.")] = 1.0
    step: Annotated[float, Word("Time step [s].")] = 5e-5
    output_inertia: Annotated[float, Word("Moment of inertia driven by the carrier, besides its own [kg·m²].")] = 0.0
    damping: Annotated[float, Word("Damping over stiffness of meshes and bearings [s].")] = 1e-5
    mass_damping: Annotated[
        float | None,
        Word(
            "Damping over mass of all parts; exudyn: of the carrier's rotation [1/s]. Unless given, 500 without "
            "--output-inertia and less with it, so that the load is hardly damped."
        ),
    ] = None
    pin_stiffness: Annotated[
        float | None, Word("One stiffness for every pin contact [N/m]; the reducer's law unless given.")
    ] = None

    def prepare(self) -> PreparedSimulation:
        """Return the simulation, its files read and checked."""
        from tolalloc.wings.motion.simulation import SimulationRequest, prepare_simulation

        own = vars(self) | {"reducer": str(self.reducer), "speed_rpm": self.speed, "torque_nm": self.torque}
        known = (field.name for field in fields(SimulationRequest))
        return prepare_simulation(SimulationRequest(**{name: own[name] for name in known}))

    def solve(self, prepared: PreparedSimulation, progress: Progress) -> Answer[SimulationResult]:
        """Return what the reducer does over time."""
        return simulated(prepared, progress)


def simulated(prepared: PreparedSimulation, progress: Progress) -> Answer[SimulationResult]:
    """Return the answer of a simulation, whose header names the unit."""
    from tolalloc.wings.motion.simulation import simulate
    from tolalloc.wings.motion.telling.simulation import SimulationTeller

    header = Header(
        name=prepared.unit.name,
        model=prepared.reducer.name,
        conditions={
            "input speed [rpm]": prepared.speed / RPM,
            "torque on the carrier [N·m]": prepared.torque,
            "engine": prepared.asked.engine,
        },
        assumptions=(*prepared.reducer.assumptions, *prepared.unit.assumptions),
    )
    result = simulate(prepared, progress)
    return Answer(kind="simulation", header=header, result=result, told_by=SimulationTeller)

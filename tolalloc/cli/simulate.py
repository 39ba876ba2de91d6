"""The command ``tolalloc simulate``: a reducer through a speed and a torque profile."""

from __future__ import annotations

from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, shown_progress, tell, write_report
from tolalloc.cli.options import RatedTorqueOption, ReducerOption, named_reducer


def simulate(
    reducer: ReducerOption = None,
    unit: Annotated[str, typer.Option(help="Shipped unit (exact, table4 of an RV-20E) or TOML file.")] = "exact",
    speed: Annotated[float, typer.Option(help="Input speed that is reached [rpm].")] = 525.0,
    torque: RatedTorqueOption = None,
    engine: Annotated[
        str,
        typer.Option(help="generalised-alpha or newmark (equivalent model), exudyn (exact profile, optional extra)."),
    ] = "generalised-alpha",
    duration: Annotated[float, typer.Option(help="Simulated time [s].")] = 2.0,
    ramp: Annotated[
        float, typer.Option(help="Time in which the speed rises [s]; the load rises in half of it afterwards.")
    ] = 1.0,
    step: Annotated[float, typer.Option(help="Time step [s].")] = 5e-5,
    output_inertia: Annotated[
        float, typer.Option(help="Moment of inertia that the carrier turns besides its own [kg·m²].")
    ] = 0.0,
    damping: Annotated[float, typer.Option(help="Damping over stiffness of meshes and bearings [s].")] = 1e-5,
    mass_damping: Annotated[
        float | None,
        typer.Option(
            help="Damping over mass of all parts; exudyn: of the carrier's rotation [1/s]. Unless given, 500 without "
            "--output-inertia and less with it, so that the load is hardly damped."
        ),
    ] = None,
    pin_stiffness: Annotated[
        float | None, typer.Option(help="One stiffness for every pin contact [N/m]; the reducer's law unless given.")
    ] = None,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Speeds, accelerations, transmission error and pins in contact over time, beside the static model."""
    from tolalloc.reducers.simulation.request import SimulationRequest, prepare_simulation
    from tolalloc.reducers.simulation.run import simulate as simulated
    from tolalloc.reports.folder import require_usable

    asked = SimulationRequest(
        reducer=named_reducer(reducer, out),
        unit=unit,
        speed_rpm=speed,
        torque_nm=torque,
        engine=engine,
        duration=duration,
        ramp=ramp,
        step=step,
        output_inertia=output_inertia,
        damping=damping,
        mass_damping=mass_damping,
        pin_stiffness=pin_stiffness,
    )
    prepared = prepare_simulation(asked)
    require_usable(out)
    announce_compilation()
    with shown_progress("ms") as progress:
        answer = simulated(prepared, progress)
    write_report(answer, out)
    tell(answer, as_json, (answer.steady_table, f"{answer.header.model}: steady part"))

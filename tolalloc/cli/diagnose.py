"""The command ``tolalloc diagnose``: from the curve of a bad unit back to the errors of its parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, shown_progress, tell, write_report
from tolalloc.cli.options import ReducerOption, StiffnessOption, TestTorqueOption, named_reducer


def diagnose(
    curve: Annotated[Path, typer.Argument(help="CSV: columns 'angle [deg]', 'transmission error [arcsec]'.")],
    reducer: ReducerOption = None,
    tolerances: Annotated[str, typer.Option(help="Tolerance table: shipped name, CSV or XLSX.")] = "rv20e_baseline",
    sheet: Annotated[str, typer.Option(help="Sheet of a workbook that holds the table; the first unless given.")] = "",
    torque: TestTorqueOption = None,
    noise: Annotated[float, typer.Option(help="Standard deviation of one reading [arcsec].")] = 0.5,
    discrepancy: Annotated[float, typer.Option(help="Standard deviation of what the model leaves out [arcsec].")] = 0.5,
    angle_offset: Annotated[float, typer.Option(help="Added to every angle of the bench [deg].")] = 0.0,
    stiffness: StiffnessOption = "",
    correlations: Annotated[str, typer.Option(help="Correlations between sources: CSV or XLSX.")] = "",
    level: Annotated[float, typer.Option(help="Probability that the named sources hold the dominant one.")] = 0.97,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Which part error the measured curve of a bad unit points to, and which ones it cannot tell apart."""
    # The report's libraries take half a second to import; a misspelt option need not wait for them.
    from tolalloc.bench.diagnosis import DiagnosisRequest, diagnose_unit
    from tolalloc.drawings.drawing import load_drawing
    from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
    from tolalloc.reports.folder import require_usable

    design = load_reducer(named_reducer(reducer, out))
    if stiffness:
        design = with_stiffness(design, load_identified_stiffness(stiffness))
    asked = DiagnosisRequest(
        curve=curve,
        reducer=design,
        errors=load_drawing(tolerances, correlations=correlations, sheet=sheet).errors,
        torque_nm=torque,
        noise_arcsec=noise,
        discrepancy_arcsec=discrepancy,
        angle_offset_deg=angle_offset,
        level=level,
        seed=seed,
    )
    require_usable(out)
    announce_compilation()
    with shown_progress("curves") as progress:
        answer = diagnose_unit(asked, progress)
    write_report(answer, out)
    tell(answer, as_json, (answer.sources.head(10), f"{curve.stem}: what the gauges would show"))

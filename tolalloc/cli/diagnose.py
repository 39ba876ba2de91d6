"""The command ``tolalloc diagnose``: from the curve of a bad unit back to the errors of its parts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, UnitProgress, announce_compilation, print_json, print_table, say


def diagnose(
    curve: Annotated[Path, typer.Argument(help="CSV: columns 'angle [deg]', 'transmission error [arcsec]'.")],
    reducer: Annotated[str, typer.Option(help="Preset name or TOML file.")] = "rv20e",
    tolerances: Annotated[str, typer.Option(help="Tolerance table: shipped name, CSV or XLSX.")] = "rv20e_baseline",
    torque: Annotated[
        float | None, typer.Option(help="Torque on the carrier [N·m], negative against the rotation.")
    ] = None,
    noise: Annotated[float, typer.Option(help="Standard deviation of one reading [arcsec].")] = 0.5,
    discrepancy: Annotated[float, typer.Option(help="Standard deviation of what the model leaves out [arcsec].")] = 0.5,
    angle_offset: Annotated[float, typer.Option(help="Added to every angle of the bench [deg].")] = 0.0,
    stiffness: Annotated[str, typer.Option(help="Identified stiffness: shipped name or TOML file.")] = "",
    correlations: Annotated[str, typer.Option(help="Correlations between sources: CSV or XLSX.")] = "",
    level: Annotated[float, typer.Option(help="Probability that the named sources hold the dominant one.")] = 0.97,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Which part error the measured curve of a bad unit points to, and which ones it cannot tell apart."""
    # The report's libraries take half a second to import; a misspelt option need not wait for them.
    from tolalloc.bench.diagnosis.answer.document import diagnosis_document, source_table
    from tolalloc.bench.diagnosis.study import DiagnosisStudy, diagnose_unit
    from tolalloc.cli.document_script import written
    from tolalloc.report.folder import require_usable
    from tolalloc.study.definition import Study

    asked = DiagnosisStudy(
        curve=curve,
        study=Study(
            name="tolalloc diagnose",
            reducer=reducer,
            tolerances=tolerances,
            torque_nm=torque,
            stiffness=stiffness,
            correlations=correlations,
            seed=seed,
        ),
        noise_arcsec=noise,
        discrepancy_arcsec=discrepancy,
        angle_offset_deg=angle_offset,
        level=level,
    )
    if out:
        require_usable(out)
    announce_compilation()
    with UnitProgress("curves") as progress:
        results = diagnose_unit(asked, progress)
    document = diagnosis_document(results)
    if out:
        written(out, lambda: document)
    if as_json:
        print_json(document.summary)
        return
    print_table(source_table(results).head(10), f"{results.name}: what the gauges would show")
    say(document)

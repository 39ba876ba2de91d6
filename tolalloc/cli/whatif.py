"""The command ``tolalloc whatif``: what other zones do to the drawing of a study, on the same random units."""

from __future__ import annotations

import re
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_kernel, shown_progress, tell, write_report
from tolalloc.cli.run import Script
from tolalloc.cli.study_script import load_study
from tolalloc.exceptions import InputError


def whatif(
    script: Script,
    zones: Annotated[
        list[str],
        typer.Argument(
            help="Zones as SOURCE=µm, or with their unit: pin.diameter=3 'disc*.pitch=10' housing=0.02mm.",
            metavar="zone...",
        ),
    ],
    units: Annotated[int, typer.Option(help="Random units of either drawing.")] = 1024,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Tell what other zones do to cost, yield and quantiles: both drawings on the same random units."""
    from tolalloc.reports.folder import require_usable
    from tolalloc.study.questions import Difference

    require_usable(out)
    study = load_study(script)
    announce_kernel(study.model)
    question = Difference(zones=dict(_zone(text) for text in zones), units=units)
    with shown_progress() as progress:
        answer = study.ask(question, study.effort, progress)
    tell(
        answer, as_json, (answer.to_frame("changes"), "What changes"), (answer.to_frame("changed zones"), "Which zones")
    )
    write_report(answer, out)


def _zone(text: str) -> tuple[str, float]:
    """Return pattern and zone [µm] of one argument, whose number may have a decimal comma and a unit.

    Refused is 1,000: it may mean one or a thousand.
    """
    pattern, separator, stated = text.partition("=")
    match = re.fullmatch(
        r"\s*(?![1-9]\d{0,2},\d{3}(?!\d))(\d+(?:[.,]\d*)?|[.,]\d+)(e[-+]?\d+)?\s*(µm|μm|um|mm)?\s*",
        stated,
        re.ASCII | re.IGNORECASE,
    )
    if match is None:
        allowed = "SOURCE=µm, such as pin.diameter=3, or with its unit as in housing=0.02mm"
        raise InputError.at("whatif", "zone", text if separator else f"{text} without =", allowed)
    number, power, unit = match.groups()
    return pattern.strip(), float(number.replace(",", ".") + (power or "")) * (
        1000.0 if (unit or "").lower() == "mm" else 1.0
    )

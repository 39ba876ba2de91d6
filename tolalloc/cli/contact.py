"""The command ``tolalloc contact``: what a modification does to clearance and contact, and its profile in a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, note, tell, write_report
from tolalloc.cli.options import RatedTorqueOption, ReducerOption, named_reducer

if TYPE_CHECKING:
    from tolalloc.reducers.cycloid.tooth_profile import ToothProfile
    from tolalloc.reducers.reducer.design import Reducer
    from tolalloc.reports.answer import Answer

ProfileFile = Annotated[Path | None, typer.Option(help="Write the tooth profile to this new .csv or .dxf file.")]
ProfilePoints = Annotated[int, typer.Option(help="Points per tooth of that file.")]
MOST_PHASES = 3600
PLACE = "tolalloc contact"
SHOWN = ("quantity", "one disc, law at every pin", "all discs, bearings yielding")
"""Columns of the loaded contact that a terminal has room for; the report has all."""


def contact(
    reducer: ReducerOption = None,
    torque: RatedTorqueOption = None,
    width: Annotated[float | None, typer.Option(help="Loaded face width [mm].")] = None,
    support: Annotated[
        float | None, typer.Option(help="Distance of two supports between which the pins bend [mm].")
    ] = None,
    law: Annotated[str, typer.Option(help="Contact law: logarithmic (Hertz), constant, table2.")] = "logarithmic",
    exact: Annotated[bool, typer.Option("--exact", help="Exact distances even for a small modification.")] = False,
    phases: Annotated[int, typer.Option(help="Phases of the crank within one pin pitch.")] = 72,
    profile: ProfileFile = None,
    points: ProfilePoints = 200,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Clearance, backlash, pins in contact, forces and pressure of the modified teeth, without errors."""
    from tolalloc.exceptions import InputError, UnknownNameError
    from tolalloc.reducers.cycloid.solvers import LAWS
    from tolalloc.reducers.reducer.files import load_reducer
    from tolalloc.reducers.teeth.answer import contact_answer

    named = named_reducer(reducer, out, profile)
    require_writable(out, profile, points)
    design = asked_reducer(load_reducer(named), width, support)
    announce_compilation("cycloid")
    if law not in LAWS:
        raise UnknownNameError.among(PLACE, "contact law", law, LAWS)
    if not 1 <= phases <= MOST_PHASES:
        raise InputError.at(PLACE, "--phases", phases, f"1 to {MOST_PHASES}")
    asked = design.torque_on_carrier(-design.load.rated_torque if torque is None else torque, PLACE)
    answer = contact_answer(design, asked, law=law, exact=True if exact else None, phases=phases)
    write_asked(answer, out, answer.assessment.profile, profile, points)
    shown = [name for name in SHOWN if name in answer.contact_table]
    loaded = (answer.contact_table[shown], f"{design.name}: {asked:g} N·m on the carrier")
    tell(answer, as_json, (answer.profile_table, f"{design.name}: profile and clearance"), loaded)


def asked_reducer(reducer: Reducer, width_mm: float | None, support_mm: float | None) -> Reducer:
    """Return the reducer with the face width and the support of the pins that were asked for.

    Raises
    ------
    InputError
        Not a width or a span of a reducer.
    """
    from tolalloc.exceptions import InputError
    from tolalloc.reading.units import MILLIMETRE

    if width_mm is not None:
        if not 0.5 <= width_mm <= 200:
            raise InputError.at(PLACE, "--width", width_mm, "0.5 to 200 mm")
        reducer = reducer.with_face_width(width_mm * MILLIMETRE)
    if support_mm is not None:
        if not 1 <= support_mm <= 500:
            raise InputError.at(PLACE, "--support", support_mm, "1 to 500 mm between two supports")
        reducer = reducer.with_pin_span(support_mm * MILLIMETRE)
    return reducer


def require_writable(out: Path | None, file: Path | None, points: int) -> None:
    """Refuse a report or a profile that could not be written, before anything long runs."""
    from tolalloc.reports.folder import require_usable

    require_usable(out)
    if file:
        from tolalloc.reducers.teeth.profile_files import require_profile_file

        require_profile_file(file, points)


def write_asked(answer: Answer, out: Path | None, teeth: ToothProfile, file: Path | None, points: int) -> None:
    """Write the report and the profile that were asked for."""
    write_report(answer, out)
    if file:
        from tolalloc.reading.units import MICROMETRE
        from tolalloc.reducers.teeth.profile_files import write_profile

        made = write_profile(teeth, points, file)
        note(
            f"Profile: {file}, {made.per_tooth} points per tooth, chord error at most "
            f"{made.chord_error / MICROMETRE:.2g} µm."
        )

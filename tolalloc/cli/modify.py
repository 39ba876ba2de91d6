"""The command ``tolalloc modify``: equidistant and shift amount by a published method."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, note, tell
from tolalloc.cli.contact import ProfileFile, ProfilePoints, require_writable, write_asked
from tolalloc.cli.options import RatedTorqueOption, ReducerOption, named_reducer

if TYPE_CHECKING:
    from tolalloc.reducers.modification import Metric


def modify(
    method: Annotated[str, typer.Argument(help="song2019 (towards a rotated profile) or li2018 (least gap).")],
    reducer: ReducerOption = None,
    radial: Annotated[float, typer.Option("--radial", help="Least clearance at tip and root [µm].")] = 15.0,
    rotation: Annotated[float, typer.Option(help="song2019: rotation of the profile to come close to [rad].")] = 0.005,
    metric: Annotated[str, typer.Option(help="song2019: same_angle, normal or nearest.")] = "same_angle",
    negative: Annotated[bool, typer.Option("--negative-shift", help="song2019: a negative shift.")] = False,
    require_gap: Annotated[
        bool, typer.Option("--require-gap", help="song2019: no interference after closing.")
    ] = False,
    torque: RatedTorqueOption = None,
    profile: ProfileFile = None,
    points: ProfilePoints = 200,
    write: Annotated[
        Path | None, typer.Option(help="Reducer file to write, new: the reducer with these amounts.")
    ] = None,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Choose equidistant and shift amount by a published objective, and say what they deliver."""
    from tolalloc.reading.files import require_new
    from tolalloc.reading.units import MICROMETRE
    from tolalloc.reducers.modification import ModificationRequest, choose
    from tolalloc.reducers.reducer.files import load_reducer, write_modified

    request = ModificationRequest(
        method=method,
        radial_clearance=radial * MICROMETRE,
        rotation=rotation,
        metric=cast("Metric", metric),
        shift_sign=-1 if negative else 1,
        require_gap=require_gap,
    )
    named = named_reducer(reducer, out, profile, write)
    require_writable(out, profile, points)
    if write:
        require_new(write)
    design = load_reducer(named)
    asked = design.torque_on_carrier(-design.load.rated_torque if torque is None else torque, "tolalloc modify")
    announce_compilation("cycloid")
    answer = choose(request, design, asked)
    write_asked(answer, out, answer.contact.assessment.profile, profile, points)
    if write:
        write_modified(named, answer.best.modification, write)
        note(f"The reducer with these amounts is {write}.")
    tell(answer, as_json, (answer.delivered, f"{design.name}, {method}: what the amounts deliver"))

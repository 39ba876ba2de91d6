"""Options that several commands share: which reducer, under which torque."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolalloc.exceptions import InputError

DEFAULT_REDUCER = "rv20e"
"""Preset of every command that writes no file."""

ReducerOption = Annotated[
    str | None,
    typer.Option(
        help=f"Preset name or TOML file; {DEFAULT_REDUCER} unless given, to be given where a file is written."
    ),
]
TestTorqueOption = Annotated[
    float | None,
    typer.Option(
        help="Torque on the carrier [N·m], negative where it resists the rotation; the reducer's test torque unless "
        "given."
    ),
]
RatedTorqueOption = Annotated[
    float | None,
    typer.Option(
        help="Torque on the carrier [N·m], negative where it resists the rotation; minus the rated one unless given."
    ),
]
StiffnessOption = Annotated[str, typer.Option(help="Identified stiffness: shipped name or TOML file.")]


def named_reducer(reducer: str | None, *written: Path | None) -> str:
    """Return the reducer that was asked for, the default one unless given.

    No file, of those that the command was asked to write, is about a reducer that nobody named.

    Raises
    ------
    InputError
        A file is to be written and no reducer was given.
    """
    if reducer is not None:
        return reducer
    if any(written):
        from tolalloc.rv.reducer.files import PRESETS

        presets = ", ".join(sorted(file.name.split(".")[0] for file in PRESETS.glob("*.reducer.toml")))
        raise InputError(
            f"--reducer is missing: where a file is written the reducer must be named; allowed is a preset ({presets}) "
            "or a TOML file."
        )
    return DEFAULT_REDUCER

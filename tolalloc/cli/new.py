"""The commands ``tolalloc new``, a folder that runs at once, and ``tolalloc schema``, what may stand in a TOML file."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from tolalloc.cli.console import note, print_json, say
from tolalloc.exceptions import InputError


class Listing(TyperCommand):
    """A command whose help lists what is known, of other packages too, which is loaded for that help alone."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return arguments and options."""
        found: list[Any] = super().get_params(ctx)
        for own in found:
            if own.help and (marked := _LIST.search(own.help)):
                own.help = own.help.replace(marked[0], _lists()[marked[0]])
        return found


_LIST = re.compile("FAMILIES|PRESETS|KINDS")  # What stands in a help for a list


def _lists() -> dict[str, str]:
    from tolalloc.cli.start import KINDS
    from tolalloc.reducers.families.known import FAMILIES

    words, presets = zip(*((own.word, ", ".join(own.new.presets)) for own in FAMILIES.values()), strict=True)
    others = map(": ".join, zip(words[1:], presets[1:], strict=True))
    return {"FAMILIES": ", ".join(words), "PRESETS": "; ".join([presets[0], *others]), "KINDS": ", ".join(KINDS)}


def new(
    name: Annotated[Path | None, typer.Argument(help="The new folder; its name becomes the name of the study.")] = None,
    family: Annotated[str, typer.Option(help="Family of reducers: FAMILIES; as the preset unless given.")] = "",
    like: Annotated[
        str,
        typer.Option(help="Preset to start from: PRESETS."),
    ] = "",
    cranks: Annotated[int | None, typer.Option(help="Cranks, 2 to 4; as the preset unless given.")] = None,
    discs: Annotated[int | None, typer.Option(help="Discs, 1 to 3; as the preset unless given.")] = None,
    samples: Annotated[
        str, typer.Option("--with", help="Samples for the other commands, such as costs,bench,lot, or all.")
    ] = "",
) -> None:
    """Make a folder with a reducer, its tolerance table, a study and samples, to start from."""
    from tolalloc.cli.start import Likeness, NewFolder, preset_of
    from tolalloc.reducers.families.known import FAMILIES

    if name is None:
        if not sys.stdin.isatty():
            raise InputError("tolalloc new: NAME is missing; give the folder to make, such as mine.")
        name = Path(typer.prompt("Name of the folder", default="mine"))
        presets = ", ".join(preset for own in FAMILIES.values() for preset in own.new.presets)
        like = preset_of(family, like or typer.prompt(f"Like which preset ({presets})", default=preset_of(family, "")))
        preset = Likeness(preset=like).reducer
        if preset.crank_count:
            cranks = cranks or typer.prompt("Cranks, 2 to 4", default=preset.crank_count, type=int)
        discs = discs or typer.prompt("Discs, 1 to 3", default=preset.disc_count, type=int)
        samples = samples or typer.prompt("Samples for the other commands (all, or none)", default="none")
        samples = "" if samples == "none" else samples
    chosen = Likeness(preset=preset_of(family, like), cranks=cranks, discs=discs)
    reducer, sources = NewFolder(place=name, like=chosen, samples=chosen.kinds(samples)).write()
    varied = sum(own.zone > 0 and not own.locked for own in sources)
    say(
        f"{name}: {reducer.name} with {reducer.drive_count} {reducer.driven_by} and {reducer.disc_count} discs, like "
        f"{chosen.preset}; {len(sources)} sources, of which {varied} may change."
    )
    say("Every zone and cost is assumed: open zones.xlsx and write your own.")
    note(f"Next: cd {name} && tolalloc check study.py && tolalloc open study.py", dim=True)


def schema(
    kind: Annotated[
        str,
        typer.Argument(help="Kind of TOML file: KINDS."),
    ],
) -> None:
    """Print the JSON schema of a kind of TOML file: its fields, their units and ranges."""
    from tolalloc.cli.start import schema as schema_of

    print_json(schema_of(kind))

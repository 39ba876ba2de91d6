"""The command ``tolalloc schema``: what may stand in a TOML file, for editors."""

from __future__ import annotations

from typing import Annotated

import typer

from tolalloc.cli.console import print_json


def schema(
    kind: Annotated[str, typer.Argument(help="Kind of TOML file: reducer, unit, stiffness, bench or chain.")],
) -> None:
    """Print the JSON schema of a kind of TOML file: its fields, their units and ranges."""
    from tolalloc.cli.start.schema import schema as schema_of

    print_json(schema_of(kind))

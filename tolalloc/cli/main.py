"""The command line: words in, answer out."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from tolalloc.cli.assemble import assemble
from tolalloc.cli.compare import compare
from tolalloc.cli.console import note
from tolalloc.cli.contact import contact
from tolalloc.cli.costs import costs
from tolalloc.cli.diagnose import diagnose
from tolalloc.cli.identify import identify
from tolalloc.cli.modify import modify
from tolalloc.cli.mount import mount
from tolalloc.cli.run import allocate, check, rank, run
from tolalloc.cli.simulate import simulate
from tolalloc.cli.transmission_error import te
from tolalloc.cli.whatif import whatif
from tolalloc.exceptions import TolallocError

app = typer.Typer(
    help="Which drawing tolerance of an RV reducer drives its transmission error, and which tolerances are cheapest.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # rich's own markup would swallow [mm]
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False) -> None:
    if version:
        from importlib.metadata import version as installed

        typer.echo(f"tolalloc {installed('tolalloc')}")
        raise typer.Exit


for command in (
    run,
    check,
    rank,
    allocate,
    whatif,
    costs,
    te,
    contact,
    modify,
    identify,
    diagnose,
    assemble,
    mount,
    simulate,
    compare,
):
    app.command()(command)


def main() -> None:
    """Run the command line; an error that a user can mend becomes one sentence and exit code 2."""
    try:
        app()
    except TolallocError as error:
        note(f"Error: {error}")
        raise SystemExit(2) from None


def run_script() -> None:
    """Run the study of the calling script, with the options of ``tolalloc run``."""
    sys.argv = [sys.argv[0], "run", *sys.argv]
    main()


if __name__ == "__main__":
    main()

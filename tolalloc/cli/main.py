"""The command line: words in, answer out."""

from __future__ import annotations

import io
import os
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Annotated

import typer

from tolalloc.cli.console import answers_alone, note
from tolalloc.cli.doctor import doctor
from tolalloc.cli.new import Listing, new, schema
from tolalloc.cli.open import open_page
from tolalloc.cli.options import SayingNumbers, inquiry_command, saying_options
from tolalloc.cli.run import allocate, rank, run
from tolalloc.cli.studies import check, export_problem, series, whatif
from tolalloc.exceptions import InputError, StoppedError, TolallocError, in_short
from tolalloc.wings import all_inquiries

app = typer.Typer(
    cls=SayingNumbers,
    help="Which drawing tolerance of an RV reducer drives its transmission error, and which tolerances are cheapest.",
    no_args_is_help=True,
    rich_markup_mode="markdown",  # rich's own markup would swallow [mm]
    add_completion=True,
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False) -> None:
    if version:
        from importlib.metadata import version as installed

        typer.echo(f"tolalloc {installed('tolalloc')}")
        raise typer.Exit


_COMMANDS: dict[Callable[..., None], str] = {
    new: "tolalloc new mine --like rv40e --cranks 3 --with all",
    check: "tolalloc check mine/study.py",
    open_page: "tolalloc open mine/study.py",
    run: "tolalloc run mine/study.py --quick",
    rank: "tolalloc rank mine/study.py --quick --pdf",
    allocate: "tolalloc allocate mine/study.py --grades --limit 50",
    whatif: "tolalloc whatif mine/study.py pin.diameter=3 'disc*.pitch=10'",
    export_problem: "tolalloc export-problem mine/study.py --out mine/problem",
    series: "tolalloc series mine/*.py --quick",
    **{inquiry_command(own): own.example for own in all_inquiries()},
    schema: "tolalloc schema reducer",
    doctor: "tolalloc doctor",
}
"""Every command, as a newcomer meets them, with an example in a folder that ``tolalloc new mine --with all`` made."""

_FIRST_DAY = "1980-01-01"
"""First day that a file inside a workbook, a ZIP archive, can state."""

EXAMPLES = {command.__name__.removesuffix("_page").replace("_", "-"): example for command, example in _COMMANDS.items()}
for (word, example), command in zip(EXAMPLES.items(), _COMMANDS, strict=True):
    app.command(word, epilog=f"Example: `{example}`", cls=Listing)(saying_options(command, word))


def main() -> None:
    """Run the command line; an error that a user can mend becomes one sentence and exit code 2."""
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # where output is not UTF-8, a µ becomes a question mark
    try:
        _require_threads(os.environ.get("NUMBA_NUM_THREADS", "1"))
        _require_clock(time.strftime("%Y-%m-%d"))
        try:
            with answers_alone() if "--json" in sys.argv and "--help" not in sys.argv else nullcontext():
                app()
        finally:
            sys.stdout.flush()
    except StoppedError as stop:
        note(str(stop))
        raise SystemExit(130) from None  # as a shell counts Ctrl-C
    except TolallocError as error:
        for sentence in str(error).split("\n"):
            note(f"Error: {sentence}")
        raise SystemExit(2) from None
    except OSError as error:  # a full disk, a name that is too long
        note(f"Error: {in_short(str(error.filename or 'output'))}: cannot be read or written ({error.strerror}).")
        if isinstance(sys.stdout, io.TextIOWrapper):  # what is left of the output has nowhere to go
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(2) from None


def _open_closed_streams() -> None:
    """Let what a closed stream would take go nowhere: Python has None in its place, and files would get its number."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115


def _require_threads(stated: str) -> None:
    """Refuse a number of threads on which numba stops with a traceback."""
    if not (stated.isascii() and stated.isdecimal() and 1 <= len(stated) <= 4 and int(stated) > 0):
        raise InputError.at("environment", "NUMBA_NUM_THREADS", stated, "a whole number from 1 to 9999, or nothing")


def _require_clock(today: str) -> None:
    """Refuse a clock that was not set, before which a workbook ends in a traceback when all is solved."""
    if today < _FIRST_DAY:
        raise InputError.at("environment", "clock", today, f"{_FIRST_DAY} or later, the first day of a workbook")


def run_script() -> None:
    """Run the study of the calling script, with the options of ``tolalloc run``."""
    sys.argv = [sys.argv[0], "run", *sys.argv]
    main()


if __name__ == "__main__":
    main()

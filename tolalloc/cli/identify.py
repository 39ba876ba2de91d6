"""The command ``tolalloc identify``: from a measurement file to a stiffness file."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, note, shown_progress, tell, write_report
from tolalloc.cli.options import ReducerOption, named_reducer
from tolalloc.exceptions import InputError

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.bench.catalogue import CatalogueAnswer
    from tolalloc.bench.identification_answer import IdentificationAnswer
    from tolalloc.bench.parameters import Parameter
    from tolalloc.reducers.reducer.design import Reducer

PLACE = "tolalloc identify"
NAMES = "sun_support, gear_mesh, crank_disc_bearing, crank_carrier_bearing, carrier_bearing, pin_contact, torque, bias"
"""Names of `tolalloc.bench.parameters.SYMBOLS`, written out so that help need not import them."""


def identify(
    data: Annotated[
        Path | None, typer.Argument(help="Measurement file (TOML): units and their readings; none with --catalogue.")
    ] = None,
    reducer: ReducerOption = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            help=f"Unknown as NAME or NAME=LOW:HIGH, again for each; NAME one of {NAMES}. Stiffness in "
            "N/m, bias in arcsec, torque over the stated one. Unless given: liu2020's three, half to double.",
        ),
    ] = None,
    priors: Annotated[
        list[str] | None,
        typer.Option("--prior", help="Known beforehand, as NAME=RELATIVE standard deviation (bias: arcsec)."),
    ] = None,
    catalogue: Annotated[
        bool,
        typer.Option("--catalogue", help="Instead of units: the rigidity in [catalogue], one factor on all bearings."),
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of every random number.")] = 1,
    write: Annotated[Path | None, typer.Option(help="Stiffness file to write, new, for --stiffness elsewhere.")] = None,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Identify stiffnesses from measured units, and say what the measurements cannot tell."""
    answer: IdentificationAnswer | CatalogueAnswer
    from tolalloc.reducers.reducer.files import load_reducer, write_identified_stiffness
    from tolalloc.reports.folder import require_usable

    design = load_reducer(named_reducer(reducer, write, out))
    require_usable(out)
    if write:
        _require_stiffness_file(write, out)
    if catalogue:
        given = {"a measurement file": data, "--parameter": parameters, "--prior": priors}
        for name, value in given.items():
            if value:
                raise InputError(f"{PLACE}: --catalogue needs no units; leave out {name}.")
        answer, tables = _from_catalogue(design)
    elif data is None:
        raise InputError(f"{PLACE}: a measurement file is missing; give one, or --catalogue.")
    else:
        answer, tables = _from_units(data, design, parameters, priors, seed, write)
    write_report(answer, out)
    if write and answer.stiffness:
        write_identified_stiffness(answer.stiffness, write)
        note(f"Stiffness file: {write}")
    tell(answer, as_json, *tables)


def _require_stiffness_file(file: Path, out: Path | None) -> None:
    """Refuse a stiffness file that could not be written, before anything long runs."""
    from tolalloc.reading.files import require_new

    require_new(file)
    if file.suffix != ".toml":
        raise InputError.at(PLACE, "--write", str(file), "a file that ends in .toml")
    if out and (out.absolute() == file.absolute() or out.absolute() in file.absolute().parents):
        raise InputError.at(PLACE, "--write", str(file), "a file outside of the report's folder")


def _from_catalogue(design: Reducer) -> tuple[CatalogueAnswer, list[tuple[pd.DataFrame, str]]]:
    """Return the factor on all bearings that gives the rigidity of the catalogue."""
    from tolalloc.bench.catalogue import identify_from_catalogue

    announce_compilation()
    answer = identify_from_catalogue(design)
    return answer, [(answer.shares, f"{design.name}: which part yields, with the factor")]


def _from_units(
    data: Path,
    design: Reducer,
    asked: list[str] | None,
    priors: list[str] | None,
    seed: int,
    stiffness: Path | None,
) -> tuple[IdentificationAnswer, list[tuple[pd.DataFrame, str]]]:
    """Return the stiffnesses that measured units tell."""
    # The report's libraries take half a second to import; a misspelt file need not wait for them.
    from tolalloc.bench.identification import IdentificationRequest
    from tolalloc.bench.identification import identify as identified
    from tolalloc.bench.identification_exhibits import estimates_table
    from tolalloc.bench.measurements import load_measurements
    from tolalloc.bench.parameters import LIU2020

    request = IdentificationRequest(
        parameters=asked_parameters(design, asked or list(LIU2020), priors or []),
        seed=seed,
        data=str(data),
    )
    if stiffness and not any(item.is_stiffness for item in request.parameters):
        raise InputError.at(PLACE, "--write", str(stiffness), "a file only where a stiffness is identified")
    measurements = load_measurements(data)
    announce_compilation()
    with shown_progress() as progress:
        answer = identified(request, measurements, design, progress)
    tables = [(estimates_table(answer), f"{design.name}: {measurements.name}")]
    if answer.choices:
        short = ["fitted", "units left out, over noise [-]", "chosen"]
        tables.append((answer.to_frame("choices")[short], "Simpler explanations"))
    return answer, tables


def asked_parameters(reducer: Reducer, asked: list[str], priors: list[str]) -> tuple[Parameter, ...]:
    """Return the unknowns as written on the command line: ``NAME`` or ``NAME=LOW:HIGH``, and ``NAME=DEVIATION``.

    Raises
    ------
    InputError, UnknownNameError
        What is not allowed.
    """
    from tolalloc.bench.parameters import parameter

    known: dict[str, float] = {}
    for text in priors:
        name, sign, number = text.partition("=")
        if not sign:
            raise InputError.at(PLACE, "--prior", text, "NAME=NUMBER, such as carrier_bearing=0.1")
        if name in known:
            raise InputError.at(PLACE, "--prior", text, "each parameter once")
        known[name] = _number(number, "--prior", text)
    found = []
    for text in asked:
        name, sign, range_ = text.partition("=")
        low, colon, high = range_.partition(":")
        if sign and not colon:
            raise InputError.at(PLACE, "--parameter", text, "NAME or NAME=LOW:HIGH, such as bias=-5:5")
        bounds = (_number(low, "--parameter", text), _number(high, "--parameter", text)) if sign else None
        found.append(parameter(name, reducer, bounds, known.pop(name, inf), PLACE))
    for name in known:
        raise InputError.at(PLACE, "--prior", name, "a prior of a parameter that is asked for")
    return tuple(found)


def _number(text: str, option: str, whole: str) -> float:
    """Return a number of an option."""
    from tolalloc.drawings.table_file import plain_number

    try:
        return plain_number(text)
    except ValueError:
        raise InputError.at(PLACE, option, whole, f"numbers; {text!r} is none") from None

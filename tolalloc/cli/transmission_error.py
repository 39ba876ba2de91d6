"""The command ``tolalloc te``: one unit, one torque."""

from __future__ import annotations

from math import isnan
from typing import Annotated

import typer

from tolalloc.cli.console import AsJson, ReportFolder, announce_compilation, tell, write_report
from tolalloc.cli.options import ReducerOption, StiffnessOption, TestTorqueOption, named_reducer

_ORDERS = 5
"""Main orders that fit on a screen [-]."""


def te(
    reducer: ReducerOption = None,
    unit: Annotated[str, typer.Option(help="Shipped unit (exact, table4 of an RV-20E) or TOML file.")] = "exact",
    torque: TestTorqueOption = None,
    stiffness: StiffnessOption = "",
    attributed: Annotated[bool, typer.Option("--attribute", help="Show which source makes which order.")] = False,
    out: ReportFolder = None,
    as_json: AsJson = False,
) -> None:
    """Transmission error of one built unit over one output turn."""
    from tolalloc.reducers.equivalent.compiled_ahead import compile_ahead
    from tolalloc.reducers.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
    from tolalloc.reducers.reducer.unit_file import load_unit
    from tolalloc.reducers.transmission_error import transmission_error
    from tolalloc.reports.folder import require_usable

    design = load_reducer(named_reducer(reducer, out))
    if stiffness:
        design = with_stiffness(design, load_identified_stiffness(stiffness))
    require_usable(out)
    announce_compilation()
    compile_ahead(design.disc_count)
    asked = design.torque_on_carrier(torque, "tolalloc te")
    answer = transmission_error(design, load_unit(unit), asked, attributed=attributed)
    write_report(answer, out)
    tables = [(answer.turn_table, answer.title)]
    if attributed:
        shown = answer.attribution_table.iloc[:, : 2 + _ORDERS]
        shown.columns = [str(name).removesuffix(" [arcsec]").removeprefix("order ") for name in shown]
        words = "What each source adds to the curve and to the main orders [arcsec]; minus cancels; all: --json"
        tables.append((shown.map(_tenths), words))
    tell(answer, as_json, *tables)


def _tenths(cell: str | float) -> str:
    """Return a cell with one decimal; what is not there stays empty."""
    return cell if isinstance(cell, str) else "" if isnan(cell) else f"{cell:.1f}"

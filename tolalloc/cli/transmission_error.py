"""The command ``tolalloc te``: one unit, one torque."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer
from jaxtyping import Float
from rich.markup import escape
from rich.table import Table

from tolalloc.cli.console import AsJson, announce_compilation, print_json, screen
from tolalloc.cli.options import ReducerOption, StiffnessOption, TestTorqueOption, named_reducer
from tolalloc.exceptions import SolveError
from tolalloc.rv.cycloid.clearance import linear_model_warnings
from tolalloc.rv.equivalent.attribution import attribute
from tolalloc.rv.equivalent.hysteresis import LOOP_ANGLES, LOOP_ASSUMPTION, both_directions, hysteresis_loop
from tolalloc.rv.equivalent.kinematics import HARMONICS
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import OUTPUTS, Solved, order_spectrum
from tolalloc.rv.equivalent.status import Status, count_statuses
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.files import load_identified_stiffness, load_reducer, with_stiffness
from tolalloc.rv.reducer.unit_file import BuiltUnit, load_unit
from tolalloc.units import ARCMINUTE, ARCSECOND, DEGREE


def te(
    reducer: ReducerOption = None,
    unit: Annotated[str, typer.Option(help="Shipped unit (exact, table4 of an RV-20E) or TOML file.")] = "exact",
    torque: TestTorqueOption = None,
    stiffness: StiffnessOption = "",
    attributed: Annotated[bool, typer.Option("--attribute", help="Show which source makes which order.")] = False,
    as_json: AsJson = False,
) -> None:
    """Transmission error of one built unit over one output turn."""
    design = load_reducer(named_reducer(reducer))
    if stiffness:
        design = with_stiffness(design, load_identified_stiffness(stiffness))
    announce_compilation()
    answer = unit_answer(design, load_unit(unit), design.torque_on_carrier(torque, "tolalloc te"), attributed)
    if as_json:
        print_json(answer)
    else:
        screen.print(as_table(answer))
        for warning in answer["warnings"]:
            screen.print(warning, style="yellow", markup=False)
        if attributed:
            screen.print(attribution_table(answer))


def unit_answer(reducer: Reducer, unit: BuiltUnit, torque: float, attributed: bool = False) -> dict[str, Any]:
    """Return what a unit does over one output turn, with units of measurement in the names."""
    model = EquivalentModel(reducer, orders=unit.orders or HARMONICS)
    errors = unit.errors(model.columns, reducer.modification.deviations)
    equilibria, extremes = model.equilibria(errors, torque), model.extremes(errors, torque)
    worst = Status(max(extremes.status[0], equilibria.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {unit.name}: no transmission error can be given, at some angle: {worst.sentence}.")
    solved = Solved.of(equilibria)
    answer = {
        "reducer": reducer.name,
        "unit": unit.name,
        "torque_nm": torque,
        "peak_to_peak_arcsec": float(extremes.peak_to_peak[0] / ARCSECOND),
        "remaining_error_arcsec": float(extremes.remaining[0] / ARCSECOND),
        "largest_arcsec": float(extremes.largest[0] / ARCSECOND),
        "largest_at_deg": float(extremes.carrier_angle[0, 0] / DEGREE),
        "smallest_arcsec": float(extremes.smallest[0] / ARCSECOND),
        "smallest_at_deg": float(extremes.carrier_angle[0, 1] / DEGREE),
        "main_orders": [
            {"order": order, "amplitude_arcsec": amplitude / ARCSECOND, "phase_deg": phase / DEGREE}
            for order, amplitude, phase in order_spectrum(equilibria.transmission_error).main(8)
        ],
        "outputs": [
            {"name": output.name, "unit": output.unit, "value": float(output.value(solved)[0])} for output in OUTPUTS
        ],
        **_loop_answer(model, errors, torque),
        "angles": {"equally_spaced": model.search.coarse, "solved_in_all": int(extremes.solves[0])},
        "largest_residual_of_largest_force": float(extremes.residual[0]),
        "statuses": dict(count_statuses(equilibria.status)),
        "warnings": list(linear_model_warnings(reducer.cycloid_stage, reducer.modification)),
        "assumptions": [*reducer.assumptions, *unit.assumptions, LOOP_ASSUMPTION],
    }
    if attributed:
        answer["attribution"] = _attribution_answer(model, errors, torque)
    return answer


def _loop_answer(model: EquivalentModel, errors: Float[np.ndarray, "1 column"], torque: float) -> dict[str, Any]:
    """Return what the hysteresis loop and the two directions of rotation show; null where an angle has no answer."""
    both = np.concatenate([errors, np.zeros_like(errors)])
    loop = hysteresis_loop(model, both, LOOP_ANGLES)
    reversed_by = both_directions(model, errors, torque).difference[0]

    def pair(values: Float[np.ndarray, "2"], unit_of_measurement: float) -> dict[str, float | None]:
        this, perfect = (None if np.isnan(value) else float(value / unit_of_measurement) for value in values)
        return {"this_unit": this, "perfect_reducer": perfect}

    return {
        "lost_motion_arcmin": pair(loop.lost_motion, ARCMINUTE),
        "backlash_arcmin": pair(loop.backlash, ARCMINUTE),
        "torsional_stiffness_nm_per_arcmin": pair(loop.torsional_stiffness, 1 / ARCMINUTE),
        "reversal_arcsec": {
            "mean": float(reversed_by.mean() / ARCSECOND),
            "peak_to_peak": float(np.ptp(reversed_by) / ARCSECOND),
        },
    }


def _attribution_answer(model: EquivalentModel, errors: Float[np.ndarray, "1 column"], torque: float) -> dict[str, Any]:
    """Return which source makes how much of each main order."""
    attribution = attribute(model, errors, torque)
    main = np.argsort(-attribution.amplitude)[:8]
    span = np.ptp(attribution.contribution, axis=1)
    return {
        "orders": [int(order) for order in attribution.order[main]],
        "amplitude_arcsec": [float(value / ARCSECOND) for value in attribution.amplitude[main]],
        "sources": [
            {
                "source": attribution.sources[at],
                "peak_to_peak_arcsec": float(span[at] / ARCSECOND),
                "share_arcsec": [float(value / ARCSECOND) for value in attribution.share[at, main]],
            }
            for at in np.argsort(-span)
        ],
    }


def as_table(answer: dict[str, Any]) -> Table:
    """Return the answer as a table for a person."""
    table = Table(title=f"{answer['reducer']}, unit {answer['unit']}, {answer['torque_nm']:g} N·m on the carrier")
    table.add_column("quantity")
    table.add_column("value", justify="right")
    reversal = answer["reversal_arcsec"]
    rows = [
        ("peak-to-peak over one output turn [arcsec]", f"{answer['peak_to_peak_arcsec']:.2f}"),
        ("finer angles may add [arcsec]", f"{answer['remaining_error_arcsec']:.3f}"),
        (f"largest, at {answer['largest_at_deg']:.2f}° [arcsec]", f"{answer['largest_arcsec']:.2f}"),
        (f"smallest, at {answer['smallest_at_deg']:.2f}° [arcsec]", f"{answer['smallest_arcsec']:.2f}"),
        *(
            (
                f"order {wave['order']} of the output turn, amplitude [arcsec] and phase",
                f"{wave['amplitude_arcsec']:.2f} ∠ {wave['phase_deg']:.0f}°",
            )
            for wave in answer["main_orders"]
        ),
        *((f"{item['name']} [{item['unit']}]", _short(item["value"])) for item in answer["outputs"]),
        *(
            (f"{label}, {whose.replace('_', ' ')} [{unit}]", "not found" if value is None else _short(value))
            for label, field, unit in (
                ("lost motion at ±3 % of rated torque", "lost_motion_arcmin", "arcmin"),
                ("backlash", "backlash_arcmin", "arcmin"),
                ("torsional stiffness", "torsional_stiffness_nm_per_arcmin", "N·m/arcmin"),
            )
            for whose, value in answer[field].items()
        ),
        ("reversing the direction adds, mean [arcsec]", f"{reversal['mean']:.2f}"),
        ("reversing the direction adds, peak-to-peak [arcsec]", f"{reversal['peak_to_peak']:.2f}"),
        *((f"angles: {outcome} [-]", str(count)) for outcome, count in answer["statuses"].items() if count),
        ("largest unbalanced force over largest force [-]", f"{answer['largest_residual_of_largest_force']:.1e}"),
    ]
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table


def attribution_table(answer: dict[str, Any]) -> Table:
    """Return which source makes which order, as a table for a person."""
    found = answer["attribution"]
    shown = found["orders"][:5]
    table = Table(
        title="What each source adds to the curve and to the main orders [arcsec]",
        caption="Orders: component along the whole wave, minus cancels; columns sum to the amplitude. All: --json",
    )
    table.add_column("source", no_wrap=True)
    table.add_column("curve", justify="right")
    for order in shown:
        table.add_column(f"{order}", justify="right")
    for item in found["sources"]:
        shares = (f"{value:.1f}" for value in item["share_arcsec"][: len(shown)])
        table.add_row(escape(item["source"]), f"{item['peak_to_peak_arcsec']:.1f}", *shares)
    table.add_row("together", "", *(f"{value:.1f}" for value in found["amplitude_arcsec"][: len(shown)]))
    return table


def _short(value: float) -> str:
    """Return a number with four significant digits and no exponent for what users meet."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"

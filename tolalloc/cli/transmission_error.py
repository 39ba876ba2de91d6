"""The answer of ``tolalloc te``: one unit, one torque."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from tolalloc.equivalent.outputs import order_spectrum, torsional_stiffness
from tolalloc.equivalent.status import Status, count_statuses
from tolalloc.equivalent.transmission_error import EquivalentModel
from tolalloc.exceptions import SolveError
from tolalloc.reducer.design import Reducer
from tolalloc.uncertainty.unit_file import BuiltUnit
from tolalloc.units import ARCMINUTE, ARCSECOND, DEGREE


def unit_answer(reducer: Reducer, unit: BuiltUnit, torque: float) -> dict[str, Any]:
    """Return peak-to-peak, orders, torsional stiffness and statuses of one unit, with units in the names."""
    model, rated = EquivalentModel(reducer), reducer.load.rated_torque
    errors = unit.errors(model.columns)
    curves, extremes = model.curves(errors, torque), model.extremes(errors, torque)
    worst = Status(max(extremes.status[0], curves.status.max()))
    if worst is not Status.CONVERGED:
        raise SolveError(f"unit {unit.name}: no transmission error can be given, at some angle: {worst.sentence}.")
    perfect = np.zeros_like(errors)
    loads = (-0.03 * rated, -rated)
    return {
        "reducer": reducer.name,
        "unit": unit.name,
        "torque_nm": torque,
        "peak_to_peak_arcsec": float(extremes.peak_to_peak[0] / ARCSECOND),
        "remaining_error_arcsec": float(extremes.remaining[0] / ARCSECOND),
        "largest_arcsec": float(extremes.largest[0] / ARCSECOND),
        "largest_at_deg": float(extremes.carrier_angle[0, 0] / DEGREE),
        "smallest_arcsec": float(extremes.smallest[0] / ARCSECOND),
        "smallest_at_deg": float(extremes.carrier_angle[0, 1] / DEGREE),
        "mean_arcsec": float(curves.transmission_error.mean() / ARCSECOND),
        "main_orders": [
            {"order": order, "amplitude_arcsec": amplitude / ARCSECOND}
            for order, amplitude in order_spectrum(curves.transmission_error).main(8)
        ],
        "pins_in_contact": {"least": int(curves.pins_in_contact.min()), "most": int(curves.pins_in_contact.max())},
        "torsional_stiffness_nm_per_arcmin": {
            "perfect_reducer": float(torsional_stiffness(model, perfect, *loads)[0] * ARCMINUTE),
            "this_unit": float(torsional_stiffness(model, errors, *loads)[0] * ARCMINUTE),
            "between_torques_nm": list(loads),
        },
        "angles": {"equally_spaced": model.search.coarse, "solved_in_all": int(extremes.solves[0])},
        "largest_residual_of_largest_force": float(extremes.residual[0]),
        "statuses": dict(count_statuses(curves.status)),
        "assumptions": [*reducer.assumptions, *unit.assumptions],
    }


def as_table(answer: dict[str, Any]) -> Table:
    """Return the answer as a table for a person."""
    table = Table(title=f"{answer['reducer']}, unit {answer['unit']}, {answer['torque_nm']:g} N·m on the carrier")
    table.add_column("quantity")
    table.add_column("value", justify="right")
    stiffness = answer["torsional_stiffness_nm_per_arcmin"]
    rows = [
        ("peak-to-peak over one output turn [arcsec]", f"{answer['peak_to_peak_arcsec']:.2f}"),
        ("finer angles may add [arcsec]", f"{answer['remaining_error_arcsec']:.3f}"),
        (f"largest, at {answer['largest_at_deg']:.2f}° [arcsec]", f"{answer['largest_arcsec']:.2f}"),
        (f"smallest, at {answer['smallest_at_deg']:.2f}° [arcsec]", f"{answer['smallest_arcsec']:.2f}"),
        ("mean [arcsec]", f"{answer['mean_arcsec']:.2f}"),
        *(
            (f"order {wave['order']} of the output turn, amplitude [arcsec]", f"{wave['amplitude_arcsec']:.2f}")
            for wave in answer["main_orders"]
        ),
        ("pins in contact, least…most [-]", "{least}…{most}".format(**answer["pins_in_contact"])),
        ("torsional stiffness, perfect reducer [N·m/arcmin]", f"{stiffness['perfect_reducer']:.0f}"),
        ("torsional stiffness, this unit, 3…100 % of rated torque [N·m/arcmin]", f"{stiffness['this_unit']:.0f}"),
        *((f"angles: {outcome} [-]", str(count)) for outcome, count in answer["statuses"].items() if count),
        ("largest unbalanced force over largest force [-]", f"{answer['largest_residual_of_largest_force']:.1e}"),
    ]
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table

"""Pictures of single units of a reducer: curves over one turn, their orders, and how exact teeth carry."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.models.model import Units
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.equivalent.answers import Equilibria
from tolalloc.reducers.equivalent.outputs import order_spectrum
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.teeth.answer import contact_answer
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.reducers.model import ReducerModel

_ORDERS = 130
"""Orders of the output turn that a report lists [-]."""


def illustrated(model: ReducerModel, units: Units) -> tuple[Section, ...]:
    """Return the curves and orders of units, with the built unit first, and how exact teeth carry the rated torque."""
    curves = _curves(model, units)
    return (
        Section(
            heading="Single units over one output turn",
            figures=(_curve_figure(curves, model.kernel.torque), _order_figure(curves, model.reducer)),
            tables=(("orders of units", _order_table(curves)),),
        ),
        Section(
            heading="How exact teeth carry the rated torque",
            paragraphs=(
                "Exact parts, Hertzian line contact, the most loaded disc by Li Lixing's share; a modification that "
                "interferes before any load has no numbers.",
            ),
            tables=(("contact", _contact_table(model, units)),),
        ),
    )


def pictured(model: ReducerModel, units: Units) -> tuple[Figure, Figure]:
    """Return the curves and the orders of units."""
    curves = _curves(model, units)
    return _curve_figure(curves, model.kernel.torque), _order_figure(curves, model.reducer)


def _curves(model: ReducerModel, units: Units) -> dict[str, Equilibria]:
    """Return the curve of every unit."""
    kernel, curves = model.kernel, {}
    if model.unit and model.built_curve:
        curves[f"unit {model.unit.name}"] = model.built_curve
    for label, (settings, x) in units.items():
        errors = model.at(settings).kernel.errors(x[np.newaxis])
        curves[label] = kernel.model.equilibria(errors, kernel.torque)
    return curves


def _curve_figure(curves: Mapping[str, Equilibria], torque: float) -> Figure:
    return Figure(
        name="transmission_error",
        title=f"Transmission error over one output turn at {torque:g} N·m",
        x_label="carrier angle [°]",
        y_label="transmission error, output side [arcsec]",
        series=tuple(
            Series(
                label=label,
                kind="line",
                x=list(curve.carrier_angle / DEGREE),
                y=list(curve.transmission_error[0] / ARCSECOND),
            )
            for label, curve in curves.items()
        ),
    )


def _amplitudes(curve: Equilibria) -> Float[np.ndarray, " order"]:
    """Return the amplitudes of the first orders [arcsec]."""
    return np.asarray(order_spectrum(curve.transmission_error).amplitude[0, :_ORDERS] / ARCSECOND)


def _order_figure(curves: Mapping[str, Equilibria], reducer: Reducer) -> Figure:
    stage = reducer.cycloid_stage
    return Figure(
        name="orders_of_units",
        title=f"Orders: multiples of {stage.disc_teeth} stand still with the housing, of {stage.pin_count} turn with "
        "disc or carrier",
        x_label="order of the output turn [-]",
        y_label="amplitude, output side [arcsec]",
        series=tuple(
            Series(label=label, kind="stems", x=list(range(1, _ORDERS + 1)), y=list(_amplitudes(curve)))
            for label, curve in curves.items()
        ),
    )


def _order_table(curves: Mapping[str, Equilibria]) -> pd.DataFrame:
    import pandas as pd

    found = {"order of the output turn [-]": np.arange(1, _ORDERS + 1)}
    return pd.DataFrame(found | {f"{label} [arcsec]": _amplitudes(curve) for label, curve in curves.items()})


def _contact_table(model: ReducerModel, units: Units) -> pd.DataFrame:
    """Return amounts, clearances and how exact teeth carry, for the modification of every unit."""
    import pandas as pd

    columns: dict[str, dict[str, float]] = {}
    for label, (settings, _) in units.items():
        amounts = model.modification(settings)
        columns[label] = {
            "equidistant Δr_rp [µm]": amounts.equidistant / MICROMETRE,
            "shift Δr_p [µm]": amounts.shift / MICROMETRE,
            "flank clearance, smallest nominal gap [µm]": amounts.flank_clearance(model.reducer.cycloid_stage)
            / MICROMETRE,
            "radial clearance at tip and root [µm]": amounts.radial_clearance / MICROMETRE,
            **_carried(replace(model.reducer, modification=amounts)),
        }
    shown = {label: f"{label.removeprefix('median unit ')} [unit of the amount]" for label in columns}
    frame = pd.DataFrame(columns).rename(columns=shown)
    return frame.rename_axis("amount").reset_index()


def _carried(reducer: Reducer) -> dict[str, float]:
    """Return how the parts without errors carry the rated torque; not a number where they interfere before any load."""
    values = [np.nan] * len(_CARRIED)
    with suppress(InputError):
        found = contact_answer(reducer, -reducer.load.rated_torque, law=reducer.stiffness.pin_contact_law).summary
        if own := found["bearings yielding"]:
            values = [
                found["profile"]["backlash [arcmin]"],
                own["pins in contact on a disc [-]"][0],
                own["largest pin force [N]"],
                own["peak pressure [MPa]"],
            ]
    return dict(zip(_CARRIED, values, strict=True))


_CARRIED = (
    "backlash of teeth and pins [arcmin]",
    "fewest pins in contact on a disc at rated torque [-]",
    "largest pin force at rated torque [N]",
    "peak pressure at rated torque [MPa]",
)

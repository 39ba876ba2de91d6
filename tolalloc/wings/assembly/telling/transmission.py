"""What the final angles of an assembly do to the transmission: sentences, tables and figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from tolalloc.reading.units import ARCSECOND, DEGREE, MEGAPASCAL, MICROMETRE, MILLIMETRE, unit_of
from tolalloc.reducers import PEAK_TO_PEAK
from tolalloc.reports.columns import of_positions
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, HeatMap, Series
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity
from tolalloc.wings.assembly.orientations import (
    DISC_FORCE,
    LINE_LOAD,
    PIN_FORCE,
    PRESSURE,
    RATED_PEAK_TO_PEAK,
    TransmissionEffect,
)
from tolalloc.wings.assembly.telling.tables import PRECISION, rounded

if TYPE_CHECKING:
    import pandas as pd

DRAWN = {"peak_to_peak": PEAK_TO_PEAK, "pin_force": PIN_FORCE, "disc_force": DISC_FORCE, "line_load": LINE_LOAD}
"""Figure name → output that is drawn over the precision."""
_BETTER_SMALL = (PEAK_TO_PEAK, RATED_PEAK_TO_PEAK, PIN_FORCE, DISC_FORCE, LINE_LOAD, PRESSURE)
BAND = (5.0, 95.0)
"""Percentiles around the median of random assemblies [%]."""
_SAME = 1e-6
"""Share by which solutions of the same angles may differ [-]."""
_CRANK_TURNS = 2
"""Turns of the crank that a curve shows; a whole output turn is too many to read [-]."""
_EVERY = 4
"""Of the places along the width every such one has a cell [-]."""
_say = Sentences("assembly", "tolalloc.wings.assembly")


def answers(effect: TransmissionEffect, output: str) -> Float[np.ndarray, "state_weight good"]:
    """Return an output of all assemblies that have an answer at every precision."""
    return effect.values[:, effect.good, effect.outputs.index(output)]


def perfect(effect: TransmissionEffect, output: str) -> float:
    """Return an output without any angular error."""
    return float(effect.perfect[effect.outputs.index(output)])


def change(effect: TransmissionEffect, output: str, precision: float) -> tuple[float, float]:
    """Return an output unadjusted and at a solved precision [-], medians of random assemblies [as the name says]."""
    at = int(np.flatnonzero(effect.state_weights == precision)[0])
    before, after = np.median(answers(effect, output)[[0, at]], axis=1)
    return float(before), float(after)


def risen(effect: TransmissionEffect, precision: float) -> tuple[str, ...]:
    """Return which outputs adjusting at a solved precision [-] leaves larger, with both values."""
    found = []
    for output in _BETTER_SMALL:
        before, after = change(effect, output, precision)
        if after > before * (1 + _SAME):
            at = f" at {effect.test_torque:g} N·m" if output == PEAK_TO_PEAK else ""
            found.append(f"{quantity(output)}{at} ({before:.4g} → {after:.4g} {unit_of(output)})")
    return tuple(found)


def value_table(effect: TransmissionEffect) -> pd.DataFrame:
    """Return every output over the precision, the median of random assemblies."""
    columns: dict[str, Any] = {PRECISION: ["exact parts", *(f"{precision:g}" for precision in effect.state_weights)]}
    for output in effect.outputs:
        columns[output] = [perfect(effect, output), *np.median(answers(effect, output), axis=1).tolist()]
    return rounded(of_positions("transmission", columns))


def difference_table(effect: TransmissionEffect) -> pd.DataFrame:
    """Return by how much the outputs of that table are above those of exact parts; a mean angle has no zero."""
    columns = {PRECISION: effect.state_weights}
    for output in _counted(effect):
        above = np.median(answers(effect, output), axis=1) / perfect(effect, output) - 1
        columns[f"{quantity(output)}, above exact parts [%]"] = 100 * above
    return rounded(of_positions("above exact parts", columns))


def fallen_table(effect: TransmissionEffect) -> pd.DataFrame | None:
    """Return in how many random assemblies an output is smaller than unadjusted; nothing of a single one."""
    if effect.good.size == 1:
        return None
    columns = {PRECISION: effect.state_weights[1:]}
    for output in _counted(effect):
        values = answers(effect, output)
        columns[f"{quantity(output)}, smaller than unadjusted [%]"] = 100 * (values[1:] < values[0]).mean(axis=1)
    return rounded(of_positions("smaller than unadjusted", columns))


def _counted(effect: TransmissionEffect) -> tuple[str, ...]:
    """Return the outputs that have a zero."""
    return tuple(output for output in effect.outputs if perfect(effect, output) > 0)


def transmission_sentences(effect: TransmissionEffect, precision: float) -> tuple[str, str]:
    """Return what adjusting gains: the line load, and outputs that need not follow the angles."""
    at, single = int(np.flatnonzero(effect.state_weights == precision)[0]), effect.good.size == 1

    def said(output: str) -> str:
        values, (before, after) = answers(effect, output), change(effect, output, precision)
        return _say(
            "change" if single else "change_of_many",
            before=before,
            after=after,
            unit=unit_of(output),
            perfect=perfect(effect, output),
            smaller=int((values[at] < values[0]).sum()),
            many=values.shape[1],
        )

    key = "line_load" if single else "line_load_of_many"
    each = {"test": said(PEAK_TO_PEAK), "rated": said(RATED_PEAK_TO_PEAK), "force": said(PIN_FORCE)}
    return (
        _say(key, many=int(effect.good.sum()), change=said(LINE_LOAD)),
        _say("transmission", torque=effect.test_torque, **each),
    )


def transmission_warnings(effect: TransmissionEffect, precision: float) -> tuple[str, ...]:
    """Return which outputs adjusting leaves larger, how that can be, and how many assemblies are left out."""
    rose, many, failed = risen(effect, precision), int(effect.good.sum()), int((~effect.good).sum())
    key = "warn_risen" if effect.good.size == 1 else "warn_risen_of_many"
    return (
        *((_say(key, outputs=", ".join(rose), many=many, why=_say("why_larger")),) if rose else ()),
        *((_say("warn_failed", failed=failed),) if failed else ()),
    )


def transmission_section(effect: TransmissionEffect, precision: float, *, measured: bool) -> Section:
    """Return the section on the transmission."""
    fallen = fallen_table(effect)
    which = _say("of_measured" if measured else "of_first_random")
    return Section(
        heading=_say("transmission_heading"),
        paragraphs=(
            _say("section_transmission", why=_say("why_larger"), torque=effect.test_torque),
            _say("section_curves", which=which),
        ),
        figures=(
            *curve_figures(effect),
            *(_over_state_weight(effect, name, output) for name, output in DRAWN.items()),
            pressure_map(effect, precision),
            deformation_figure(effect),
        ),
        tables=(
            ("transmission", value_table(effect)),
            ("above exact parts", difference_table(effect)),
            *((("smaller than unadjusted", fallen),) if fallen is not None else ()),
        ),
    )


def curve_figures(effect: TransmissionEffect) -> tuple[Figure, Figure]:
    """Return transmission error and pin force of a disc over the carrier angle."""
    angle, both = effect.curves.carrier_angle, (effect.perfect_curves, effect.curves)
    shown = angle <= _CRANK_TURNS * 2 * np.pi / effect.reducer.cycloid_stage.disc_teeth
    labels = ("exact parts", *(f"Q = {precision:g}" for precision in effect.state_weights))
    error = np.concatenate([each.transmission_error for each in both]) / ARCSECOND

    def drawn(name: str, title: str, y_label: str, curves: Float[np.ndarray, "curve angle"]) -> Figure:
        x, named = angle[shown] / DEGREE, zip(labels, curves, strict=True)
        lines = tuple(Series.line(label, x, curve[shown]) for label, curve in named)
        return Figure(name=name, title=title, x_label="carrier angle [°]", y_label=y_label, series=lines)

    title, less = _say("transmission_error_figure", turns=_CRANK_TURNS), error - error.mean(axis=1, keepdims=True)
    force = np.concatenate([each.disc_force for each in both])
    return (
        drawn("transmission_error", title, "transmission error less its mean [arcsec]", less),
        drawn("mesh_force", _say("mesh_force_figure"), "sum of pin forces of a disc [N]", force),
    )


def _over_state_weight(effect: TransmissionEffect, name: str, output: str) -> Figure:
    """Return the largest values of an output over the precision."""
    values, many = answers(effect, output), effect.good.size > 1
    low, high = np.percentile(values, BAND, axis=1) if many else ((), ())
    label = _say("band" if many else "single", low=BAND[0], high=BAND[1])
    short = _say("short_band" if many else "single", low=BAND[0], high=BAND[1])
    return Figure(
        name=name,
        title=_say("over_precision_figure", output=quantity(output).capitalize(), of=short),
        x_label=PRECISION,
        y_label=output,
        series=(Series.line(label, effect.state_weights, np.median(values, axis=1), low, high),),
        horizontal=((perfect(effect, output), ""),),
    )


def pressure_map(effect: TransmissionEffect, precision: float) -> HeatMap:
    """Return the pressure along the pins that carry, unadjusted above adjusted at a solved precision [-]."""
    chosen = [(0.0, effect.patterns[0])]
    if precision > 0:
        chosen.append((precision, effect.patterns[int(np.flatnonzero(effect.state_weights == precision)[0])]))
    rows = [(value, pattern, pin) for value, pattern in chosen for pin in np.flatnonzero(pattern.force)]
    first = effect.patterns[0]
    return HeatMap(
        name="pressure",
        title=_say("pressure_figure", disc=first.disc, angle=first.carrier_angle / DEGREE),
        columns=[f"{place:.1f}" for place in first.position[::_EVERY] / MILLIMETRE],
        rows=[f"Q = {value:g}, pin {pin + 1}" for value, _, pin in rows],
        x_label="place along the width [mm]",
        label="pressure [MPa]",
        values=[(pattern.pressure[pin, ::_EVERY] / MEGAPASCAL).tolist() for _, pattern, pin in rows],
    )


def deformation_figure(effect: TransmissionEffect) -> Figure:
    """Return the largest compression of every pin that carries."""
    return Figure(
        name="deformation",
        title=_say("deformation_figure", disc=effect.patterns[0].disc),
        x_label="pin [-]",
        y_label="compression [µm]",
        series=tuple(
            Series.points(
                f"Q = {precision:g}", np.flatnonzero(own.force) + 1, own.deformation[own.force > 0] / MICROMETRE
            )
            for precision, own in zip(effect.state_weights, effect.patterns, strict=True)
        ),
    )

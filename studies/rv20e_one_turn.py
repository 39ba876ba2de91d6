"""One turn of the RV-20E of liu2020's Table 4: what its errors do to the curve, the pins and the lost motion.

python studies/rv20e_one_turn.py [--out FOLDER]
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import tolalloc as ta
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, DEGREE
from tolalloc.reducers.equivalent.hysteresis import DRAWN, LOST_MOTION, both_directions, hysteresis_loop
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import attribute, forces
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series

TORQUE = -1.0


def exact(model: EquivalentModel) -> np.ndarray:
    """Return the unit without errors."""
    return load_unit("exact").errors(model.columns, model.reducer.modification.deviations)


def kink(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw the smallest value, magnified, and what equally spaced angles see of it."""
    middle = float(model.extremes(unit, TORQUE).carrier_angle[0, 1])
    angles = middle + np.linspace(-1.0, 1.0, 801) * 0.6 * DEGREE
    found = model.equilibria(unit, TORQUE, angles)
    spaced = middle + (np.arange(-1, 3) - (middle / (2 * np.pi / 936)) % 1) * 2 * np.pi / 936
    coarse = model.equilibria(unit, TORQUE, spaced[np.abs(spaced - middle) < 0.6 * DEGREE])
    return Figure(
        name="kink",
        title="The smallest value is a kink, where one pin takes over from another",
        x_label="carrier angle [°]",
        y_label="transmission error [arcsec]",
        series=(
            Series(
                label="801 angles",
                kind="line",
                x=list(angles / DEGREE),
                y=list(found.transmission_error[0] / ARCSECOND),
            ),
            Series(
                label="angles of a turn in 936 steps",
                kind="points",
                x=list(coarse.carrier_angle / DEGREE),
                y=list(coarse.transmission_error[0] / ARCSECOND),
            ),
        ),
    )


def contact(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw how many pins carry."""
    found = model.equilibria(unit, TORQUE)
    return Figure(
        name="pins_in_contact",
        title="Pins that carry load, both discs together",
        x_label="carrier angle [°]",
        y_label="pins in contact [-]",
        series=(
            Series(
                label="at −1 N·m",
                kind="line",
                x=list(found.carrier_angle / DEGREE),
                y=[int(count) for count in found.pins_in_contact[0]],
            ),
        ),
    )


def pin_forces(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw the forces on the pins at one angle, with and without errors."""
    rated = -model.reducer.load.rated_torque
    pins = [forces(model.equilibria(errors, rated, np.array([1.0]))).pins[0, 0, 0] for errors in (exact(model), unit)]
    return Figure(
        name="pin_forces",
        title="Force of each pin on disc 1 at rated torque: errors overload a few pins",
        x_label="pin [-]",
        y_label="force [N]",
        series=tuple(
            Series(label=label, kind="stems", x=list(np.arange(1, values.size + 1)), y=list(values))
            for label, values in zip(("exact parts", "unit of Table 4"), pins, strict=True)
        ),
    )


def loop(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw torque against twist at one angle, with and without errors."""
    found = hysteresis_loop(model, np.concatenate([exact(model), unit]), np.array([2.5]), DRAWN)
    share = LOST_MOTION * found.torque[-1]
    return Figure(
        name="torque_twist",
        title="Torque against twist at one angle, sun held",
        x_label="twist of the carrier [arcmin]",
        y_label="torque on the carrier [N·m]",
        series=tuple(
            Series(label=label, kind="line", x=list(twist[:, 0] / ARCMINUTE), y=list(found.torque))
            for label, twist in zip(("exact parts, modified teeth", "unit of Table 4"), found.twist, strict=True)
        ),
        horizontal=((share, "±3 % of rated torque"), (-share, "")),
    )


def directions(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw the error in one direction of rotation and what reversing adds."""
    forward, backward = both_directions(model, unit, TORQUE)
    angle = list(2 * np.pi * np.arange(forward.shape[1]) / forward.shape[1] / DEGREE)
    return Figure(
        name="both_directions",
        title="Reversing the rotation lets the play show where few pins carry",
        x_label="carrier angle [°]",
        y_label="transmission error [arcsec]",
        series=(
            Series(label="counter-clockwise", kind="line", x=angle, y=list(forward[0] / ARCSECOND)),
            Series(label="clockwise minus it", kind="line", x=angle, y=list((backward - forward)[0] / ARCSECOND)),
        ),
    )


def sources(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw what the sources add to the three strongest orders."""
    found = attribute(model, unit, TORQUE)
    main = np.argsort(-found.amplitude)[:3]
    order = np.argsort(-np.abs(found.share[:, main]).max(axis=1))[:14]
    return Figure(
        name="sources_of_orders",
        title="What each source adds to an order's amplitude; negative cancels",
        x_label="share of the amplitude [arcsec]",
        y_label="",
        series=tuple(
            Series(
                label=f"order {found.order[at]:g}: {found.amplitude[at] / ARCSECOND:.1f}″",
                kind="bars",
                x=[found.sources[source] for source in order],
                y=list(found.share[order, at] / ARCSECOND),
            )
            for at in main
        ),
    )


def build(quick: bool) -> Document:  # noqa: ARG001 (one turn has nothing to shorten)
    """Return the report."""
    reducer, table4 = load_reducer("rv20e_liu2020"), load_unit("table4")
    model = EquivalentModel(reducer)
    unit = table4.errors(model.columns, reducer.modification.deviations)
    answer = ta.te(reducer="rv20e_liu2020", unit="table4", torque=TORQUE, attributed=True)
    turn = replace(answer.figures["transmission_error"], name="one_turn")
    return Document(
        title="One turn of the RV-20E of liu2020's Table 4",
        subtitle=f"{TORQUE:g} N·m on the carrier unless said otherwise",
        answer=answer.sentences,
        warnings=answer.warnings,
        sections=(
            Section(
                heading="Transmission error",
                figures=(turn, kink(model, unit), directions(model, unit)),
                tables=(("one turn", answer.tables["one turn"]),),
            ),
            Section(heading="Contact", figures=(contact(model, unit), pin_forces(model, unit), loop(model, unit))),
            Section(
                heading="What makes it",
                figures=(sources(model, unit),),
                tables=(("attribution", answer.tables["attribution"]),),
            ),
        ),
        assumptions=answer.assumptions,
        summary=answer.summary,
    )


study = ta.Study(questions=[ta.Calculation(build)], name="rv20e_one_turn")

if __name__ == "__main__":
    ta.run_script()

"""One turn of the RV-20E of liu2020's Table 4, as pictures: `python studies/rv20e_one_turn.py [FOLDER]`."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from tolalloc.report.figure import Figure, Series
from tolalloc.report.plots import save_png
from tolalloc.rv.equivalent.attribution import attribute
from tolalloc.rv.equivalent.hysteresis import LOST_MOTION, both_directions, hysteresis_loop
from tolalloc.rv.equivalent.model import EquivalentModel
from tolalloc.rv.equivalent.outputs import forces
from tolalloc.rv.reducer.files import load_reducer
from tolalloc.rv.reducer.unit_file import load_unit
from tolalloc.units import ARCMINUTE, ARCSECOND, DEGREE

TORQUE = -1.0


def exact(model: EquivalentModel) -> np.ndarray:
    """Return the unit without errors."""
    return load_unit("exact").errors(model.columns, model.reducer.modification.deviations)


def curve(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw the transmission error and its extremes."""
    found, extremes = model.equilibria(unit, TORQUE), model.extremes(unit, TORQUE)
    at = [float(angle) for angle in extremes.carrier_angle[0] / DEGREE]
    values = [float(extremes.largest[0] / ARCSECOND), float(extremes.smallest[0] / ARCSECOND)]
    return Figure(
        name="one_turn",
        title=f"Transmission error over one output turn: {extremes.peak_to_peak[0] / ARCSECOND:.1f}″ peak-to-peak",
        x_label="carrier angle [°]",
        y_label="transmission error [arcsec]",
        series=(
            Series(
                label=f"{found.carrier_angle.size} equally spaced angles",
                kind="line",
                x=list(found.carrier_angle / DEGREE),
                y=list(found.transmission_error[0] / ARCSECOND),
            ),
            Series(label="extremes, refined", kind="points", x=at, y=values),
        ),
    )


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
    found = hysteresis_loop(model, np.concatenate([exact(model), unit]), np.array([2.5]))
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
    both = both_directions(model, unit, TORQUE)
    angle = list(2 * np.pi * np.arange(both.forward.shape[1]) / both.forward.shape[1] / DEGREE)
    return Figure(
        name="both_directions",
        title="Reversing the rotation lets the play show where few pins carry",
        x_label="carrier angle [°]",
        y_label="transmission error [arcsec]",
        series=(
            Series(label="counter-clockwise", kind="line", x=angle, y=list(both.forward[0] / ARCSECOND)),
            Series(label="clockwise minus it", kind="line", x=angle, y=list(both.difference[0] / ARCSECOND)),
        ),
    )


def sources(model: EquivalentModel, unit: np.ndarray) -> Figure:
    """Draw what the sources add to the three strongest orders."""
    found = attribute(model, unit, TORQUE)
    main = found.order[np.argsort(-found.amplitude)[:3]]
    order = np.argsort(-np.abs(found.share[:, main - 1]).max(axis=1))[:14]
    return Figure(
        name="sources_of_orders",
        title="What each source adds to an order's amplitude; negative cancels",
        x_label="share of the amplitude [arcsec]",
        y_label="",
        series=tuple(
            Series(
                label=f"order {at}: {found.amplitude[at - 1] / ARCSECOND:.1f}″",
                kind="bars",
                x=[found.sources[source] for source in order],
                y=list(found.share[order, at - 1] / ARCSECOND),
            )
            for at in main
        ),
    )


def main() -> None:
    """Draw everything."""
    parser = argparse.ArgumentParser(description="One turn of the RV-20E of liu2020's Table 4, as pictures.")
    parser.add_argument("folder", nargs="?", type=Path, default="runs/rv20e_one_turn", help="default: %(default)s")
    folder = parser.parse_args().folder
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        parser.error(f"{folder}: the folder cannot be made ({error.strerror}).")
    reducer = load_reducer("rv20e")
    model = EquivalentModel(reducer)
    unit = load_unit("table4").errors(model.columns, reducer.modification.deviations)
    for draw in (curve, kink, contact, pin_forces, loop, directions, sources):
        figure = draw(model, unit)
        save_png(figure, folder / f"{figure.name}.png")
        print(folder / f"{figure.name}.png")


if __name__ == "__main__":
    main()

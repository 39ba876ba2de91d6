"""Figures of a simulated reducer: speeds, accelerations and contacts over time, transmission error over the angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int, Shaped

from tolalloc.reading.units import RPM
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    from tolalloc.reducers.simulation.answer import SimulationAnswer

_POINTS = 2000
"""Points of a line, about two for every dot of a screen; the file of the whole series has all [-]."""


def _thinned(values: Shaped[np.ndarray, " time"]) -> Int[np.ndarray, " shown"]:
    """Return which points show a line: least and most of each stretch, so that no vibration hides between them."""
    stretches = np.array_split(np.arange(values.size), min(_POINTS // 2, values.size))
    ends = [(part[np.argmin(values[part])], part[np.argmax(values[part])]) for part in stretches]
    return np.unique(np.array(ends))


def line(label: str, x: Float[np.ndarray, " time"], y: Shaped[np.ndarray, " time"]) -> Series:
    """Return a line thin enough for a page."""
    shown = _thinned(y)
    return Series(label=label, kind="line", x=x[shown].tolist(), y=y[shown].tolist())


def _over_time(name: str, title: str, label: str, *lines: Series) -> Figure:
    return Figure(name=name, title=title, x_label="time [s]", y_label=label, series=lines)


def run_figures(results: SimulationAnswer) -> tuple[Figure, ...]:
    """Return the whole run over time: input and output speed, their accelerations, contacts of each disc."""
    series, contacts = results.series, results.series.pins_in_contact
    time, who = series.time, results.engine
    speeds = (("input", series.input_speed), ("output", series.output_speed))
    accelerations = (("input", series.input_acceleration), ("output", series.output_acceleration))
    return (
        *(
            _over_time(f"{name}_speed", f"Speed of the {name}", "speed [rpm]", line(who, time, speed / RPM))
            for name, speed in speeds
        ),
        *(
            _over_time(
                f"{name}_acceleration",
                f"Acceleration of the {name}",
                "angular acceleration [rad/s²]",
                line(who, time, acceleration),
            )
            for name, acceleration in accelerations
        ),
        _over_time(
            "contacts",
            "Pins that carry",
            "pins in contact [-]",
            *(line(f"disc {disc + 1}", time, contacts[:, disc]) for disc in range(contacts.shape[1])),
        ),
    )


def error_figure(found: dict[str, SimulationAnswer], passes: int | None = None) -> Figure:
    """Return the transmission error over the last pin passes of the steady part, of several engines and at rest."""
    first = next(iter(found.values()))
    stage = first.reducer.cycloid_stage
    shown = (np.inf if passes is None else passes) * 360.0 / (stage.disc_teeth * stage.pin_count)
    lines = []
    for label, results in found.items():
        angle, moving, _ = results.arcseconds
        last = angle >= angle[-1] - shown
        lines.append(line(label, angle[last], moving[last]))
    angle, _, resting = first.arcseconds
    last = angle >= angle[-1] - shown
    lines.append(line("at rest", angle[last], resting[last]))
    return Figure(
        name="transmission_error",
        title="Transmission error of the steady part, in motion and at rest",
        x_label="carrier angle [°]",
        y_label="transmission error [″]",
        series=tuple(lines),
    )

"""Which orders of an RV-20E meet its natural frequencies at which speed, and what that does to them.

python studies/rv20e_speeds.py [--out FOLDER] [--quick]
"""

from __future__ import annotations

import numpy as np
import pandas as pd

import tolalloc as ta
from tolalloc.exceptions import SolveError
from tolalloc.reading.units import ARCSECOND, RPM
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.running.progress import Progress
from tolalloc.wings.motion.motion import ASSUMPTIONS, Damping, generalised_alpha, inertia_of
from tolalloc.wings.motion.speeds import Modes, OrdersAgainstSpeed, critical_speeds, modes, orders_against_speed

TORQUE = -167.0
LOADS = (0.0, 1.0, 100.0)
"""Moments of inertia that the carrier turns besides its own [kg·m²]."""
ORDERS = (1, 2, 39, 40, 78, 79, 80)
FASTEST = 60.0 * RPM
"""Largest speed of the output [rad/s]."""
DAMPING = Damping(mass_proportional=20.0, stiffness_proportional=2e-6)
STEPS = 4680
"""Time steps per output turn: three per pin pass, and the orders shown are twenty times slower [-]."""
MODE_ANGLES = 360


def campbell_figure(found: Modes, load: float) -> Figure:
    """Draw the lowest mode's band and the orders over the output speed."""
    speed = np.array([0.0, FASTEST])
    highest = 1.2 * ORDERS[-1] * FASTEST / (2 * np.pi)
    band = (found.frequency[:, 0].min(), found.frequency[:, 0].max())
    series = [
        Series(label=f"order {order}", kind="line", x=list(speed / RPM), y=list(order * speed / (2 * np.pi)))
        for order in ORDERS
    ]
    if band[0] < highest:
        middle = [float(np.mean(band))] * 2
        low, high = [float(band[0])] * 2, [float(band[1])] * 2
        series.append(
            Series(label="lowest mode over a turn", kind="line", x=list(speed / RPM), y=middle, low=low, high=high)
        )
    return Figure(
        name=f"campbell_{load:g}",
        title=f"Orders and the lowest mode, {load:g} kg·m² at the output",
        x_label="output speed [rpm]",
        y_label="frequency [Hz]",
        series=tuple(series),
    )


def speed_figure(found: OrdersAgainstSpeed, load: float) -> Figure:
    """Draw the amplitude of every order over the output speed."""
    return Figure(
        name=f"orders_{load:g}",
        title=f"Orders of the transmission error, {load:g} kg·m² at the output",
        x_label="output speed [rpm]",
        y_label="amplitude [arcsec]",
        series=tuple(
            Series(
                label=f"order {order}",
                kind="line",
                x=list(found.speed / RPM),
                y=list(found.amplitude[0, :, at] / ARCSECOND),
            )
            for at, order in enumerate(found.order)
        ),
    )


def critical_rows(found: Modes, load: float) -> list[dict[str, object]]:
    """Return the critical speeds of the lowest mode."""
    return [
        {
            "output inertia [kg·m²]": load,
            "order [-]": each.order,
            "from [rpm]": each.slowest / RPM,
            "to [rpm]": each.fastest / RPM,
            "carrier's share of the mode [-]": each.carrier_share,
        }
        for each in critical_speeds(found, ORDERS, (0.0, FASTEST))
        if each.mode == 0
    ]


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    reducer = load_reducer("rv20e_liu2020")
    model = EquivalentModel(reducer)
    errors = load_unit("table4").errors(model.columns, reducer.modification.deviations)
    angles = 2 * np.pi * np.arange(MODE_ANGLES) / MODE_ANGLES
    speeds = np.linspace(5.0, 60.0, 4 if quick else 23) * RPM
    rows: list[dict[str, object]] = []
    figures: list[Figure] = []
    spans: list[dict[str, object]] = []
    progress.begin("motion at all speeds", len(LOADS), "loads")
    for load in LOADS:
        inertia = inertia_of(reducer, output_inertia=load)
        about = modes(model, errors[0], TORQUE, inertia, angles)
        found = orders_against_speed(
            model, errors, TORQUE, inertia, DAMPING, generalised_alpha(0.8), speeds, ORDERS, STEPS
        )
        if found.status.any():
            raise SolveError(f"{reducer.name}: {int(found.status.astype(bool).sum())} speeds have no motion.")
        rows += critical_rows(about, load)
        figures += [campbell_figure(about, load), speed_figure(found, load)]
        spans += [
            {
                "output inertia [kg·m²]": load,
                "output speed [rpm]": float(speed / RPM),
                "peak-to-peak [arcsec]": float(found.peak_to_peak[0, at] / ARCSECOND),
                "not settled [arcsec]": float(found.unsettled[0, at] / ARCSECOND),
            }
            for at, speed in enumerate(speeds)
        ]
        progress.advance(1)
    progress.begin("at rest")
    resting = float(model.extremes(errors, TORQUE).peak_to_peak[0] / ARCSECOND)
    table = pd.DataFrame(spans)
    worst = table.loc[table["peak-to-peak [arcsec]"].idxmax()]
    light = table[table["output inertia [kg·m²]"] == 0.0]["peak-to-peak [arcsec]"]
    return Document(
        title="RV-20E: orders against speed",
        subtitle=f"unit table4, {TORQUE:g} N·m on the carrier, output up to {FASTEST / RPM:g} rpm",
        answer=(
            f"Without inertia at the output the peak-to-peak stays within {(light - resting).abs().max():.2g}″ of the "
            f"static {resting:.1f}″ up to {FASTEST / RPM:g} rpm.",
            f"It is largest with {worst['output inertia [kg·m²]']:g} kg·m² at {worst['output speed [rpm]']:.1f} rpm: "
            f"{worst['peak-to-peak [arcsec]']:.0f}″.",
        ),
        warnings=("Quick run: few speeds.",) if quick else (),
        sections=(
            Section(
                heading="Where orders meet the lowest mode",
                paragraphs=(
                    "A mode's frequency changes over a turn with the pins that carry, so a critical speed is a range.",
                ),
                figures=tuple(figures[::2]),
                tables=(("critical", pd.DataFrame(rows)),),
            ),
            Section(heading="What that does to the orders", figures=tuple(figures[1::2]), tables=(("speeds", table),)),
        ),
        assumptions=(
            *reducer.assumptions,
            *ASSUMPTIONS,
            f"damping: {DAMPING.mass_proportional:g} 1/s times the masses, {DAMPING.stiffness_proportional:g} s times "
            "the stiffness of meshes and bearings; the height of a resonance is a matter of it",
        ),
        summary={"static peak-to-peak [arcsec]": resting, "critical speeds": rows, "speeds": spans},
    )


study = ta.Study(questions=[ta.Calculation(build)], name="rv20e_speeds")

if __name__ == "__main__":
    ta.run_script()

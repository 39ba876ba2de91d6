"""How many teeth of xi2015's RV-40E carry: by the compliance that its angles imply, and by steel line contact.

python studies/xi2015_contact.py [--out FOLDER]
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.optimize import brentq

import tolalloc as ta
from tolalloc.reading.units import DEGREE, MEGAPASCAL, MICROMETRE, MILLIMETRE
from tolalloc.reducers.cycloid.clearance import formula_gap
from tolalloc.reducers.cycloid.loaded_contact import (
    LoadedContact,
    PressedDiscs,
    default_phases,
    pressed,
    pressed_linear,
)
from tolalloc.reducers.cycloid.tooth_profile import normals
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.running.progress import Progress

TORQUE = 572.0
SHARE = 0.55
PRINTED_END = 150.02
WIDTHS = (10.0, 12.0, 16.0)
PHASES = 1000


def implied_deflection(reducer: Reducer) -> float:
    """Return the δ_max at which the printed end of the loaded zone carries nothing [m]."""
    stage, at = reducer.cycloid_stage, np.array([PRINTED_END * DEGREE])
    return float((formula_gap(stage, reducer.modification, at) / normals(stage.shortening, at).lever)[0])


def row(name: str, contact: LoadedContact) -> dict[str, object]:
    """Return one line of the table of methods, the first phase and all phases."""
    counts, times = np.unique(contact.pins_in_contact, return_counts=True)
    return {
        "contact": name,
        "deflection [µm]": float(contact.deflection[0]) / MICROMETRE,
        "zone from [deg]": float(contact.zone[0, 0]) / DEGREE,
        "zone to [deg]": float(contact.zone[0, 1]) / DEGREE,
        "pins, one in the crank direction [-]": int(contact.pins_in_contact[0, 0]),
        "pins over all phases": ", ".join(
            f"{count}: {time / contact.phase.size:.1%}" for count, time in zip(counts, times, strict=True)
        ),
        "largest pin force [N]": float(contact.force[0].max()),
        "peak pressure [MPa]": float(contact.pressure[0].max()) / MEGAPASCAL,
        "at [deg]": float(contact.pin_angle[0].ravel()[contact.pressure[0].argmax()]) / DEGREE,
    }


def force_figure(contacts: dict[str, LoadedContact]) -> Figure:
    """Draw the forces of the pins by each reading."""
    series = []
    for name, contact in contacts.items():
        angle = contact.pin_angle[0, 0]
        order = [at for at in np.argsort(angle) if angle[at] > 0]
        series.append(
            Series(label=name, kind="points", x=list(angle[order] / DEGREE), y=list(contact.force[0, 0, order]))
        )
    return Figure(
        name="compliance",
        title="The number of teeth that carry is a statement about compliance",
        x_label="angle of the pin from the crank direction [°]",
        y_label="force [N]",
        series=tuple(series),
    )


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    reducer = load_reducer("rv40e_xi2015")
    reducer = replace(reducer, stiffness=replace(reducer.stiffness, pin_contact_law="logarithmic"))
    phase, torque = default_phases(reducer, 100 if quick else PHASES), SHARE * TORQUE
    discs = PressedDiscs(reducer=reducer, torque=torque)
    progress.begin("readings of the compliance", 3 + len(WIDTHS), "readings")
    deflection = implied_deflection(reducer)
    implied = pressed_linear(discs, phase, deflection)
    progress.advance(1)
    rows, first = [row("compliance that the printed angles imply", implied)], default_phases(reducer, 1)

    def short_of(span_mm: float) -> float:
        bending = PressedDiscs(reducer=reducer.with_pin_span(span_mm * MILLIMETRE), torque=torque)
        return float(pressed_linear(bending, first).deflection[0]) - deflection

    span = float(brentq(short_of, 5.0, 60.0))
    on_supports = PressedDiscs(reducer=reducer.with_pin_span(span * MILLIMETRE), torque=torque)
    rows.append(
        row(f"pins that bend between supports {span:.1f} mm apart, linear method", pressed_linear(on_supports, phase))
    )
    progress.advance(1)
    rows.append(row(f"the same, law at every pin ({span:.1f} mm)", pressed(on_supports, phase)))
    progress.advance(1)
    steel = {}
    for width in WIDTHS:
        own = PressedDiscs(reducer=reducer.with_face_width(width * MILLIMETRE), torque=torque)
        steel[width] = pressed(own, phase)
        rows.append(row(f"steel line contact, {width:g} mm, linear method", pressed_linear(own, phase)))
        rows.append(row(f"steel line contact, {width:g} mm, law at every pin", steel[width]))
        progress.advance(1)
    progress.begin("loaded contact")
    share = float(np.mean(implied.pins_in_contact == 16))
    found = ta.contact(reducer="rv40e_xi2015", torque=-TORQUE)
    return Document(
        title="RV-40E of xi2015: how many teeth carry 572 N·m",
        subtitle=f"{torque:g} N·m on the more loaded disc, {phase.size} phases of the pin pitch.",
        answer=(
            f"The printed zone of 3.18…150.02° needs a largest deflection of {deflection / MICROMETRE:.3f} µm, which "
            f"xi2015 does not print: then 16 pins carry in {share:.1%} of the phases and 17 in the others, at most "
            f"{implied.force[0].max():.1f} N with a pin in the crank direction.",
            f"Steel line contact alone is about {deflection / steel[12.0].deflection[0]:.0f} times stiffer: "
            f"{steel[12.0].pins_in_contact[0, 0]} pins at 12 mm width. So 16 is a statement about compliance: it takes "
            f"pins that bend between supports {span:.1f} mm apart, which pins in half grooves do not.",
        ),
        warnings=found.warnings,
        sections=(
            Section(
                heading="Every reading of the compliance",
                figures=(force_figure({"implied by the angles": implied, "steel line contact, 12 mm": steel[12.0]}),),
                tables=(("readings", pd.DataFrame(rows)),),
            ),
            *found.sections,
        ),
        assumptions=found.assumptions,
        summary={
            "implied deflection [µm]": deflection / MICROMETRE,
            "span of two supports [mm]": span,
            "readings": rows,
            "reducer as it is": found.summary,
        },
    )


study = ta.Study(questions=[ta.Calculation(build)], name="xi2015_contact")

if __name__ == "__main__":
    ta.run_script()

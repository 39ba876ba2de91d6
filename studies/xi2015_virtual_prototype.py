"""xi2015's run of an RV-40E, three ways: at rest, with masses, and with exact profiles in a multibody engine.

python studies/xi2015_virtual_prototype.py [--out FOLDER] [--quick]
"""

from __future__ import annotations

from dataclasses import replace
from math import inf

import pandas as pd

import tolalloc as ta
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND, RPM
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reports.document import Document, Section
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.wings.motion.ask.simulate import simulated
from tolalloc.wings.motion.prototype import engine, with_rigid_bearings
from tolalloc.wings.motion.simulation import SimulationRequest, SimulationResult, prepare_simulation, with_ideal_gears
from tolalloc.wings.motion.telling.simulation import error_figure, range_text, rest_row, run_figures, steady_row

IMPLIED = 3.67e7
"""Stiffness of every pin contact at which 16 to 17 carry, as xi2015's printed angles imply [N/m]."""
STEEL, RIGID_STEEL = "steel line contact, 12 mm", "the same, rigid joints"
SOFT = f"{IMPLIED:.3g} N/m at every pin, rigid joints"
MODEL, PROTOTYPE = "generalised-alpha", "exudyn"
TORQUE, SPEED = -572.0, 525.0
Simulated = Answer[SimulationResult]
OTHERS = ((TORQUE, SPEED / 2), (TORQUE / 2, SPEED), (TORQUE / 4, SPEED))
"""Torques on the carrier and input speeds at which the prototype is asked again [N·m, rpm]."""


def readings() -> dict[str, Reducer]:
    """Return the reducer by what is supposed of its pin contacts; its first stage does not yield in either."""
    reducer = with_ideal_gears(load_reducer("rv40e_xi2015"))
    law = replace(reducer.stiffness, pin_contact_law="logarithmic")
    soft = replace(reducer.stiffness, pin_contact=IMPLIED, pin_contact_law="constant", pin_bending=inf)
    steel = replace(reducer, stiffness=law)
    return {
        STEEL: steel,
        RIGID_STEEL: with_rigid_bearings(steel),
        SOFT: with_rigid_bearings(replace(reducer, stiffness=soft)),
    }


def run(
    reducer: Reducer, name: str, quick: bool, progress: Progress, torque: float = TORQUE, speed: float = SPEED
) -> Simulated:
    """Return a simulation of xi2015's run, or of a shorter one."""
    times = {"ramp": 0.2, "duration": 0.8} if quick else {}
    asked = SimulationRequest(reducer="rv40e_xi2015", engine=name, torque_nm=torque, speed_rpm=speed, **times)
    progress.begin("nominal state")
    return simulated(replace(prepare_simulation(asked), reducer=reducer), progress)


def missing() -> str:
    """Return why there is no prototype, empty if there is one."""
    try:
        engine()
    except InputError as error:
        return str(error)
    return ""


def difference_section(results: list[SimulationResult]) -> Section:
    """Return how the prototype departs from the static model under other loads and speeds."""
    table = pd.DataFrame(
        {
            "torque on the carrier [N·m]": [each.prepared.torque for each in results],
            "input speed [rpm]": [each.prepared.speed / RPM for each in results],
            "static transmission error, mean [arcsec]": [
                float(each.at_rest.transmission_error.mean() / ARCSECOND) for each in results
            ],
            "prototype beside it, mean [arcsec]": [float(each.difference.mean() / ARCSECOND) for each in results],
            "largest [arcsec]": [float(abs(each.difference).max() / ARCSECOND) for each in results],
        }
    )
    return Section(
        heading=f"Why the prototype differs: {SOFT}",
        paragraphs=(
            "The static model and the model in motion take the gap between tooth and pin as linear in the "
            "displacements; the prototype has the exact profile. Such a difference would not depend on the speed, "
            "as one by inertia does, and would fall faster than the load.",
        ),
        tables=(("load", table),),
    )


def answer(found: dict[str, dict[str, SimulationResult]], lacking: str) -> tuple[str, ...]:
    """Return what the engines agree on and what they do not."""
    models = {name: by_engine[MODEL] for name, by_engine in found.items()}
    first = models[STEEL]
    counts = " and ".join(f"{range_text(*models[name].contacts[0])} with {name}" for name in (STEEL, SOFT))
    largest = max(float(abs(results.difference).max() / ARCSECOND) for results in models.values())
    sentences = [
        f"The output turns {first.ratio:.4f} times slower than the input; pins in contact on each disc: {counts}. "
        "xi2015 reports 16: the count says how compliant the contacts were made, not how the teeth are shaped.",
        f"With the same gaps and springs, motion changes the transmission error by {largest:.2g}″ at most: the static "
        f"model is enough at this speed, where the discs pass {first.pin_pass:.1f} pins per second.",
    ]
    if lacking:
        return (*sentences, f"There is no prototype with exact profiles here: {lacking}")
    apart = "; ".join(
        f"{name}: {results[PROTOTYPE].difference.mean() / ARCSECOND:.2f}″ in the mean, largest force "
        f"{results[PROTOTYPE].largest_force[0] / results[PROTOTYPE].largest_force[1] - 1:+.1%}"
        for name, results in found.items()
    )
    return (
        *sentences,
        f"The prototype with exact profiles departs further from the static model: {apart}.",
        "What rigid joints leave of it is the exact profile against the linear gap. The rest is the prototype's ideal "
        "first stage, which does not feel how planets move on bearings that yield.",
    )


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    lacking = missing()
    engines = (MODEL, "newmark") if lacking else (MODEL, "newmark", PROTOTYPE)
    for each in engines:  # compiled functions load at first use, which is no computing time
        run(readings()[STEEL], each, True, progress)
    told = {
        name: {each: run(reducer, each, quick, progress) for each in engines} for name, reducer in readings().items()
    }
    found = {name: {each: own.result for each, own in by_engine.items()} for name, by_engine in told.items()}
    rows = [
        {"pin contact": name, **row}
        for name, by_engine in found.items()
        for row in (rest_row(by_engine[MODEL]), *(steady_row(each) for each in by_engine.values()))
    ]
    table, shown = pd.DataFrame(rows), MODEL if lacking else PROTOTYPE
    differences: tuple[Section, ...] = ()
    if not lacking:
        others = [run(readings()[SOFT], PROTOTYPE, quick, progress, *other).result for other in OTHERS]
        differences = (difference_section([found[SOFT][PROTOTYPE], *others]),)
    cautions = (
        f"{name}, {engine}: {text}"
        for name, by_engine in told.items()
        for engine, each in by_engine.items()
        for text in each.warnings
    )
    return Document(
        title="RV-40E of xi2015 in motion: static model, model with masses, virtual prototype",
        subtitle=f"525 rpm at the input, {TORQUE:g} N·m on the carrier, no errors"
        + (", a run of 0.8 s instead of 2 s." if quick else "."),
        answer=answer(found, lacking),
        warnings=tuple(cautions),
        sections=(
            Section(
                heading="Same reducer, same load",
                paragraphs=(
                    "All have a first stage that does not yield. Steel line contact is Hertz's law for tooth and "
                    "pin; the other stiffness is the one that the printed angles of the loaded zone imply.",
                ),
                figures=(error_figure(found[STEEL], passes=10),),
                tables=(("engines", table),),
            ),
            *differences,
            Section(
                heading=f"The run over time: {shown}, {SOFT}",
                paragraphs=(
                    "xi2015's Figures 10 to 14: speed and acceleration of input and output, pins in contact. "
                    "It stores a step every 10 ms, which cannot show the pin passes. Its text lets the speed "
                    "rise in 1 s, its formula in 0.1 s; the full run follows the text.",
                ),
                figures=run_figures(found[SOFT][shown]),
            ),
        ),
        assumptions=(
            f"pin contacts: {STEEL}, or {SOFT}, in place of the reducer's own law",
            *told[STEEL][shown].assumptions,
        ),
        summary={"engines": table.astype(object).where(table.notna(), None).to_dict("records")},
    )


study = ta.Study(questions=[ta.Calculation(build)], name="xi2015_virtual_prototype")

if __name__ == "__main__":
    ta.run_script()

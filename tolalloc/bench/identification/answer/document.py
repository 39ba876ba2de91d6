"""What measured units say of the stiffness: answer, warnings, sections and summary of one report."""

from __future__ import annotations

from typing import Any

import numpy as np

from tolalloc.bench.identification.answer import figures, tables
from tolalloc.bench.identification.answer.results import IdentificationResults
from tolalloc.bench.identification.data import CURVE, LOOP, PEAK_TO_PEAK
from tolalloc.bench.identification.parameters import BIAS
from tolalloc.bench.identification.resampling import Candidate
from tolalloc.bench.identification.stand_in import LARGE_DRIFT
from tolalloc.bench.identification.swarm import ASSUMED
from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure
from tolalloc.units import ARCSECOND


def baseline_sentences(results: IdentificationResults) -> tuple[str, ...]:
    """Return how a constant alone, and the choice by units not seen, compare with the fit."""
    if results.chosen is None:
        return (f"{results.count}: too few to judge a fit by units that it has not seen, or to resample.",)
    found = []
    if PEAK_TO_PEAK in results.kinds:
        found.append(_verdict(results))
    found.append(
        f"Judged by {results.count}, each left out in turn, the simplest choice as good as the best within a standard "
        f"error is: {results.chosen.name}."
    )
    return tuple(found)


def _verdict(results: IdentificationResults) -> str:
    """Return whether a constant explains the peak-to-peaks, or the stiffness does, or nothing needs explaining."""
    asked = tuple(item.name for item in results.parameters)
    given, constant, whole = (results.candidate(*names) for names in ((), (BIAS,), asked))
    if not (given and constant and whole):
        return f"{results.count} are too few to judge the fit of all parameters by units that it has not seen."

    def left(item: Candidate, *, unseen: bool) -> float:
        return item.rms(results.data, PEAK_TO_PEAK, unseen=unseen) / ARCSECOND

    numbers = (
        f"the reducer as given leaves {left(given, unseen=False):.3g}″ rms, one bias "
        f"{left(constant, unseen=False):.3g}″ ({left(constant, unseen=True):.3g}″ on units left out), the fit of "
        f"{whole.name} {left(whole, unseen=False):.3g}″ ({left(whole, unseen=True):.3g}″ on units left out)."
    )
    unseen = {name: left(item, unseen=True) for name, item in (("given", given), ("bias", constant), ("fit", whole))}
    best = min(unseen, key=lambda name: unseen[name])
    return {
        "given": "Neither a constant nor the stiffness explains these peak-to-peaks better than the reducer as given: ",
        "bias": "A constant explains these peak-to-peaks better than the stiffness does: ",
        "fit": f"{'Stiffness and constant together explain' if BIAS in asked else 'The stiffness explains'} these "
        "peak-to-peaks better than a constant does: ",
    }[best] + numbers


def answer(results: IdentificationResults) -> tuple[str, ...]:
    """Return the answer in sentences."""
    reach = "; ".join(
        f"{kind} {results.rms(results.at_start, kind):.3g}″ as given, {results.rms(results.at_found, kind):.3g}″ at "
        f"the least objective, {results.rms(results.at_written, kind):.3g}″ with what the stiffness file states"
        for kind in results.kinds
    )
    return (
        *(item.sentence for item in results.estimates),
        *(
            f"Direction {number}: {item.sentence(results.logarithms)}."
            for number, item in enumerate(results.information.directions, start=1)
        ),
        f"Root-mean-square of model less measured: {reach}.",
        *baseline_sentences(results),
    )


def warnings(results: IdentificationResults) -> tuple[str, ...]:
    """Return what a reader must know before using the numbers."""
    found, own = [], results.information
    open_ones = [item.parameter.symbol for item in results.estimates if not item.identified]
    if open_ones:
        found.append(
            f"Not identified: {', '.join(open_ones)}. What the data leave open the stiffness file takes from the "
            "bounds: towards their middle, with the standard uncertainty of an even distribution."
        )
    found += [
        f"{item.parameter.symbol} has its least objective on a bound: widen it, or read the interval as a limit."
        for item in results.estimates
        if item.on_bound and item.identified
    ]
    if results.data.noise_stated and own.estimated:
        found.append(
            f"Residuals are {np.sqrt(own.reduced_chi_square):.2g} times the stated noise: errors of the units or the "
            "model itself miss something. All uncertainties are widened by that factor."
        )
    if not results.data.noise_stated:
        found.append("No noise was stated, so it is estimated from what the fit leaves.")
    if results.drift > LARGE_DRIFT:
        found.append(
            f"The polynomials behind profiles and bootstrap have their least objective {results.drift:.2g} standard "
            "deviations away from the model's, so first-order intervals of the model widen theirs: narrow the bounds, "
            "or ask for fewer parameters."
        )
    return (*found, *(f"Repaired: {repair}." for repair in results.measurements.repairs))


_SWARM = (
    f"improved particle swarm: ω = {ASSUMED.inertia:g}, C1 = C2 = {ASSUMED.acceleration:g}, "
    f"{ASSUMED.neighbours} neighbour to either side on a ring, stop at the bounds; liu2020 prints none"
)


def assumptions(results: IdentificationResults) -> tuple[str, ...]:
    """Return what no source states."""
    return (
        *results.reducer.assumptions,
        *results.measurements.assumptions,
        "noise is normal and independent from reading to reading; errors of the units are known exactly",
        "curves and loops lose their mean; angles and directions of the bench are those of the model",
        "bounds enter the covariance as an even distribution between them",
        *((_SWARM,) if results.comparison or "improved" in results.found.method else ()),
    )


def summary(results: IdentificationResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    data = results.data
    return {
        "reducer": results.reducer.name,
        "data": results.measurements.name,
        "units [-]": int(data.units.size),
        "readings [-]": int(data.measured.size),
        "method": results.found.method,
        "objective [-]": results.found.objective,
        "evaluations [-]": results.found.evaluations,
        "status": results.found.status,
        "parameters": [
            {
                "name": item.parameter.name,
                "unit": item.parameter.unit,
                "start": item.parameter.start,
                "value": item.value,
                "relative standard uncertainty [-]"
                if item.parameter.name != BIAS
                else "standard uncertainty [arcsec]": (item.uncertainty),
                "interval": list(item.interval),
                "identified": item.identified,
                "on bound": item.on_bound,
            }
            for item in results.estimates
        ],
        "directions": [item.sentence(results.logarithms) for item in results.information.directions],
        "reduced chi square [-]": results.information.reduced_chi_square,
        "rms before [arcsec]": {kind: results.rms(results.at_start, kind) for kind in results.kinds},
        "rms after [arcsec]": {kind: results.rms(results.at_found, kind) for kind in results.kinds},
        "rms as written [arcsec]": {kind: results.rms(results.at_written, kind) for kind in results.kinds},
        "choices": [
            {
                "fitted": item.name,
                "left out [noise]": item.score,
                "rms [arcsec]": {kind: item.rms(data, kind, unseen=False) / ARCSECOND for kind in results.kinds},
                "rms left out [arcsec]": {
                    kind: item.rms(data, kind, unseen=True) / ARCSECOND for kind in results.kinds
                },
            }
            for item in results.candidates
        ],
        "chosen": results.chosen.name if results.chosen else None,
        "methods": [
            {
                "method": item.method,
                "objectives [-]": [float(value) for value in item.objectives],
                "evaluations [-]": [run.evaluations for run in item.runs],
                "objective of the best on the model [-]": item.on_model,
            }
            for item in results.comparison
        ],
        "warnings": list(warnings(results)),
        "assumptions": list(assumptions(results)),
    }


def _reading_figures(results: IdentificationResults) -> tuple[Figure, ...]:
    """Return the figures of every kind of reading that there is."""
    drawn = []
    if PEAK_TO_PEAK in results.kinds:
        drawn.append(figures.peak_to_peak_figure(results))
    if CURVE in results.kinds:
        drawn += [*figures.curve_figures(results), figures.unit_residual_figure(results, CURVE)]
    if LOOP in results.kinds:
        drawn += [*figures.loop_figures(results), figures.unit_residual_figure(results, LOOP)]
    return tuple(drawn)


def _sections(results: IdentificationResults) -> tuple[Section, ...]:
    """Return the sections in the order of the questions that a reader has."""
    stand_in = results.stand_in
    parameters = Section(
        heading="Parameters",
        paragraphs=(
            "The profile interval counts: it follows the real shape of the objective between the bounds. The "
            "first-order one assumes a parabola, the bootstrap draws the units anew. Written: what the "
            "stiffness file states, with one standard uncertainty: readings and bounds together.",
        ),
        tables=(("parameters", tables.parameters_table(results)),),
    )
    fixed = Section(
        heading="What the data fix",
        paragraphs=(
            "Eigenvectors of the Fisher information, best known first: each is a combination of relative changes that "
            "the data know independently of the others.",
            f"Profiles, bootstrap and choices ask polynomials of the model: {stand_in.trained} runs, rms error "
            f"{stand_in.rms_error / ARCSECOND:.2g}″, largest {stand_in.largest_error / ARCSECOND:.2g}″ on "
            f"{stand_in.held_out} runs that the fit has not seen.",
        ),
        figures=(figures.profile_figure(results),),
        tables=(("directions", tables.directions_table(results)),),
    )
    choices = Section(
        heading="Simpler explanations",
        paragraphs=(
            "Each choice is fitted to all units but one and judged by that one, in turn. Chosen is the one with the "
            "fewest parameters that is as good as the best within one standard error.",
        ),
        tables=(("choices", tables.choices_table(results)),),
    )
    readings = Section(
        heading="Measured against modelled",
        figures=_reading_figures(results),
        tables=(("units", tables.units_table(results)),),
    )
    return (parameters, fixed, *((choices,) if results.candidates else ()), readings)


def _methods_section(results: IdentificationResults) -> Section:
    """Return how the methods compare over many seeds."""
    return Section(
        heading="Methods",
        paragraphs=(
            "All methods minimise the same objective on the same polynomials, Gauss–Newton from eight random starts "
            "for each seed; the last column puts the best answer of each to the model itself.",
        ),
        figures=(figures.convergence_figure(results),),
        tables=(("methods", tables.methods_table(results)),),
    )


def identification_document(results: IdentificationResults) -> Document:
    """Return the report of one identification."""
    return Document(
        title=f"{results.reducer.name}: stiffness from {results.measurements.name}",
        subtitle=f"{results.count}, {results.data.measured.size} readings; {results.found.method} on polynomials of "
        f"the model, finished on the model by Gauss–Newton, {results.found.evaluations} evaluations in all; "
        f"{results.found.status}; seed {results.seed}.",
        answer=answer(results),
        warnings=warnings(results),
        sections=(*_sections(results), *((_methods_section(results),) if results.comparison else ())),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )

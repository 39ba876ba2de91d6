"""liu2020: what its printed pairs say of the stiffness, and what measured units would have to show."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
from published.liu2020_searches import MethodRuns, compare, methods_section, on_polynomials, search
from published.liu2020_swarm import ASSUMED, ImprovedPSO, SwarmSettings
from published.liu2020_tables import BOUNDS, printed_section
from published.recovery import Recovery, recovery
from published.simulated_bench import Bench, random_units, simulated_bench

import tolalloc as ta
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.families.rv import RV
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import BuiltUnit
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.header import Header
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.wings.bench.identification import IdentificationRequest, IdentificationResult, identify
from tolalloc.wings.bench.information import information
from tolalloc.wings.bench.least_squares import IdentificationProblem
from tolalloc.wings.bench.measurements import Measurements
from tolalloc.wings.bench.parameters import SYMBOLS, Parameter, parameter
from tolalloc.wings.bench.prediction import KernelPredictor, data_of
from tolalloc.wings.bench.telling.identification import IdentificationTeller, estimate_sentence

TRUTH = {"crank_disc_bearing": 1.15e10, "crank_carrier_bearing": 1.5e10, "carrier_bearing": 7.6e10}
"""Stiffness of the simulated units, inside the bounds of Table 5 and away from the start [N/m]."""

SETTINGS = (
    SwarmSettings(),
    SwarmSettings(inertia=0.9, neighbours=3),
    SwarmSettings(inertia=0.7),
    SwarmSettings(inertia=0.7298, acceleration=1.4962),
    SwarmSettings(inertia=0.5),
)
"""Inertia, acceleration and neighbourhood of the improved swarm, none of which is printed."""

LIKE_TABLE_7 = 2.8
"""Zones of the 50 simulated units over the tolerance table's, so that their mean is that of Table 7, assumed [-]."""

CURVES_AND_LOOPS = Bench(
    curve_torques=(-1.0, 1.0),
    curve_angles=2 * np.pi * np.arange(360) / 360,
    curve_noise=ARCSECOND,
    loop_angles=(0.0, 1.0, 2.0, 3.0),
    loop_torques=167.0 * np.array([share for share in np.arange(-12, 13) / 12 if share]),
    loop_noise=0.2 * ARCSECOND,
)
"""Curves in both directions at a small torque, loops up to the rated one; noises are assumed."""


def settings_section(answer: IdentificationResult, methods: tuple[MethodRuns, ...], seeds: int) -> Section:
    """Return how the improved swarm depends on what liu2020 does not print."""
    problem = on_polynomials(answer)
    least = min(float(item.objectives.min()) for item in methods)
    rows = []
    for settings in SETTINGS:
        runs = [
            search(problem, "improved particle swarm", seed, partial(ImprovedPSO, settings=settings))
            for seed in range(1, seeds + 1)
        ]
        off = np.sqrt(np.array([run.objective for run in runs]) / least) - 1
        rows.append(
            {
                "ω [-]": settings.inertia,
                "C1 = C2 [-]": settings.acceleration,
                "neighbours to either side [-]": settings.neighbours,
                "S above the least, median [-]": float(np.median(off)),
                "S above the least, worst [-]": float(off.max()),
                "within 1e-4 of the least [-]": float((off <= 1e-4).mean()),
            }
        )
    return Section(
        heading="What liu2020 does not print of its swarm",
        paragraphs=(f"Each setting over {seeds} seeds on the 50 simulated units; the first is the one used above.",),
        tables=(("swarm settings", pd.DataFrame(rows)),),
    )


def recovery_section(found: Recovery, symbols: tuple[str, ...]) -> Section:
    """Return how often repeated measurements of curves and loops find the truth."""
    repetitions = found.error.shape[0]
    rows = []
    for at, (symbol, share) in enumerate(zip(symbols, found.coverage, strict=True)):
        rows.append(
            {
                "parameter": symbol,
                "mean error [%]": 100 * float(found.error[:, at].mean()),
                "standard deviation of the error [%]": 100 * float(found.error[:, at].std(ddof=1)),
                "standard error stated, mean [%]": 100 * float(found.standard_error[:, at].mean()),
                "95 % intervals that hold the truth [-]": int(found.covered[:, at].sum()),
                "share of them [-]": f"{share.estimate:.2f} ({share.low:.2f}…{share.high:.2f})",
            }
        )
    scaled = found.error / found.standard_error
    return Section(
        heading="Curves and loops, measured again and again",
        paragraphs=(
            f"{repetitions} repetitions with fresh noise, each fitted by Gauss–Newton on the model itself: in "
            f"{found.recovered} all three stiffnesses are within three standard errors of the truth.",
        ),
        figures=(
            Figure(
                name="recovery",
                title="Error over the standard error that each fit states: two thirds should lie within ±1",
                x_label="found less true, over the standard error [-]",
                y_label="repetitions [-]",
                series=tuple(
                    Series(label=symbol, kind="histogram", x=list(scaled[:, at])) for at, symbol in enumerate(symbols)
                ),
            ),
        ),
        tables=(("recovery", pd.DataFrame(rows)),),
    )


def kinds_section(true: Reducer, parameters: tuple[Parameter, ...], exact: Measurements) -> Section:
    """Return how well each kind of reading would know the stiffnesses, to first order around the truth."""
    nothing = replace(exact, peak_to_peak=None, curves=(), loops=())
    kinds = {
        "peak-to-peaks": replace(nothing, peak_to_peak=exact.peak_to_peak),
        "curves in one direction": replace(nothing, curves=exact.curves[::2]),
        "curves in both directions": replace(nothing, curves=exact.curves),
        "loops": replace(nothing, loops=exact.loops),
        "curves and loops": replace(nothing, curves=exact.curves, loops=exact.loops),
    }
    rows, there = [], tuple(replace(item, start=TRUTH[item.name]) for item in parameters)
    for name, measured in kinds.items():
        data = data_of(measured, name)
        problem = IdentificationProblem(
            parameters=there,
            data=data,
            predictor=KernelPredictor(true, there, measured, data),
            weight=np.ones(len(measured.units)),
        )
        own = information(problem, problem.predictor(problem.start), problem.start)
        errors = {
            f"standard error of {item.symbol} [%]": 100 * float(value)
            for item, value in zip(there, own.standard_errors, strict=True)
        }
        rows.append({"readings of five units": name, **errors})
    return Section(
        heading="What each kind of reading carries",
        paragraphs=(
            "First order around the truth. Peak-to-peaks of so few units know nothing; curves know K_pd, and of the "
            "others little more than a sum; loops know the sum of K_pd and K_b best; both together know all three.",
        ),
        tables=(("kinds of readings", pd.DataFrame(rows)),),
    )


def renamed(sections: tuple[Section, ...], name: str, heading: str) -> tuple[Section, ...]:
    """Return sections of a second report with headings, figures and tables that do not meet those of the first."""
    return tuple(
        replace(
            section,
            heading=f"{heading}: {section.heading.lower()}",
            figures=tuple(replace(figure, name=f"{name}_{figure.name}") for figure in section.figures),
            tables=tuple((f"{name} {table}", frame) for table, frame in section.tables),
        )
        for section in sections
    )


def build(quick: bool, progress: Progress) -> Document:
    """Return the report."""
    given, seeds = load_reducer("rv20e_liu2020"), SeedTree(2020)
    true = replace(given, stiffness=replace(given.stiffness, **TRUTH))
    errors = ErrorModel(load_tolerance_table("rv20e_table4"))
    first, methods = _peak_to_peaks(given, true, errors, seeds, quick, progress)
    second, again = _curves_and_loops(given, true, errors, seeds, quick, progress)
    progress.begin("tables and figures")
    document, curves = told(first).document, told(second).document
    compared = methods_section(methods, first.data.measured.size)
    printed, repeated = printed_section(), recovery_section(again, tuple(item.symbol for item in second.parameters))
    truth = ", ".join(f"{SYMBOLS[name]} = {value:.4g}" for name, value in TRUTH.items())
    return replace(
        document,
        title="liu2020: identification of the stiffness",
        subtitle=f"Printed pairs; units simulated with {truth} N/m and noise; seeds from 1.",
        answer=(
            *printed.paragraphs,
            *(f"Peak-to-peaks of 50 units at 1 N·m: {estimate_sentence(item)}" for item in first.estimates),
            *(f"Curves and loops of 5 units: {estimate_sentence(item)}" for item in second.estimates),
            *repeated.paragraphs,
        ),
        warnings=tuple(f"Peak-to-peaks: {sentence}" for sentence in document.warnings),
        sections=(
            replace(printed, paragraphs=()),
            *renamed((*document.sections, compared), "peaks", "50 simulated units"),
            settings_section(first, methods, _seeds(quick)),
            kinds_section(true, second.parameters, _every_kind(true, errors, seeds)),
            *renamed(curves.sections, "curves", "Curves and loops of five units"),
            repeated,
        ),
        assumptions=(
            *document.assumptions,
            f"improved particle swarm: ω = {ASSUMED.inertia:g}, C1 = C2 = {ASSUMED.acceleration:g}, "
            f"{ASSUMED.neighbours} neighbour to either side on a ring, stop at the bounds; liu2020 prints none",
            f"50 simulated units: {LIKE_TABLE_7:g} times the zones of the tolerance table, so that their mean "
            "peak-to-peak is that of Table 7; five units: its own zones",
            "noise of peak-to-peaks and curves 1″, of loops 0.2″; true stiffness chosen inside the bounds of Table 5",
        ),
        summary={
            "peak-to-peaks": {**document.summary, "methods": [item.summary for item in methods]},
            "curves and loops": curves.summary,
            "repetitions [-]": again.error.shape[0],
            "within three standard errors [-]": again.recovered,
            "intervals that hold the truth [-]": [int(count) for count in again.covered.sum(axis=0)],
        },
    )


def told(result: IdentificationResult) -> Answer[IdentificationResult]:
    """Return an identification as it is told of."""
    header = Header(name=result.measurements.name, model=result.reducer.name, seed=1)
    return Answer(kind="identification", header=header, result=result, told_by=IdentificationTeller)


def _seeds(quick: bool) -> int:
    return 3 if quick else 30


def _peak_to_peaks(
    given: Reducer, true: Reducer, errors: ErrorModel, seeds: SeedTree, quick: bool, progress: Progress
) -> tuple[IdentificationResult, tuple[MethodRuns, ...]]:
    """Identify from peak-to-peaks of 50 units within the bounds of Table 5, all methods compared."""
    nothing = np.empty(0)
    bench = Bench(peak_to_peak_torque=-1.0, peak_to_peak_noise=ARCSECOND, curve_angles=nothing, loop_torques=nothing)
    units = random_units(errors, 50, seeds.child("units"), LIKE_TABLE_7)
    measured = simulated_bench(true, units, bench).measured(seeds.child("noise"))
    request = IdentificationRequest(
        parameters=tuple(parameter(name, given, BOUNDS[name]) for name in RV.identified),
        data="50 simulated units",
    )
    answer = identify(request, measured, given, progress)
    return answer, compare(answer, _seeds(quick), progress)


def _five_units(errors: ErrorModel, seeds: SeedTree) -> tuple[BuiltUnit, ...]:
    return random_units(errors, 5, seeds.child("five units"))


def _every_kind(true: Reducer, errors: ErrorModel, seeds: SeedTree) -> Measurements:
    """Return what a perfect bench would read of the five units, peak-to-peaks included."""
    bench = replace(CURVES_AND_LOOPS, peak_to_peak_torque=-1.0, peak_to_peak_noise=ARCSECOND)
    return simulated_bench(true, _five_units(errors, seeds), bench).measurements


def _curves_and_loops(
    given: Reducer, true: Reducer, errors: ErrorModel, seeds: SeedTree, quick: bool, progress: Progress
) -> tuple[IdentificationResult, Recovery]:
    """Identify from curves in both directions and torque loops of five units, then again with fresh noise."""
    exact = simulated_bench(true, _five_units(errors, seeds), CURVES_AND_LOOPS)
    parameters = tuple(parameter(name, given) for name in RV.identified)
    request = IdentificationRequest(parameters=parameters, data="5 simulated units")
    results = identify(request, exact.measured(seeds.child("once")), given, progress)
    progress.begin("measured again and again")
    truth = np.array([item.coordinate(TRUTH[item.name]) for item in parameters])
    repetitions = 10 if quick else 100
    return results, recovery(given, parameters, truth, exact, repetitions, seeds.child("again"), progress.advance)


study = ta.Study(questions=[ta.Calculation(build)], name="liu2020_identification")

if __name__ == "__main__":
    ta.run_script()

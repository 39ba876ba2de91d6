"""Does a diagnosis keep its promises? 200 simulated RV-20E units, each diagnosed from one noisy curve.

python studies/rv20e_diagnosis.py --quick
"""

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import pandas as pd

import tolalloc as ta
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import limited_measure
from tolalloc.reducers.model import ReducerModel
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.running.chunks import one_thread
from tolalloc.running.progress import Progress
from tolalloc.wings.bench.diagnosis import Diagnosis, diagnose
from tolalloc.wings.bench.measurements import MeasuredCurve
from tolalloc.wings.bench.posterior import CurveProblem, DiagnosisEffort, Noise, thinned
from tolalloc.wings.bench.sources import dominant, reductions

UNITS, QUICK = 200, 2
READINGS = 1440
"""Readings of one output turn [-]."""
NOISE = Noise()
SEEDS = SeedTree(1).child("diagnosis")
DRAWN, ERRORS = ta.reducer("rv20e_liu2020"), ta.drawing("rv20e_table4").errors


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One unit: which source truly drives it, and whether the intervals hold the truth."""

    unit: int
    dominant: str
    named: tuple[str, ...]
    twins_counted_once: int
    explained: bool
    columns_hold: np.ndarray
    gauges_hold: np.ndarray
    curves: int


def simulated(model: ReducerModel, deviations: np.ndarray, seeds: SeedTree) -> MeasuredCurve:
    """Return the noisy curve of a unit, what the model leaves out included."""
    kernel = model.kernel
    angle = 2 * np.pi * np.arange(READINGS) / READINGS
    exact = kernel.model.equilibria(kernel.errors(deviations), kernel.torque, angle).transmission_error[0]
    generator = seeds.generator()
    spread, vector = np.linalg.eigh(NOISE.left_out(angle))
    left_out = vector @ (np.sqrt(np.maximum(spread, 0.0)) * generator.standard_normal(READINGS))
    read = exact + left_out + NOISE.reading * generator.standard_normal(READINGS)
    return MeasuredCurve(unit=0, torque=kernel.torque, carrier_angle=angle, transmission_error=read - read.mean())


def outcome(number: int) -> Outcome:
    """Draw a unit from the drawings, simulate its curve, diagnose it and compare with the truth."""
    model = DRAWN.bound(ERRORS, "rv20e_diagnosis")
    kernel, errors = model.kernel, ERRORS
    uniform = next(SEEDS.child("units", str(number)).uniform_chunks(1, len(errors.columns)))
    deviations = errors.deviations(errors.standard_values(uniform), errors.zones)
    curve = simulated(model, deviations, SEEDS.child("noise", str(number)))
    effort = DiagnosisEffort()
    found = diagnose(curve, kernel, errors, errors.zones, NOISE, SEEDS.child("diagnose", str(number)), effort)
    problem = CurveProblem(
        kernel=kernel, errors=errors, zones=errors.zones, readings=thinned(curve, NOISE, effort.angles)
    )
    owner = np.array(errors.source_of_column)
    gauges = np.array([limited_measure(source, deviations[:, owner == source.name])[0] for source in errors.active])
    low, high = found.column_interval
    return Outcome(
        unit=number,
        dominant=found.sources[dominant(reductions(problem, deviations))[0]],
        named=found.named,
        twins_counted_once=counted_once(found),
        explained=found.fit.explained,
        columns_hold=(low <= deviations[0]) & (deviations[0] <= high),
        gauges_hold=(found.reading_interval[0] <= gauges) & (gauges <= found.reading_interval[1]),
        curves=found.evaluations,
    )


def counted_once(found: Diagnosis) -> int:
    """Return how many sources are named if two twins, which no curve tells apart, count as one."""
    both = sum(one in found.named and other in found.named for one, other in found.twins)
    return len(found.named) - both


def standard_error(share: float, count: int) -> float:
    """Return the standard error of a share [-]."""
    return float(np.sqrt(max(share * (1 - share), 0.25 / count) / count))


def figure(outcomes: list[Outcome], named: np.ndarray) -> Figure:
    """Draw how many sources are named."""
    sizes = [one.twins_counted_once for one in outcomes if one.explained]
    values = list(range(1, max(sizes) + 1))
    return Figure(
        name="named",
        title=f"How many sources are named; the true one is among them in {named.mean():.1%} of the units",
        x_label="sources named, twins counted once [-]",
        y_label="units [-]",
        series=(Series(label="units", kind="stems", x=values, y=[sizes.count(value) for value in values]),),
    )


def build(quick: bool, progress: Progress) -> Document:
    """Diagnose all units and say what the promises came to."""
    units, workers = QUICK if quick else UNITS, os.cpu_count() or 1
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=one_thread) as pool:
        progress.begin("diagnosed units", units)
        outcomes = []
        for one in pool.map(outcome, range(units)):
            outcomes.append(one)
            progress.advance(1)
    owner, sources = np.array(ERRORS.source_of_column), ERRORS.active
    named = np.array([one.dominant in one.named for one in outcomes])
    columns, gauges = (np.array([getattr(one, name) for one in outcomes]) for name in ("columns_hold", "gauges_hold"))
    explained = np.array([one.explained for one in outcomes])
    sizes = np.array([(len(one.named), one.twins_counted_once) for one in outcomes if one.explained])
    table = pd.DataFrame(
        {
            "source": [source.name for source in sources],
            "intervals of its columns that hold [%]": [columns[:, owner == one.name].mean() * 100 for one in sources],
            "intervals of its gauge that hold [%]": gauges.mean(axis=0) * 100,
            "true dominant source [units]": [sum(one.dominant == own.name for one in outcomes) for own in sources],
        }
    )
    summary = {
        "units [-]": units,
        "explained [-]": int(explained.sum()),
        "true dominant source named [-]": float(named.mean()),
        "its standard error [-]": standard_error(float(named.mean()), units),
        "95 % intervals of columns that hold [-]": float(columns.mean()),
        "95 % intervals of gauges that hold [-]": float(gauges.mean()),
        "sources named, mean [-]": float(sizes[:, 0].mean()),
        "sources named, twins counted once, mean [-]": float(sizes[:, 1].mean()),
        "curves solved per unit, mean [-]": float(np.mean([one.curves for one in outcomes])),
    }
    return Document(
        title="Diagnosis of simulated RV-20E units",
        subtitle=f"{units} units drawn from the tolerance table, {READINGS} readings each, 0.5″ noise of a reading and "
        "0.5″ that the model leaves out, both also in the simulated curves",
        answer=(
            f"The true dominant source is among the named ones in {named.mean():.1%} of the units (promised: 97 %); "
            f"{explained.sum()} of {units} curves are explained, an unexplained one counts as missed.",
            f"95 % intervals hold the truth in {columns.mean():.1%} of all columns, {gauges.mean():.1%} of all gauges.",
            f"Named are {sizes[:, 0].mean():.2f} sources on average, {sizes[:, 1].mean():.2f} with twins counted once.",
        ),
        warnings=("Quick run: few units.",) if quick else (),
        sections=(
            Section(heading="How many sources are named", figures=(figure(outcomes, named),)),
            Section(heading="Source by source", tables=(("sources", table),)),
        ),
        assumptions=("noise and what the model leaves out: 0.5″ each, the latter alike over 1.5° of the carrier",),
        summary=summary,
        seed=SEEDS.seed,
    )


study = ta.Study(questions=[ta.Calculation(build)], name="rv20e_diagnosis")

if __name__ == "__main__":
    ta.run_script()

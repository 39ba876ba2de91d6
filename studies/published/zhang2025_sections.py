"""What the study of zhang2025's BX40E adds to the report of one assembly."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

import tolalloc as ta
from published.zhang2025_genetic import genetic_allocation
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import SolveError
from tolalloc.reading.units import ARCSECOND, MEGAPASCAL, MICROMETRE
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.equivalent.outputs import contact_pattern
from tolalloc.reducers.equivalent.solvers.records import AngleSearch
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.running.progress import Progress
from tolalloc.wings.assembly.control import regulator
from tolalloc.wings.assembly.gains import norms
from tolalloc.wings.assembly.mounting import best_mounting, random_mounting
from tolalloc.wings.assembly.orientations import OrientationResponse
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.stock import PartStock, drawn_parts
from tolalloc.wings.assembly.tolerances import AngularAllocation, allocate_angles, best_state_weight
from tolalloc.wings.assembly.trajectory import foreseen

SEEDS = SeedTree(1).child("zhang2025")
PRECISIONS = (0.0, 5.0, 10.0)
"""Those of zhang2025's figures 8 and 9 [-]."""
STEPS = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Precisions between which falls are counted [-]."""
NORM_DRAWS = 10_000
PHOTOELASTIC_TORQUE, PHOTOELASTIC_FACTOR = -10.0, 10.0
"""Load of zhang2025's photoelastic test [N·m]; by how much its angles were enlarged [-]."""
EFFORT_PRICE = 0.02 / ARCSECOND**2
"""Price of effort, assumed [cost units/rad²]."""
SETS_OF = {1: "clocking one unit", 4: "four units from one stock"}


def finals(plan: AssemblyPlan, errors: np.ndarray, precision: float) -> np.ndarray:
    """Return final states of parts that are measured beforehand [rad]."""
    adjusting = regulator(plan.space, plan.final_weight(precision))
    return foreseen(plan.space, adjusting, errors).adjusted[..., -1, :]


def uniform_errors(plan: AssemblyPlan, draws: int) -> np.ndarray:
    """Return part errors within ±60″ [rad]."""
    drawn = SEEDS.child("draws").generator().uniform(-60, 60, (draws, plan.tolerances.size))
    return drawn * ARCSECOND


def drawn_parts_section(plan: AssemblyPlan, draws: int) -> tuple[Section, str]:
    """Return how often each output falls with the precision, over random parts."""
    grid = np.linspace(0.0, 20.0, 81)
    norm = norms(plan, uniform_errors(plan, NORM_DRAWS), grid)
    falls = (np.diff(norm, axis=0) < 0).all(axis=0)
    convex = (np.diff(norm, n=2, axis=0) > -1e-12 * norm[0]).all(axis=0)
    angles = np.abs([finals(plan, uniform_errors(plan, NORM_DRAWS), float(own)) for own in range(11)])
    rising = (np.diff(angles, axis=0) > 0).any(axis=0).mean()
    reducer = load_reducer(plan.reducer)
    response = OrientationResponse(model=EquivalentModel(reducer), chain=plan.chain, torque=reducer.load.test_torque)
    states = np.array([finals(plan, uniform_errors(plan, draws), precision) for precision in STEPS])
    found = response(states.reshape(-1, states.shape[2]))
    good = np.asarray(found.good.reshape(len(STEPS), draws).all(axis=0))
    if (~good).mean() > LARGEST_FAILED_SHARE:
        raise SolveError(f"{plan.name}: {np.count_nonzero(~good)} of {draws} sets of parts have no equilibrium.")
    values = found.values.reshape(len(STEPS), draws, -1)[:, good]
    change = np.diff(values, axis=0)
    table = pd.DataFrame(
        {
            "output": response.outputs,
            f"falls from Q = {STEPS[0]:g} to {STEPS[-1]:g} [% of draws]": (values[-1] < values[0]).mean(axis=0) * 100,
            "falls at every step [% of draws]": (change < 0).all(axis=0).mean(axis=0) * 100,
        }
        | {f"median at Q = {precision:g}": np.median(own, axis=0) for precision, own in zip(STEPS, values, strict=True)}
    )
    table = table[~table["output"].str.contains("mean")]
    load = table["output"].str.contains("line load").to_numpy()
    share = float(table.loc[load, table.columns[1]].iloc[0])
    sentence = (
        f"Of {NORM_DRAWS} random sets of parts the norm of the final angles falls with Q in {falls.mean():.2%} and is "
        f"convex in {convex.mean():.2%}; a single angle rises somewhere between Q = 0 and 10 in {rising:.0%} of all "
        f"angles. Of {values.shape[1]} sets the largest line load is lower at Q = 10 than unadjusted in {share:.0f} %."
    )
    return (
        Section(
            heading="Random parts: what falls with the precision and what need not",
            paragraphs=(
                f"Errors within ±60″ about every axis, {draws} sets for the transmission, {np.count_nonzero(~good)} "
                "of them left out for want of an equilibrium. That the norm falls is a "
                "theorem; of single angles and of anything that the transmission does it is not: a tilted disc wedges "
                "between the pins and more of them carry, and two discs turned against each other share unevenly.",
            ),
            tables=(("falls", table.reset_index(drop=True)),),
        ),
        sentence,
    )


def pattern_section(plan: AssemblyPlan, errors: np.ndarray, precisions: tuple[float, ...]) -> Section:
    """Return the contact of disc 2 at the load of the photoelastic test, its angles enlarged."""
    reducer = load_reducer(plan.reducer)
    response = OrientationResponse(
        model=EquivalentModel(reducer, AngleSearch(coarse=156)), chain=plan.chain, torque=PHOTOELASTIC_TORQUE
    )
    last, angle = slice(3 * (len(plan.chain.parts) - 1), 3 * len(plan.chain.parts) - 1), None
    rows: list[dict[str, Any]] = []
    series = []
    for precision in precisions:
        state = np.zeros((1, plan.space.states))
        state[0, last] = PHOTOELASTIC_FACTOR * finals(plan, errors.ravel(), precision)[last]
        found = contact_pattern(
            response.model, response.errors(state)[0], PHOTOELASTIC_TORQUE, reducer.disc_count, angle
        )
        angle = found.carrier_angle
        x, y = state[0, last] / ARCSECOND
        rows.append(
            {
                "Q [-]": precision,
                "tilt about x, enlarged [arcsec]": x,
                "about y, enlarged [arcsec]": y,
                "peak pressure [MPa]": float(found.pressure.max()) / MEGAPASCAL,
                "largest deformation [µm]": float(found.deformation.max()) / MICROMETRE,
                "largest pin force [N]": float(found.force.max()),
                "pins that carry [-]": int(np.count_nonzero(found.force)),
            }
        )
        pins = list(range(1, found.force.size + 1))
        series.append(Series(label=f"Q = {precision:g}", kind="points", x=pins, y=list(found.deformation / MICROMETRE)))
    return Section(
        heading="One disc at the load of the photoelastic test",
        paragraphs=(
            f"{plan.chain.names[-1]} alone, its tilt ten times what adjusting leaves and its rotation left out, at "
            f"{abs(PHOTOELASTIC_TORQUE):g} N·m and the carrier angle where the unadjusted disc is loaded most. "
            "zhang2025 enlarges the angles of a polycarbonate disc; here it is of steel, and nothing relieves a tilt, "
            "so the trend compares and the pressures do not.",
        ),
        figures=(
            Figure(
                name="photoelastic",
                title="Largest deformation of every pin, tilt ten times enlarged",
                x_label="pin [-]",
                y_label="deformation [µm]",
                series=tuple(series),
            ),
        ),
        tables=(("photoelastic", pd.DataFrame(rows)),),
    )


def priced_section(plan: AssemblyPlan) -> tuple[Section, str]:
    """Return costs over the precision once effort has a price."""
    if plan.requirements is None:
        raise ValueError("the plan states no costs")
    priced = replace(plan, requirements=replace(plan.requirements, effort_price=EFFORT_PRICE))
    found, at_ten = best_state_weight(priced), allocate_angles(priced, 10.0)
    best = found.best
    sentence = (
        f"Once effort costs {EFFORT_PRICE * ARCSECOND**2:g} cost units per arcsec², the cheapest precision is "
        f"Q = {best.gains.state_weight:.3f} with {best.total:.4f} cost units in all; Q = 10 costs {at_ten.total:.2f}."
    )
    curves = {"tolerances": found.cost, "effort": found.effort_cost, "together": found.total}
    return (
        Section(
            heading="What precision is worth once effort has a price",
            paragraphs=(f"{sentence} Certified gap {best.gap:.1e}, with the filter of the plan's tolerances.",),
            figures=(
                Figure(
                    name="priced_precision",
                    title="Dearer parts or more adjusting",
                    x_label="precision Q [-]",
                    y_label="cost [cost units]",
                    series=tuple(
                        Series(label=label, kind="line", x=list(found.state_weights), y=list(values))
                        for label, values in curves.items()
                    ),
                    vertical=((best.gains.state_weight, "cheapest"),),
                    logarithmic_x=True,
                ),
            ),
        ),
        sentence,
    )


def exponential_section(plan: AssemblyPlan) -> Section:
    """Return the allocation with exponential instead of reciprocal costs."""
    own = plan.requirements
    if own is None:
        raise ValueError("the plan states no costs")
    # Of the same price and slope as the reciprocal cost at 30″: b/t and b/t·exp(1 − t/30″) touch there.
    scale = np.full_like(own.factor, 30.0 * ARCSECOND)
    factor = own.factor / scale * np.e
    requirements = replace(own, form="exponential", factor=factor, scale=scale)
    found = {
        "reciprocal": allocate_angles(plan),
        "exponential": allocate_angles(replace(plan, requirements=requirements)),
    }
    return Section(
        heading="Reciprocal and exponential costs",
        paragraphs=(
            "Exponential costs that touch the reciprocal ones at ±30″. Both programs are convex, and each has its own "
            "certificate. The four limits of rotation fix the four tolerances about z, whatever these cost.",
        ),
        tables=(("forms", pd.DataFrame([_row(name, each) for name, each in found.items()])),),
    )


def _row(name: str, allocation: AngularAllocation) -> dict[str, Any]:
    return {
        "costs": name,
        "cost [cost units]": allocation.total,
        "certified bound [cost units]": allocation.bound,
        "gap [-]": f"{allocation.gap:.1e}",
        "smallest tolerance of a tilt [arcsec]": float(allocation.tolerances[:, :2].min()) / ARCSECOND,
        "largest tolerance of a tilt [arcsec]": float(allocation.tolerances[:, :2].max()) / ARCSECOND,
    }


def genetic_section(plan: AssemblyPlan, seeds: int, progress: Progress) -> tuple[Section, str]:
    """Return what zhang2025's genetic algorithm ends above the certified cost."""
    rows = []
    progress.begin("genetic algorithm", 2 * seeds, "searches")
    for precision in (0.0, plan.state_weight):
        certified = allocate_angles(plan, precision)
        runs = []
        for seed in range(seeds):
            runs.append(genetic_allocation(plan, certified, SEEDS.child("genetic", str(seed))))
            progress.advance(1)
        excess = np.array([run.total / certified.total - 1 for run in runs]) * 100
        rows.append(
            {
                "Q [-]": precision,
                "certified cost [cost units]": certified.total,
                "seeds [-]": seeds,
                "least excess [%]": excess.min(),
                "median excess [%]": float(np.median(excess)),
                "largest excess [%]": excess.max(),
            }
        )
    table = pd.DataFrame(rows)
    last = rows[-1]
    sentence = (
        f"zhang2025's genetic algorithm (100 designs, 300 generations) ends {last['least excess [%]']:.2f}…"
        f"{last['largest excess [%]']:.2f} % above the certified cost at Q = {plan.state_weight:g} over {seeds} seeds."
    )
    return (
        Section(
            heading="The genetic algorithm beside the certificate",
            paragraphs=("Operators and settings beyond the name are assumptions; the algorithm knows no bound.",),
            tables=(("genetic", table),),
        ),
        sentence,
    )


def mounting_section(sets: int, progress: Progress) -> tuple[Section, str]:
    """Return what choosing the mounting of measured parts is worth, over random sets of parts of an RV-20E."""
    errors = ta.drawing("rv20e_table4").errors
    kernel = ta.reducer("rv20e_liu2020").bound(errors, "zhang2025_assembly").kernel
    progress.begin("mounting of measured parts", len(SETS_OF) * sets, "sets")
    rows = [_mounted(kernel, errors, units, sets, progress) for units in SETS_OF]
    table = pd.DataFrame(rows)
    first = rows[0]
    sentence = (
        f"Choosing how the measured parts of one RV-20E are mounted makes its peak-to-peak "
        f"{first['below a random mounting, median [%]']:.0f} % smaller than a random mounting does, and "
        f"{first['below the worst mounting, median [%]']:.0f} % smaller than the worst one (medians of {sets} sets)."
    )
    return (
        Section(
            heading="Which part goes where, and how it is turned there",
            paragraphs=(
                "Sets of parts drawn from the tolerance table of the RV-20E, as if each part had been measured; every "
                "mounting is judged by the peak-to-peak of the equivalent model. One unit: all its mountings are "
                "tried. Four units: assignments, turns and exchanges until none helps.",
            ),
            tables=(("mounting", table),),
        ),
        sentence,
    )


def _mounted(kernel: KernelResponse, errors: Any, units: int, sets: int, progress: Progress) -> dict[str, Any]:
    random, worst, seconds, evaluations = [], [], [], []
    for number in range(sets):
        seeds = SEEDS.child("mounting", str(units), str(number))
        parts = drawn_parts(errors, kernel.model.reducer, units, seeds.child("parts"))
        start = time.perf_counter()
        stock = PartStock(reducer=kernel.model.reducer, parts=parts, columns=errors.columns)
        found = best_mounting(stock, kernel, seeds.child("search"))
        seconds.append(time.perf_counter() - start)
        chance = random_mounting(stock, kernel, max(found.evaluations // units, 1), seeds.child("chance"))
        after = float(found.after.mean())
        random.append((1 - after / chance.means.mean()) * 100)
        worst.append((1 - after / chance.means.max()) * 100)
        evaluations.append(found.evaluations)
        progress.advance(1)
    row: dict[str, Any] = {"mounting": SETS_OF[units], "sets [-]": sets}
    for name, values in (("a random mounting", random), ("the worst mounting", worst)):
        low, median, high = np.quantile(values, [0.05, 0.5, 0.95])
        row |= {
            f"below {name}, median [%]": median,
            f"below {name}, 5 % of sets [%]": low,
            f"below {name}, 95 % of sets [%]": high,
        }
    return row | {
        "time a set, median [s]": float(np.median(seconds)),
        "units solved a set": float(np.median(evaluations)),
    }

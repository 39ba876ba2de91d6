"""How the cost of an answer grows: time against units, sources, angles, pins, discs, cranks, requirements, grades, ...

    python studies/benchmarks/growth.py [--rounds 5] [--figures docs/figures] [--json]

Every line changes one size and keeps the others: 256 random units of an RV-20E of printed stiffness, peak-to-peak, or a
random allocation. Sizes are measured in turn, round after round; the exponent is the slope through the medians of the
upper half of the sizes, time ∝ sizeᵉ. What 1e8 units cost follows from the rate at the most units.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy_cores import CORES, timed

sys.path.insert(0, str(Path(__file__).parents[2]))

import tolalloc as ta
from tests.builders import prepared
from tests.random_cases import DISC_TILT, random_units
from tests.verification.test_process_choice import compiled, random_problem
from tolalloc.allocation.cost.model import Process, ReciprocalPower
from tolalloc.allocation.search import process_choice
from tolalloc.allocation.search.discrete import DiscreteProblem, feature_options
from tolalloc.allocation.space.problem import AllocationProblem, PricedFeature, Stack
from tolalloc.capability.experiment import Experiment
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.unit_file import load_unit
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.plots import save_png

SEED, TORQUE, UNITS = 20261124, -1.0, 256
REQUIREMENTS = (
    *(ta.PEAK_TO_PEAK, ta.LOST_MOTION, "largest pin force, rated torque [N]", ta.PRELOAD),
    *(ta.RADIAL_CLEARANCE, ta.TORSIONAL_STIFFNESS, ta.BACKLASH, ta.FRICTION_TORQUE),
)

Work = Callable[[], object]


@dataclass(frozen=True)
class Line:
    """What grows with one size."""

    name: str  # What the size counts
    work: str  # What is done at every size
    sizes: tuple[int, ...]
    prepare: Callable[[int], Work]  # Size → what is timed, all tables made


@dataclass(frozen=True)
class Growth:
    """What was measured of a line."""

    line: Line
    seconds: Float[np.ndarray, "round size"]

    @property
    def medians(self) -> Float[np.ndarray, " size"]:
        """Median time of every size [s]."""
        return np.asarray(np.median(self.seconds, axis=0))

    @property
    def exponent(self) -> float:
        """Slope of the logarithms through the upper half of the sizes, three at least [-]."""
        upper = min(len(self.line.sizes) // 2, len(self.line.sizes) - 3) if len(self.line.sizes) > 3 else 0
        sizes, medians = np.log(self.line.sizes)[upper:], np.log(self.medians)[upper:]
        return float(np.polyfit(sizes, medians, 1)[0])


def printed_units(model: EquivalentModel, count: int) -> Float[np.ndarray, "sample column"]:
    """Return random units around the printed one; what a reducer has more of is off by as much as what it was."""
    unit, generator = load_unit("table4").errors(load_model().columns), np.random.default_rng(SEED)
    known = dict(zip(load_model().columns, unit[0], strict=True))
    like = [known.get(name, known.get(name.replace("3", "1").replace("4", "2"), 0.0)) for name in model.columns]
    return random_units(np.array([like]), model.columns, generator, count)


def load_model() -> EquivalentModel:
    """Return the RV-20E of the printed stiffness."""
    return EquivalentModel(load_reducer("rv20e_liu2020"))


def extremes(model: EquivalentModel, count: int = UNITS) -> Work:
    """Return the peak-to-peak of random units as work."""
    errors = printed_units(model, count)
    model.extremes(errors[:8], TORQUE)  # makes the tables
    return lambda: model.extremes(errors, TORQUE)


def of_columns(count: int) -> Work:
    """Return the peak-to-peak of units of which so many sources err; none of them tilts a disc."""
    model, generator = load_model(), np.random.default_rng(SEED)
    errors = np.zeros((UNITS, len(model.columns)))
    kept = [at for at, name in enumerate(model.columns) if not re.search(f"{DISC_TILT}|^modification", name)]
    some = generator.choice(kept, count, replace=False)
    errors[:, some] = 2e-6 * generator.normal(size=(UNITS, count)) / np.sqrt(count / 12)
    model.extremes(errors[:8], TORQUE)
    return lambda: model.extremes(errors, TORQUE)


def at_angles(angles: int) -> Work:
    """Return the curves of units at so many angles."""
    model, angle = load_model(), 2 * np.pi * np.arange(angles) / angles
    errors, tables = printed_units(model, UNITS), model.tables_at(angle)
    model.equilibria_of(tables, errors[:8], TORQUE, angle)
    return lambda: model.equilibria_of(tables, errors, TORQUE, angle)


def with_pins(pins: int) -> Reducer:
    """Return the RV-20E with other pins of the same shortening, circle and share of the circle."""
    own = load_reducer("rv20e_liu2020")
    ratio = own.cycloid_stage.pin_count / pins
    stage = replace(
        own.cycloid_stage,
        pin_count=pins,
        disc_teeth=pins - 1,
        pin_radius=own.cycloid_stage.pin_radius * ratio,
        eccentricity=own.cycloid_stage.eccentricity * ratio,
    )
    return replace(own, cycloid_stage=stage)


def reading(count: int) -> Work:
    """Return so many requirements of random units at the shipped drawing as work."""
    study = prepared()
    response = study.model.reading(REQUIREMENTS[:count])
    experiment = Experiment.of(response, study.errors, SeedTree(SEED))
    x = experiment.deviations(experiment.errors.standard_values(experiment.uniform(UNITS)))
    return lambda: response(x)


def allocated(features: int) -> Work:
    """Return the proven allocation of so many features with competing processes as work."""
    problem = random_problem(SEED, features=features, processes=2, stacks=2)
    return lambda: process_choice.allocate(problem)


def on_grades(grades: int) -> Work:
    """Return the proven choice of 30 features' grades as work."""
    generator = np.random.default_rng(SEED)
    ladder = 1.6 ** np.linspace(0, 7, grades)
    features = tuple(
        PricedFeature(
            name=f"feature {number}",
            processes=(
                Process(
                    name="process",
                    cost=ReciprocalPower(factor=generator.uniform(2, 10), exponent=generator.uniform(0.5, 1.2)),
                    minimum=1.0,
                    maximum=float(ladder[-1]),
                ),
            ),
        )
        for number in range(30)
    )
    stacks = []
    for number in range(2):
        weights = np.exp(generator.normal(0.0, 0.7, 30))
        budget = float(np.linalg.norm(weights)) * 5.0
        stacks.append(Stack(name=f"{number}", worst_case=0 * weights, root_sum_square=weights, budget=budget))
    labels = [f"grade {at}" for at in range(grades)]
    options = tuple(feature_options(own, ladder, labels) for own in features)
    case = DiscreteProblem(problem=AllocationProblem(features=features, stacks=tuple(stacks)), options=options)
    return case.solve


def along_front(designs: int) -> Work:
    """Return the exact front of so many designs of 30 features as work."""
    problem = random_problem(SEED, features=30, processes=1, stacks=2)
    program, stacks = compiled(problem), problem.stacks
    budgets = stacks[0].budget * np.linspace(0.8, 1.4, designs)
    points = [(replace(stacks[0], budget=own), *stacks[1:]) for own in budgets.tolist()]
    return lambda: [program.solve(point) for point in points]


def along_front_of_processes(designs: int) -> Work:
    """Return the proven front of so many designs of 30 features with competing processes as work."""
    problem = random_problem(SEED, features=30, processes=2, stacks=2)
    rows = np.tile([stack.budget for stack in problem.stacks], (designs, 1))
    rows[:, 0] *= np.linspace(0.8, 1.4, designs)

    def work() -> None:
        series = process_choice.BudgetSeries(problem)
        for row in rows:
            series.allocate(row)

    return work


def _reducer(**changes: int) -> Work:
    return extremes(EquivalentModel(replace(load_reducer("rv20e_liu2020"), **changes)))


PEAK = f"peak-to-peak of {UNITS} units"
LINES = (
    Line("units", "peak-to-peak", (16, 64, 256, 1024, 4096), lambda size: extremes(load_model(), size)),
    Line("sources", PEAK, (12, 24, 48, 96, 192), of_columns),
    Line("angles", f"curves of {UNITS} units", (468, 936, 1872, 3744), at_angles),
    Line("pins", PEAK, (20, 40, 60, 80), lambda size: extremes(EquivalentModel(with_pins(size)))),
    Line("discs", PEAK, (1, 2, 3), lambda size: _reducer(disc_count=size)),
    Line("cranks", PEAK, (2, 3, 4), lambda size: _reducer(crank_count=size)),
    Line("requirements", f"all of {UNITS} units", (1, 2, 4, 8), reading),
    Line("features", "proven allocation, two processes each", (12, 24, 48, 96, 192), allocated),
    Line("grades", "proven choice, 30 features", (4, 8, 16, 32), on_grades),
    Line("designs of a front", "30 features", (10, 20, 50, 100), along_front),
    Line(
        "designs of a front with processes", "30 features, two processes each", (10, 20, 50), along_front_of_processes
    ),
)

_OF_MODEL = 7
"""So many of the lines are the model's, those behind them the allocation's [-]."""


def measured(line: Line, rounds: int) -> Growth:
    """Return the seconds of all sizes, round after round, once everything is compiled."""
    works = [line.prepare(size) for size in line.sizes]
    works[0]()
    seconds = np.empty((rounds, len(works)))
    for number in range(rounds):
        for at, work in enumerate(works):
            seconds[number, at] = timed(work)[0]
        sys.stderr.write(f"\r{line.name}: round {number + 1} of {rounds}   ")
    sys.stderr.write("\n")
    return Growth(line=line, seconds=seconds)


def figure(found: list[Growth], of_allocation: bool) -> Figure:
    """Return time against size, each relative to its first size, of the model or of the allocation."""
    what = "allocation" if of_allocation else "model"
    return Figure(
        name=f"growth_of_{what}",
        title=f"How the time of the {what} grows",
        x_label="size over its smallest [-]",
        y_label="time over that of the smallest [-]",
        series=tuple(
            Series(
                label=f"{own.line.name}, exponent {own.exponent:.2f}",
                kind="line",
                x=(np.array(own.line.sizes) / own.line.sizes[0]).tolist(),
                y=(own.medians / own.medians[0]).tolist(),
            )
            for own in found
            if (own.line in LINES[_OF_MODEL:]) == of_allocation
        ),
        logarithmic=True,
        logarithmic_x=True,
    )


def table(found: list[Growth]) -> str:
    """Return the answer for people."""
    rows = [f"{CORES} cores; median seconds (least…most) at every size", ""]
    for own in found:
        rows.append(f"{own.line.name} ({own.line.work}): exponent {own.exponent:.2f}")
        for size, seconds in zip(own.line.sizes, own.seconds.T, strict=True):
            rows.append(f"{size:10,}{np.median(seconds):12.4f} ({seconds.min():.4f}…{seconds.max():.4f})")
    for own in (each for each in found if each.line.name == "units"):
        hours = own.medians[-1] / own.line.sizes[-1] * 1e8 * CORES / 3600
        rows.append(f"1e8 units at the rate of the most: {hours:.0f} core hours")
    return "\n".join(rows)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--rounds", type=int, default=5, help="measurements of each size")
    parser.add_argument("--only", choices=[line.name for line in LINES], help="one line alone")
    parser.add_argument("--figures", type=Path, help="folder of two pictures")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    if asked.rounds < 1:
        parser.error(f"--rounds is {asked.rounds}; allowed is 1 or more.")
    found = [measured(line, asked.rounds) for line in LINES if asked.only in (None, line.name)]
    if asked.figures:
        for drawn in (figure(found, of_allocation=False), figure(found, of_allocation=True)):
            save_png(drawn, asked.figures / f"{drawn.name}.png")
    if asked.json:
        print(json.dumps({own.line.name: {"exponent": own.exponent, "s": own.seconds.tolist()} for own in found}))
        return
    print(table(found))


if __name__ == "__main__":
    main()

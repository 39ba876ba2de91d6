"""Random reducers, units, tolerance tables, studies and assemblies, the same ones for ever."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

import tolalloc as ta
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reading.units import ARCSECOND, MICROMETRE, MILLIMETRE
from tolalloc.reducers import LOST_MOTION, PEAK_TO_PEAK, RADIAL_CLEARANCE, TORSIONAL_STIFFNESS
from tolalloc.reducers.choice import ReducerChoice
from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Clearances, CycloidStage, FirstStage, Load, Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer
from tolalloc.reducers.reducer.stiffness import Material, Stiffness
from tolalloc.wings.assembly.chain import ChainPart, DatumFlowChain
from tolalloc.wings.assembly.plan import AssemblyPlan
from tolalloc.wings.assembly.steps import AssemblyStep

LAWS = ("constant", "table2", "logarithmic")
SINGLE, DISC_TILT = r"^each_|\.each_", r"^disc\d+\.tilt"
"""Names of the columns of single pins and teeth, and of tilted discs."""


def random_cycloid_stage(generator: np.random.Generator) -> CycloidStage:
    """Return a cycloid stage whose pins neither overlap nor undercut the teeth."""
    pins, circle = int(generator.integers(16, 61)), generator.uniform(0.03, 0.12)
    shortening = generator.uniform(0.5, 0.85)
    around = np.linspace(0, np.pi, 500)
    bend = 1 + pins * shortening**2 - shortening * (1 + pins) * np.cos(around)
    path = circle * (1 + shortening**2 - 2 * shortening * np.cos(around)) ** 1.5
    convex = (path[bend > 0] / bend[bend > 0]).min()
    width = generator.uniform(0.006, 0.02)
    return CycloidStage(
        pin_count=pins,
        disc_teeth=pins - 1,
        pin_circle_radius=circle,
        pin_radius=generator.uniform(0.3, 0.9) * min(convex, np.pi * circle / pins),
        eccentricity=shortening * circle / pins,
        face_width=width,
        disc_spacing=generator.uniform(1.0, 1.5) * width,
    )


def random_clearances(generator: np.random.Generator) -> Clearances:
    """Return none in half of the cases, else some of 1–15 µm."""
    names = ("gear_mesh", "crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")
    some = generator.random() < 0.5
    return Clearances(**{name: generator.uniform(1e-6, 15e-6) for name in names if some and generator.random() < 0.6})


def random_reducer(generator: np.random.Generator) -> Reducer:
    """Return a reducer of 2–4 cranks and 1–3 discs; every stiffness within a factor of about 3 of an RV-20E's."""
    stage, (sun, planet) = random_cycloid_stage(generator), (int(z) for z in generator.integers((9, 20), (31, 61)))
    crank_circle = generator.uniform(0.4, 0.65) * stage.pin_circle_radius

    def around(stiffness: float) -> float:
        return stiffness * 10 ** generator.uniform(-0.5, 0.5)

    return Reducer(
        name="random",
        source="test",
        crank_count=int(generator.integers(2, 5)),
        disc_count=int(generator.integers(1, 4)),
        first_stage=FirstStage(
            sun_teeth=sun,
            planet_teeth=planet,
            module=2 * crank_circle / (sun + planet),
            pressure_angle=np.radians(generator.uniform(14.5, 28)),
        ),
        cycloid_stage=stage,
        disc_material=Material(elastic_modulus=206e9, poisson_ratio=0.3),
        pin_material=Material(elastic_modulus=206e9, poisson_ratio=0.3),
        stiffness=Stiffness(
            sun_support=around(1e8),
            gear_mesh=around(2e8),
            crank_disc_bearing=around(5e9),
            crank_carrier_bearing=around(8e9),
            carrier_bearing=around(3e10),
            pin_contact=around(1e9),
            pin_contact_law=str(generator.choice(LAWS)),
        ),
        modification=Modification(equidistant=0.0, shift=0.0),
        load=Load(test_torque=-1.0, rated_torque=100.0),
        clearances=random_clearances(generator),
    )


def random_orders(generator: np.random.Generator) -> tuple[int, ...]:
    """Return one to four orders of harmonic deviations."""
    orders = generator.choice(np.arange(1, 13), generator.integers(1, 5), replace=False)
    return tuple(int(order) for order in np.sort(orders))


def is_angle(column: str) -> bool:
    """Return whether an error column is an angle; the others are lengths."""
    return re.search(r"\.(tilt|phase|rotation)\b", column) is not None


def random_unit(reducer: Reducer, columns: tuple[str, ...], generator: np.random.Generator) -> dict[str, float]:
    """Return errors of 0.3–10 µm and angles of 10–100 µrad; half of the units have single pins and teeth or disc tilt.

    Discs tilt under the linear laws only; the others do not have those columns.
    """
    size, angle = 0.3e-6 * 33 ** generator.random(), 1e-5 * 10 ** generator.random()
    left_out = [kind for kind in (SINGLE, DISC_TILT) if generator.random() < 0.5]
    values = np.where([is_angle(column) for column in columns], angle, size) * generator.normal(size=len(columns))
    return without(dict(zip(columns, values.tolist(), strict=True)), *left_out)


def without(unit: dict[str, float], *patterns: str) -> dict[str, float]:
    """Return a unit whose errors of the given names are zero."""
    return {name: 0.0 if any(re.search(at, name) for at in patterns) else value for name, value in unit.items()}


@dataclass(frozen=True)
class Case:
    """Two random units of a random reducer at a random torque and one or two carrier angles."""

    reducer: Reducer
    orders: tuple[int, ...]
    units: tuple[dict[str, float], ...]
    torque: float
    carrier_angle: np.ndarray


def random_case(seed: int) -> Case:
    """Return the case of a seed; the same one for ever."""
    generator = np.random.default_rng(seed)
    reducer, orders = random_reducer(generator), random_orders(generator)
    columns = EquivalentModel(reducer, orders=orders).columns
    return Case(
        reducer=reducer,
        orders=orders,
        units=tuple(random_unit(reducer, columns, generator) for _ in range(2)),
        torque=float(generator.choice([-1, 1]) * 0.1 * 5000 ** generator.random()),
        carrier_angle=generator.uniform(0, 2 * np.pi, generator.integers(1, 3)),
    )


def variations(case: Case) -> Iterator[tuple[str, Case]]:
    """Each kind of nonlinearity or of single error that a case holds, and the case without it."""
    law = case.reducer.stiffness.pin_contact_law
    if case.reducer.clearances != Clearances():
        yield "play", replace(case, reducer=replace(case.reducer, clearances=Clearances()))
    if law != "constant":
        stiffness = replace(case.reducer.stiffness, pin_contact_law="constant")
        yield law, replace(case, reducer=replace(case.reducer, stiffness=stiffness))
    for kind, names in (("disc tilt", DISC_TILT), ("single pins and teeth", SINGLE)):
        units = tuple(without(unit, names) for unit in case.units)
        if units != case.units:
            yield kind, replace(case, units=units)


def random_units(
    unit: np.ndarray, columns: tuple[str, ...], generator: np.random.Generator, count: int, spread: float = 0.5
) -> np.ndarray:
    """Return units with magnitudes of ± the spread around the unit's and random phases; modification is kept."""
    units = np.repeat(unit, count, axis=0)
    for first, name in enumerate(columns):
        factor = generator.uniform(1 - spread, 1 + spread, count)
        if name.endswith(".x") or ".cos" in name:
            magnitude = np.hypot(units[:, first], units[:, first + 1]) * factor
            phase = generator.uniform(0, 2 * np.pi, count)
            units[:, first], units[:, first + 1] = magnitude * np.cos(phase), magnitude * np.sin(phase)
        elif name in ("pin.diameter", "housing.groove.radius"):
            units[:, first] *= factor
    return units


_TABLE_UNITS = 1024
"""Units at the zones of the table that the limits are set by [-]."""
_FURTHER = {LOST_MOTION: 1, TORSIONAL_STIFFNESS: -1, RADIAL_CLEARANCE: -1}
"""Outputs that may be limited beside the peak-to-peak, and the side on which."""
_FLANK, _RADIAL = (1.0, 5.0), (5.0, 20.0)  # µm


def random_rv20e(generator: np.random.Generator) -> Reducer:
    """Return a reducer of 2–4 cranks and 1–3 discs, as large as an RV-20E to a factor of two, of other stiffness.

    Its pins, teeth and gears are those of the printed RV-20E drawn larger or smaller, so that no tooth is undercut.
    """
    printed, size = load_reducer("rv20e_liu2020"), 2 ** generator.uniform(-0.5, 1)
    springs = ("sun_support", "gear_mesh", "crank_disc_bearing", "crank_carrier_bearing", "carrier_bearing")
    stage = printed.cycloid_stage
    lengths = ("pin_circle_radius", "pin_radius", "eccentricity", "face_width", "disc_spacing")
    return replace(
        printed,
        crank_count=int(generator.integers(2, 5)),
        disc_count=int(generator.integers(1, 4)),
        first_stage=replace(printed.first_stage, module=size * printed.first_stage.module),
        cycloid_stage=replace(stage, **{name: size * getattr(stage, name) for name in lengths}),
        stiffness=replace(
            printed.stiffness,
            **{name: getattr(printed.stiffness, name) * 2 ** generator.uniform(-1, 1) for name in springs},
        ),
    )


def random_sources(generator: np.random.Generator, reducer: Reducer) -> tuple[Source, ...]:
    """Return the sources of the shipped table for as many cranks and discs, at other zones, ranges, costs, groups."""
    shipped = {own.name: own for own in load_tolerance_table("rv20e_table4", "generic")}
    found, of_group = dict[str, Source](), dict[str, tuple[float, bool, bool]]()
    for own in shipped.values():
        for crank in range(1, reducer.crank_count + 1) if re.search(r"(crank|bore|planet)1", own.name) else (0,):
            for disc in range(1, reducer.disc_count + 1) if re.search(r"(disc|journal)1", own.name) else (0,):
                name = re.sub(r"(crank|bore|planet)1", rf"\g<1>{crank}", own.name)
                name = re.sub(r"(disc|journal)1", rf"\g<1>{disc}", name)
                found[name] = replace(own, name=name)
    kept = {}
    for name, own in found.items():
        if any(int(at) > reducer.crank_count for at in re.findall(r"(?:crank|bore|planet)(\d)", name)):
            continue
        if any(int(at) > reducer.disc_count for at in re.findall(r"(?:disc|journal)(\d)", name)):
            continue
        # What belongs together is scaled, locked and split alike, so that its members keep a range in common.
        factor, locked, alone = of_group.setdefault(
            own.group, (2 ** generator.uniform(-1, 1), generator.random() < 0.1, generator.random() < 0.25)
        )
        kept[name] = replace(
            own,
            zone=own.zone * factor,
            minimum=own.zone * factor * generator.uniform(0.1, 0.25),
            maximum=own.zone * factor * generator.uniform(1.8, 4.0),
            cost=own.cost * 2 ** generator.uniform(-1, 1),
            locked=own.locked or locked,
            group=name if alone and not own.locked else own.group,
        )
    return tuple(kept.values())


def random_processes(
    generator: np.random.Generator, sources: tuple[Source, ...]
) -> dict[str, list[tuple[str, float, float, float, float]]]:
    """Return a rough and a fine way of making the features of some groups: A + B/t over half the zone [mm]."""
    chosen = {own.group: generator.random() < 0.4 for own in sources if not own.locked and own.zone > 0}
    costs = {}
    for own in sources:
        if not chosen.get(own.group, False) or own.locked:
            continue
        half, low, high = (size / 2 / MILLIMETRE for size in (own.zone, own.minimum, own.maximum))
        costs[own.name] = [
            ("rough", 0.0, own.cost * half, 0.6 * half, high),
            ("fine", 0.5 * own.cost, 0.7 * own.cost * half, low, 1.2 * half),
        ]
    return costs


def random_study(number: int) -> ta.Study:
    """Return the study of a number: a reducer of 2–4 cranks and 1–3 discs, its table, one to four limits.

    Notes
    -----
    The stiffness is a printed one, so no preload is limited; the limits lie around what the table keeps, and half of
    the studies ask for grades.
    """
    generator = np.random.default_rng([20260, number])
    reducer = random_rv20e(generator)
    modification = Modification.from_clearances(
        generator.uniform(1.5, 3) * MICROMETRE, generator.uniform(8, 15) * MICROMETRE, reducer.cycloid_stage
    )
    name = f"random reducer {number}"
    choice = ReducerChoice(
        reducer=replace(reducer, name=name, modification=modification),
        ranges=(None, _FLANK, _RADIAL),
    )
    sources = random_sources(generator, reducer)
    costs = random_processes(generator, sources) if generator.random() < 0.5 else ""
    drawing = Drawing(name=name, errors=ErrorModel(sources), costs=costs)
    return ta.Study(
        choice,
        drawing,
        limits=_limits(generator, choice, drawing),
        questions=[ta.Allocation(grades=bool(generator.random() < 0.5), fixed_first=False, what_if=False, front=False)],
        name=f"random-{number}",
        seed=number + 1,
    )


def _limits(generator: np.random.Generator, choice: ReducerChoice, drawing: Drawing) -> dict[str, ta.Limit]:
    """Return one to four limits, each a little inside or outside what the table keeps."""
    further = generator.choice(list(_FURTHER), int(generator.integers(0, 4)), replace=False)
    outputs, errors = (PEAK_TO_PEAK, *(str(own) for own in further)), drawing.errors
    uniform = generator.random((_TABLE_UNITS, len(errors.columns)))
    response = choice.bound(errors, "random study").reading(outputs)
    found = response(errors.deviations(errors.standard_values(uniform), errors.zones))
    limits = {}
    for output, values in zip(outputs, found.values[found.good].T, strict=True):
        side, target = _FURTHER.get(output, 1), float(generator.choice([0.95, 0.98, 0.99]))
        end = float(np.quantile(values, target if side > 0 else 1 - target))
        # The peak-to-peak is what zones are for; the others only reach inside the table now and then.
        inside = generator.uniform(0.75, 1.3) if output == PEAK_TO_PEAK else generator.uniform(0.97, 1.2)
        limit = end * inside if side > 0 else end - (inside - 1) * abs(end)
        limit = float(f"{limit:.4g}")
        show = ta.AtYield(target=target)
        limits[output] = ta.Limit(upper=limit, show=show) if side > 0 else ta.Limit(lower=limit, show=show)
    return limits


def random_plan(seed: int) -> AssemblyPlan:
    """Return a tree of three to six parts that are turned, weighted and measured as it comes, also between parts."""
    generator = np.random.default_rng(seed)
    names = [f"KC{number}" for number in range(1, int(generator.integers(4, 8)))]
    parts = tuple(
        ChainPart(
            name=name,
            on=str(generator.choice(["KC0", *names[:at]])),
            turned=tuple(generator.uniform(-np.pi, np.pi, 3).tolist()),
        )
        for at, name in enumerate(names)
    )
    steps = []
    for at, name in enumerate(names):
        there, earlier = names[: at + 1], names[:at]
        between = [f"{name} - {generator.choice(earlier)}"] if earlier else []
        steps.append(
            AssemblyStep(
                mount=name,
                adjust=tuple(one for one in there if generator.random() < 0.7),
                effort={one: float(generator.uniform(0.5, 20)) for one in there},
                measure=(*(one for one in there if generator.random() < 0.5), *between),
            )
        )
    return AssemblyPlan(
        name=f"plan {seed}",
        source="random",
        chain=DatumFlowChain(datum="KC0", parts=parts),
        steps=tuple(steps),
        tolerances=generator.uniform(5, 60, (len(names), 3)) * ARCSECOND,
        state_weight=float(generator.uniform(0.5, 20)),
        weights=generator.uniform(0.2, 3, len(names)),
        measurement_noise=2 * ARCSECOND,
        adjustment_noise=1 * ARCSECOND,
    )


QUICK = 20


def seeds(count: int, quick: int = QUICK) -> list[object]:
    """Return the seeds 0 … count − 1, those from ``quick`` on marked slow."""
    return [seed if seed < quick else pytest.param(seed, marks=pytest.mark.slow) for seed in range(count)]

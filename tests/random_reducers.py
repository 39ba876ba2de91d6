"""Random reducers and units around the sizes of RV reducers, for tests."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tolalloc.reducers.equivalent.model import EquivalentModel
from tolalloc.reducers.reducer.design import Clearances, CycloidStage, FirstStage, Load, Modification, Reducer
from tolalloc.reducers.reducer.stiffness import Material, Stiffness

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

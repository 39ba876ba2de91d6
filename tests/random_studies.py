"""Random reducers with random tolerance tables and limits, for the quality of allocations; the same ones for ever."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

import tolalloc as ta
from tolalloc.drawings.drawing import Drawing
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reading.units import MICROMETRE, MILLIMETRE
from tolalloc.reducers import LOST_MOTION, PEAK_TO_PEAK, RADIAL_CLEARANCE, TORSIONAL_STIFFNESS
from tolalloc.reducers.choice import ReducerChoice
from tolalloc.reducers.reducer.design import Modification, Reducer
from tolalloc.reducers.reducer.files import load_reducer

_TABLE_UNITS = 1024
"""Units at the zones of the table that the limits are set by [-]."""
_FURTHER = {LOST_MOTION: 1, TORSIONAL_STIFFNESS: -1, RADIAL_CLEARANCE: -1}
"""Outputs that may be limited beside the peak-to-peak, and the side on which."""
_FLANK, _RADIAL = (1.0, 5.0), (5.0, 20.0)  # µm


def random_reducer(generator: np.random.Generator) -> Reducer:
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
    shipped = {own.name: own for own in load_tolerance_table("rv20e_baseline", "generic")}
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
    reducer = random_reducer(generator)
    modification = Modification.from_clearances(
        generator.uniform(1.5, 3) * MICROMETRE, generator.uniform(8, 15) * MICROMETRE, reducer.cycloid_stage
    )
    name = f"random reducer {number}"
    choice = ReducerChoice(
        reducer=replace(reducer, name=name, modification=modification),
        flank_clearance=_FLANK,
        radial_clearance=_RADIAL,
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

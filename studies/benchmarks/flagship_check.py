"""The drawing of the flagship study on other random reducers, by plain functions of arrays.

    python studies/benchmarks/flagship_check.py RUN [--units 20000] [--seed 20260101] [--json]

RUN is the folder of a run of ``studies/rv20e_allocation.py``. Its drawing, with the modification that it states, is
made anew with numpy's random numbers; ``tolalloc.numeric`` gives peak-to-peak, lost motion and radial clearance, also
of discs that are colder and warmer than the ring, whose teeth are shifted by α·R_p·ΔT; the model gives the rest. Beside
every limit stands the share that keeps it with its exact 95 % interval, to be held against the 99.73 % that the run
promised; beside the catalogue's figures stand the medians.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).parents[2]))

import tolalloc as ta
from tolalloc import numeric
from tolalloc.drawings.drawing import load_drawing
from tolalloc.reading.units import ARCMINUTE, ARCSECOND, MICROMETRE
from tolalloc.reducers import EFFICIENCY, PRELOAD, TORSIONAL_STIFFNESS
from tolalloc.reducers.equivalent.hysteresis import TURN_ANGLES
from tolalloc.reducers.model import ReducerModel
from tolalloc.reducers.reducer.design import THERMAL_EXPANSION, Reducer
from tolalloc.study.prepared import Prepared
from tolalloc.study.script import load_study

STUDY = Path(__file__).parents[1] / "rv20e_allocation.py"
AT_ONCE = 2_000
"""Reducers that are solved together [-]."""
FRICTION_UNITS = 1_000
"""Of them those whose efficiency is read, which takes a loop with friction [-]."""
LOST_AT = 0.03
"""Share of the rated torque at which catalogues state lost motion [-]."""


def interval(kept: int, units: int) -> tuple[float, float]:
    """Return the exact 95 % interval of a share, Clopper and Pearson's [-]."""
    low = beta.ppf(0.025, kept, units - kept + 1) if kept else 0.0
    high = beta.ppf(0.975, kept + 1, units - kept) if kept < units else 1.0
    return float(low), float(high)


def independent(reducer: Reducer, named: Mapping[str, np.ndarray | float]) -> dict[str, np.ndarray]:
    """Return what plain functions say of reducers, by the name of the output."""
    rows = numeric.deviations(reducer, named)
    torque = LOST_AT * reducer.load.rated_torque
    one, other = (
        numeric.transmission_error(reducer, rows, TURN_ANGLES.tolist(), sign * torque) for sign in (-1.0, 1.0)
    )
    return {
        ta.PEAK_TO_PEAK: np.atleast_1d(numeric.peak_to_peak(reducer, rows, reducer.load.test_torque)) / ARCSECOND,
        ta.LOST_MOTION: np.abs((one - other).mean(axis=1)) / ARCMINUTE,
        ta.RADIAL_CLEARANCE: numeric.radial_clearance(reducer, rows) / MICROMETRE,
    }


def solved(model: ReducerModel, x: np.ndarray, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return what the model reads of reducers that have an equilibrium."""
    found = model.reading(names)(x)
    return {name: found.values[found.good, at] for at, name in enumerate(names)}


def drawn(known: Prepared, model: ReducerModel, units: int, seed: int) -> dict[str, np.ndarray]:
    """Return every output of random reducers, drawn with numpy's numbers."""
    errors, reducer = known.errors, model.reducer_in_force
    generator, parts = np.random.default_rng(seed), list[dict[str, np.ndarray]]()
    for first in range(0, units, AT_ONCE):
        count = min(AT_ONCE, units - first)
        uniform = generator.random((count, len(errors.columns)))
        x = errors.deviations(errors.standard_values(uniform), errors.zones)
        named = dict(zip(errors.columns, x.T, strict=True))
        # The table's rows deviate from the amounts in force; plain functions take the amounts themselves.
        amounts = {name: amount + named.get(name, 0.0) for name, amount in reducer.modification.deviations.items()}
        part = independent(reducer, {**named, **amounts})
        for case in model.load_cases:
            shift = THERMAL_EXPANSION * reducer.cycloid_stage.pin_circle_radius * (case.disc_temperature or 0.0)
            shifted = {**amounts, "modification.shift": amounts["modification.shift"] + shift}
            part |= {ta.at(name, case): own for name, own in independent(reducer, {**named, **shifted}).items()}
            part |= solved(model, x, (ta.at(ta.FRICTION_TORQUE, case),))
        part |= solved(model, x, (ta.FRICTION_TORQUE, PRELOAD))
        if first < FRICTION_UNITS:
            part |= solved(model, x[: FRICTION_UNITS - first], (EFFICIENCY, TORSIONAL_STIFFNESS))
        parts.append(part)
    return {name: np.concatenate([part[name] for part in parts if name in part]) for name in parts[0]}


def checked(run: Path, units: int, seed: int) -> dict[str, object]:
    """Return shares kept beside what the run promised, and medians beside the catalogue."""
    study = replace(load_study(STUDY), drawing=load_drawing(run / "allocation.csv"))
    known = Prepared(study=study)
    model = known.model
    assert isinstance(model, ReducerModel)
    found = drawn(known, model, units, seed)
    limits: dict[str, object] = {}
    for requirement in known.requirements:
        values, ((sign, limit), *_) = found[requirement.output], requirement.limits.turned
        kept = int(np.sum(sign * values <= sign * limit))
        limits[requirement.output] = {
            "limit": limit,
            "kept [-]": kept / units,
            "95 % interval [-]": interval(kept, units),
            "median": float(np.median(values)),
            "99.73 % quantile": float(np.quantile(values, 0.9973 if sign > 0 else 0.0027)),
        }
    stated = model.reducer.catalogue
    return {
        "reducers [-]": units,
        "limits": limits,
        "efficiency at rated torque, median [%]": float(np.median(found[EFFICIENCY])),
        "torsional rigidity, median [N·m/arcmin]": float(np.median(found[TORSIONAL_STIFFNESS])),
        "the catalogue's rigidity [N·m/arcmin]": stated.torsional_rigidity * ARCMINUTE if stated else None,
        "the catalogue's lost motion [arcmin]": stated.lost_motion / ARCMINUTE if stated else None,
        "the catalogue's transmission error [arcsec]": stated.transmission_error / ARCSECOND if stated else None,
    }


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("run", type=Path)
    parser.add_argument("--units", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=20260101)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    found = checked(asked.run, asked.units, asked.seed)
    if asked.json:
        print(json.dumps(found, ensure_ascii=False, indent=1))
        return
    for name, value in found.items():
        if isinstance(value, dict):
            for output, figures in value.items():
                print(output, "; ".join(f"{own}: {number}" for own, number in figures.items()))
        else:
            print(f"{name}: {value}")


if __name__ == "__main__":
    main()

"""Sample measurements: what a bench would have read of random units whose crank bearings are stiffer than stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import ARCSECOND, DEGREE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import with_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.reducer.unit_file import BuiltUnit
from tolalloc.reducers.reducer.unit_table import table_text, units_text

STIFFER = "crank_disc_bearing"
FACTOR = 1.25
"""True stiffness of these bearings over that of the reducer file [-]."""
_READINGS = 144
"""Readings of a curve [-]."""
_LEVELS = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
"""Torques of a loop over the rated torque [-]."""
_NOISE = {"curve": 0.3, "loop": 0.1}
"""Standard deviation of one reading [arcsec]."""
_SIMULATED = "Simulated by tolalloc new, not measured."


def bench_files(reducer: Reducer, errors: ErrorModel, deviations: Float[np.ndarray, "unit column"]) -> dict[str, str]:
    """Return a measurement file and the tables that it names: the parts, a curve and a loop of every unit."""
    value = FACTOR * getattr(reducer.stiffness, STIFFER)
    true = with_stiffness(
        reducer, IdentifiedStiffness(source="simulated", values={STIFFER: value}, standard_uncertainty={STIFFER: 0.0})
    )
    rated, generator = float(reducer.load.rated_torque), SeedTree(1).child("bench").generator()
    kernel = bind(true, errors, -rated, "new folder")[0]
    x, model = kernel.errors(deviations), kernel.model

    def twisted(torque: float, angle: Float[np.ndarray, " angle"], kind: str) -> Float[np.ndarray, "unit angle"]:
        found = model.equilibria(x, torque, angle).transmission_error / ARCSECOND
        return np.asarray(found + _NOISE[kind] * generator.standard_normal(found.shape))

    angle = 2 * np.pi * np.arange(_READINGS) / _READINGS
    curves = twisted(-rated, angle, "curve")
    loops = np.concatenate([twisted(float(level) * rated, np.zeros(1), "loop") for level in _LEVELS], axis=1)
    files = {"bench_units.csv": _parts(errors, deviations)}
    for unit, (curve, loop) in enumerate(zip(curves, loops, strict=True), start=1):
        for kind, first, along, read in (
            ("curve", "angle [deg]", angle / DEGREE, curve),
            ("loop", "torque [N·m]", _LEVELS * rated, loop),
        ):
            second = {"curve": "transmission error [arcsec]", "loop": "twist [arcsec]"}[kind]
            rows = zip(along.round(6).tolist(), read.round(3).tolist(), strict=True)
            files[f"bench_{kind}{unit}.csv"] = table_text((first, second), rows, (_SIMULATED,))
    return {"bench.toml": _main(reducer, len(deviations), rated), **files}


def _parts(errors: ErrorModel, deviations: Float[np.ndarray, "unit column"]) -> str:
    """Return the errors of the parts, a row per unit."""
    columns = errors.columns
    units = [
        BuiltUnit(name=str(unit), source="simulated", deviations=dict(zip(columns, map(float, row), strict=True)))
        for unit, row in enumerate(deviations, start=1)
    ]
    rounded = [replace(own, deviations={name: round(v, 9) for name, v in own.deviations.items()}) for own in units]
    return units_text(rounded, "bench_units.csv", (_SIMULATED,))


def _main(reducer: Reducer, units: int, rated: float) -> str:
    """Return the measurement file."""
    lines = [
        f"# {_SIMULATED} The truth: {STIFFER} is {FACTOR:g} times what the reducer file says.",
        f'name = "{units} simulated units of {reducer.name}"',
        'source = "simulated on the equivalent model"',
        'units = "bench_units.csv"',
        'neglected = ["*"] # what the table leaves out is taken as exact',
        'assumptions = ["units and readings are simulated"]',
    ]
    for unit in range(1, units + 1):
        noise = {kind: f"noise_arcsec = {value:g}" for kind, value in _NOISE.items()}
        lines += ["", "[[curves]]", f'unit = "{unit}"', f'file = "bench_curve{unit}.csv"']
        lines += [f"torque_nm = {-rated:g}", noise["curve"]]
        lines += ["", "[[loops]]", f'unit = "{unit}"', f'file = "bench_loop{unit}.csv"', "carrier_angle_deg = 0"]
        lines += [noise["loop"]]
    return "\n".join(lines) + "\n"

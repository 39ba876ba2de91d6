"""Measured units of a new reducer, simulated: curves and loops of a bench, one bad unit, gauge readings of a lot."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.families.known import family_of
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import with_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.unit_file import BuiltUnit, table_text, units_text
from tolalloc.study.sample import SIMULATED, NewReducer, Sample
from tolalloc.wings.bench.lots import drawn_lot

FACTOR = 1.6
"""True stiffness of these bearings over that of the reducer file [-]."""
_READINGS = 144
"""Readings of a curve [-]."""
_LEVELS = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
"""Torques of a loop over the rated torque [-]."""
_READING_NOISE = {"curve": 0.3, "loop": 0.1}
"""Standard deviation of one reading [arcsec]."""
_ANGLES, _UNITS, _LOT = 720, 2, 25
_THICK = 1.3
"""Deviation that all pins of the lot have in common, over the σ that fills the zone at Cp 1 [-]."""
_NOISE = 0.5
"""Standard deviation of a simulated reading [arcsec]."""
_BAD, _OTHERS = 6 * MICROMETRE, 0.2
"""Wave of order 2 of the housing's pitch in the bad unit [m]; its other errors over random ones [-]."""
_CURVE = "# Simulated: a unit whose pitch of the housing is bad.\nangle [deg],transmission error [arcsec]\n"


def bench_files(new: NewReducer) -> dict[str, str]:
    """Return a measurement file and the tables that it names: the parts, a curve and a loop of every unit."""
    reducer, errors, deviations = new.reducer, new.errors, new.units(_UNITS)
    stiffer = family_of(reducer).new.stiffer
    value = FACTOR * getattr(reducer.stiffness, stiffer)
    true = with_stiffness(
        reducer, IdentifiedStiffness(source="simulated", values={stiffer: value}, standard_uncertainty={stiffer: 0.0})
    )
    rated, generator = float(reducer.load.rated_torque), SeedTree(1).child("bench").generator()
    kernel = bind(true, errors, -rated, "new folder")[0]
    x, model = kernel.errors(deviations), kernel.model

    def twisted(torque: float, angle: Float[np.ndarray, " angle"], kind: str) -> Float[np.ndarray, "unit angle"]:
        found = model.equilibria(x, torque, angle).transmission_error / ARCSECOND
        return np.asarray(found + _READING_NOISE[kind] * generator.standard_normal(found.shape))

    angle = 2 * np.pi * np.arange(_READINGS) / _READINGS
    curves = twisted(-rated, angle, "curve")
    loops = np.concatenate([twisted(float(level) * rated, np.zeros(1), "loop") for level in _LEVELS], axis=1)
    built = deviations + [true.modification.deviations.get(column, 0.0) for column in errors.columns]
    files = {"bench_units.csv": _parts(errors, built)}
    for unit, (curve, loop) in enumerate(zip(curves, loops, strict=True), start=1):
        for kind, heads, along, read in (
            ("curve", ("angle [deg]", "transmission error [arcsec]"), angle / DEGREE, curve),
            ("loop", ("torque [N·m]", "twist [arcsec]"), _LEVELS * rated, loop),
        ):
            rows = zip(along.round(6).tolist(), read.round(3).tolist(), strict=True)
            files[f"bench_{kind}{unit}.csv"] = table_text(heads, rows, (SIMULATED,))
    return {"bench.toml": _main(reducer, len(deviations), rated), **files}


def _parts(errors: ErrorModel, deviations: Float[np.ndarray, "unit column"]) -> str:
    """Return the errors of the parts, a row per unit; amounts of modification are whole ones, as in a unit file."""
    units = [
        BuiltUnit(name=str(unit), source="simulated", deviations=dict(zip(errors.columns, row, strict=True)))
        for unit, row in enumerate(deviations.round(9).tolist(), start=1)
    ]
    return units_text(units, "bench_units.csv", (SIMULATED,))


def _main(reducer: Reducer, units: int, rated: float) -> str:
    """Return the measurement file."""
    lines = [
        f"# {SIMULATED} The truth: {family_of(reducer).new.stiffer} is {FACTOR:g} times what the reducer file says.",
        f'name = "{units} simulated units of {reducer.name}"',
        'source = "simulated on the equivalent model"',
        'units = "bench_units.csv"',
        'neglected = ["*"] # what the table leaves out is taken as exact',
        'assumptions = ["units and readings are simulated"]',
    ]
    for unit in range(1, units + 1):
        noise = {kind: f"noise_arcsec = {value:g}" for kind, value in _READING_NOISE.items()}
        lines += ["", "[[curves]]", f'unit = "{unit}"', f'file = "bench_curve{unit}.csv"']
        lines += [f"torque_nm = {-rated:g}", noise["curve"]]
        lines += ["", "[[loops]]", f'unit = "{unit}"', f'file = "bench_loop{unit}.csv"', "carrier_angle_deg = 0"]
        lines += [noise["loop"]]
    return "\n".join(lines) + "\n"


def curve_files(new: NewReducer) -> dict[str, str]:
    """Return the transmission error of a unit whose housing has a bad pitch, for ``tolalloc diagnose``."""
    x = _OTHERS * new.units(1)
    x[0, new.errors.columns.index("housing.pitch.cos2")] = _BAD
    angle, kernel = 2 * np.pi * np.arange(_ANGLES) / _ANGLES, new.kernel
    found = kernel.model.equilibria(kernel.errors(x), kernel.torque, angle).transmission_error[0] / ARCSECOND
    read = found + _NOISE * SeedTree(1).child("readings").generator().standard_normal(_ANGLES)
    rows = (f"{at:.1f},{value:.3f}\n" for at, value in zip(angle / DEGREE, read, strict=True))
    return {"unit7.csv": _CURVE + "".join(rows)}


def lot_files(new: NewReducer) -> dict[str, str]:
    """Return gauge readings of a lot whose pins are all too thick, for ``tolalloc lot``."""
    sources = [own for own in new.errors.active if own.each == 1 and not own.systematic]
    columns = drawn_lot(sources, _LOT, SeedTree(1).child("lot").generator())
    read = np.array([own.values for own in columns])
    at = [own.name for own in sources].index("pin.diameter")
    read[at] += _THICK * sources[at].zone / 6
    rows = [[unit, *row] for unit, row in enumerate((read.T / MICROMETRE).round(3).tolist(), start=1)]
    return {"lot.csv": table_text(("unit", *(own.header for own in columns)), rows, (SIMULATED,))}


SAMPLES = {
    "bench": Sample(
        files={"bench.toml": "curves and loops of two units, simulated; its tables are `bench_….csv`"},
        make=bench_files,
        command="tolalloc identify bench.toml --reducer reducer.toml",
    ),
    "curve": Sample(
        files={"unit7.csv": "the curve of a bad unit, simulated"},
        make=curve_files,
        command="tolalloc diagnose unit7.csv --reducer reducer.toml --tolerances zones.csv",
    ),
    "lot": Sample(
        files={"lot.csv": "gauge readings of a lot of 25 units, simulated"},
        make=lot_files,
        command="tolalloc lot lot.csv zones.csv",
    ),
}

"""Samples of what the other commands read, simulated with a new reducer or invented, and said to be so."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.files import DATA as CHAINS
from tolalloc.assembly.places import places_of
from tolalloc.bench.lots import drawn_lot
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.drawings.table_file import DATA as TABLES
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.families.known import SOURCES, family_of
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import with_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reducers.response.kernel import KernelResponse
from tolalloc.reducers.unit_file import BuiltUnit, table_text, units_text

_WAYS = (("jig bored", "bored", "jig ground"), ("ground", "turned", "ground twice"), ("ground", "turned", "lapped"))
"""Of each pattern of sources that is priced, the processes of today, for wide zones alone, and for narrow ones."""
_HEADER = (
    "# Invented ways to make the features: replace them by your own. A row without a factor is today's process, with\n"
    "# the cost of the tolerance table at its zone. min and max are cut to those of the table.\n"
    "sources,process,model,fixed [cost units],factor [cost units µm^n],min [µm],max [µm],change [cost units],"
    "inspection [cost units],note"
)


def process_files(sources: Sequence[Source], priced: Sequence[str]) -> dict[str, str]:
    """Return a process capability library and a process cost table, by file name, that prices patterns of sources."""
    rows = [_HEADER]
    for pattern, (today, wide, narrow) in zip(priced, _WAYS, strict=True):
        like = [own for own in sources if fnmatchcase(own.name, pattern)]
        zone = max(own.zone for own in like) / MICROMETRE
        product = max(own.cost * own.zone for own in like) / MICROMETRE
        rows += [
            f"{pattern},{today},reciprocal,,,,,0,0,assumed: today's process",
            f"{pattern},{wide},reciprocal,0.2,{0.4 * product:.3g},{1.15 * zone:.3g},,0.2,0,"
            "assumed: a cheaper machine that holds wide zones only",
            f"{pattern},{narrow},reciprocal,0.8,{0.3 * product:.3g},,{0.75 * zone:.3g},0.3,0.05,"
            "assumed: a second operation that pays for narrow zones; every part measured",
        ]
    library = (TABLES / "generic.processes.csv").read_text(encoding="utf-8")
    return {"processes.csv": library, "process_costs.csv": "\n".join(rows) + "\n"}


FACTOR = 1.6
"""True stiffness of these bearings over that of the reducer file [-]."""
_READINGS = 144
"""Readings of a curve [-]."""
_LEVELS = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])
"""Torques of a loop over the rated torque [-]."""
_READING_NOISE = {"curve": 0.3, "loop": 0.1}
"""Standard deviation of one reading [arcsec]."""
_SIMULATED = "Simulated by tolalloc new, not measured."


def bench_files(reducer: Reducer, errors: ErrorModel, deviations: Float[np.ndarray, "unit column"]) -> dict[str, str]:
    """Return a measurement file and the tables that it names: the parts, a curve and a loop of every unit."""
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
        for kind, first, along, read in (
            ("curve", "angle [deg]", angle / DEGREE, curve),
            ("loop", "torque [N·m]", _LEVELS * rated, loop),
        ):
            second = {"curve": "transmission error [arcsec]", "loop": "twist [arcsec]"}[kind]
            rows = zip(along.round(6).tolist(), read.round(3).tolist(), strict=True)
            files[f"bench_{kind}{unit}.csv"] = table_text((first, second), rows, (_SIMULATED,))
    return {"bench.toml": _main(reducer, len(deviations), rated), **files}


def _parts(errors: ErrorModel, deviations: Float[np.ndarray, "unit column"]) -> str:
    """Return the errors of the parts, a row per unit; amounts of modification are whole ones, as in a unit file."""
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
        f"# {_SIMULATED} The truth: {family_of(reducer).new.stiffer} is {FACTOR:g} times what the reducer file says.",
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


_MEASURED = """# Invented: errors of the axes of one assembly's parts, each about its own x, y, z.
part,x [arcsec],y [arcsec],z [arcsec]
KC1,12,-8,5
KC2,-6,14,-9
KC3,4,10,-13
KC4,-11,-3,7
"""
_NO_REDUCER = (
    '# reducer = "reducer.toml" tells what the angles do to the transmission, '
    'where its pin_contact_law is "constant" or "table2"'
)


def assembly_files(reducer: Reducer) -> dict[str, str]:
    """Return a chain file of two cranks and two discs, and measured angles of its parts, by file name.

    The chain names no reducer: a line contact, which a new reducer has, does not say what a leaning disc does.
    """
    text = (CHAINS / "bx40e.chain.toml").read_text(encoding="utf-8")
    text = re.sub(r'^reducer = ".*"$', _NO_REDUCER, text, count=1, flags=re.MULTILINE)
    text = re.sub(r'^name = "BX40E"$', f'name = "{reducer.name}"', text, count=1, flags=re.MULTILINE)
    return {"chain.toml": text, "angles.csv": _MEASURED}


_ANGLES, _PARTS, _UNITS, _LOT = 720, 60, 2, 25
_THICK = 1.3
"""Deviation that all pins of the lot have in common, over the σ that fills the zone at Cp 1 [-]."""
_NOISE = 0.5
"""Standard deviation of a simulated reading [arcsec]."""
_BAD, _OTHERS = 6 * MICROMETRE, 0.2
"""Wave of order 2 of the housing's pitch in the bad unit [m]; its other errors over random ones [-]."""
_SHOP = """# Invented prices, for trying: replace them by what your shop quotes.
process,tolerance,unit,cost
pin turned,40,µm,4
pin turned,20,µm,5.5
pin turned,10,µm,9
pin turned,6,µm,13.5
pin ground,10,µm,11
pin ground,6,µm,12.5
pin ground,3,µm,18
pin ground,2,µm,25
"""
_CYCLE = (("start", 1.2, 10, 10), ("constant", 0.6, 20, 30), ("stop", -0.8, 10, 10), ("hold", 0.3, 1, 50))
"""Load cases of a joint: name, torque over the rated one that resists [-], speed [rpm], share of the time [%]."""
_CYCLE_HEADS = ("case", "torque [N·m]", "speed [rpm]", "share [%]")
_CURVE = "# Simulated: a unit whose pitch of the housing is bad.\nangle [deg],transmission error [arcsec]\n"


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Simulated files of one reducer."""

    # The reducer and its tolerance table
    reducer: Reducer
    sources: tuple[Source, ...]

    @property
    def makers(self) -> dict[str, Callable[[], dict[str, str]]]:
        """Kind of sample → what makes its files, by name."""
        return {
            "costs": lambda: {"shop.csv": self.shop},
            "processes": lambda: process_files(self.sources, family_of(self.reducer).new.priced),
            "cmm": lambda: {"pin_diameters.csv": self.measured_pins},
            "bench": lambda: bench_files(self.reducer, self._errors, self._units(_UNITS)),
            "cycle": lambda: {"cycle.csv": self.cycle},
            "curve": lambda: {"unit7.csv": self.curve},
            "lot": lambda: {"lot.csv": self.lot},
            "parts": lambda: {"parts.csv": self.parts},
            "assembly": lambda: assembly_files(self.reducer),
        }

    @cached_property
    def _errors(self) -> ErrorModel:
        return ErrorModel(self.sources)

    @cached_property
    def _kernel(self) -> KernelResponse:
        return bind(self.reducer, self._errors, None, "new folder")[0]

    def _units(self, units: int) -> Float[np.ndarray, "unit column"]:
        """Return the deviations of random units [m, angles rad]."""
        uniform = next(SeedTree(1).child("samples").uniform_chunks(units, len(self._errors.columns)))
        return self._errors.deviations(self._errors.standard_values(uniform), self._errors.zones)

    @property
    def shop(self) -> str:
        """Prices that a shop quoted for zones of a pin, for ``tolalloc costs``."""
        return _SHOP

    @property
    def measured_pins(self) -> str:
        """Diameters of made pins, for the column ``measured`` of the tolerance table."""
        source = next(own for own in self.sources if own.name == "pin.diameter")
        drawn = SeedTree(1).child("pins").generator().normal(0.1, 0.8, _PARTS) * source.zone / 6 / MICROMETRE
        return "deviation [µm]\n" + "".join(f"{value:.2f}\n" for value in drawn)

    @property
    def curve(self) -> str:
        """Transmission error of a unit whose housing has a bad pitch, for ``tolalloc diagnose``."""
        x = _OTHERS * self._units(1)
        x[0, self._errors.columns.index("housing.pitch.cos2")] = _BAD
        angle = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
        kernel = self._kernel
        found = kernel.model.equilibria(kernel.errors(x), kernel.torque, angle).transmission_error[0] / ARCSECOND
        read = found + _NOISE * SeedTree(1).child("readings").generator().standard_normal(_ANGLES)
        return _CURVE + "".join(f"{at:.1f},{value:.3f}\n" for at, value in zip(angle / DEGREE, read, strict=True))

    @property
    def cycle(self) -> str:
        """Load cases of a robot's joint, for ``tolalloc duty``."""
        rated = self.reducer.load.rated_torque
        rows = [(name, float(f"{-share * rated:.4g}"), *rest) for name, share, *rest in _CYCLE]
        return table_text(_CYCLE_HEADS, rows, ("Invented, for trying: replace it by your own.",))

    @property
    def lot(self) -> str:
        """Gauge readings of a lot whose pins are all too thick, for ``tolalloc lot``."""
        sources = [own for own in self._errors.active if own.each == 1 and not own.systematic]
        columns = drawn_lot(sources, _LOT, SeedTree(1).child("lot").generator())
        read = np.array([own.values for own in columns])
        at = [own.name for own in sources].index("pin.diameter")
        read[at] += _THICK * sources[at].zone / 6
        rows = [[unit, *row] for unit, row in enumerate((read.T / MICROMETRE).round(3).tolist(), start=1)]
        return table_text(("unit", *(own.header for own in columns)), rows, (_SIMULATED,))

    @property
    def parts(self) -> str:
        """Measured parts of two units, for ``tolalloc mount``."""
        rows = ["# Simulated: the parts of two units, drawn inside the tolerance table.", "part,kind,error,value,unit"]
        kinds = {place.kind for place in places_of(self.reducer)}
        for unit, x in enumerate(self._units(_UNITS), start=1):
            for name, value in zip(self._errors.columns, x, strict=True):
                part, error = _part_and_error(name)
                if part:
                    kind = part if part in kinds else part.rstrip("0123456789")
                    rows.append(f"{part}-{unit},{kind},{error},{value / MICROMETRE:.2f},µm")
        return "\n".join(rows) + "\n"


def _part_and_error(column: str) -> tuple[str, str]:
    """Return which measured part of a unit a column belongs to and what the parts table calls it; none of others."""
    kind = SOURCES.of_column(column)
    if kind.first_stage or not kind.place:
        return "", ""
    if kind.fixed:
        return "housing", column
    part, _, error = column.partition(".")
    return part, error

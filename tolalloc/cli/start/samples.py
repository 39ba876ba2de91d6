"""Samples of what the other commands read, simulated with the new reducer and its table, and said to be so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.mounting.places import places_of
from tolalloc.cli.start.assembly_files import assembly_files
from tolalloc.cli.start.bench_files import bench_files
from tolalloc.cli.start.process_files import process_files
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.choice import bind
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.response.kernel import KernelResponse

_ANGLES, _PARTS, _UNITS = 720, 60, 2
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
_CURVE = "# Simulated: a unit whose pitch of the housing is bad.\nangle [deg],transmission error [arcsec]\n"


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Simulated files of one reducer.

    Parameters
    ----------
    reducer, sources
        The reducer and its tolerance table.
    """

    reducer: Reducer
    sources: tuple[Source, ...]

    @property
    def makers(self) -> dict[str, Callable[[], dict[str, str]]]:
        """Kind of sample → what makes its files, by name."""
        return {
            "costs": lambda: {"shop.csv": self.shop},
            "processes": lambda: process_files(self.sources),
            "cmm": lambda: {"pin_diameters.csv": self.measured_pins},
            "bench": lambda: bench_files(self.reducer, self._errors, self._units(_UNITS)),
            "curve": lambda: {"unit7.csv": self.curve},
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
    part, _, rest = column.partition(".")
    if column == "pin.diameter" or column.startswith("carrier.assembly"):
        return "housing", column
    return (part, rest) if part.rstrip("0123456789") in ("housing", "carrier", "crank", "disc") else ("", "")

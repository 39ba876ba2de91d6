"""Process capability libraries: what a process does to a feature, so that tolerance tables need only name it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from tolalloc.drawings.distributions import Distribution, require_shape
from tolalloc.drawings.table_file import DATA, read_rows
from tolalloc.drawings.zones import Feature
from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.files import Record, shipped_or_path

_UNITS = {"Cp": "-", "shift": "half zone", "shape": "-"}
"""Field → unit that its header may state."""

CLOSED_FORMS = tuple(kind for kind in Distribution if kind not in (Distribution.MIXTURE, Distribution.EMPIRICAL))


class ProcessCapability(Record):
    """One row: a process and a feature; the fields are the column headers without their unit."""

    process: Annotated[str, Field(min_length=1)]
    feature: Feature
    Cp: Annotated[float, Field(ge=0.1, le=10)]
    shift: Annotated[float, Field(ge=-1, le=1)] = 0.0
    distribution: Distribution = Distribution.NORMAL
    shape: float | None = None
    sorted: bool = False
    note: Annotated[str, Field(min_length=1)]

    @model_validator(mode="after")
    def _distribution_makes_sense(self) -> ProcessCapability:
        if self.distribution not in CLOSED_FORMS:
            raise ValueError(
                f"distribution {self.distribution.value} belongs to single sources; allowed is one of "
                + ", ".join(CLOSED_FORMS)
            )
        if self.feature is not Feature.SIZE and self.shift != 0:
            raise ValueError(f"shift must be 0 for feature {self.feature.value}: {self.shift:g}")
        require_shape(self.distribution, self.shape)
        return self

    @property
    def cells(self) -> dict[str, object]:
        """What a row of a tolerance table takes from it."""
        return self.model_dump(include={"Cp", "shift", "distribution", "shape", "sorted"})


ProcessCapabilities = Mapping[tuple[str, Feature], ProcessCapability]
"""Process and feature → capability."""


def load_process_capabilities(name: str | Path) -> ProcessCapabilities:
    """Return a process capability library by shipped name or from the user's CSV file.

    Raises
    ------
    InputError, UnknownNameError
        The file, row, field and value that are not allowed.
    """
    path = shipped_or_path(name, DATA, ".processes.csv", "process capability library")
    found: dict[tuple[str, Feature], ProcessCapability] = {}
    for place, capability in read_rows(path, ProcessCapability, "process", _UNITS):
        key = capability.process, capability.feature
        if key in found:
            raise InputError(
                f"{place}: process is {key[0]!r} for feature {key[1].value} for the second time; each has one row."
            )
        found[key] = capability
    return found


def with_process(cells: Mapping[str, object], capabilities: ProcessCapabilities, place: str) -> dict[str, object]:
    """Return the cells of a row of a tolerance table, completed by the capability of the process that it names.

    Raises
    ------
    UnknownNameError
        The library has no such process for the row's feature, and the row does not state Cp either.

    Notes
    -----
    A process may be known to a process cost table alone. Its row states Cp, so nothing has to be looked up.
    """
    process, feature = cells.get("process"), cells.get("feature", Feature.SIZE)
    if process is None:
        return dict(cells)
    capability = capabilities.get((str(process), Feature(str(feature))))
    if capability is None:
        if "Cp" in cells:
            return dict(cells)
        known = [name for name, kind in capabilities if kind == feature]
        raise UnknownNameError.among(place, f"Cp is empty, and process for feature {feature}", str(process), known)
    taken = capability.cells
    if cells.get("distribution", capability.distribution) is not capability.distribution:
        del taken["shape"]  # it belongs to the library's distribution
    return {**taken, **cells}

"""The shipped tolerance tables, which are those of an RV-20E with two cranks, for a reducer of three."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.sources import Source
from tolalloc.drawings.tolerance_table import load_tolerance_table
from tolalloc.reducers.equivalent.model import EquivalentModel

FIRST_STAGE = ("sun.", "planet", "mesh")
STANDING = ("housing.", "each_pin.", "carrier.assembly", "carrier.tilt", "sun.assembly")
"""What stands still in the housing; a source that begins like none of these turns with the sun, a disc or the carrier.
The pins' common diameter and the common radius of their grooves are the same all round and count as neither."""


def table_of_three_cranks(name: str, pins: int = 40) -> dict[str, Source]:
    """Return the sources of a shipped table by name; those of the third crank are like the first one's."""
    found = {source.name: source for source in load_tolerance_table(name, "generic")}
    for source in tuple(found.values()):
        if source.each > 1:
            found[source.name] = replace(source, each=pins if source.name.startswith("each_pin.") else pins - 1)
        for first in ("bore1", "crank1", "planet1", "mesh1"):
            if first in source.name:
                third = source.name.replace(first, first[:-1] + "3")
                found[third] = replace(source, name=third)
    return found


def drawn_units(errors: ErrorModel, model: EquivalentModel, units: int, scale: float = 1.0) -> np.ndarray:
    """Return the columns of random units at the reducer's modification, all zones scaled alike [m, angles rad]."""
    uniform = np.random.default_rng(20260101).uniform(size=(units, len(errors.columns)))
    found = np.zeros((units, len(model.columns)))
    found[:, [model.columns.index(name) for name in errors.columns]] = errors.deviations(
        errors.standard_values(uniform), scale * errors.zones
    )
    for name, amount in model.reducer.modification.deviations.items():
        found[:, model.columns.index(name)] = amount
    return found


def only(units: np.ndarray, model: EquivalentModel, *beginnings: str, without: bool = False) -> np.ndarray:
    """Return the units with the errors alone whose names begin like these, or without them; the modification stays."""
    chosen = np.array([name.startswith(beginnings) is not without for name in model.columns])
    modification = np.array([name.startswith("modification.") for name in model.columns])
    return np.asarray(np.where(chosen | modification, units, 0.0))

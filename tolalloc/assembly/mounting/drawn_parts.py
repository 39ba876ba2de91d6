"""Random measured parts inside their drawings, for studies of what choosing them is worth."""

from __future__ import annotations

import numpy as np

from tolalloc.assembly.mounting.columns import owned_columns, unmounted
from tolalloc.assembly.mounting.parts import MeasuredPart
from tolalloc.assembly.mounting.places import places_of
from tolalloc.drawing.error_model import ErrorModel
from tolalloc.drawing.seeds import SeedTree
from tolalloc.rv.reducer.design import Reducer


def drawn_parts(errors: ErrorModel, reducer: Reducer, units: int, seeds: SeedTree) -> tuple[MeasuredPart, ...]:
    """Return the parts of random units; as they come, they make these units again.

    Parameters
    ----------
    errors
        The sources; what they do not list is exact.
    reducer
        Nominal design.
    units
        Number of units [-].
    seeds
        Node of the seed tree.

    Notes
    -----
    A part keeps the zones of the place that it is drawn for, where the drawings of like parts differ. A kind of part
    without any error is left out.
    """
    uniform = np.concatenate(list(seeds.uniform_chunks(units, len(errors.columns))))
    rows = errors.deviations(errors.standard_values(uniform), errors.zones)
    parts = []
    for unit, row in enumerate(rows, start=1):
        deviations = {**errors.still, **dict(zip(errors.columns, map(float, row), strict=True))}
        nonzero = {column: value for column, value in deviations.items() if value != 0.0}
        for place in places_of(reducer):
            if owned_columns(errors.columns, (place,)):
                own = unmounted(nonzero, place, place.turns[0])
                parts.append(MeasuredPart(name=f"{place.name} of unit {unit}", kind=place.kind, errors=own))
    return tuple(parts)

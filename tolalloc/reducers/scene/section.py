"""The reducer in a ranking's report: one unit moving, its places coloured by what the sources there drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.exceptions import SolveError
from tolalloc.reducers.scene.places import is_placed
from tolalloc.reducers.scene.scene import PER_CRANK_TURN, Scene, scene_of
from tolalloc.reports.document import Section
from tolalloc.reports.picture.moving import MovingPicture, strongest

if TYPE_CHECKING:
    from tolalloc.reducers.model import ReducerModel

_COARSE = 8
"""Angles per turn of the cranks in a report, which stays small [-]."""


def scene_at(
    model: ReducerModel,
    x: Float[np.ndarray, " column"],
    unit: str,
    sources: tuple[str, ...],
    per_crank_turn: int = PER_CRANK_TURN,
) -> Scene:
    """Return the scene of one unit's deviations [m, angles rad], with so many angles per turn of the cranks [-].

    Raises
    ------
    SolveError
        An angle without equilibrium.
    """
    kernel, placed = model.kernel, tuple(filter(is_placed, sources))
    errors = kernel.errors(x[np.newaxis])[0]
    return scene_of(kernel.model, errors, kernel.torque, unit=unit, sources=placed, per_crank_turn=per_crank_turn)


def moving(
    model: ReducerModel, errors: ErrorModel, x: Float[np.ndarray, " column"], shares: Mapping[str, float], unit: str
) -> tuple[Section, ...]:
    """Return the section with the moving picture of one unit [m, angles rad], coloured by its sources' shares [-].

    A unit that has no equilibrium at some angle has no picture.
    """
    named = tuple(source.name for source in errors.sources)
    elsewhere = ", ".join(name for name in named if not is_placed(name))
    try:
        scene = scene_at(model, x, unit, named, per_crank_turn=_COARSE)
    except SolveError:
        return ()
    return (
        Section(
            heading="The reducer",
            paragraphs=(
                f"The {unit} in true proportion, errors and gaps drawn larger. The stronger a place is coloured, the "
                "more the sources that sit there drive together, over the place that drives most. Point at a place to "
                "see its sources, and at a source in a table to see its place.",
                *((f"The picture has no place for {elsewhere}.",) if elsewhere else ()),
            ),
            figures=(
                MovingPicture(
                    name="reducer",
                    title=f"{model.name}, {unit}",
                    record=scene.record(coarse=True),
                    shares=strongest(shares, scene.place_by_source),
                ),
            ),
        ),
    )

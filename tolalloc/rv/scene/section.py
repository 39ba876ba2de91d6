"""The reducer in a ranking's report: one unit moving, its places coloured by what the sources there drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.report.document import Section
from tolalloc.report.picture.moving import MovingPicture, strongest
from tolalloc.rv.scene.scene import scene_of

if TYPE_CHECKING:
    from tolalloc.rv.model import ReducerModel


def moving(
    model: ReducerModel, errors: ErrorModel, x: Float[np.ndarray, " column"], shares: Mapping[str, float], unit: str
) -> tuple[Section, ...]:
    """Return the section with the moving picture of one unit [m, angles rad], coloured by its sources' shares [-]."""
    kernel = model.kernel
    sources = tuple(source.name for source in errors.sources)
    scene = scene_of(
        kernel.model, kernel.errors(x[np.newaxis])[0], kernel.torque, unit=unit, sources=sources, per_crank_turn=8
    )
    return (
        Section(
            heading="The reducer",
            paragraphs=(
                f"The {unit} in true proportion, errors and gaps drawn larger. The stronger a place is coloured, the "
                "more the sources that sit there drive together, over the place that drives most. Point at a place to "
                "see its sources, and at a source in a table to see its place.",
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

"""What a check of a study says of a reducer: its nominal clearances, and how many random units are jammed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.rv.equivalent.preload import preload
from tolalloc.units import ARCMINUTE, MICROMETRE

if TYPE_CHECKING:
    from tolalloc.rv.model import ReducerModel


def examined(model: ReducerModel, x: Float[np.ndarray, "sample column"]) -> tuple[str, ...]:
    """Return nominal clearances, how many random units are jammed, and what is said of the catalogue.

    Parameters
    ----------
    model
        The reducer.
    x
        Deviations of the random units [m, angles rad].
    """
    stage, (flank, radial) = model.reducer.cycloid_stage, model.present_clearances
    found, rated = preload(model.kernel.model, model.kernel.errors(x)), model.rated_pin_force
    solved = found.status == 0
    if not solved.any():
        return (f"None of {len(x)} random units has an equilibrium without torque.", *model.remarks)
    jammed, median = found.pin_force[solved] > rated, np.median(found.pin_force[solved])
    unsolved = "" if solved.all() else f" ({(~solved).sum()} have no equilibrium)"
    return (
        f"Nominal clearance {flank:.3g} µm on the flank and {radial:.3g} µm at tip and root, which leave "
        f"{2 * flank * MICROMETRE / stage.disc_pitch_radius / ARCMINUTE:.2g}′ of free rotation.",
        f"Of {len(x)} random units {jammed.mean():.1%} are jammed{unsolved}: without torque their pins press with "
        f"more than the {rated:.0f} N of the rated torque; half of all press with {median:.2g} N or more.",
        *model.remarks,
        *model.cautions(np.array(model.present_clearances)),
    )

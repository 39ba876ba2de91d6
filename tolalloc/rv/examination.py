"""What a check of a study says of a reducer: its clearances, how many random units are jammed, and what frees them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.guarantee import USUAL_YIELD
from tolalloc.models import Examination
from tolalloc.rv import PRELOAD
from tolalloc.rv.equivalent.preload import preload
from tolalloc.units import ARCMINUTE, MICROMETRE

if TYPE_CHECKING:
    from tolalloc.rv.model import ReducerModel


def examined(model: ReducerModel, x: Float[np.ndarray, "sample column"]) -> Examination:
    """Return sizes that differ, clearances, how many random units are jammed, and what is said of the catalogue.

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
        none = f"None of {len(x)} random units has an equilibrium without torque."
        return Examination(
            (*model.mismatches, none, *model.remarks), f"none of its units has an equilibrium: {_advice(model)}"
        )
    jammed, median = found.pin_force[solved] > rated, np.median(found.pin_force[solved])
    unsolved = "" if solved.all() else f" ({(~solved).sum()} have no equilibrium)"
    sentences = (
        *model.mismatches,
        f"Nominal clearance {flank:.3g} µm on the flank and {radial:.3g} µm at tip and root, which leave "
        f"{2 * flank * MICROMETRE / stage.disc_pitch_radius / ARCMINUTE:.2g}′ of free rotation.",
        f"Of {len(x)} random units {jammed.mean():.1%} are jammed{unsolved}: without torque their pins press with "
        f"more than the {rated:.0f} N of the rated torque; half of all press with {median:.2g} N or more.",
        *model.remarks,
        *model.cautions(np.array(model.present_clearances)),
    )
    # Where the model has no limit of its own for them, its stiffnesses are too large for the share to mean anything.
    matters = PRELOAD in model.own_limits and jammed.mean() > 1 - USUAL_YIELD
    return Examination(sentences, f"{jammed.mean():.1%} of its units are jammed: {_advice(model)}" if matters else "")


def _advice(model: ReducerModel) -> str:
    """Return what frees jammed units, as the end of a sentence."""
    flank, _ = model.present_clearances
    freely = (
        "flank_clearance of ta.reducer(...) lets the allocation open it, at present from "
        f"{model.flank[0] / MICROMETRE:.3g} to {model.flank[1] / MICROMETRE:.3g} µm"
        if model.flank
        else "flank_clearance=(smallest, largest) of ta.reducer(...) would let the allocation open it"
    )
    return (
        f"a tooth modification that leaves more than the present {flank:.3g} µm on the flank frees them; "
        f"`tolalloc modify` proposes one, and {freely}"
    )

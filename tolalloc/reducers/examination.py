"""What a check of a study says of a reducer: clearances, how many random units are preloaded, and what frees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.requirement import USUAL_YIELD
from tolalloc.models.model import Examination
from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers import PRELOAD, RADIAL_CLEARANCE
from tolalloc.reducers.equivalent.preload import preload

if TYPE_CHECKING:
    from tolalloc.reducers.model import ReducerModel


def examined(model: ReducerModel, x: Float[np.ndarray, "sample column"]) -> Examination:
    """Return sizes that differ, clearances, how many random units are preloaded, and what is said of the catalogue.

    Parameters
    ----------
    model
        The reducer at the modification in force.
    x
        Deviations of the random units [m, angles rad].
    """
    stage, (flank, radial) = model.reducer.cycloid_stage, model.present_clearances
    found, rated = preload(model.kernel.model, model.kernel.errors(x)), model.rated_pin_force
    solved = found.status == 0
    if not solved.any():
        none = f"None of {len(x)} random units has an equilibrium without torque."
        but = f"none of its units has an equilibrium: {_advice(model)}"
        return Examination((*model.mismatches, none, *model.remarks), but, f"Cannot be built as drawn: {none}")
    left = model.reading((RADIAL_CLEARANCE,))(x)
    radial_left = left.values[left.good, 0]
    preloaded, median = found.pin_force[solved] > rated, np.median(found.pin_force[solved])
    unsolved = "" if solved.all() else f" ({(~solved).sum()} have no equilibrium)"
    cautions = model.cautions(np.array(model.present_clearances))
    sentences = (
        *model.mismatches,
        f"Nominal clearance {flank:.3g} µm on the flank and {radial:.3g} µm at tip and root, which leave "
        f"{2 * flank * MICROMETRE / stage.disc_pitch_radius / ARCMINUTE:.2g}′ of free rotation.",
        f"Of {len(x)} random units {preloaded.mean():.1%} are preloaded{unsolved}: without torque their pins press "
        f"with more than the {rated:.0f} N of the rated torque; half of all press with {median:.2g} N or more.",
        f"The radial clearance of a unit is {_true_minus(float(radial_left.min()))} µm at least.",
        *model.remarks,
        *cautions,
    )
    figures = {
        "share preloaded [-]": float(preloaded.mean()),
        "pin force of the rated torque [N]": rated,
        "share without radial clearance [-]": float((radial_left < 0).mean()),
        "least radial clearance [µm]": float(radial_left.min()),
    }
    reasons = _reasons(model, figures)
    if not reasons:
        return Examination(sentences, figures=figures)
    trust = " ".join(own for own in cautions if "not trust" in own)
    fault = f"Cannot be built as drawn: of {len(x):,} random reducers {' and '.join(reasons)}. {trust}".strip()
    return Examination(sentences, f"of its units {' and '.join(reasons)}: {_advice(model)}", fault, figures)


def _reasons(model: ReducerModel, figures: Mapping[str, float]) -> list[str]:
    """Return what keeps more units from being built than usually may miss a limit."""
    found, allowed = [], 1 - USUAL_YIELD
    if (share := figures["share preloaded [-]"]) > allowed:
        by = "" if PRELOAD in model.own_limits else ", by stiffnesses that no dimensions support"
        force = figures["pin force of the rated torque [N]"]
        found.append(f"{share:.1%} are preloaded (a pin presses with more than the {force:.0f} N of rated torque{by})")
    if (share := figures["share without radial clearance [-]"]) > allowed:
        least = _true_minus(figures["least radial clearance [µm]"])
        found.append(f"{share:.1%} have no radial clearance ({least} µm at worst)")
    return found


def _true_minus(number: float) -> str:
    return f"{number:.2g}".replace("-", "−")


def _advice(model: ReducerModel) -> str:
    """Return what frees preloaded units, as the end of a sentence."""
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

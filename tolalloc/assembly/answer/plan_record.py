"""Everything that was asked of an assembly, so that its answer can be traced; units in the names."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.assembly.steps import AssemblyStep, adjustable, efforts
from tolalloc.units import ARCSECOND, DEGREE, MILLIMETRE


def plan_record(plan: AssemblyPlan) -> dict[str, Any]:
    """Return the whole plan."""
    required = plan.requirements
    return {
        "name": plan.name,
        "source": plan.source,
        "reducer": plan.reducer or None,
        "datum": plan.chain.datum,
        "precision [-]": plan.precision,
        "measurement noise, σ [arcsec]": plain(plan.measurement_noise, ARCSECOND),
        "adjustment noise, σ [arcsec]": plain(plan.adjustment_noise, ARCSECOND),
        "parts": [_part(plan, at) for at in range(len(plan.chain.parts))],
        "steps": [_step(plan, number, step) for number, step in enumerate(plan.steps, start=1)],
        "tolerances": None if required is None else _tolerances(required),
        "assumptions": list(plan.assumptions),
    }


def plain(values: float | Float[np.ndarray, "*shape"], unit: float = 1.0) -> Any:
    """Return numbers in a unit for JSON, without digits that mean nothing; what is infinite is not stated.

    Parameters
    ----------
    values
        The numbers [SI].
    unit
        The unit [SI].
    """
    found = np.round(np.asarray(values) / unit, 6) + 0.0
    stated = np.asarray(found, dtype=object)
    stated[~np.isfinite(found)] = None
    return stated.tolist()


def _part(plan: AssemblyPlan, at: int) -> dict[str, Any]:
    part, required = plan.chain.parts[at], plan.requirements
    return {
        "part": part.name,
        "on": part.on,
        "turned [deg]": plain(np.array(part.turned), DEGREE),
        "position [mm]": plain(np.array(part.position), MILLIMETRE),
        "tilts": list(part.tilts),
        "rotates": list(part.rotates),
        "tolerance, ± [arcsec]": plain(plan.tolerances[at], ARCSECOND),
        "weight [-]": plain(plan.weights[at]),
        **({} if required is None else _limits_and_costs(required, at)),
    }


def _limits_and_costs(required: AngularRequirements, at: int) -> dict[str, Any]:
    reciprocal = required.form == "reciprocal"
    unit, name = (ARCSECOND, "cost units·arcsec") if reciprocal else (1.0, "cost units")
    return {
        "tilt limit, 3σ [arcsec]": plain(required.tilt_limit[at], ARCSECOND),
        "rotation limit, 3σ [arcsec]": plain(required.rotation_limit[at], ARCSECOND),
        f"cost factor [{name}]": plain(required.factor[at], unit),
        "cost fixed [cost units]": plain(required.fixed[at]),
        **({} if reciprocal else {"cost scale [arcsec]": plain(required.scale[at], ARCSECOND)}),
    }


def _step(plan: AssemblyPlan, number: int, step: AssemblyStep) -> dict[str, Any]:
    turned = zip(plan.chain.names, adjustable(plan.chain, step), plain(efforts(plan.chain, step)), strict=True)
    return {
        "step [-]": number,
        "mount": step.mount,
        "effort of what may be turned [-]": {name: effort for name, may, effort in turned if may},
        "measure": list(step.measure),
    }


def _tolerances(required: AngularRequirements) -> dict[str, Any]:
    return {
        "smallest [arcsec]": plain(required.smallest, ARCSECOND),
        "largest [arcsec]": plain(required.largest, ARCSECOND),
        "cost form": required.form,
        "effort price [cost units/arcsec²]": plain(required.effort_price, 1 / ARCSECOND**2),
    }

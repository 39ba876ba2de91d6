"""The answer of an assembly for a program, and everything that was asked, so that it can be traced."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.assembly.answer import tables, tolerance_tables
from tolalloc.assembly.answer.tables import has_limits
from tolalloc.assembly.orientations import TransmissionEffect
from tolalloc.assembly.plan import AngularRequirements, AssemblyPlan
from tolalloc.assembly.steps import AssemblyStep, adjustable, efforts
from tolalloc.reading.units import ARCSECOND, DEGREE, MILLIMETRE

if TYPE_CHECKING:
    from tolalloc.assembly.answer.answer import AdjustedParts, AngularTolerances, AssemblyAnswer


def summary(answer: AssemblyAnswer) -> dict[str, Any]:
    """Return the whole answer."""
    plan, sweep, at = answer.plan, answer.sweep, tables.at_precision(answer)
    tolerances, made = tolerance_tables.limited_tolerances(answer), answer.tables
    return {
        "assembly": plan.name,
        "source": plan.source,
        "reducer": answer.transmission.reducer.name if answer.transmission else None,
        "precision [-]": plan.precision,
        "seed": answer.header.seed,
        "plan": plan_record(plan),
        "expected rms unadjusted [arcsec]": plain(sweep.total[0], ARCSECOND),
        "expected rms adjusted [arcsec]": plain(sweep.total[at], ARCSECOND),
        "left however large the precision [arcsec]": plain(sweep.noise_floor, ARCSECOND),
        "turning only what was just mounted, rms [arcsec]": (
            None if answer.fewer is None else plain(answer.fewer, ARCSECOND)
        ),
        "expected effort [arcsec²]": plain(sweep.effort[at], ARCSECOND**2),
        "diminished from precision [-]": sweep.diminished(),
        "measured": _measured(answer, answer.measured) if answer.measured else None,
        "steps": _records(made["steps"]),
        "characteristics": _records(made["characteristics"]),
        "sweep": _records(made["sweep"]),
        "transmission": _transmission(answer.transmission, made) if answer.transmission else None,
        "tolerances": _tolerances(answer, tolerances) if tolerances else None,
        "warnings": list(answer.warnings),
    }


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table's rows; what is not there is null, as JSON has no other word for it."""
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    return [{str(name): value for name, value in row.items()} for row in rows]


def _measured(answer: AssemblyAnswer, measured: AdjustedParts) -> dict[str, Any]:
    before, after = plain(measured.norms[[0, tables.at_precision(answer)]], ARCSECOND)
    return {
        "name": measured.name,
        f"{tables.norm_of(answer)} unadjusted [arcsec]": before,
        f"{tables.norm_of(answer)} adjusted [arcsec]": after,
        "largest difference by finite rotations [arcsec]": plain(finite_difference(measured)),
        **(
            {"smallest precision tried that keeps all limits [-]": measured.keeping and plain(measured.keeping)}
            if has_limits(answer)
            else {}
        ),
        "angles": _records(answer.tables["angles"]),
    }


def finite_difference(measured: AdjustedParts) -> float:
    """Return the largest difference that finite rotations make in an angle that nobody adjusts [arcsec]."""
    return float(np.abs(measured.exact - measured.unadjusted).max()) / ARCSECOND


def _transmission(effect: TransmissionEffect, made: dict[str, pd.DataFrame]) -> dict[str, Any]:
    return {
        "assemblies [-]": int(effect.good.size),
        "failed [-]": int((~effect.good).sum()),
        "values": _records(made["transmission"]),
        "above perfect parts": _records(made["above perfect parts"]),
        "smaller than unadjusted": _records(made.get("smaller than unadjusted", pd.DataFrame())),
    }


def _tolerances(answer: AssemblyAnswer, tolerances: AngularTolerances) -> dict[str, Any]:
    verified, unadjusted = tolerances.verification, tolerances.unadjusted
    return {
        "cost unadjusted [cost units]": None if isinstance(unadjusted, str) else plain(unadjusted.total),
        "cost adjusted [cost units]": plain(tolerances.adjusted.total),
        "lower bound adjusted [cost units]": plain(tolerances.adjusted.bound),
        "cost re-tuned [cost units]": plain(tolerances.retuned.best.total),
        "re-tuning settled": tolerances.retuned.settled,
        "best precision [-]": (
            plain(tolerances.by_precision.best.gains.precision) if tolerance_tables.is_priced(answer.plan) else None
        ),
        "verified": tolerance_tables.verified_name(answer.plan, tolerances),
        "assemblies [-]": verified.assemblies,
        "within all limits [-]": verified.share.estimate,
        "low 2.5 % [-]": verified.share.low,
        "high 97.5 % [-]": verified.share.high,
        "parts": _records(answer.tables["angular tolerances"]),
        "limits": _records(answer.tables["limits"]),
        "certificates": _records(answer.tables["certificates"]),
    }


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
        "tolerances": None if required is None else _tolerances_asked(required),
        "assumptions": list(plan.assumptions),
    }


def plain(values: float | Float[np.ndarray, "*shape"], unit: float = 1.0) -> Any:
    """Return numbers [SI] in a unit [SI] for JSON, without digits that mean nothing; what is infinite is not stated."""
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


def _tolerances_asked(required: AngularRequirements) -> dict[str, Any]:
    return {
        "smallest [arcsec]": plain(required.smallest, ARCSECOND),
        "largest [arcsec]": plain(required.largest, ARCSECOND),
        "cost form": required.form,
        "effort price [cost units/arcsec²]": plain(required.effort_price, 1 / ARCSECOND**2),
    }

"""The answer of an assembly for a program, units in the names."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tolalloc.assembly.answer import tables, tolerance_tables
from tolalloc.assembly.answer.cautions import warnings
from tolalloc.assembly.answer.characteristics import characteristic_table, has_limits
from tolalloc.assembly.answer.plan_record import plain, plan_record
from tolalloc.assembly.answer.results import AngularTolerances, AssemblyResults, MeasuredParts, TransmissionEffect
from tolalloc.assembly.answer.transmission import difference_table, fallen_table, value_table
from tolalloc.units import ARCSECOND


def summary(results: AssemblyResults) -> dict[str, Any]:
    """Return the whole answer."""
    plan, sweep, at = results.plan, results.sweep, tables.at_precision(results)
    tolerances = tolerance_tables.limited_tolerances(results)
    return {
        "assembly": plan.name,
        "source": plan.source,
        "reducer": results.transmission.reducer.name if results.transmission else None,
        "precision [-]": plan.precision,
        "seed": results.seed,
        "plan": plan_record(plan),
        "expected rms unadjusted [arcsec]": plain(sweep.total[0], ARCSECOND),
        "expected rms adjusted [arcsec]": plain(sweep.total[at], ARCSECOND),
        "left however large the precision [arcsec]": plain(sweep.noise_floor, ARCSECOND),
        "turning only what was just mounted, rms [arcsec]": (
            None if results.fewer is None else plain(results.fewer, ARCSECOND)
        ),
        "expected effort [arcsec²]": plain(sweep.effort[at], ARCSECOND**2),
        "diminished from precision [-]": sweep.diminished(),
        "measured": _measured(results, results.measured) if results.measured else None,
        "steps": _records(tables.step_table(results)),
        "characteristics": _records(characteristic_table(results)),
        "sweep": _records(tables.sweep_table(results)),
        "transmission": _transmission(results.transmission) if results.transmission else None,
        "tolerances": _tolerances(results, tolerances) if tolerances else None,
        "warnings": list(warnings(results)),
    }


def _records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table's rows; what is not there is null, as JSON has no other word for it."""
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    return [{str(name): value for name, value in row.items()} for row in rows]


def _measured(results: AssemblyResults, measured: MeasuredParts) -> dict[str, Any]:
    before, after = plain(measured.norms[[0, tables.at_precision(results)]], ARCSECOND)
    return {
        "name": measured.name,
        f"{tables.norm_of(results)} unadjusted [arcsec]": before,
        f"{tables.norm_of(results)} adjusted [arcsec]": after,
        "largest difference by finite rotations [arcsec]": plain(finite_difference(measured)),
        **(
            {"smallest precision tried that keeps all limits [-]": measured.keeping and plain(measured.keeping)}
            if has_limits(results)
            else {}
        ),
        "angles": _records(tables.angle_table(results)),
    }


def finite_difference(measured: MeasuredParts) -> float:
    """Return the largest difference that finite rotations make in an angle that nobody adjusts [arcsec]."""
    return float(np.abs(measured.exact - measured.unadjusted).max()) / ARCSECOND


def _transmission(effect: TransmissionEffect) -> dict[str, Any]:
    return {
        "assemblies [-]": int(effect.good.size),
        "failed [-]": int((~effect.good).sum()),
        "values": _records(value_table(effect)),
        "above perfect parts": _records(difference_table(effect)),
        "smaller than unadjusted": _records(fallen_table(effect)),
    }


def _tolerances(results: AssemblyResults, tolerances: AngularTolerances) -> dict[str, Any]:
    verified, unadjusted = tolerances.verification, tolerances.unadjusted
    return {
        "cost unadjusted [cost units]": None if isinstance(unadjusted, str) else plain(unadjusted.total),
        "cost adjusted [cost units]": plain(tolerances.adjusted.total),
        "lower bound adjusted [cost units]": plain(tolerances.adjusted.bound),
        "cost re-tuned [cost units]": plain(tolerances.retuned.best.total),
        "re-tuning settled": tolerances.retuned.settled,
        "best precision [-]": (
            plain(tolerances.by_precision.best.gains.precision) if tolerance_tables.is_priced(results.plan) else None
        ),
        "verified": tolerance_tables.verified_name(results.plan, tolerances),
        "assemblies [-]": verified.assemblies,
        "within all limits [-]": verified.share.estimate,
        "low 2.5 % [-]": verified.share.low,
        "high 97.5 % [-]": verified.share.high,
        "parts": _records(tolerance_tables.tolerance_table(results.plan, tolerances)),
        "limits": _records(tolerance_tables.limit_table(results.plan, tolerances)),
        "certificates": _records(tolerance_tables.certificate_table(results.plan, tolerances)),
    }

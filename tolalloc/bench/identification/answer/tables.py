"""Tables of an identification: parameters, directions, choices of parameters, methods."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.bench.identification.answer.results import IdentificationResults
from tolalloc.bench.identification.parameters import BIAS, Parameter
from tolalloc.units import ARCSECOND

_OPEN = 10.0  # width of an interval of a logarithm beyond which it says nothing [-]


def _span(item: Parameter, low: float, high: float) -> str:
    """Return an interval of coordinates as values."""
    return f"{item.value(float(low)):.4g}…{item.value(float(high)):.4g}"


def parameters_table(results: IdentificationResults) -> pd.DataFrame:
    """Return every parameter with all its intervals."""
    rows, first_order = [], results.information.interval
    for at, (item, estimate) in enumerate(zip(results.parameters, results.estimates, strict=True)):
        rows.append(
            {
                "parameter": f"{item.symbol} [{item.unit}], {item.name.replace('_', ' ')}",
                "given": f"{item.start:.4g}",
                "bounds": f"{item.low:.4g}…{item.high:.4g}",
                "least objective at": f"{item.value(float(results.found.coordinates[at])):.4g}",
                "95 % profile": f"{estimate.interval[0]:.4g}…{estimate.interval[1]:.4g}",
                "95 % first order": _span(item, *first_order[:, at])
                if item.name == BIAS or np.ptp(first_order[:, at]) < _OPEN
                else "no limit",
                "95 % bootstrap": _span(item, *results.bootstrap.interval[:, at]) if results.bootstrap else "",
                "identified": "yes" if estimate.identified else "no",
                "on a bound": "yes" if estimate.on_bound else "no",
                "written": f"{estimate.value:.4g}",
                "standard uncertainty": f"{estimate.uncertainty:.3g} arcsec"
                if item.name == BIAS
                else f"{100 * estimate.uncertainty:.3g} %",
            }
        )
    return pd.DataFrame(rows)


def estimates_table(results: IdentificationResults) -> pd.DataFrame:
    """Return what a person reads first of every parameter."""
    return pd.DataFrame(
        [
            {
                "parameter": f"{item.parameter.symbol} [{item.parameter.unit}]",
                "given": item.parameter.start,
                "identified": item.value if item.identified else "no",
                "95 % interval": f"{item.interval[0]:.4g}…{item.interval[1]:.4g}",
            }
            for item in results.estimates
        ]
    )


def directions_table(results: IdentificationResults) -> pd.DataFrame:
    """Return the combinations that the data fix, best first."""
    rows = []
    for number, item in enumerate(results.information.directions, start=1):
        rows.append(
            {
                "direction": number,
                **{
                    symbol: round(float(share), 3) + 0.0
                    for symbol, share in zip(results.logarithms, item.loading, strict=True)
                },
                "standard error left by the data [%]": 100 * item.deviation
                if item.deviation < item.room
                else "no limit",
                "left by the bounds alone [%]": 100 * item.room,
                "fixed": "yes" if item.is_fixed else "no",
            }
        )
    return pd.DataFrame(rows)


def choices_table(results: IdentificationResults) -> pd.DataFrame:
    """Return every choice of parameters with what it leaves of units seen and not seen."""
    rows = []
    for item in results.candidates:
        row: dict[str, object] = {"fitted": item.name, "parameters [-]": len(item.parameters)}
        for kind in results.kinds:
            row[f"{kind}, rms [arcsec]"] = item.rms(results.data, kind, unseen=False) / ARCSECOND
            row[f"{kind}, units left out, rms [arcsec]"] = item.rms(results.data, kind, unseen=True) / ARCSECOND
        row["units left out, over noise [-]"] = item.score
        row["chosen"] = "yes" if results.chosen is item else ""
        rows.append(row)
    return pd.DataFrame(rows)


def short_choices_table(results: IdentificationResults) -> pd.DataFrame:
    """Return every choice of parameters with its score alone, for a narrow screen."""
    return choices_table(results)[["fitted", "units left out, over noise [-]", "chosen"]]


def methods_table(results: IdentificationResults) -> pd.DataFrame:
    """Return how every method did over its seeds."""
    least = max(min(float(item.objectives.min()) for item in results.comparison), np.finfo(float).tiny)
    near = least * (1 + 1e-4) ** 2
    rows = []
    for item in results.comparison:
        until = item.evaluations_until(near)
        off = np.sqrt(item.objectives / least) - 1
        rows.append(
            {
                "method": item.method,
                "seeds [-]": len(item.runs),
                "evaluations [-]": float(np.median([run.evaluations for run in item.runs])),
                "S above the least, median [-]": float(np.median(off)),
                "S above the least, worst [-]": float(off.max()),
                "within 1e-4 of the least [-]": float((off <= 1e-4).mean()),
                "evaluations until then, median [-]": float(np.median(until))
                if np.isfinite(np.median(until))
                else "never",
                "residual of the best on the model, over noise [-]": float(
                    np.sqrt(2 * item.on_model / results.data.measured.size)
                ),
            }
        )
    return pd.DataFrame(rows)


def units_table(results: IdentificationResults) -> pd.DataFrame:
    """Return the residual of every unit before and after."""
    data, rows = results.data, []
    for unit in data.units:
        row: dict[str, object] = {"unit": results.measurements.units[unit].name}
        for kind in results.kinds:
            chosen = np.zeros(data.measured.size, bool)
            for block in results.blocks(kind):
                chosen[block.rows] = True
            chosen &= data.unit == unit
            if not chosen.any():
                continue
            for when, prediction in (("before", results.at_start), ("after", results.at_found)):
                left = (prediction.values - data.measured)[chosen] / ARCSECOND
                value = float(left[0]) if left.size == 1 else float(np.sqrt((left**2).mean()))
                name = "model less measured" if left.size == 1 else "rms of model less measured"
                row[f"{kind}, {name}, {when} [arcsec]"] = value
        rows.append(row)
    return pd.DataFrame(rows)

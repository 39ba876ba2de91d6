"""The tables of what the limits do and of what the answer rests on, as frames with a unit in every header."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.capability.indices import Limits, capability, quantile_interval
from tolalloc.capability.monte_carlo import proportion
from tolalloc.reading.units import MICROMETRE, unit_of
from tolalloc.reports.wording import quantity

if TYPE_CHECKING:
    from tolalloc.sensitivity.answer import RankingAnswer


def capability_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return every requirement with its distribution, capability and yield."""
    rows = []
    for at, output in enumerate(answer.outputs):
        values, limits = (
            answer.sample.evaluation.values[answer.sample.evaluation.good, at],
            answer.limits.get(output),
        )
        row: dict[str, object] = {
            "requirement": quantity(output),
            "unit": unit_of(output),
            "Mean": float(values.mean()),
            "Sigma": float(values.std(ddof=1)),
            "Min": float(values.min()),
            "Max": float(values.max()),
        }
        kept = quantile_interval(values, answer.target)
        row |= {
            f"{answer.target:.2%} quantile, low 2.5 %": kept.low,
            f"{answer.target:.2%} quantile, high 97.5 %": kept.high if np.isfinite(kept.high) else "sample too small",
        }
        if limits:
            row |= _kept(answer, values, limits)
        rows.append(row)
    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def _kept(answer: RankingAnswer, values: Float[np.ndarray, " unit"], limits: Limits) -> dict[str, object]:
    """Return limits, capability and yield of one output; units without an answer count as outside."""
    units = answer.sample.evaluation.status.size
    inside = proportion(units, units - values.size + limits.outside(values))
    row: dict[str, object] = {
        "LSL": np.nan if limits.lower is None else limits.lower,
        "USL": np.nan if limits.upper is None else limits.upper,
        "Yield [%]": inside.estimate * 100,
        "Yield low 2.5 % [%]": inside.low * 100,
        "Yield high 97.5 % [%]": inside.high * 100,
        "% out [%]": (1 - inside.estimate) * 100,
        "PPM [1e-6]": (1 - inside.estimate) * 1e6,
        "OK": "yes" if inside.bound >= answer.target else "no",
    }
    if np.ptp(values) > 0:
        found = capability(values, limits)
        row |= {
            "Pp [-]": np.nan if found.pp is None else found.pp,
            "Ppk [-]": found.ppk,
            "PPM if normal [1e-6]": found.normal_ppm,
        }
    return row


def beyond_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return the share beyond the limit by every method that was asked."""
    found = answer.beyond
    return pd.DataFrame(
        [
            {
                "method": item.method,
                "probability beyond the limit [-]": item.probability,
                "standard error [-]": item.standard_error,
                "coefficient of variation [-]": item.coefficient_of_variation,
                "units solved [-]": item.calls,
                "relied on": "yes" if item is found.estimate else "no",
                "cautions": "; ".join(item.cautions),
            }
            for item in dict.fromkeys((*found.estimates, found.estimate))
        ]
    )


def stack_up_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return worst case, root-sum-square and Monte Carlo side by side."""
    sample = answer.sample
    rows = [
        ("worst case", answer.classical.worst_case, "single errors at their limits, worst phase, summed"),
        ("root-sum-square", answer.classical.root_sum_square, "the same, squared, summed, rooted, as if independent"),
        ("Monte Carlo mean", float(sample.values.mean()), "real model, all errors together"),
        (
            f"Monte Carlo {answer.target:.2%} quantile",
            sample.quantile(answer.target),
            "real model, all errors together",
        ),
    ]
    return pd.DataFrame(rows, columns=["estimate", f"{answer.spoken} [{answer.unit}]", "assumes"])


def reject_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return what the units outside have in common, the strongest source first."""
    found = answer.reject
    first, lift, excess = found.first_interval, found.lift_interval, found.excess_interval
    frame = pd.DataFrame(
        {
            "source": found.sources,
            "excess [-]": found.excess,
            "excess low 5 % [-]": excess[0],
            "excess high 95 % [-]": excess[1],
            "columns [-]": found.columns,
            "lift [-]": found.lift,
            "lift low 5 % [-]": lift[0],
            "lift high 95 % [-]": lift[1],
            "target index S1 [-]": found.first,
            "target S1 low 5 % [-]": first[0],
            "target S1 high 95 % [-]": first[1],
            "p-value of no effect [-]": found.p_value,
            "median of all [µm]": found.median / MICROMETRE,
            "median outside [µm]": found.median_outside / MICROMETRE,
        }
    )
    return frame.sort_values("excess [-]", ascending=False, kind="stable").reset_index(drop=True)


def inverse_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return how far each zone may open alone, or must close."""
    found = answer.inverse
    now = [source.zone / MICROMETRE for source in answer.errors.active if source.name in found.sources]
    frame = pd.DataFrame(
        {
            "source": found.sources,
            "zone now [µm]": now,
            "factor alone [-]": found.factor,
            "factor low 5 % [-]": found.low,
            "factor high 95 % [-]": found.high,
            "zone alone [µm]": found.zone / MICROMETRE,
            "reading": [_reading(value) for value in found.factor],
        }
    )
    return frame.sort_values("factor alone [-]", kind="stable", na_position="first").reset_index(drop=True)


def _reading(factor: float) -> str:
    """Return a factor as words."""
    if np.isnan(factor):
        return "cannot meet the limit alone, not even at zone 0"
    if np.isinf(factor):
        return "does not matter: 10 times the zone keeps the limit"
    return f"may open by {factor - 1:.0%}" if factor >= 1 else f"must close by {1 - factor:.0%}"


def measures_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return every measure of every source side by side, in the order of the total index."""
    sobol, local = answer.indices, answer.local
    effects, moments = answer.effects, answer.moments
    spread, distance = effects.mu_star_interval(0), moments.delta_interval
    columns = {
        "total index ST [-]": (sobol.sources, sobol.total),
        "bound of ST by derivatives [-]": (answer.derivatives.sources, answer.derivatives.bound),
        "bound low 5 % [-]": (answer.derivatives.sources, answer.derivatives.bound_interval[0]),
        "bound high 95 % [-]": (answer.derivatives.sources, answer.derivatives.bound_interval[1]),
        f"Morris mu* [{answer.unit}]": (effects.sources, effects.mu_star[0]),
        f"mu* low 5 % [{answer.unit}]": (effects.sources, spread[0]),
        f"mu* high 95 % [{answer.unit}]": (effects.sources, spread[1]),
        f"Morris sigma [{answer.unit}]": (effects.sources, effects.sigma[0]),
        "PAWN [-]": (moments.sources, moments.pawn),
        "delta [-]": (moments.sources, moments.delta),
        "delta low 5 % [-]": (moments.sources, distance[0]),
        "delta high 95 % [-]": (moments.sources, distance[1]),
        f"Sens at nominal [{answer.unit}/µm]": (local.sources, local.at_nominal),
        f"Sens, root mean square [{answer.unit}/µm]": (local.sources, local.root_mean_square),
        f"alone at its limit [{answer.unit}]": (answer.classical.sources, answer.classical.alone),
    }
    if answer.shapley:
        columns["Shapley effect [-]"] = (answer.shapley.sources, answer.shapley.effects[0])
    names = dict.fromkeys(sobol.sources[at] for at in sobol.order)
    names |= dict.fromkeys(name for sources, _ in columns.values() for name in sources)
    frame = pd.DataFrame({"source": list(names)})
    for header, (sources, values) in columns.items():
        by_name = dict(zip(sources, values, strict=True))
        frame[header] = [by_name.get(name, np.nan) for name in names]
    return frame


def surrogate_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return the stand-ins with their errors on units that they had not seen."""
    return pd.DataFrame(answer.choice.table)


def mapping_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return how every zone became a distribution, and where the zone comes from."""
    rows = [(source.name, source.mapping, source.note) for source in answer.errors.active]
    rows += [
        (source.name, source.mapping, "not on the drawing: not known of the model") for source in answer.model.uncertain
    ]
    return pd.DataFrame(rows, columns=["source", "zone → distribution", "note of the table"])


def measured_tables(answer: RankingAnswer) -> tuple[tuple[str, pd.DataFrame], ...]:
    """Return how the measured parts of each source were fitted, one table for all; none if no parts were measured."""
    rows = [
        {
            "source": source.name,
            "parts [-]": source.measured.fit.parts,
            "mean [µm]": source.measured.fit.mean / MICROMETRE,
            "sigma [µm]": source.measured.fit.deviation / MICROMETRE,
            "Cp [-]": source.measured.fit.cp,
            "Cpk [-]": source.measured.fit.cpk,
            "distribution": fitted.distribution.value,
            "AIC [-]": fitted.aic,
            "Kolmogorov–Smirnov distance [-]": fitted.distance,
            "best": "yes" if fitted is source.measured.fit.best else "no",
        }
        for source in answer.errors.active
        if source.measured
        for fitted in source.measured.fit.fits
    ]
    return (("measured parts", pd.DataFrame(rows)),) if rows else ()


def work_table(answer: RankingAnswer) -> pd.DataFrame:
    """Return what each stage took, and how its units ended."""
    return pd.DataFrame(
        [
            {
                "stage": name,
                "units [-]": own["units"],
                "seconds [s]": own["seconds"],
                "units per second [1/s]": own["units per second"],
            }
            for name, own in answer.header.stages.items()
        ]
    )

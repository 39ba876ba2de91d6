"""The tables of a ranking, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.report.ranking.results import RankingResults
from tolalloc.report.sobol_table import sobol_table
from tolalloc.response.kernel import PEAK_TO_PEAK
from tolalloc.sensitivity.capability import capability, quantile_interval, wilson_interval
from tolalloc.sensitivity.shapley import ShapleyEffects
from tolalloc.units import MICROMETRE


def _by_name(names: tuple[str, ...], values: Float[np.ndarray, " source"]) -> dict[str, float]:
    """Return values by the name of their source."""
    return dict(zip(names, values.tolist(), strict=True))


def ranking_table(results: RankingResults) -> pd.DataFrame:
    """Return the ranking for the peak-to-peak, with the zone and the signed local derivative beside it."""
    frame = sobol_table(results.sobol.of(PEAK_TO_PEAK))
    zones = dict(
        zip((source.name for source in results.errors.active), results.errors.zones / MICROMETRE, strict=False)
    )
    sens = _by_name(results.local.sources, results.local.at_nominal)
    return frame.assign(
        **{
            "zone [µm]": [zones.get(name, np.nan) for name in frame["source"]],
            "Sens at nominal [arcsec/µm]": [sens.get(name, np.nan) for name in frame["source"]],
        }
    )


def overall_table(results: RankingResults) -> pd.DataFrame:
    """Return one ranking over all requirements: the largest total index of each source and where it has it."""
    overall, sobol = results.sobol.overall, results.sobol
    interval, rank = overall.total_interval, overall.rank_interval
    rows = []
    for place, at in enumerate(overall.order):
        row: dict[str, object] = {
            "rank [-]": place + 1,
            "source": overall.sources[at],
            "largest ST [-]": overall.total[at],
            "low 5 % [-]": interval[0, at],
            "high 95 % [-]": interval[1, at],
            "rank low 5 % [-]": rank[0, at],
            "rank high 95 % [-]": rank[1, at],
            "drives most": overall.drives[at].split(" [")[0],
        }
        for output in results.outputs:
            if output not in sobol.constant:
                row[f"ST {output.split(' [')[0]} [-]"] = sobol.indices.total[sobol.position(output), at]
        rows.append(row)
    return pd.DataFrame(rows)


def growth_table(results: RankingResults) -> pd.DataFrame:
    """Return how the first places settled as the blocks grew."""
    names = results.sobol.sources
    return pd.DataFrame(
        [
            {
                "blocks [-]": step.blocks,
                "first places": ", ".join(names[at] for at in step.first),
                "share of the resamples with this order [%]": step.probability * 100,
            }
            for step in results.sobol.growth.history
        ]
    )


def orders_table(results: RankingResults) -> pd.DataFrame:
    """Return what each source adds to the wave of each order, alone and with others."""
    found, rows = results.orders, []
    first, total = found.first_interval, found.total_interval
    for at, order in enumerate(found.orders):
        for source in np.argsort(-found.total[at], kind="stable"):
            rows.append(
                {
                    "order of the output turn [-]": order,
                    "standard deviation of the wave [arcsec]": found.deviation[at],
                    "source": found.sources[source],
                    "share alone [-]": found.first[at, source],
                    "alone low 5 % [-]": first[at, 0, source],
                    "alone high 95 % [-]": first[at, 1, source],
                    "share with others [-]": found.total[at, source],
                    "with others low 5 % [-]": total[at, 0, source],
                    "with others high 95 % [-]": total[at, 1, source],
                }
            )
    return pd.DataFrame(rows)


def capability_table(results: RankingResults) -> pd.DataFrame:
    """Return every requirement with its distribution, capability and yield."""
    rows = []
    for at, output in enumerate(results.outputs):
        values, limits = (
            results.sample.evaluation.values[results.sample.evaluation.good, at],
            results.limits.get(output),
        )
        name, unit = output.rsplit(" [", 1)
        row: dict[str, object] = {
            "requirement": name,
            "unit": unit.rstrip("]"),
            "Mean": float(values.mean()),
            "Sigma": float(values.std(ddof=1)),
            "Min": float(values.min()),
            "Max": float(values.max()),
        }
        kept = quantile_interval(values, results.target)
        row |= {
            f"{results.target:.2%} quantile, low 95 %": kept.low,
            f"{results.target:.2%} quantile, high 95 %": kept.high if np.isfinite(kept.high) else "sample too small",
        }
        if limits:
            found = capability(values, limits)
            units = results.sample.evaluation.status.size
            inside = wilson_interval(units, values.size - found.outside)
            row |= {
                "LSL": np.nan if limits.lower is None else limits.lower,
                "USL": np.nan if limits.upper is None else limits.upper,
                "Pp [-]": np.nan if found.pp is None else found.pp,
                "Ppk [-]": found.ppk,
                "Yield [%]": inside.estimate * 100,
                "Yield low 95 % [%]": inside.low * 100,
                "Yield high 95 % [%]": inside.high * 100,
                "% out [%]": (1 - inside.estimate) * 100,
                "PPM [1e-6]": (1 - inside.estimate) * 1e6,
                "PPM if normal [1e-6]": found.normal_ppm,
                "OK": "yes" if inside.low >= results.target else "no",
            }
        rows.append(row)
    return pd.DataFrame(rows).dropna(axis="columns", how="all")


def reject_table(results: RankingResults) -> pd.DataFrame:
    """Return what the units outside have in common, the strongest source first."""
    found = results.reject
    first, lift = found.first_interval, found.lift_interval
    frame = pd.DataFrame(
        {
            "source": found.sources,
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
    return frame.sort_values("lift [-]", ascending=False, kind="stable").reset_index(drop=True)


def inverse_table(results: RankingResults) -> pd.DataFrame:
    """Return how far each zone may open alone, or must close."""
    found = results.inverse
    now = [source.zone / MICROMETRE for source in results.errors.active if source.name in found.sources]
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


def measures_table(results: RankingResults) -> pd.DataFrame:
    """Return every measure of every source side by side, in the order of the total index."""
    sobol, local = results.sobol.of(PEAK_TO_PEAK), results.local
    columns = {
        "total index ST [-]": (sobol.sources, sobol.total),
        "bound of ST by derivatives [-]": (results.derivatives.sources, results.derivatives.bound),
        "Morris mu* [arcsec]": (results.effects.sources, results.effects.mu_star[0]),
        "Morris sigma [arcsec]": (results.effects.sources, results.effects.sigma[0]),
        "PAWN [-]": (results.moments.sources, results.moments.pawn),
        "delta [-]": (results.moments.sources, results.moments.delta),
        "Sens at nominal [arcsec/µm]": (local.sources, local.at_nominal),
        "Sens, root mean square [arcsec/µm]": (local.sources, local.root_mean_square),
        "alone at its limit [arcsec]": (results.classical.sources, results.classical.alone),
    }
    if results.shapley:
        columns["Shapley effect [-]"] = (results.shapley.sources, results.shapley.effects[0])
    names = dict.fromkeys(sobol.sources[at] for at in sobol.order)
    names |= dict.fromkeys(name for sources, _ in columns.values() for name in sources)
    frame = pd.DataFrame({"source": list(names)})
    for header, (sources, values) in columns.items():
        by_name = _by_name(tuple(sources), np.asarray(values))
        frame[header] = [by_name.get(name, np.nan) for name in names]
    return frame


def shapley_table(found: ShapleyEffects) -> pd.DataFrame:
    """Return the Shapley effects on the peak-to-peak, the largest first."""
    interval, rank = found.interval(0), found.rank_interval(0)
    order = np.argsort(-found.effects[0], kind="stable")
    return pd.DataFrame(
        {
            "source": [found.sources[at] for at in order],
            "Shapley effect [-]": found.effects[0][order],
            "low 5 % [-]": interval[0][order],
            "high 95 % [-]": interval[1][order],
            "rank low 5 % [-]": rank[0][order],
            "rank high 95 % [-]": rank[1][order],
        }
    )


def beyond_table(results: RankingResults) -> pd.DataFrame:
    """Return the share beyond the limit by every method that was asked."""
    found = results.beyond
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
            for item in found.estimates
        ]
    )


def surrogate_table(results: RankingResults) -> pd.DataFrame:
    """Return the stand-ins with their errors on units that they had not seen."""
    return pd.DataFrame(results.choice.table)


def stack_up_table(results: RankingResults) -> pd.DataFrame:
    """Return worst case, root-sum-square and Monte Carlo side by side."""
    sample = results.sample
    rows = [
        ("worst case", results.classical.worst_case, "single errors at their limits, worst phase, summed"),
        ("root-sum-square", results.classical.root_sum_square, "the same, squared, summed, rooted"),
        ("Monte Carlo mean", float(sample.values.mean()), "real model, all errors together"),
        (
            f"Monte Carlo {results.target:.2%} quantile",
            sample.quantile(results.target),
            "real model, all errors together",
        ),
    ]
    return pd.DataFrame(rows, columns=["estimate", "peak-to-peak [arcsec]", "assumes"])


def mapping_table(results: RankingResults) -> pd.DataFrame:
    """Return how every zone became a distribution, and where the zone comes from."""
    rows = [(source.name, source.mapping, source.note) for source in results.errors.active]
    return pd.DataFrame(rows, columns=["source", "zone → distribution", "note of the table"])


def work_table(results: RankingResults) -> pd.DataFrame:
    """Return what each stage took, and how its units ended."""
    return pd.DataFrame(
        [
            {
                "stage": name,
                "units [-]": own["units"],
                "seconds [s]": own["seconds"],
                "units per second [1/s]": own["units per second"],
            }
            for name, own in results.stages.items()
        ]
    )

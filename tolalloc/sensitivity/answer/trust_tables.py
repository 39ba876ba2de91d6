"""The tables of what the answer rests on, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.rv.response.kernel import PEAK_TO_PEAK
from tolalloc.sensitivity.answer.results import RankingResults
from tolalloc.units import MICROMETRE


def measures_table(results: RankingResults) -> pd.DataFrame:
    """Return every measure of every source side by side, in the order of the total index."""
    sobol, local = results.sobol.of(PEAK_TO_PEAK), results.local
    effects, moments = results.effects, results.moments
    spread, distance = effects.mu_star_interval(0), moments.delta_interval
    columns = {
        "total index ST [-]": (sobol.sources, sobol.total),
        "bound of ST by derivatives [-]": (results.derivatives.sources, results.derivatives.bound),
        "bound low 5 % [-]": (results.derivatives.sources, results.derivatives.bound_interval[0]),
        "bound high 95 % [-]": (results.derivatives.sources, results.derivatives.bound_interval[1]),
        "Morris mu* [arcsec]": (effects.sources, effects.mu_star[0]),
        "mu* low 5 % [arcsec]": (effects.sources, spread[0]),
        "mu* high 95 % [arcsec]": (effects.sources, spread[1]),
        "Morris sigma [arcsec]": (effects.sources, effects.sigma[0]),
        "PAWN [-]": (moments.sources, moments.pawn),
        "delta [-]": (moments.sources, moments.delta),
        "delta low 5 % [-]": (moments.sources, distance[0]),
        "delta high 95 % [-]": (moments.sources, distance[1]),
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
        by_name = dict(zip(sources, values, strict=True))
        frame[header] = [by_name.get(name, np.nan) for name in names]
    return frame


def surrogate_table(results: RankingResults) -> pd.DataFrame:
    """Return the stand-ins with their errors on units that they had not seen."""
    return pd.DataFrame(results.choice.table)


def mapping_table(results: RankingResults) -> pd.DataFrame:
    """Return how every zone became a distribution, and where the zone comes from."""
    rows = [(source.name, source.mapping, source.note) for source in results.errors.active]
    return pd.DataFrame(rows, columns=["source", "zone → distribution", "note of the table"])


def measured_tables(results: RankingResults) -> tuple[tuple[str, pd.DataFrame], ...]:
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
        for source in results.errors.active
        if source.measured
        for fitted in source.measured.fit.fits
    ]
    return (("measured parts", pd.DataFrame(rows)),) if rows else ()


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

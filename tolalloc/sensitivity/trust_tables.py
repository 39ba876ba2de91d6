"""The tables of what the answer rests on, as frames with a unit in every header."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tolalloc.sensitivity.answer import RankingAnswer
from tolalloc.units import MICROMETRE


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

"""What a measured curve tells of the parts of its unit: answer, tables, pictures and summary of one report."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from tolalloc.bench.diagnosis.answer.results import DiagnosisResults
from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure, Series
from tolalloc.units import ARCSECOND, DEGREE, MICROMETRE


def source_table(results: DiagnosisResults) -> pd.DataFrame:
    """Return what the gauge of every source would show, the likeliest to dominate first."""
    found = results.diagnosis
    zones = np.array([source.zone for source in results.errors.active])
    low, high = found.reading_interval / MICROMETRE
    frame = pd.DataFrame(
        {
            "source": found.sources,
            "P(dominant) [%]": found.dominant_probability * 100,
            "named": ["yes" if name in found.named else "no" for name in found.sources],
            "reading [µm]": found.reading_mean / MICROMETRE,
            "low 2.5 % [µm]": low,
            "high 97.5 % [µm]": high,
            "zone [µm]": zones / MICROMETRE,
        }
    )
    order = np.lexsort((-np.abs(found.reading_mean) / zones, -found.dominant_probability))
    return frame.iloc[order].reset_index(drop=True)


def column_table(results: DiagnosisResults) -> pd.DataFrame:
    """Return every column with its interval, and how much of what the drawing left open the curve has closed."""
    found = results.diagnosis
    levers = [source.lever for source in results.errors.active for _ in source.columns]
    scale = np.array(levers) / MICROMETRE
    low, high = found.column_interval * scale
    return pd.DataFrame(
        {
            "column": found.columns,
            "mean [µm]": found.column_mean * scale,
            "low 2.5 % [µm]": low,
            "high 97.5 % [µm]": high,
        }
    )


def group_table(results: DiagnosisResults) -> pd.DataFrame:
    """Return the columns that the curve does not tell apart, with the combination that it knows."""
    rows = [
        {
            "group [-]": number,
            "column": column,
            "spread alone over the drawing's [-]": alone,
            "weight in the known sum [-]": weight,
            "known sum over the drawing's spread [-]": group.value,
            "its spread over the drawing's [-]": group.together,
        }
        for number, group in enumerate(results.diagnosis.groups, start=1)
        for column, alone, weight in zip(group.columns, group.alone, group.combination, strict=True)
    ]
    return pd.DataFrame(rows)


def answer(results: DiagnosisResults) -> tuple[str, ...]:
    """Return the diagnosis in sentences."""
    found, fit = results.diagnosis, results.diagnosis.fit
    peak_to_peak = np.ptp(results.curve.transmission_error) / ARCSECOND
    measured = f"The curve of {results.name} has {peak_to_peak:.1f}″ between its highest and lowest reading"
    if not fit.explained:
        return (
            f"{measured}. No errors inside these drawings explain it: mean sum of squared residuals "
            f"{fit.chi_square:.0f} where {fit.freedom} are expected. The unit has an error that is not in the "
            "tolerance table, the bench counts its angle differently, or the noise is larger than stated.",
        )
    table = source_table(results)
    named = table[table["named"] == "yes"]
    likely = ", ".join(
        f"{name} ({share:.0f} %)" for name, share in zip(named["source"], named["P(dominant) [%]"], strict=True)
    )
    first = named.iloc[0]
    sentences = [
        f"{measured}. The source that drives it is with {results.level:.0%} probability among: {likely}.",
        f"{first['source']}: its gauge would show {first['reading [µm]']:.2g} µm (95 % interval "
        f"{first['low 2.5 % [µm]']:.2g}…{first['high 97.5 % [µm]']:.2g} µm), the drawing allows "
        f"{first['zone [µm]']:.3g} µm.",
    ]
    if found.twins:
        pairs = "; ".join(f"{one} and {other}" for one, other in found.twins)
        sentences.append(
            "The reducer turned by half a turn is the same reducer, so no curve tells these apart: " + pairs + "."
        )
    sentences += [
        f"Not told apart by this curve: {', '.join(sources)}."
        for sources in dict.fromkeys(group.sources for group in found.groups)
    ]
    return tuple(sentences)


def warnings(results: DiagnosisResults) -> tuple[str, ...]:
    """Return what a reader must know before opening the unit."""
    found = []
    if not results.diagnosis.fit.explained:
        found.append("Not explained: readings of the sources are of the least bad errors and mean nothing.")
    failed = sum(count for outcome, count in results.statuses.items() if outcome != "equilibrium found")
    if failed:
        found.append(f"{failed} curves have no equilibrium and were left out.")
    return (*found, *(f"Repaired: {repair}." for repair in results.curve.repairs))


def assumptions(results: DiagnosisResults) -> tuple[str, ...]:
    """Return what no source states."""
    noise = results.noise
    return (
        *results.reducer.assumptions,
        f"a reading errs by {noise.reading / ARCSECOND:.2g}″ (standard deviation), independently of the others",
        f"the model leaves out {noise.discrepancy / ARCSECOND:.2g}″ (standard deviation), alike over "
        f"{noise.correlation_angle / DEGREE:.2g}° of the carrier",
        "before the curve is read, the parts are distributed as the tolerance table says",
        "the bench's angle counts from the model's zero; its offset in transmission error is unknown",
        *(
            (f"not in the tolerance table and taken as exact: {', '.join(results.neglected)}",)
            if results.neglected
            else ()
        ),
    )


def summary(results: DiagnosisResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    found = results.diagnosis
    return {
        "unit": results.name,
        "reducer": results.reducer.name,
        "torque [N·m]": results.torque,
        "seed": results.seed,
        "explained": found.fit.explained,
        "mean sum of squared residuals [-]": found.fit.chi_square,
        "expected [-]": found.fit.freedom,
        "named": list(found.named),
        "level [-]": results.level,
        "sources": source_table(results).to_dict("records"),
        "twins": [list(pair) for pair in found.twins],
        "not told apart": [list(group.sources) for group in found.groups],
        "curves solved [-]": found.evaluations,
        "curves failed [-]": found.failed,
        "warnings": list(warnings(results)),
    }


def _dominant_figure(results: DiagnosisResults) -> Figure:
    frame = source_table(results)
    return Figure(
        name="dominant",
        title="Which source drives this unit",
        x_label="probability of being the dominant source [%]",
        y_label="",
        series=(Series(label="probability", kind="bars", x=list(frame["source"]), y=list(frame["P(dominant) [%]"])),),
    )


def _reading_figure(results: DiagnosisResults) -> Figure:
    frame = source_table(results)
    share = frame[["reading [µm]", "low 2.5 % [µm]", "high 97.5 % [µm]"]].div(frame["zone [µm]"], axis=0)
    mean, low, high = (list(share[column]) for column in share.columns)
    return Figure(
        name="readings",
        title="What the gauges would show, over the drawing's zone",
        x_label="reading over zone [-]",
        y_label="",
        series=(
            Series(label="mean and 95 % interval", kind="bars", x=list(frame["source"]), y=mean, low=low, high=high),
        ),
        vertical=((1.0, "zone"),),
    )


def _curve_figures(results: DiagnosisResults) -> tuple[Figure, Figure]:
    fit = results.diagnosis.fit
    angle = list(fit.carrier_angle / DEGREE)
    measured, fitted = (list(values / ARCSECOND) for values in (fit.measured, fit.fitted))
    low, high = (list(edge / ARCSECOND) for edge in fit.band)
    left = list((fit.measured - fit.fitted) / ARCSECOND)
    axis = "carrier angle [°]"
    return (
        Figure(
            name="curve",
            title="Measured curve, and those of the errors that it allows",
            x_label=axis,
            y_label="transmission error [arcsec]",
            series=(
                Series(label="measured", kind="points", x=angle, y=measured),
                Series(label="model, mean and 95 % band", kind="line", x=angle, y=fitted, low=low, high=high),
            ),
        ),
        Figure(
            name="left",
            title="Measured less model",
            x_label=axis,
            y_label="transmission error [arcsec]",
            series=(Series(label="measured less model", kind="line", x=angle, y=left),),
            horizontal=((0.0, ""),),
        ),
    )


def diagnosis_document(results: DiagnosisResults) -> Document:
    """Return the report."""
    groups = group_table(results)
    return Document(
        title=f"Diagnosis of {results.name}",
        subtitle=f"{results.reducer.name}, {results.torque:g} N·m on the carrier, {len(results.errors.active)} sources",
        answer=answer(results),
        warnings=warnings(results),
        sections=(
            Section(
                heading="Which source drives it",
                paragraphs=("The dominant source is the one without which this unit's peak-to-peak would fall most.",),
                figures=(_dominant_figure(results),),
                tables=(("sources", source_table(results)),),
            ),
            Section(heading="What the gauges would show", figures=(_reading_figure(results),)),
            Section(
                heading="What the curve does not tell apart",
                tables=(("groups", groups),) if len(groups) else (),
                paragraphs=() if len(groups) else ("Nothing beyond what the answer says.",),
            ),
            Section(heading="The curve", figures=_curve_figures(results)),
            Section(heading="Columns of the model", tables=(("columns", column_table(results)),)),
        ),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )

"""How the two modification amounts were chosen: tables, figures and report of every algorithm over its seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.report.document import Document, Section
from tolalloc.report.figure import Figure, Series
from tolalloc.rv.cycloid.assessment import Assessment
from tolalloc.rv.modification.problem import ModificationProblem
from tolalloc.rv.modification.result import REACHED, SearchResult, Spread
from tolalloc.rv.teeth import contact_tables
from tolalloc.rv.teeth.contact import contact_sections
from tolalloc.units import ARCMINUTE, MICROMETRE


@dataclass(frozen=True, kw_only=True)
class ModificationResults:
    """A finished choice.

    Parameters
    ----------
    method
        Whose method it is.
    problem
        What was minimised, and what had to be kept.
    reference
        The sure optimum.
    spreads
        Answers of each algorithm from many seeds.
    polished
        Share of each algorithm's seeds that reach the optimum when polished [-].
    assessment
        What the optimum does on the reducer.
    seed
        First seed of each algorithm [-].
    warnings, assumptions
        What the method itself must warn of, and what its source does not print.
    """

    method: str
    problem: ModificationProblem
    reference: SearchResult
    spreads: tuple[Spread, ...]
    polished: tuple[float, ...]
    assessment: Assessment
    seed: int
    warnings: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()


_NONE = 1e-11  # clearance that counts as none [m]


def _ends(lengths: Float[np.ndarray, " seed"]) -> tuple[float, float]:
    """Return the smallest and the largest of lengths [µm]."""
    return float(lengths.min() / MICROMETRE), float(lengths.max() / MICROMETRE)


def algorithms_table(results: ModificationResults) -> pd.DataFrame:
    """Return what each algorithm found, over all its seeds."""
    best = results.reference
    rows: list[dict[str, object]] = [
        {
            "algorithm": best.algorithm,
            "seeds [-]": 1,
            "reached it [-]": 1.0,
            "polished [-]": 1.0,
            "Δr_rp [µm]": f"{best.amounts[0] / MICROMETRE:.6g}",
            "Δr_p [µm]": f"{best.amounts[1] / MICROMETRE:.6g}",
            "objective [µm]": f"{best.objective / MICROMETRE:.6g}",
            "evaluations [-]": best.evaluations,
        }
    ]
    for spread, polished in zip(results.spreads, results.polished, strict=True):
        objectives = np.array([result.objective for result in spread.results])
        rows.append(
            {
                "algorithm": spread.results[0].algorithm,
                "seeds [-]": len(spread.results),
                "reached it [-]": spread.share,
                "polished [-]": polished,
                "Δr_rp [µm]": contact_tables.span(*_ends(spread.amounts[:, 0])),
                "Δr_p [µm]": contact_tables.span(*_ends(spread.amounts[:, 1])),
                "objective [µm]": contact_tables.span(*_ends(objectives)),
                "evaluations [-]": int(np.median([result.evaluations for result in spread.results])),
            }
        )
    return pd.DataFrame(rows)


def delivered_table(results: ModificationResults) -> pd.DataFrame:
    """Return what was asked for beside what the exact distances show."""
    found, problem = results.assessment.exact_clearance, results.problem
    lowest = float(found.after.min())
    return pd.DataFrame(
        [
            (
                "radial clearance at tip and root [µm]",
                f"{problem.radial_clearance / MICROMETRE:g} or more",
                found.radial,
            ),
            ("smallest clearance after the first contact [µm]", "0", lowest if abs(lowest) > _NONE else 0.0),
        ],
        columns=["quantity", "asked", "delivered, exact distances"],
    ).assign(**{"delivered, exact distances": lambda frame: frame["delivered, exact distances"] / MICROMETRE})


def convergence_figure(results: ModificationResults) -> Figure:
    """Draw how far each algorithm is from the optimum after so many evaluations: median and quartiles of the seeds."""
    most = max(result.evaluations for spread in results.spreads for result in spread.results)
    at = np.unique(np.geomspace(10, most, 160).astype(int))
    floor = 1e-7  # below that, the objective in micrometres is the optimum for any purpose
    series = []
    for spread in results.spreads:
        band = np.maximum((spread.band(at) - results.reference.objective) / MICROMETRE, floor)
        known = np.isfinite(band).all(axis=0) & (at <= max(result.evaluations for result in spread.results))
        series.append(
            Series(
                label=spread.results[0].algorithm,
                kind="line",
                x=[float(value) for value in at[known]],
                y=list(band[1, known]),
                low=list(band[0, known]),
                high=list(band[2, known]),
            )
        )
    seeds = len(results.spreads[0].results)
    return Figure(
        name="convergence",
        title=f"Distance from the optimum: median and quartiles of {seeds} seeds",
        x_label="evaluations [-]",
        y_label="objective above the optimum [µm]",
        series=tuple(series),
        logarithmic=True,
    )


def answer(results: ModificationResults) -> tuple[str, ...]:
    """Return the answer in sentences."""
    best, problem = results.reference, results.problem
    equidistant, shift = best.amounts / MICROMETRE
    return (
        f"Equidistant amount {equidistant:.4f} µm, shift amount {shift:.4f} µm (pin radius and pin circle radius plus "
        f"these at grinding): the least {problem.description}, {best.objective / MICROMETRE:.6g} µm.",
        f"In a reducer file: [modification] equidistant_um = {equidistant:.4f}, shift_um = {shift:.4f}.",
        *contact_tables.answer(results.assessment),
    )


def summary(results: ModificationResults) -> dict[str, Any]:
    """Return the whole answer for a program, units in the names."""
    best = results.reference
    return {
        "method": results.method,
        "objective": results.problem.description,
        "equidistant amount [µm]": best.amounts[0] / MICROMETRE,
        "shift amount [µm]": best.amounts[1] / MICROMETRE,
        "objective [µm]": best.objective / MICROMETRE,
        "status": best.status,
        "violation [µm]": best.violation / MICROMETRE,
        "backlash [arcmin]": results.assessment.clearance.backlash / ARCMINUTE,
        "algorithms": [
            {
                "algorithm": spread.results[0].algorithm,
                "reached the reference [-]": spread.share,
                "reached it when polished [-]": polished,
                "seeds": [result.seed for result in spread.results],
                "equidistant amounts [µm]": [float(value) / MICROMETRE for value in spread.amounts[:, 0]],
                "shift amounts [µm]": [float(value) / MICROMETRE for value in spread.amounts[:, 1]],
                "objectives [µm]": [result.objective / MICROMETRE for result in spread.results],
                "evaluations [-]": [result.evaluations for result in spread.results],
            }
            for spread, polished in zip(results.spreads, results.polished, strict=True)
        ],
        "contact": contact_tables.summary(results.assessment),
        "warnings": [*results.warnings, *results.assessment.warnings],
        "assumptions": list(results.assumptions),
    }


def choice_section(results: ModificationResults) -> Section:
    """Return the section that shows how the amounts were found."""
    return Section(
        heading="How the amounts were found",
        paragraphs=(
            f"Objective: {results.problem.description}. A seed has reached the reference if both amounts are within "
            f"{REACHED / MICROMETRE:g} µm of its amounts; polished is the share that does after a local search "
            "from where it ended.",
        ),
        figures=(convergence_figure(results),),
        tables=(("algorithms", algorithms_table(results)), ("delivered", delivered_table(results))),
    )


def modification_document(results: ModificationResults, *more: Section) -> Document:
    """Return the report of one choice; further sections follow the choice."""
    found = results.assessment
    return Document(
        title=f"{found.reducer.name}: tooth modification by {results.method}",
        subtitle=f"{results.problem.name}; contact at {found.torque:g} N·m on the carrier; first seed {results.seed}.",
        answer=answer(results),
        warnings=(*results.warnings, *found.warnings),
        sections=(choice_section(results), *more, *contact_sections(found)),
        assumptions=(*results.assumptions, *found.assumptions),
        summary=summary(results),
        seed=results.seed,
    )

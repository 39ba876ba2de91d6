"""How evolutionary algorithms find the two modification amounts: every algorithm over many seeds beside the optimum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float

from tolalloc.reading.units import MICROMETRE
from tolalloc.reducers.modification import ModificationProblem, ModificationRequest, ModificationResult, choose
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reports.document import Document, Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.tellers.contact import span
from tolalloc.running.progress import Progress
from tolalloc.study.answer import Answer
from tolalloc.study.inquiries.modify import answer_of

from .li2018_genetic import binary_search
from .modification_searches import ALGORITHMS, REACHED, SearchResult, Spread, polish, search

ASSUMPTIONS = {
    "song2019": ("song2019 prints no generations or care for bounds: 400 generations, pymoo's repair",),
    "li2018": (
        "li2018's algorithm: crossover 0.8, best fitness twice the mean, penalty and extrapolation by SUMT: unprinted",
    ),
}
"""Method → what its source does not print of its algorithm."""

Searcher = Callable[[ModificationProblem, int], SearchResult]


@dataclass(frozen=True, kw_only=True)
class ModificationComparison:
    """A choice with every algorithm beside it.

    Parameters
    ----------
    answer
        The sure optimum and what it does on the reducer.
    spreads
        Answers of each algorithm from many seeds.
    polished
        Share of each algorithm's seeds that reach the optimum when polished [-].
    seed
        First seed of each algorithm [-].
    """

    answer: Answer[ModificationResult]
    spreads: tuple[Spread, ...]
    polished: tuple[float, ...]
    seed: int


def searchers(method: str) -> dict[str, Searcher]:
    """Return pymoo's algorithms, and for li2018 its own."""

    def by_pymoo(name: str) -> Searcher:
        return lambda problem, seed: search(problem, name, seed)

    own: dict[str, Searcher] = {"binary genetic algorithm": binary_search} if method == "li2018" else {}
    return {**{name: by_pymoo(name) for name in ALGORITHMS}, **own}


def compared(
    study: ModificationRequest, reducer: Reducer, torque: float, seeds: range, progress: Progress
) -> ModificationComparison:
    """Return the best amounts and how every algorithm found them; each algorithm and finished search is told."""
    progress.begin("reference", 1, "searches")
    answer = answer_of(choose(study, reducer, torque))
    chosen = answer.result
    progress.advance(1)
    spreads, polished = [], []
    for name, searcher in searchers(study.method).items():
        progress.begin(name, len(seeds), "searches")
        results = []
        for seed in seeds:
            results.append(searcher(chosen.problem, seed))
            progress.advance(1)
        spreads.append(Spread(results=tuple(results), reference=chosen.best))
        done = tuple(polish(chosen.problem, result) for result in results)
        polished.append(Spread(results=done, reference=chosen.best).share)
    return ModificationComparison(
        answer=answer, spreads=tuple(spreads), polished=tuple(polished), seed=next(iter(seeds))
    )


def _ends(lengths: Float[np.ndarray, " seed"]) -> str:
    """Return the smallest and the largest of lengths [µm]."""
    return span(float(lengths.min() / MICROMETRE), float(lengths.max() / MICROMETRE))


def algorithms_table(found: ModificationComparison) -> pd.DataFrame:
    """Return what each algorithm found, over all its seeds."""
    best = found.answer.result.best
    rows: list[dict[str, object]] = [
        {
            "algorithm": "reference",
            "seeds [-]": 1,
            "reached it [-]": 1.0,
            "polished [-]": 1.0,
            "Δr_rp [µm]": f"{best.amounts[0] / MICROMETRE:.6g}",
            "Δr_p [µm]": f"{best.amounts[1] / MICROMETRE:.6g}",
            "objective [µm]": f"{best.objective / MICROMETRE:.6g}",
            "evaluations [-]": best.evaluations,
        }
    ]
    for spread, polished in zip(found.spreads, found.polished, strict=True):
        rows.append(
            {
                "algorithm": spread.results[0].algorithm,
                "seeds [-]": len(spread.results),
                "reached it [-]": spread.share,
                "polished [-]": polished,
                "Δr_rp [µm]": _ends(spread.amounts[:, 0]),
                "Δr_p [µm]": _ends(spread.amounts[:, 1]),
                "objective [µm]": _ends(np.array([result.objective for result in spread.results])),
                "evaluations [-]": int(np.median([result.evaluations for result in spread.results])),
            }
        )
    return pd.DataFrame(rows)


def convergence_figure(found: ModificationComparison) -> Figure:
    """Draw how far each algorithm is from the optimum after so many evaluations: median and quartiles of the seeds."""
    most = max(result.evaluations for spread in found.spreads for result in spread.results)
    at = np.unique(np.geomspace(10, most, 160).astype(int))
    floor = 1e-7  # below that, the objective in micrometres is the optimum for any purpose
    series = []
    for spread in found.spreads:
        band = np.maximum((spread.band(at) - found.answer.result.best.objective) / MICROMETRE, floor)
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
    return Figure(
        name="convergence",
        title=f"Distance from the optimum: median and quartiles of {len(found.spreads[0].results)} seeds",
        x_label="evaluations [-]",
        y_label="objective above the optimum [µm]",
        series=tuple(series),
        logarithmic=True,
    )


def _summaries(found: ModificationComparison) -> list[dict[str, Any]]:
    """Return what each algorithm found, for a program."""
    return [
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
        for spread, polished in zip(found.spreads, found.polished, strict=True)
    ]


def comparison_document(found: ModificationComparison, *more: Section) -> Document:
    """Return the report of one comparison; further sections follow it."""
    document, method = found.answer.document, found.answer.header.name
    objective = found.answer.result.problem.description
    section = Section(
        heading="How the algorithms found the amounts",
        paragraphs=(
            f"Objective: {objective}. A seed has reached the reference if both amounts are within "
            f"{REACHED / MICROMETRE:g} µm of its amounts; polished is the share that does after a local search from "
            "where it ended.",
        ),
        figures=(convergence_figure(found),),
        tables=(("algorithms", algorithms_table(found)),),
    )
    return replace(
        document,
        subtitle=f"{document.subtitle} First seed {found.seed}.",
        sections=(section, *more, *document.sections),
        assumptions=(*document.assumptions, *ASSUMPTIONS[method], "sizes of the genetic algorithm and of CMA-ES: ours"),
        summary={**document.summary, "algorithms": _summaries(found)},
        seed=found.seed,
    )

"""The sections of a ranking's report."""

from __future__ import annotations

import pandas as pd

from tolalloc.drawing.tolerance_table import table_frame
from tolalloc.report.document import Section
from tolalloc.sensitivity.answer import driver_tables, figures, limit_tables, trust_tables
from tolalloc.sensitivity.answer.results import RankingResults


def driver_sections(results: RankingResults) -> tuple[Section, ...]:
    """Return which error drives what: the peak-to-peak, all requirements, each order."""
    stage = results.reducer.cycloid_stage
    return (
        Section(
            heading="Which error drives the peak-to-peak",
            paragraphs=(
                "The total index is the share of the variance in which the error has a part, alone or together with "
                "others; the first-order index is its part alone. Contribution is its share of the sum of all total "
                "indices. Intervals of 90 % and places come from resampled blocks.",
            ),
            figures=(figures.ranking_figure(results),),
            tables=(
                ("ranking", driver_tables.ranking_table(results)),
                *_pairs(results),
                ("growth", driver_tables.growth_table(results)),
            ),
        ),
        *_correlated(results),
        Section(
            heading="One ranking over all requirements",
            paragraphs=(
                "Sources by their largest total index over the outputs that have a limit "
                f"({', '.join(name.split(' [')[0] for name in results.sobol.ranked)}); the others stand beside them.",
            ),
            figures=(figures.requirements_figure(results),),
            tables=(("all requirements", driver_tables.overall_table(results)),),
        ),
        Section(
            heading="Which error makes which order",
            paragraphs=(
                f"Errors that stand still in the housing show at multiples of {stage.disc_teeth}, errors that turn "
                f"with disc or carrier at multiples of {stage.pin_count}; what a source adds only together with others "
                "is the difference of the two shares.",
            ),
            figures=(figures.orders_figure(results),),
            tables=(("orders", driver_tables.orders_table(results)),),
        ),
    )


def _pairs(results: RankingResults) -> tuple[tuple[str, pd.DataFrame], ...]:
    """Return the table of pairs, if the study asked for it."""
    pairs = driver_tables.pairs_table(results)
    return () if pairs.empty else (("pairs", pairs),)


def _correlated(results: RankingResults) -> tuple[Section, ...]:
    """Return how correlated sources share the variance; nothing where all are independent."""
    if results.shapley is None:
        return ()
    return (
        Section(
            heading="Correlated sources",
            paragraphs=results.errors.correlation.mappings(results.errors.sources),
            tables=(("Shapley effects", driver_tables.shapley_table(results.shapley)),),
        ),
    )


def limit_sections(results: RankingResults) -> tuple[Section, ...]:
    """Return what the limits do: yield, units beyond them, and how far each zone may open."""
    alone = figures.inverse_figure(results)
    return (
        Section(
            heading="Yield and capability",
            figures=(figures.sample_figure(results),),
            tables=(
                ("requirements", limit_tables.capability_table(results)),
                ("beyond the limit", limit_tables.beyond_table(results)),
                ("stack-up", limit_tables.stack_up_table(results)),
            ),
        ),
        Section(
            heading="What drives the units out of the limit",
            figures=(figures.reject_figure(results),),
            tables=(("rejects", limit_tables.reject_table(results)),),
        ),
        Section(
            heading="How far each zone may open alone",
            figures=(alone,) if alone else (),
            tables=(("alone", limit_tables.inverse_table(results)),),
        ),
    )


def trust_sections(results: RankingResults) -> tuple[Section, ...]:
    """Return what the answer rests on: other measures, stand-ins, distributions, work done."""
    return (
        Section(
            heading="Other measures of the same",
            paragraphs=(
                f"An index of PAWN below {results.moments.pawn_dummy:.3f} or of delta below "
                f"{results.moments.delta_dummy:.3f} means nothing: an input that does nothing reaches as much.",
            ),
            tables=(("measures", trust_tables.measures_table(results)),),
        ),
        Section(
            heading="Stand-ins for the model",
            paragraphs=(results.choice.reason,),
            tables=(("surrogates", trust_tables.surrogate_table(results)),),
        ),
        Section(
            heading="From zone to distribution",
            tables=(
                ("mapping", trust_tables.mapping_table(results)),
                *trust_tables.measured_tables(results),
                ("tolerances", table_frame(results.errors.sources)),
            ),
        ),
        Section(
            heading="Work done",
            paragraphs=(
                ", ".join(f"{count} units: {outcome}" for outcome, count in results.statuses.items() if count),
            ),
            tables=(("work", trust_tables.work_table(results)),),
        ),
    )

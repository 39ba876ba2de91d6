"""The sections of a ranking's report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from tolalloc.drawings.tolerance_table import table_frame
from tolalloc.reports.document import Section
from tolalloc.reports.portrait import portrait_of
from tolalloc.sensitivity import driver_tables, figures, limit_tables

if TYPE_CHECKING:
    from tolalloc.sensitivity.answer import RankingAnswer


def driver_sections(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return which error drives what: the peak-to-peak, all requirements, each order."""
    return (
        Section(
            heading=f"Which error drives the {answer.spoken}",
            paragraphs=(
                "The total index is the share of the variance in which the error has a part, alone or together with "
                "others; the first-order index is its part alone. Contribution is its share of the sum of all total "
                "indices. Intervals of 90 % and places come from resampled blocks.",
            ),
            figures=(figures.ranking_figure(answer),),
            tables=(
                ("ranking", answer.ranking),
                *_pairs(answer),
                ("growth", driver_tables.convergence_table(answer)),
            ),
        ),
        *_dimensions(answer),
        *_correlated(answer),
        Section(
            heading="One ranking over all requirements",
            paragraphs=(
                "Sources by their largest total index over the outputs that have a limit "
                f"({', '.join(name.split(' [')[0] for name in answer.sobol.ranked)}), {answer.sobol.blocks} blocks; "
                f"the others stand beside them, {answer.sobol.blocks_of_others} blocks.",
            ),
            figures=(figures.requirements_figure(answer),),
            tables=(("all requirements", driver_tables.overall_table(answer)),),
        ),
        *_orders(answer),
        *_reducer(answer),
    )


def _dimensions(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return the ranking with one line per dimension of the drawing; nothing where each is one source."""
    if answer.dimensions is None:
        return ()
    return (
        Section(
            heading=f"Which dimension of the drawing drives the {answer.spoken}",
            paragraphs=(
                "One line per dimension, whose members (both discs of one drawing) are taken together and not set "
                "against each other. A dimension has a part, alone or with others, in so much of the variance (total "
                "index); the parts of all may add up to more than 100 %.",
            ),
            tables=(("dimensions", driver_tables.dimensions_table(answer, answer.dimensions)),),
            unfolded=True,
            first=True,
        ),
    )


def _reducer(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return the model's picture of the median unit, coloured by the drivers of the leading output; or nothing."""
    total = answer.indices.total
    shares = dict(zip(answer.indices.sources, (total / total.sum()).tolist(), strict=True))
    return portrait_of(answer.model).moving(answer.errors, answer.sample.unit_at(0.5)[0], shares, "median unit")


def _orders(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return what makes each order; nothing for a model without spectra."""
    if answer.orders is None:
        return ()
    own = portrait_of(answer.model).spectra_note
    note = f"{own}; " if own else ""
    return (
        Section(
            heading="Which error makes which order",
            paragraphs=(
                f"{note}what a source adds only together with others is the difference of the two shares. "
                f"{answer.sobol.blocks_of_others} blocks.",
            ),
            figures=(figures.orders_figure(answer),),
            tables=(("orders", driver_tables.orders_table(answer)),),
        ),
    )


def _pairs(answer: RankingAnswer) -> tuple[tuple[str, pd.DataFrame], ...]:
    """Return the table of pairs, if the study asked for it."""
    pairs = driver_tables.pairs_table(answer)
    return () if pairs.empty else (("pairs", pairs),)


def _correlated(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return how correlated sources share the variance; nothing where all are independent."""
    if answer.shapley is None:
        return ()
    return (
        Section(
            heading="Correlated sources",
            paragraphs=answer.errors.correlation.mappings(answer.errors.sources),
            tables=(("Shapley effects", driver_tables.shapley_table(answer.shapley)),),
        ),
    )


def limit_sections(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return what the limits do: yield, units beyond them, and how far each zone may open."""
    alone = figures.inverse_figure(answer)
    return (
        Section(
            heading="Yield and capability",
            figures=(figures.sample_figure(answer),),
            tables=(
                ("requirements", answer.requirements),
                ("beyond the limit", limit_tables.beyond_table(answer)),
                ("stack-up", limit_tables.stack_up_table(answer)),
            ),
        ),
        Section(
            heading="What drives the units out of the limit",
            figures=(figures.reject_figure(answer),),
            tables=(("rejects", answer.rejects),),
        ),
        Section(
            heading="How far each zone may open alone",
            figures=(alone,) if alone else (),
            tables=(("alone", answer.alone),),
        ),
    )


def trust_sections(answer: RankingAnswer) -> tuple[Section, ...]:
    """Return what the answer rests on: other measures, stand-ins, distributions, work done."""
    return (
        Section(
            heading="Other measures of the same",
            paragraphs=(
                f"An index of PAWN below {answer.moments.pawn_dummy:.3f} or of delta below "
                f"{answer.moments.delta_dummy:.3f} means nothing: an input that does nothing reaches as much.",
            ),
            tables=(("measures", limit_tables.measures_table(answer)),),
        ),
        Section(
            heading="Stand-ins for the model",
            paragraphs=(answer.choice.reason,),
            tables=(("surrogates", limit_tables.surrogate_table(answer)),),
        ),
        Section(
            heading="From zone to distribution",
            tables=(
                ("mapping", limit_tables.mapping_table(answer)),
                *limit_tables.measured_tables(answer),
                ("tolerances", table_frame(answer.errors.sources)),
            ),
        ),
        Section(
            heading="Work done",
            paragraphs=(
                ", ".join(f"{count} units: {outcome}" for outcome, count in answer.header.statuses.items() if count),
            ),
            tables=(("work", limit_tables.work_table(answer)),),
        ),
    )

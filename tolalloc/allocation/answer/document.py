"""The cheapest drawing: the sections of one report, with its answer, warnings and summary."""

from __future__ import annotations

from tolalloc.allocation.answer import figures, optimality_tables, tables, what_if_tables
from tolalloc.allocation.answer.before_after import units_figure, zones_figure
from tolalloc.allocation.answer.cautions import assumptions, warnings
from tolalloc.allocation.answer.drawing import drawing_table, full_drawing_table
from tolalloc.allocation.answer.paragraphs import cheapest_clearances, quantiles
from tolalloc.allocation.answer.results import AllocationResults
from tolalloc.allocation.answer.sentences import answer
from tolalloc.allocation.answer.summary import summary
from tolalloc.report.document import Document, Section
from tolalloc.sensitivity.driver_tables import sobol_table


def sections(results: AllocationResults) -> tuple[Section, ...]:
    """Return the sections of the report."""
    price, chosen = what_if_tables.prices_table(results), results.chosen
    return (
        Section(
            heading="What to write on the drawing",
            figures=(zones_figure(drawing_table(results), "zone [µm]"),),
            tables=(("drawing", drawing_table(results)),),
            paragraphs=(
                "allocation.csv beside this report has the layout of the tolerance table and is read back by tolalloc; "
                "drawing.xlsx goes on calculating: change a zone there and see cost and limits.",
            ),
        ),
        Section(
            heading="What still drives the peak-to-peak of the drawing",
            tables=(("shares", sobol_table(results.shares)),),
        ),
        Section(
            heading="Requirements",
            paragraphs=quantiles(results),
            figures=(
                units_figure(
                    results.joint.baseline.sample.values,
                    chosen.sample.values,
                    chosen.achieved.estimate,
                    results.joint.limit,
                ),
            ),
            tables=(
                ("requirements", tables.requirements_table(results)),
                ("designs", tables.designs_table(results)),
            ),
        ),
        _optimality(results),
        Section(
            heading="Modification against tolerances",
            paragraphs=cheapest_clearances(results),
            figures=figures.trade_figures(results),
            tables=(("modification", what_if_tables.trade_table(results)),),
        ),
        *((Section(heading="What a good unit costs", tables=(("unit price", price),)),) if len(price) else ()),
        Section(
            heading="When an assumption is wrong",
            figures=(figures.robustness_figure(results),),
            tables=(
                ("robustness", what_if_tables.robustness_table(results)),
                ("variants", what_if_tables.variants_table(results)),
            ),
        ),
        Section(
            heading="Work done",
            paragraphs=(
                ", ".join(
                    f"{count} unit{'' if count == 1 else 's'}: {outcome}"
                    for outcome, count in results.statuses.items()
                    if count
                )
                + ".",
            ),
            tables=(
                ("verified designs", tables.verified_table(results)),
                ("tolerances", full_drawing_table(results)),
                ("work", tables.work_table(results)),
            ),
        ),
    )


def _optimality(results: AllocationResults) -> Section:
    """Return how far from optimal the drawing can be."""
    return Section(
        heading="How far from optimal",
        paragraphs=(
            "The bound is a Lagrange dual that takes no solver's word. It holds for the convex models around the "
            "verified design, not for designs far from it; the front below was searched with other means. One "
            "column has the budget of the limits themselves, the other one standard error less, where the search "
            "aims; where the verified design takes more of a limit than that, what it takes counts.",
            "The last table shows the free zones. Each lies between what its process can hold and the smallest and "
            "the largest zone of the tolerance table, whichever is narrower.",
        ),
        figures=(figures.front_figure(results),),
        tables=(
            ("certificate", optimality_tables.certificate_table(results)),
            ("front", optimality_tables.front_table(results)),
            ("searched front", optimality_tables.searched_table(results)),
            ("front with clearance", optimality_tables.clearance_front_table(results)),
            ("bounds by process and table", optimality_tables.bounds_table(results)),
        ),
    )


def allocation_document(results: AllocationResults) -> Document:
    """Return the report."""
    return Document(
        title=f"The cheapest drawing of {results.reducer.name}: {results.name}",
        subtitle=(
            f"{len(results.requirements)} requirement{'s' if len(results.requirements) > 1 else ''}, "
            f"{results.torque:g} N·m on the carrier, seed {results.seed}"
        ),
        answer=answer(results),
        warnings=warnings(results),
        sections=sections(results),
        assumptions=assumptions(results),
        summary=summary(results),
        seed=results.seed,
    )

"""The sections of a report on an allocation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolalloc.allocation.answer import figures, optimality_tables, tables, what_if_tables
from tolalloc.allocation.answer.before_after import units_figure, zones_figure
from tolalloc.allocation.answer.dimensions import effects_figure
from tolalloc.allocation.answer.drawing import full_drawing_table
from tolalloc.allocation.answer.sentences import amounts_convention, drawn_amounts
from tolalloc.allocation.space.requirement import AtYield
from tolalloc.reading.units import unit_of
from tolalloc.reports.document import Section
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.tellers.ranking_tables import sobol_table
from tolalloc.reports.wording import quantity, short, with_unit

if TYPE_CHECKING:
    from tolalloc.allocation.answer.answer import AllocationAnswer


def sections(answer: AllocationAnswer) -> tuple[Section, ...]:
    """Return the sections of the report."""
    return (
        _drawing(answer),
        Section(
            heading="Every source of the drawing",
            figures=(zones_figure(answer.drawing_table, "zone [µm]"),),
            tables=(("drawing", answer.drawing_table),),
            paragraphs=("The members of each dimension, with the share of each in the sum of all total indices.",),
            unfolded=True,
        ),
        Section(
            heading=f"What still drives the {short(answer.leading)} of the drawing",
            tables=(("shares", sobol_table(answer.shares)),),
        ),
        _requirements(answer),
        *_illustrated(answer),
        _optimality(answer),
        *_what_if(answer),
        Section(
            heading="Work done",
            paragraphs=(
                ", ".join(
                    f"{count} unit{'' if count == 1 else 's'}: {outcome}"
                    for outcome, count in answer.header.statuses.items()
                    if count
                )
                + ".",
            ),
            tables=(
                ("verified designs", tables.verified_table(answer)),
                ("tolerances", full_drawing_table(answer)),
                ("work", tables.work_table(answer)),
            ),
        ),
    )


def _drawing(answer: AllocationAnswer) -> Section:
    """Return the first page: what to write, a line per dimension."""
    effects = effects_figure(answer)
    return Section(
        heading="What to write on the drawing",
        paragraphs=(
            " ".join((*drawn_amounts(answer), *amounts_convention(answer))),
            "One line per dimension. What to write is rounded down to 0.1 µm, so that it allows nothing wider than the "
            "zone that was verified. The part in the variance (total index) is that of all members of a dimension "
            "together, alone or with others, so the parts of all may add up to more than 100 %.",
            "allocation.csv beside this report has the layout of the tolerance table and is read back by tolalloc; "
            "drawing.xlsx goes on calculating: change a zone there and see cost and limits; frames.dxf has the frames "
            "for a drawing program.",
        ),
        figures=(effects,) if effects else (),
        tables=(("dimensions", answer.dimensions_table),),
        unfolded=True,
        first=True,
    )


def _requirements(answer: AllocationAnswer) -> Section:
    """Return how the designs stand against the requirements."""
    chosen = answer.chosen
    return Section(
        heading="Requirements",
        paragraphs=_quantiles(answer),
        figures=(
            units_figure(
                answer.leading,
                answer.free.baseline.sample.values,
                chosen.sample.values,
                chosen.achieved.estimate,
                answer.requirements[0].limits,
            ),
        ),
        tables=(
            ("requirements", answer.requirements_table),
            ("designs", tables.designs_table(answer)),
        ),
    )


def _illustrated(answer: AllocationAnswer) -> tuple[Section, ...]:
    """Return the median units before and after, as the model pictures them."""
    before, after = answer.free.baseline, answer.chosen
    units = {
        "median unit before": (before.settings, before.sample.unit_at(0.5)[0]),
        "median unit after": (after.settings, after.sample.unit_at(0.5)[0]),
    }
    return portrait_of(answer.model).illustrated(units)


def _optimality(answer: AllocationAnswer) -> Section:
    """Return how far from optimal the drawing can be."""
    fronts = answer.fronts
    return Section(
        heading="How far from optimal",
        paragraphs=(
            "The bound is a Lagrange dual that takes no solver's word. It holds for the convex models around the "
            "verified design, not for designs far from it. The front of NSGA-II was searched with other "
            "means and may lie on either side of it: none of its points was verified for all limits. One "
            "column has the budget of the limits themselves, the other one standard error less, where the search "
            "aims; where the verified design takes more of a limit than that, what it takes counts.",
            "The last table shows the free zones. Each lies between what its process can hold and the smallest and "
            "the largest zone of the tolerance table, whichever is narrower.",
        ),
        figures=(figures.front_figure(answer, fronts),) if fronts else (),
        tables=(
            ("certificate", optimality_tables.certificate_table(answer)),
            *(optimality_tables.front_tables(answer, fronts) if fronts else ()),
            ("bounds by process and table", optimality_tables.bounds_table(answer)),
        ),
    )


def _what_if(answer: AllocationAnswer) -> tuple[Section, ...]:
    """Return what would be otherwise: settings, yields, assumptions."""
    found = []
    if answer.trade:
        found.append(
            Section(
                heading=f"{portrait_of(answer.model).settings_word.capitalize()} against tolerances",
                paragraphs=_cheapest_settings(answer),
                figures=figures.trade_figures(answer, answer.trade),
                tables=(("modification", what_if_tables.trade_table(answer.trade)),),
            )
        )
    if answer.prices and answer.prices.priced.size:
        tables = (("unit price", what_if_tables.prices_table(answer.prices)),)
        found.append(Section(heading="What a good unit costs", tables=tables))
    if answer.robustness:
        moved = what_if_tables.robustness_table(answer, answer.robustness)
        found.append(
            Section(
                heading="When an assumption is wrong",
                figures=(figures.robustness_figure(moved),),
                tables=(
                    ("robustness", moved),
                    ("variants", what_if_tables.variants_table(answer.robustness)),
                ),
            )
        )
    return tuple(found)


def _quantiles(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return how much safer than asked the drawing is, since its units are few."""
    said = []
    for check in answer.chosen.checks:
        kept, value, guarantee = (
            tables.unit_quantile(answer.chosen, check),
            check.constraints[0].value,
            check.requirement.guarantee,
        )
        if isinstance(guarantee, AtYield) and np.isfinite(kept) and np.isfinite(value):
            unit = unit_of(check.requirement.output)
            end = "at most" if check.constraints[0].sign > 0 else "at least"
            said.append(
                f"{quantity(check.requirement.output)}: {guarantee.target:.2%} of these units keep "
                f"{end} {kept:.4g} {unit}; {value:.4g} {unit} is what "
                f"{answer.chosen.joint.units:,} units show with {answer.chosen.confidence:.1%} confidence."
            )
    return tuple(said)


def _cheapest_settings(answer: AllocationAnswer) -> tuple[str, ...]:
    """Return where the zones are cheapest among the settings that were tried."""
    trade = answer.trade
    if trade is None or not np.isfinite(trade.cheapest).all():
        return ("With no choice that was tried were zones found that keep all requirements.",)
    missed_by = ""
    if np.isfinite(trade.error):
        missed_by = f", whose corrected model misses the real one by {with_unit(f'{trade.error:.2g}', answer.leading)}"
    where = " and ".join(
        f"{value:.3g} {unit_of(name)} {quantity(name)}" for name, value in zip(trade.names, trade.cheapest, strict=True)
    )
    return (
        f"Of the choices that were tried the zones are cheapest with {where}: {np.nanmin(trade.cost):.2f} cost units "
        f"by the local models{missed_by}.",
    )

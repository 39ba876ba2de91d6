"""The cheapest drawing that keeps every requirement: what to write, what it costs, and how sure that is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd

from tolalloc.allocation.result import AllocationResult
from tolalloc.reading.plugins import left_out_if_broken, plugins
from tolalloc.reading.units import unit_of
from tolalloc.reports.columns import plain
from tolalloc.reports.document import Section
from tolalloc.reports.finished_run import told_yields
from tolalloc.reports.portrait import portrait_of
from tolalloc.reports.teller import Teller
from tolalloc.reports.tellers import allocation_figures as figures
from tolalloc.reports.tellers import allocation_sentences as texts
from tolalloc.reports.tellers import allocation_tables as tables
from tolalloc.reports.tellers.allocation_assembly import assembly_sections, assembly_summary
from tolalloc.reports.tellers.allocation_drawing import (
    dimensions_table,
    effects_figure,
    risks,
    sources_table,
    tolerances_frame,
    write_drawing,
    zones_figure,
)
from tolalloc.reports.tellers.allocation_population import assumed_alone
from tolalloc.reports.tellers.ranking_tables import sobol_table, work_table
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import short

_say = Sentences("allocation")


class AllocationTeller(Teller[AllocationResult]):
    """What is said and shown of the cheapest drawing."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return texts.title(self.result, self.header)

    @property
    def subtitle(self) -> str:
        """Under which conditions it holds."""
        count = len(self.result.requirements)
        conditions = [super().subtitle] if self.header.conditions else []
        asked = _say("requirements" if count > 1 else "requirement", count=count)
        return ", ".join([asked, *conditions, _say("seed", seed=self.header.seed)])

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The answer in sentences, each no stronger than what was computed."""
        return texts.sentences(self.result, self.header.cost_unit)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before acting on the answer."""
        return tuple(texts.warnings(self.result, self.header))

    @cached_property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        return texts.assumptions(self.result, self.header)

    @property
    def before(self) -> tuple[str, ...]:
        """That every number of the table is assumed, if so."""
        return assumed_alone(self.result)

    @property
    def headline(self) -> tuple[str, ...]:
        """The verdict and the cost."""
        return texts.headline(self.result, self.header.cost_unit)

    @property
    def headline_table(self) -> tuple[pd.DataFrame, str]:
        """The drawing as it is and as drawn."""
        shown = tables.today_frame(self.result, self.header.cost_unit)
        return shown.drop(columns=["shown for", "binds"], errors="ignore"), self.header.name

    @property
    def shown(self) -> tuple[str, ...]:
        """What to write, its total-effect index and its cost."""
        return dimensions_table(self.result).shown(self.header.cost_unit)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The sections of the report."""
        return self.standing(
            self._today,
            self._risks,
            self._pictures,
            self._front,
            self._dimensions,
            lambda: assembly_sections(self.result, self.header.cost_unit),
            self._sources,
            self._shares,
            self._requirements,
            self._illustrated,
            self._optimality,
            self._what_if,
            self._work,
        )

    def _risks(self) -> Iterator[Section]:
        yield Section(heading=_say("heading_risks"), paragraphs=tuple(risks(self.result)), first=True)

    def _sources(self) -> Iterator[Section]:
        sources = sources_table(self.result)
        yield Section(
            heading=_say("heading_sources"),
            figures=(zones_figure(sources.rows),),
            tables=((sources.name, sources.frame(self.header.cost_unit)),),
            paragraphs=(_say("sources"),),
            folded=True,
        )

    def _shares(self) -> Iterator[Section]:
        shares = self.result.shares
        yield Section(
            heading=_say("heading_shares", output=short(self.result.leading)),
            tables=(("shares", sobol_table(shares, "dimension")),) if shares else (),
            folded=True,
        )

    def _work(self) -> Iterator[Section]:
        result, unit = self.result, self.header.cost_unit
        known = ((outcome, count) for outcome, count in self.header.statuses.items() if count)
        counts = (f"{count} unit{'' if count == 1 else 's'}: {outcome}" for outcome, count in known)
        yield Section(
            heading=_say("heading_work"),
            paragraphs=(f"{', '.join(counts)}.",),
            tables=(
                ("tried designs", tables.tried_table(result).frame(unit)),
                ("tolerances", tolerances_frame(result, unit)),
                ("work", work_table(self.header).drop(columns="units per second [1/s]")),
            ),
            folded=True,
        )

    def _today(self) -> Iterator[Section]:
        """Yield the first page: the drawing as it is beside the drawing as drawn."""
        result = self.result
        yield Section(
            heading=_say("heading_today"),
            tables=(("today and as drawn", tables.today_frame(result, self.header.cost_unit)),),
            paragraphs=(*texts.today_values(result), *texts.capability_change(result)),
            first=True,
        )

    def _pictures(self) -> Iterator[Section]:
        """Yield, on the first page, units before and after and what opening a zone adds."""
        shown = (figures.units_figure(self.result), *effects_figure(self.result))
        yield Section(heading=_say("heading_pictures"), figures=shown, first=True)

    def _front(self) -> Iterator[Section]:
        """Yield, on the first page, what other limits cost."""
        result, unit, front = self.result, self.header.cost_unit, self.result.front
        if front:
            yield Section(
                heading=_say("heading_front", output=short(result.leading)),
                paragraphs=tuple(texts.front(result, front)),
                figures=(figures.front_figure(result, front, unit),) if front.points else (),
                tables=(("front", tables.front_frame(result, front, unit)),) if front.points else (),
                first=True,
            )

    def _dimensions(self) -> Iterator[Section]:
        """Yield, on the first page, what to write, a line per dimension."""
        result = self.result
        yield Section(
            heading=_say("heading_dimensions"),
            paragraphs=(*texts.amounts_convention(result), _say("dimensions"), texts.files(self.result)),
            tables=(("dimensions", dimensions_table(result).frame(self.header.cost_unit)),),
            unfolded=True,
            first=True,
        )

    def _requirements(self) -> Iterator[Section]:
        """Yield how the designs stand against the requirements."""
        shown = (tables.requirements_table(self.result), tables.designs_table(self.result))
        yield Section(
            heading=_say("heading_requirements"),
            paragraphs=tuple(texts.quantiles(self.result)),
            tables=tuple((own.name, own.frame(self.header.cost_unit)) for own in shown),
            folded=True,
        )

    def _illustrated(self) -> Iterator[Section]:
        """Yield the median units before and after, as the model pictures them."""
        before, after = self.result.free.baseline, self.result.chosen
        units = {
            "median unit before": (before.settings, before.sample.unit_at(0.5)[0]),
            "median unit after": (after.settings, after.sample.unit_at(0.5)[0]),
        }
        yield from (replace(own, folded=True) for own in portrait_of(self.result.model).illustrated(units))

    def _optimality(self) -> Iterator[Section]:
        """Yield how far from optimal the drawing can be."""
        result, unit = self.result, self.header.cost_unit
        yield Section(
            heading=_say("heading_optimality"),
            paragraphs=(_say("bound"), _say("bounds_table")),
            tables=(
                ("certificate", tables.certificate_frame(result, unit)),
                ("bounds by process and table", tables.bounds_frame(result, unit)),
            ),
        )

    def _what_if(self) -> Iterator[Section]:
        """Yield what would be otherwise: settings, yields, assumptions."""
        result, unit = self.result, self.header.cost_unit
        if result.trade:
            yield Section(
                heading=_say("heading_trade", word=portrait_of(result.model).settings_word.capitalize()),
                paragraphs=texts.cheapest_settings(result, unit),
                figures=figures.trade_figures(result, result.trade, unit),
                tables=(("modification", tables.trade_frame(result.trade, unit)),),
            )
        if result.prices and result.prices.priced.size:
            priced = (("unit price", tables.prices_frame(result.prices, unit)),)
            yield Section(heading=_say("heading_good_unit"), tables=priced)
        if result.robustness:
            moved = tables.robustness_frame(result, result.robustness)
            shown = [("robustness", moved), ("variants", tables.variants_frame(result.robustness, unit))]
            if region := result.robustness.uncertain:
                shown.append((f"{region.name} region", tables.region_frame(region, result.free.chosen.met)))
            zones = figures.robustness_figure(moved)
            yield Section(heading=_say("heading_robustness"), figures=(zones,), tables=tuple(shown))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        result, header = self.result, self.header
        chosen, free, robustness = result.chosen, result.free, result.robustness
        portrait, examined = portrait_of(result.model), texts.examined(result)
        limits, blocking, steady = result.requirements[0].limits, chosen.blocking, None
        if robustness:
            steady = [group for group, same in zip(robustness.groups, robustness.same, strict=True) if same]
        limit = "limit [arcsec]" if unit_of(result.leading) == "arcsec" else f"limit of {result.leading}"
        answered = {
            "study": header.name,
            "study hash": header.digest,
            portrait.kind: header.model,
            **header.conditions,
            limit: free.limit,
            **({f"lower {limit}": limits.lower} if None not in (limits.lower, limits.upper) else {}),
            "yield target [-]": getattr(result.requirements[0].guarantee, "target", None),
            "seed": header.seed,
            "quick": header.quick,
            "met": result.met,
            "overall error of the verification [-]": result.error,
            "yield [-]": chosen.achieved.estimate,
            "yield interval 95 % [-]": [chosen.achieved.low, chosen.achieved.high],
            "yield lower bound, one-sided 95 % [-]": chosen.achieved.bound,
            **told_yields(result.yields, chosen.joint),
            f"{short(result.leading)} kept [{unit_of(result.leading)}]": chosen.quantile_bound,
            **self._costs,
            **assembly_summary(result),
            "blocking requirement": None if result.met else blocking.requirement.output,
            f"beyond its limit by [{unit_of(blocking.requirement.output)}]": None if result.met else -blocking.slack,
            "cannot be built because": examined.fault or None,
            **examined.figures,
            **portrait.amounts(chosen.settings),
            "requirements": tables.requirements_table(result).records(),
            "drawing": sources_table(result).records(),
            "zones that stay the same": steady,
            **portrait.facts,
            "statuses": dict(header.statuses),
            "warnings": list(self.warnings),
        }
        return {name: plain(value) for name, value in answered.items()}

    @property
    def _costs(self) -> dict[str, Any]:
        """What the drawing costs and what it is compared with, for a program."""
        result, chosen, free = self.result, self.result.chosen, self.result.free
        return {
            "cost [cost units]": chosen.cost,
            "cost of the tolerance table [cost units]": free.baseline.cost,
            "tolerance table met": free.baseline.met,
            "cost of proportional scaling [cost units]": free.proportional.cost,
            "proportional scaling met": free.proportional.met,
            "saving [-]": 1 - chosen.cost / free.proportional.cost,
            "saving at least [-]": result.least_saving,
            "cost of tolerances alone [cost units]": result.fixed.chosen.cost if result.fixed else None,
            f"cost of {texts.free_label(result)} [cost units]": free.chosen.cost,
            "cost on grades [cost units]": result.graded.chosen.cost if result.graded else None,
            "lower bound [cost units]": result.bound if result.met else None,
            "lower bound holds for every drawing": result.bound_is_certified if result.met else None,
            "gap of the convex program [-]": free.optimum.gap,
        }

    def add_files(self, folder: Path) -> None:
        """Write the drawing as files that are read back, go on calculating, and enter a drawing program."""
        write_drawing(self.result, self.header, folder)
        for name, export in plugins("exports", (), ("__call__",)).items():
            with left_out_if_broken(f"export {name!r} of {export.__module__}"), TemporaryDirectory() as made:
                export(self.result, self.header, Path(made))
                if taken := sorted(own.name for own in Path(made).iterdir() if (folder / own.name).exists()):
                    raise FileExistsError(f"{', '.join(taken)} is written already")
                copytree(made, folder, dirs_exist_ok=True)


TELLER = AllocationTeller

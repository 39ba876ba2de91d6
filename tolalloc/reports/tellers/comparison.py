"""Two finished studies side by side: answers, rankings with their intervals, zones and costs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from tolalloc.reading.units import COST_UNITS, unit_of
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.finished_run import HIGH, LOW, TOTAL, Comparison, FinishedRun
from tolalloc.reports.teller import Teller
from tolalloc.reports.templates import Sentences
from tolalloc.reports.wording import quantity, with_unit

_say = Sentences("comparison")
_SAME, _NAMED = 1e-6, 3
"""Relative change from which a zone is another one, and how many of them a sentence names [-]."""


class ComparisonTeller(Teller[Comparison]):
    """What is said of two finished runs side by side."""

    @property
    def title(self) -> str:
        """What it is."""
        return _say("title")

    @property
    def subtitle(self) -> str:
        """Which ones."""
        return _say("subtitle", first=self._names[0], second=self._names[1])

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The comparison in a few sentences."""
        moved = list(self._ranking.loc[self._ranking["90 % intervals"] == "apart", "dimension"])
        kept = (self._kept(label, run) for label, run in zip(self._names, self.result.runs, strict=True))
        return (*kept, _say("moved", sources=", ".join(moved)) if moved else _say("unmoved"))

    def _kept(self, label: str, run: FinishedRun) -> str:
        """Return how many units of a run keep each limit and all at once, and at which cost if it allocated."""
        kept, (_, *others) = self._leading(label, run), [*run.yields.items()] or [("", 0.0)]
        if not others or run.joint is None:
            return kept
        each = ", ".join(_say("limit", output=output, share=share) for output, share in others)
        return _say("others", kept=kept, each=each, joint=run.joint)

    def _leading(self, label: str, run: FinishedRun) -> str:
        """Return how many units of a run keep the limits of the leading output, and at which cost if it allocated."""
        found = run.summary
        # Ranking and allocation of one run may name the same limit differently.
        limits = " and ".join(dict.fromkeys(with_unit(f"{limit:g}", name) for name, limit in run.limits.items()))
        if "met" not in found:  # a ranking alone decides nothing
            return _say("kept", label=label, share=found["yield [-]"], limits=limits)
        verdict, cost = _say("verdict_met" if found["met"] else "verdict_missed"), found["cost [cost units]"]
        gaps = {"verdict": verdict, "cost": cost, "cost_unit": self.header.cost_unit}
        return _say("allocated", label=label, share=found["yield [-]"], limits=limits, **gaps)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What makes the two hard to compare."""
        result, found = self.result, []
        if not result.same_question:
            found.append(_say("other_question"))
        if not result.same_versions:
            found.append(_say("other_versions"))
        labelled = zip(self._names, result.runs, strict=True)
        found += [_say("quick", label=label) for label, run in labelled if run.manifest.get("quick")]
        if result.first.currency != result.second.currency:
            first, second = (run.currency or COST_UNITS for run in result.runs)
            found.append(_say("other_currency", first=first, second=second))
        if result.same_study:
            found.append(_say("same_study"))
        return tuple(found)

    @property
    def since(self) -> tuple[str, ...]:
        """What changed since the first run, in two sentences and where to see more."""
        first, second = self.result.runs
        other = () if self.result.same_question else (_say("other_question"),)
        both = _say("both", before=first.folder, now=second.folder)
        return (self._since(first, second), *other, _changed(_zones(self.result, COST_UNITS)), both)

    def _since(self, first: FinishedRun, second: FinishedRun) -> str:
        """Return how cost and yield changed."""
        jointly = None not in (first.joint, second.joint)
        shares = [run.joint if jointly else run.summary["yield [-]"] for run in (first, second)]
        limits = _say("all_limits" if jointly and len(second.yields) > 1 else "the_limit")
        costs = [run.summary.get("cost [cost units]") for run in (first, second)]
        gaps = {"before": first.folder, "share": shares[0], "then": shares[1], "limits": limits}
        if None in costs:
            return _say("since", **gaps)
        return _say("since_cost", first=costs[0], second=costs[1], cost_unit=self.header.cost_unit, **gaps)

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Answers, rankings, zones."""
        unit = self.header.cost_unit
        named = self._answers["quantity"].map(lambda name: _named(name, unit))
        answers = self._answers.assign(quantity=named)
        return (
            Section(heading=_say("heading_answers"), tables=(("answers", answers),)),
            Section(
                heading=_say("heading_rankings"),
                paragraphs=(_say("rankings"),),
                figures=(self._figure,),
                tables=(("rankings", self._ranking),),
            ),
            Section(heading=_say("heading_zones"), tables=(("zones", _zones(self.result, unit)),)),
        )

    @property
    def terminal(self) -> tuple[tuple[pd.DataFrame, str], ...]:
        """Every number and word that is not the same in both, rankings and zones."""
        answers, rankings, zones = (frame for own in self.sections for _, frame in own.tables)
        differing = answers[answers[self._names[0]] != answers[self._names[1]]]
        first = () if differing.empty else ((differing, "answers that differ"),)
        return (*first, (rankings, "rankings"), (zones, "zones"))

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The comparison for a program."""
        ranking, zones = self._ranking, _zones(self.result, COST_UNITS)
        return {
            "A": self.result.first.name,
            "B": self.result.second.name,
            "same question": self.result.same_question,
            "answers": self._answers.to_dict("records"),
            "rankings": ranking.astype(object).where(ranking.notna(), None).to_dict("records"),
            "zones": zones.astype(object).where(zones.notna(), None).to_dict("records"),
            "warnings": list(self.warnings),
        }

    @property
    def _names(self) -> tuple[str, str]:
        """Names of both runs, with their folders where two are of one study."""
        names = [run.name for run in self.result.runs]
        if names[0] == names[1]:
            names = [f"{run.name} in {run.folder}" for run in self.result.runs]
        return f"A: {names[0]}", f"B: {names[1]}"

    @cached_property
    def _ranking(self) -> pd.DataFrame:
        """Every dimension with its rank and total index in both, and whether their intervals lie apart."""
        columns = ["rank [-]", TOTAL, LOW, HIGH]
        joint = _joined([run.ranking.set_index("dimension")[columns] for run in self.result.runs])
        apart = (joint[f"{LOW} A"] > joint[f"{HIGH} B"]) | (joint[f"{LOW} B"] > joint[f"{HIGH} A"])
        missing = joint[f"{TOTAL} A"].isna() | joint[f"{TOTAL} B"].isna()
        joint["90 % intervals"] = np.select([missing, apart], ["only in one", "apart"], "overlap")
        heads = {f"rank [-] {run}": f"rank {run} [-]" for run in "AB"}
        heads |= {f"{TOTAL} {run}": f"total index {run} [-]" for run in "AB"}
        found = joint.reset_index().rename(columns=heads)[["dimension", *heads.values(), "90 % intervals"]]
        return found.sort_values(["rank A [-]", "rank B [-]"], ignore_index=True)

    @cached_property
    def _answers(self) -> pd.DataFrame:
        """Every number of the two answers, and the difference where there is one."""
        first, second = (run.summary for run in self.result.runs)
        rows = []
        for name in dict.fromkeys([*first, *second]):
            values = [summary.get(name) for summary in (first, second)]
            if any(isinstance(value, list | dict) for value in values):
                continue
            row: dict[str, object] = {"quantity": name}
            row |= {label: "–" if value is None else value for label, value in zip(self._names, values, strict=True)}
            numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
            row["B − A"] = float(numbers[1] - numbers[0]) if len(numbers) == 2 else ""
            rows.append(row)
        return pd.DataFrame(rows)

    @property
    def _figure(self) -> Figure:
        """The total indices of both with their intervals."""
        names = list(self._ranking["dimension"])
        series = []
        for label, run in zip(self._names, self.result.runs, strict=True):
            own = run.ranking.set_index("dimension")[[TOTAL, LOW, HIGH]].astype(float).reindex(names).fillna(0.0)
            total, low, high = (list(own[column]) for column in (TOTAL, LOW, HIGH))
            series.append(Series.bars(label, names, total, low, high))
        return Figure("rankings", _say("figure"), "total index ST [-]", series=tuple(series))


def _named(name: str, cost_unit: str) -> str:
    """Return the name of a number of a summary with what costs are counted in."""
    return f"{quantity(name)} [{cost_unit}]" if unit_of(name) == COST_UNITS else name


def _joined(sides: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return the tables of A and B beside each other, with the rows that either has."""
    return sides[0].add_suffix(" A").join(sides[1].add_suffix(" B"), how="outer")


def _zones(comparison: Comparison, cost_unit: str) -> pd.DataFrame:
    """Return every zone and cost in both."""
    sides = []
    for zones in (run.zones for run in comparison.runs):
        side = pd.DataFrame({"source": _names(zones), "zone": zones["plus [unit]"] - zones["minus [unit]"]})
        sides.append(side.assign(cost=zones["cost [cost units]"], unit=zones["unit"]).set_index("source"))
    joint = _joined(sides)
    joint = joint[(joint[["zone A", "zone B"]] != 0.0).any(axis=1)].reset_index()  # what both neglect is left out
    joint["unit"] = joint["unit A"].fillna(joint["unit B"])
    joint["B over A, less 1 [%]"] = (joint["zone B"] / joint["zone A"].where(joint["zone A"] > 0) - 1) * 100
    costs = {f"cost {run}": f"cost {run} [{cost_unit}]" for run in "AB"}
    shown = ["source", "unit", "zone A", "zone B", "B over A, less 1 [%]", *costs.values()]
    return joint.rename(columns=costs)[shown]


def _changed(zones: pd.DataFrame) -> str:
    """Return which zones changed most, those of numbered parts together."""
    alike = zones.assign(source=zones["source"].str.replace(r"\d+", "*", regex=True)).drop_duplicates(
        ["source", "zone A", "zone B"]
    )
    moved = alike[(alike["zone B"] / alike["zone A"] - 1).abs() > _SAME]
    if moved.empty:
        return _say("unchanged")
    most = moved.reindex(moved["B over A, less 1 [%]"].abs().sort_values(ascending=False).index).head(_NAMED)
    named = [
        _say("changed_zone", source=own["source"], first=own["zone A"], second=own["zone B"], unit=own["unit"])
        for _, own in most.iterrows()
    ]
    return _say("changed", zones=", ".join(named), count=len(moved), rows=len(alike))


def _names(zones: pd.DataFrame) -> pd.Series:
    """Return what the sources of a tolerance table are, whatever its own ids."""
    own = zones.get("source")
    return zones["id"] if own is None else own.where(own.notna() & (own != ""), zones["id"])


TELLER = ComparisonTeller

"""Two finished studies side by side: answers, rankings with their intervals, zones and costs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from tolalloc.reading.units import COST_UNITS
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section, tables_of
from tolalloc.reports.figure import Figure, Series
from tolalloc.reports.header import Header
from tolalloc.reports.wording import with_unit
from tolalloc.study.finished_run import HIGH, LOW, TOTAL, FinishedRun, common_currency


@dataclass(frozen=True, kw_only=True)
class ComparisonAnswer(Answer):
    """Two finished runs side by side.

    Parameters
    ----------
    first, second
        The runs, in the order in which they were named.
    """

    kind: ClassVar[str] = "comparison"

    first: FinishedRun
    second: FinishedRun

    @classmethod
    def of(cls, first: FinishedRun, second: FinishedRun) -> ComparisonAnswer:
        """Return the comparison of two runs."""
        header = Header(name=f"{first.name}, {second.name}", model="", currency=common_currency((first, second)))
        return cls(header=header, first=first, second=second)

    @property
    def title(self) -> str:
        """What it is."""
        return "Two studies side by side"

    @property
    def subtitle(self) -> str:
        """Which ones."""
        return f"{self.names[0]}; {self.names[1]}."

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The comparison in a few sentences."""
        sentences = []
        for label, run in zip(self.names, self.runs, strict=True):
            found = run.summary
            # Ranking and allocation of one run may name the same limit differently.
            limits = " and ".join(dict.fromkeys(with_unit(f"{limit:g}", name) for name, limit in run.limits.items()))
            kept = f"{label}: {found['yield [-]']:.2%} of units keep the limit of {limits}"
            if "met" in found:  # an allocation; a ranking alone decides nothing
                kept += f", {'met' if found['met'] else 'NOT met'}, cost {found['cost [cost units]']:.2f} cost units"
            sentences.append(f"{kept}.")
        table = self.ranking
        moved = list(table.loc[table["90 % intervals"] == "apart", "source"])
        sentences.append(
            f"Sources whose total indices differ beyond their 90 % intervals: {', '.join(moved)}."
            if moved
            else "No source's total index differs beyond its 90 % intervals."
        )
        return tuple(sentences)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What makes the two hard to compare."""
        found = []
        if not self.same_question:
            found.append("The two studies were not asked the same question: reducer, torque, limit or yield differ.")
        versions = [run.manifest.get("versions") for run in self.runs]
        if versions[0] != versions[1]:
            found.append("The two studies ran with different versions of the program or its libraries.")
        found += [
            f"{label} is a quick run: its intervals are wide."
            for label, run in zip(self.names, self.runs, strict=True)
            if run.manifest.get("quick")
        ]
        if self.first.currency != self.second.currency:
            units = [run.currency or COST_UNITS for run in self.runs]
            found.append(f"The costs of A are in {units[0]} and those of B in {units[1]}; they cannot be compared.")
        if self.first.manifest.get("study hash") == self.second.manifest.get("study hash"):
            found.append("Both are runs of one and the same study, seed included.")
        return tuple(found)

    @cached_property
    def ranking(self) -> pd.DataFrame:
        """Every source with its rank and total index in both, and whether their intervals lie apart."""
        columns = ["rank [-]", TOTAL, LOW, HIGH]
        first, second = (run.ranking.set_index("source")[columns] for run in self.runs)
        joint = first.add_suffix(" A").join(second.add_suffix(" B"), how="outer")
        apart = (joint[f"{LOW} A"] > joint[f"{HIGH} B"]) | (joint[f"{LOW} B"] > joint[f"{HIGH} A"])
        missing = joint[f"{TOTAL} A"].isna() | joint[f"{TOTAL} B"].isna()
        return pd.DataFrame(
            {
                "source": joint.index,
                "rank A [-]": joint["rank [-] A"].to_numpy(),
                "rank B [-]": joint["rank [-] B"].to_numpy(),
                "total index A [-]": joint[f"{TOTAL} A"].to_numpy(),
                "total index B [-]": joint[f"{TOTAL} B"].to_numpy(),
                "90 % intervals": np.select([missing, apart], ["only in one", "apart"], "overlap"),
            }
        ).sort_values(["rank A [-]", "rank B [-]"], ignore_index=True)

    @cached_property
    def differing(self) -> pd.DataFrame:
        """Every number and word of the two answers that is not the same in both."""
        table = self.to_frame("answers")
        return table[table[self.names[0]] != table[self.names[1]]]

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Answers, rankings, zones."""
        return (
            Section(heading="Answers", tables=(("answers", _headline_table(self)),)),
            Section(
                heading="Which error drives it",
                paragraphs=("Overlap of intervals does not prove that two indices are the same.",),
                figures=(_ranking_figure(self),),
                tables=(("rankings", self.ranking),),
            ),
            Section(heading="What to write on the drawing", tables=(("zones", _zones_table(self)),)),
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The comparison for a program."""
        answers, ranking, zones = (tables_of(self.sections)[name] for name in ("answers", "rankings", "zones"))
        return {
            "A": self.first.name,
            "B": self.second.name,
            "same question": self.same_question,
            "answers": answers.to_dict("records"),
            "rankings": ranking.astype(object).where(ranking.notna(), None).to_dict("records"),
            "zones": zones.astype(object).where(zones.notna(), None).to_dict("records"),
            "warnings": list(self.warnings),
        }

    @property
    def runs(self) -> tuple[FinishedRun, FinishedRun]:
        """Both runs."""
        return self.first, self.second

    @property
    def names(self) -> tuple[str, str]:
        """Names of both runs, with their folders where two are of one study."""
        names = [run.name for run in self.runs]
        if names[0] == names[1]:
            names = [f"{run.name} in {run.folder}" for run in self.runs]
        return f"A: {names[0]}", f"B: {names[1]}"

    @property
    def same_question(self) -> bool:
        """Whether both were asked for the same reducer or model, torque, limits and yield."""
        asked = ("reducer", "model", "torque [N·m]", "yield target [-]", *self.first.limits, *self.second.limits)
        return all(self.first.summary.get(name) == self.second.summary.get(name) for name in asked)


def _headline_table(comparison: ComparisonAnswer) -> pd.DataFrame:
    """Return every number of the two answers, and the difference where there is one."""
    first, second = (run.summary for run in comparison.runs)
    rows = []
    for name in dict.fromkeys([*first, *second]):
        values = [summary.get(name) for summary in (first, second)]
        if any(isinstance(value, list | dict) for value in values):
            continue
        row: dict[str, object] = {"quantity": name}
        row |= {label: "–" if value is None else value for label, value in zip(comparison.names, values, strict=True)}
        numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
        row["B − A"] = float(numbers[1] - numbers[0]) if len(numbers) == 2 else ""
        rows.append(row)
    return pd.DataFrame(rows)


def _zones_table(comparison: ComparisonAnswer) -> pd.DataFrame:
    """Return every zone and cost in both."""
    parts = []
    for run in comparison.runs:
        zone = run.zones["plus [unit]"] - run.zones["minus [unit]"]
        parts.append(pd.DataFrame({"zone": zone, "cost": run.zones["cost [cost units]"], "unit": run.zones["unit"]}))
        parts[-1].index = pd.Index(_names(run.zones), name="source")
    joint = parts[0].add_suffix(" A").join(parts[1].add_suffix(" B"), how="outer")
    joint = joint[(joint[["zone A", "zone B"]] != 0.0).any(axis=1)]  # what both neglect is left out
    change = (joint["zone B"] / joint["zone A"].where(joint["zone A"] > 0) - 1) * 100
    return pd.DataFrame(
        {
            "source": joint.index,
            "unit": joint["unit A"].fillna(joint["unit B"]).to_numpy(),
            "zone A": joint["zone A"].to_numpy(),
            "zone B": joint["zone B"].to_numpy(),
            "B over A, less 1 [%]": change.to_numpy(),
            "cost A [cost units]": joint["cost A"].to_numpy(),
            "cost B [cost units]": joint["cost B"].to_numpy(),
        }
    )


def _names(zones: pd.DataFrame) -> pd.Series:
    """Return what the sources of a tolerance table are, whatever its own ids."""
    own = zones.get("source")
    return zones["id"] if own is None else own.where(own.notna() & (own != ""), zones["id"])


def _ranking_figure(comparison: ComparisonAnswer) -> Figure:
    """Draw the total indices of both with their intervals."""
    names = list(comparison.ranking["source"])
    series = []
    for label, run in zip(comparison.names, comparison.runs, strict=True):
        own = run.ranking.set_index("source").reindex(names).fillna(0.0)
        columns = (list(own[column].astype(float)) for column in (TOTAL, LOW, HIGH))
        total, low, high = columns
        series.append(Series(label=label, kind="bars", x=names, y=total, low=low, high=high))
    return Figure(
        name="rankings",
        title="Total Sobol index of every source in both studies, with 90 % intervals",
        x_label="total index ST [-]",
        series=tuple(series),
    )

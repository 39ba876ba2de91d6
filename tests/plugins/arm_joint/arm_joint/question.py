"""A question with its teller: how far the limited outputs of random units spread."""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import pandas as pd

import tolalloc as ta
from tolalloc.reading.named_fields import whole


class SpreadTeller(ta.Teller[pd.DataFrame], kind="spread"):
    """What is said of the spread."""

    @property
    def title(self) -> str:
        """What the answer is about."""
        return f"How far {self.header.model} spreads: {self.header.name}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for each output."""
        return tuple(f"{row.output}: {row.mean:.4g} ± {row.deviation:.2g}." for row in self.result.itertuples())

    @property
    def sections(self) -> tuple[ta.Section, ...]:
        """The table."""
        return (ta.Section(heading="Spread", tables=(("spread", self.result),)),)

    @property
    def summary(self) -> dict[str, Any]:
        """The answer for a program."""
        return {"spread": self.result.to_dict("records")}


@dataclass(frozen=True, kw_only=True)
class Spread(ta.Question):
    """Mean and standard deviation of random units."""

    kind = "spread"
    units: Annotated[int, whole("a whole number from 2 to 100,000", 2, 100_000)] = 100

    def answer(self, prepared: Any, record: Any) -> ta.Answer[pd.DataFrame]:
        """Return both for each limited output."""
        outputs = tuple(prepared.study.limits)
        with record.stage("random units"):
            found = prepared.model.observed(record.observe).reading(outputs)(prepared.random_units(self.units))
        values = found.values[found.good]
        table = pd.DataFrame({"output": outputs, "mean": values.mean(axis=0), "deviation": values.std(axis=0, ddof=1)})
        header = replace(prepared.header, statuses=record.counts, stages=record.stages)
        return ta.Answer(kind=self.kind, header=header, result=table)

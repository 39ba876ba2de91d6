"""What a measured curve tells of the parts of its unit: the answer with its sentences, tables, pictures and summary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tolalloc.bench.measurements import MeasuredCurve
from tolalloc.bench.posterior import Noise
from tolalloc.drawings.error_model import ErrorModel
from tolalloc.reading.units import ARCSECOND, DEGREE, MICROMETRE
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.reports.figure import Figure, Series

if TYPE_CHECKING:
    import pandas as pd

    from tolalloc.bench.diagnosis import Diagnosis


@dataclass(frozen=True, kw_only=True)
class DiagnosisAnswer(Answer):
    """A diagnosed unit; the header has its name, and what the binding of the drawing to the reducer assumes."""

    # Its nominal design, and the torque on the carrier at which it was measured [N·m]
    reducer: Reducer
    torque: float
    errors: ErrorModel  # What the drawings say of its parts
    curve: MeasuredCurve  # Its cleaned curve
    noise: Noise  # What separates a reading from the model
    level: float  # Probability that the named sources must have of containing the dominant one [-]
    diagnosis: Diagnosis  # What was found
    kind: ClassVar[str] = "diagnosis"

    @cached_property
    def sources(self) -> pd.DataFrame:
        """What the gauge of every source would show, the likeliest to dominate first."""
        import pandas as pd

        found = self.diagnosis
        zones = np.array([source.zone for source in self.errors.active])
        low, high = found.reading_interval / MICROMETRE
        frame = pd.DataFrame(
            {
                "source": found.sources,
                "P(dominant) [%]": found.dominant_probability * 100,
                "named": ["yes" if name in found.named else "no" for name in found.sources],
                "reading [µm]": found.reading_mean / MICROMETRE,
                "low 2.5 % [µm]": low,
                "high 97.5 % [µm]": high,
                "zone [µm]": zones / MICROMETRE,
            }
        )
        order = np.lexsort((-np.abs(found.reading_mean) / zones, -found.dominant_probability))
        return frame.iloc[order].reset_index(drop=True)

    def _columns(self) -> pd.DataFrame:
        """Return every column with its interval."""
        import pandas as pd

        found = self.diagnosis
        levers = [source.lever for source in self.errors.active for _ in source.columns]
        scale = np.array(levers) / MICROMETRE
        low, high = found.column_interval * scale
        return pd.DataFrame(
            {
                "column": found.columns,
                "mean [µm]": found.column_mean * scale,
                "low 2.5 % [µm]": low,
                "high 97.5 % [µm]": high,
            }
        )

    def _groups(self) -> pd.DataFrame:
        """Return the columns that the curve does not tell apart, with the combination that it knows."""
        import pandas as pd

        rows = [
            {
                "group [-]": number,
                "column": column,
                "spread alone over the drawing's [-]": alone,
                "weight in the known sum [-]": weight,
                "known sum over the drawing's spread [-]": group.value,
                "its spread over the drawing's [-]": group.together,
            }
            for number, group in enumerate(self.diagnosis.groups, start=1)
            for column, alone, weight in zip(group.columns, group.alone, group.combination, strict=True)
        ]
        return pd.DataFrame(rows)

    @property
    def title(self) -> str:
        """Which unit it is."""
        return f"Diagnosis of {self.header.name}"

    @property
    def subtitle(self) -> str:
        """How it was measured."""
        return f"{self.header.model}, {self.torque:g} N·m on the carrier, {len(self.errors.active)} sources"

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """The diagnosis in sentences."""
        found, fit = self.diagnosis, self.diagnosis.fit
        peak_to_peak = np.ptp(self.curve.transmission_error) / ARCSECOND
        measured = f"The curve of {self.header.name} has {peak_to_peak:.1f}″ between its highest and lowest reading"
        if not fit.explained:
            return (
                f"{measured}. No errors inside these drawings explain it: mean sum of squared residuals "
                f"{fit.chi_square:.0f} where {fit.freedom} are expected. The unit has an error that is not in the "
                "tolerance table, the bench counts its angle differently, or the noise is larger than stated.",
            )
        named = self.sources[self.sources["named"] == "yes"]
        likely = ", ".join(
            f"{name} ({share:.0f} %)" for name, share in zip(named["source"], named["P(dominant) [%]"], strict=True)
        )
        first = named.iloc[0]
        sentences = [
            f"{measured}. The source that drives it is with {self.level:.0%} probability among: {likely}.",
            f"{first['source']}: its gauge would show {first['reading [µm]']:.2g} µm (95 % interval "
            f"{first['low 2.5 % [µm]']:.2g}…{first['high 97.5 % [µm]']:.2g} µm), the drawing allows "
            f"{first['zone [µm]']:.3g} µm.",
        ]
        if found.twins:
            pairs = "; ".join(f"{one} and {other}" for one, other in found.twins)
            sentences.append(
                "The reducer turned by half a turn is the same reducer, so no curve tells these apart: " + pairs + "."
            )
        sentences += [
            f"Not told apart by this curve: {', '.join(sources)}."
            for sources in dict.fromkeys(group.sources for group in found.groups)
        ]
        return tuple(sentences)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before opening the unit."""
        found = []
        if not self.diagnosis.fit.explained:
            found.append("Not explained: readings of the sources are of the least bad errors and mean nothing.")
        if self.header.failed:
            found.append(f"{self.header.failed} curves have no equilibrium and were left out.")
        return (*found, *(f"Repaired: {repair}." for repair in self.curve.repairs))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        noise = self.noise
        return (
            *self.reducer.assumptions,
            f"a reading errs by {noise.reading / ARCSECOND:.2g}″ (standard deviation), independently of the others",
            f"the model leaves out {noise.discrepancy / ARCSECOND:.2g}″ (standard deviation), alike over "
            f"{noise.correlation_angle / DEGREE:.2g}° of the carrier",
            "before the curve is read, the parts are distributed as the tolerance table says",
            "the bench's angle counts from the model's zero; its offset in transmission error is unknown",
            *self.header.assumptions,
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        found = self.diagnosis
        return {
            "unit": self.header.name,
            "reducer": self.header.model,
            "torque [N·m]": self.torque,
            "seed": self.header.seed,
            "explained": found.fit.explained,
            "mean sum of squared residuals [-]": found.fit.chi_square,
            "expected [-]": found.fit.freedom,
            "named": list(found.named),
            "level [-]": self.level,
            "sources": self.sources.to_dict("records"),
            "twins": [list(pair) for pair in found.twins],
            "not told apart": [list(group.sources) for group in found.groups],
            "curves solved [-]": found.evaluations,
            "curves failed [-]": found.failed,
            "warnings": list(self.warnings),
        }

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Sections in the order of the questions that a reader has."""
        groups = self._groups()
        return (
            Section(
                heading="Which source drives it",
                paragraphs=("The dominant source is the one without which this unit's peak-to-peak would fall most.",),
                figures=(self._dominant_figure(),),
                tables=(("sources", self.sources),),
            ),
            Section(heading="What the gauges would show", figures=(self._reading_figure(),)),
            Section(
                heading="What the curve does not tell apart",
                tables=(("groups", groups),) if len(groups) else (),
                paragraphs=() if len(groups) else ("Nothing beyond what the answer says.",),
            ),
            Section(heading="The curve", figures=self._curve_figures()),
            Section(heading="Columns of the model", tables=(("columns", self._columns()),)),
        )

    def _dominant_figure(self) -> Figure:
        names, shares = list(self.sources["source"]), list(self.sources["P(dominant) [%]"])
        return Figure(
            name="dominant",
            title="Which source drives this unit",
            x_label="probability of being the dominant source [%]",
            series=(Series(label="probability", kind="bars", x=names, y=shares),),
        )

    def _reading_figure(self) -> Figure:
        frame = self.sources
        share = frame[["reading [µm]", "low 2.5 % [µm]", "high 97.5 % [µm]"]].div(frame["zone [µm]"], axis=0)
        mean, low, high = (list(share[column]) for column in share.columns)
        names = list(frame["source"])
        return Figure(
            name="readings",
            title="What the gauges would show, over the drawing's zone",
            x_label="reading over zone [-]",
            series=(Series(label="mean and 95 % interval", kind="bars", x=names, y=mean, low=low, high=high),),
            vertical=((1.0, "zone"),),
        )

    def _curve_figures(self) -> tuple[Figure, Figure]:
        fit = self.diagnosis.fit
        angle = list(fit.carrier_angle / DEGREE)
        measured, fitted = (list(values / ARCSECOND) for values in (fit.measured, fit.fitted))
        low, high = (list(edge / ARCSECOND) for edge in fit.band)
        left = list((fit.measured - fit.fitted) / ARCSECOND)
        axis = "carrier angle [°]"
        return (
            Figure(
                name="curve",
                title="Measured curve, and those of the errors that it allows",
                x_label=axis,
                y_label="transmission error [arcsec]",
                series=(
                    Series(label="measured", kind="points", x=angle, y=measured),
                    Series(label="model, mean and 95 % band", kind="line", x=angle, y=fitted, low=low, high=high),
                ),
            ),
            Figure(
                name="left",
                title="Measured less model",
                x_label=axis,
                y_label="transmission error [arcsec]",
                series=(Series(label="measured less model", kind="line", x=angle, y=left),),
                horizontal=((0.0, ""),),
            ),
        )

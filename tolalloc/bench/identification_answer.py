"""What measured units say of the stiffness: the answer with its sentences, warnings, sections and summary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from tolalloc.bench import identification_exhibits as exhibits
from tolalloc.bench.information import Information
from tolalloc.bench.least_squares import Identified
from tolalloc.bench.measurements import Measurements
from tolalloc.bench.parameters import BIAS, Parameter
from tolalloc.bench.prediction import LARGE_DRIFT, PEAK_TO_PEAK, AllReadings, Prediction
from tolalloc.bench.profile import ParameterChoice, ParameterEstimate, ParameterProfile, as_stiffness
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.files import write_identified_stiffness
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.reports.answer import Answer
from tolalloc.reports.document import Section
from tolalloc.sensitivity.surrogate.regression import BoxPolynomial


@dataclass(frozen=True, kw_only=True)
class IdentificationAnswer(Answer):
    """Stiffnesses from measured units, their uncertainty, and how simpler explanations compare."""

    # What was measured, and the reducer as it was given
    measurements: Measurements
    reducer: Reducer
    data: AllReadings  # All readings in one row
    parameters: tuple[Parameter, ...]  # The unknowns
    found: Identified  # The least objective, on the model itself
    # What the model says should have been read, before and after
    at_start: Prediction
    at_found: Prediction
    at_written: Prediction  # The same for what the stiffness file states
    # What the data fix around the least objective, and around what the stiffness file states
    information: Information
    written: Information
    # How far the least objective of the polynomials is from that of the model, over the standard deviation [-]
    drift: float
    profiles: tuple[ParameterProfile, ...]  # The same without a parabola
    estimates: tuple[ParameterEstimate, ...]  # Every parameter with its uncertainty
    bootstrap: Float[np.ndarray, "resample parameter"] | None  # Coordinates for units drawn anew; none for a few [-]
    choices: tuple[ParameterChoice, ...]  # Simpler and richer choices of parameters; none for a few units
    chosen: ParameterChoice | None  # The simplest that is as good as the best
    polynomial: BoxPolynomial  # What profiles, bootstrap and choices asked instead of the model
    kind: ClassVar[str] = "identification"

    @property
    def logarithms(self) -> tuple[str, ...]:
        """Symbols of all parameters but the bias: those whose relative changes the directions combine."""
        return tuple(item.symbol for item in self.parameters if item.name != BIAS)

    @property
    def count(self) -> str:
        """Number of units in words."""
        units = int(self.data.units.size)
        return "1 unit" if units == 1 else f"{units} units"

    @cached_property
    def stiffness(self) -> IdentifiedStiffness | None:
        """The answer for a stiffness file; none if no stiffness was asked for."""
        notes = (
            f"identified by {self.found.method} from {self.count} of {self.reducer.name}; residuals "
            f"{np.sqrt(self.information.reduced_chi_square):.3g} times the noise",
        )
        return as_stiffness(self.estimates, self.written, self.measurements.source, notes)

    def rms(self, prediction: Prediction, kind: str) -> float:
        """Return the root-mean-square of predicted less measured for one kind of reading [arcsec]."""
        rows = self.data.rows(kind)
        left = prediction.values[rows] - self.data.measured[rows]
        return float(np.sqrt((left**2).mean()) / ARCSECOND)

    def choice(self, *names: str) -> ParameterChoice | None:
        """Return the choice of just these parameters, if it was judged."""
        for item in self.choices:
            if {one.name for one in item.parameters} == set(names):
                return item
        return None

    @property
    def title(self) -> str:
        """What was measured on which reducer."""
        return f"{self.reducer.name}: stiffness from {self.measurements.name}"

    @property
    def subtitle(self) -> str:
        """How it was found."""
        return (
            f"{self.count}, {self.data.measured.size} readings; {self.found.method} on polynomials of "
            f"the model, finished on the model by Gauss–Newton, {self.found.evaluations} evaluations in all; "
            f"{self.found.status}; seed {self.header.seed}."
        )

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """Parameters, what the data fix, residuals, and what simpler explanations leave."""
        reach = "; ".join(
            f"{kind} {self.rms(self.at_start, kind):.3g}″ as given, {self.rms(self.at_found, kind):.3g}″ at "
            f"the least objective, {self.rms(self.at_written, kind):.3g}″ with what the stiffness file states"
            for kind in self.data.kinds
        )
        return (
            *(item.sentence for item in self.estimates),
            *(
                f"Direction {number}: {item.sentence(self.logarithms)}."
                for number, item in enumerate(self.information.directions, start=1)
            ),
            f"Root-mean-square of model less measured: {reach}.",
            *self._comparisons,
        )

    @property
    def _comparisons(self) -> tuple[str, ...]:
        """How a constant alone, and the choice by units not seen, compare with the fit."""
        if self.chosen is None:
            return (f"{self.count}: too few to judge a fit by units that it has not seen, or to resample.",)
        return (
            *((self._verdict,) if PEAK_TO_PEAK in self.data.kinds else ()),
            f"Judged by {self.count}, each left out in turn, the simplest choice as good as the best within a standard "
            f"error is: {self.chosen.name}.",
        )

    @property
    def _verdict(self) -> str:
        """Whether a constant explains the peak-to-peaks, or the stiffness does, or nothing needs explaining."""
        asked = tuple(item.name for item in self.parameters)
        given, constant, whole = (self.choice(*names) for names in ((), (BIAS,), asked))
        if not (given and constant and whole):
            return f"{self.count} are too few to judge the fit of all parameters by units that it has not seen."

        def left(item: ParameterChoice, *, unseen: bool) -> float:
            return item.rms(self.data, PEAK_TO_PEAK, unseen=unseen) / ARCSECOND

        numbers = (
            f"the reducer as given leaves {left(given, unseen=False):.3g}″ rms, one bias "
            f"{left(constant, unseen=False):.3g}″ ({left(constant, unseen=True):.3g}″ on units left out), the fit of "
            f"{whole.name} {left(whole, unseen=False):.3g}″ ({left(whole, unseen=True):.3g}″ on units left out)."
        )
        unseen = {
            name: left(item, unseen=True) for name, item in (("given", given), ("bias", constant), ("fit", whole))
        }
        both = "Stiffness and constant together explain" if BIAS in asked else "The stiffness explains"
        return {
            "given": "Neither a constant nor the stiffness explains these peak-to-peaks better than the reducer as "
            "given: ",
            "bias": "A constant explains these peak-to-peaks better than the stiffness does: ",
            "fit": f"{both} these peak-to-peaks better than a constant does: ",
        }[min(unseen, key=lambda name: unseen[name])] + numbers

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before using the numbers."""
        found, own = [], self.information
        open_ones = [item.parameter.symbol for item in self.estimates if not item.identified]
        if open_ones:
            found.append(
                f"Not identified: {', '.join(open_ones)}. What the data leave open the stiffness file takes from the "
                "bounds: towards their middle, with the standard uncertainty of an even distribution."
            )
        found += [
            f"{item.parameter.symbol} has its least objective on a bound: widen it, or read the interval as a limit."
            for item in self.estimates
            if item.on_bound and item.identified
        ]
        if self.data.noise_stated and own.estimated:
            found.append(
                f"Residuals are {np.sqrt(own.reduced_chi_square):.2g} times the stated noise: errors of the units or "
                "the model itself miss something. All uncertainties are widened by that factor."
            )
        if not self.data.noise_stated:
            found.append("No noise was stated, so it is estimated from what the fit leaves.")
        if self.drift > LARGE_DRIFT:
            found.append(
                f"The polynomials behind profiles and bootstrap have their least objective {self.drift:.2g} standard "
                "deviations away from the model's, so first-order intervals of the model widen theirs: narrow the "
                "bounds, or ask for fewer parameters."
            )
        return (*found, *(f"Repaired: {repair}." for repair in self.measurements.repairs))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What no source states."""
        return (
            *self.reducer.assumptions,
            *self.measurements.assumptions,
            "noise is normal and independent from reading to reading; errors of the units are known exactly",
            "curves and loops lose their mean; angles and directions of the bench are those of the model",
            "bounds enter the covariance as an even distribution between them",
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The whole answer for a program, units in the names."""
        data, kinds = self.data, self.data.kinds
        return {
            "reducer": self.reducer.name,
            "data": self.measurements.name,
            "units [-]": int(data.units.size),
            "readings [-]": int(data.measured.size),
            "method": self.found.method,
            "objective [-]": self.found.objective,
            "evaluations [-]": self.found.evaluations,
            "status": self.found.status,
            "parameters": [_as_row(item) for item in self.estimates],
            "directions": [item.sentence(self.logarithms) for item in self.information.directions],
            "reduced chi square [-]": self.information.reduced_chi_square,
            "rms before [arcsec]": {kind: self.rms(self.at_start, kind) for kind in kinds},
            "rms after [arcsec]": {kind: self.rms(self.at_found, kind) for kind in kinds},
            "rms as written [arcsec]": {kind: self.rms(self.at_written, kind) for kind in kinds},
            "choices": [
                {
                    "fitted": item.name,
                    "left out [noise]": item.score,
                    "rms [arcsec]": {kind: item.rms(data, kind, unseen=False) / ARCSECOND for kind in kinds},
                    "rms left out [arcsec]": {kind: item.rms(data, kind, unseen=True) / ARCSECOND for kind in kinds},
                }
                for item in self.choices
            ],
            "chosen": self.chosen.name if self.chosen else None,
            "warnings": list(self.warnings),
            "assumptions": list(self.assumptions),
        }

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Sections in the order of the questions that a reader has."""
        polynomial = self.polynomial
        parameters = Section(
            heading="Parameters",
            paragraphs=(
                "The profile interval counts: it follows the real shape of the objective between the bounds. The "
                "first-order one assumes a parabola, the bootstrap draws the units anew. Written: what the "
                "stiffness file states, with one standard uncertainty: readings and bounds together.",
            ),
            tables=(("parameters", exhibits.parameters_table(self)),),
        )
        fixed = Section(
            heading="What the data fix",
            paragraphs=(
                "Eigenvectors of the Fisher information, best known first: each is a combination of relative changes "
                "that the data know independently of the others.",
                f"Profiles, bootstrap and choices ask polynomials of the model: {polynomial.trained} runs, rms error "
                f"{polynomial.rms_error / ARCSECOND:.2g}″, largest {polynomial.largest_error / ARCSECOND:.2g}″ on "
                f"{polynomial.held_out} runs that the fit has not seen.",
            ),
            figures=(exhibits.profile_figure(self),),
            tables=(("directions", exhibits.directions_table(self)),),
        )
        choices = Section(
            heading="Simpler explanations",
            paragraphs=(
                "Each choice is fitted to all units but one and judged by that one, in turn. Chosen is the one with "
                "the fewest parameters that is as good as the best within one standard error.",
            ),
            tables=(("choices", exhibits.choices_table(self)),),
        )
        readings = Section(
            heading="Measured against modelled",
            figures=exhibits.reading_figures(self),
            tables=(("units", exhibits.units_table(self)),),
        )
        return (parameters, fixed, *((choices,) if self.choices else ()), readings)

    def add_files(self, folder: Path) -> None:
        """Add the stiffness file, if a stiffness was asked for."""
        if self.stiffness:
            write_identified_stiffness(self.stiffness, folder / "identified.stiffness.toml")


def _as_row(item: ParameterEstimate) -> dict[str, Any]:
    kind = "standard" if item.parameter.name == BIAS else "relative standard"
    unit = "arcsec" if item.parameter.name == BIAS else "-"
    return {
        "name": item.parameter.name,
        "unit": item.parameter.unit,
        "start": item.parameter.start,
        "value": item.value,
        f"{kind} uncertainty [{unit}]": item.uncertainty,
        "interval": list(item.interval),
        "identified": item.identified,
        "on bound": item.on_bound,
    }

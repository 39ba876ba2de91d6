"""Everything the report of an identification is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tolalloc.bench.identification.data import Block, Data
from tolalloc.bench.identification.estimate import Estimate, as_stiffness
from tolalloc.bench.identification.information import Information
from tolalloc.bench.identification.parameters import BIAS, Parameter
from tolalloc.bench.identification.prediction import Prediction
from tolalloc.bench.identification.profile import Profile
from tolalloc.bench.identification.resampling import Bootstrap, Candidate
from tolalloc.bench.identification.result import Comparison, Identified
from tolalloc.bench.measurement.records import Measurements
from tolalloc.rv.reducer.design import Reducer
from tolalloc.rv.reducer.stiffness import IdentifiedStiffness
from tolalloc.surrogate.polynomial import BoxPolynomial
from tolalloc.units import ARCSECOND


@dataclass(frozen=True, kw_only=True)
class IdentificationResults:
    """A finished identification.

    Parameters
    ----------
    measurements, reducer
        What was measured, and the reducer as it was given.
    data
        All readings in one row.
    parameters
        The unknowns.
    found
        Answer of the chosen method, on the model itself.
    at_start, at_found
        What the model says should have been read, before and after.
    at_written
        The same for what the stiffness file states.
    information, written
        What the data fix around the least objective, and around what the stiffness file states.
    profiles, bootstrap
        The same without a parabola, and for units drawn anew; no bootstrap for a few units.
    drift
        How far the least objective of the polynomials is from that of the model, over the standard deviation [-].
    estimates
        Every parameter with its uncertainty.
    candidates, chosen
        Simpler and richer choices of parameters, and the simplest that is as good as the best; none for a few units.
    stand_in
        The polynomials that profiles, bootstrap, candidates and swarms asked instead of the model.
    comparison
        Every method over many seeds, if asked for.
    seed
        Seed of every random number [-].
    """

    measurements: Measurements
    reducer: Reducer
    data: Data
    parameters: tuple[Parameter, ...]
    found: Identified
    at_start: Prediction
    at_found: Prediction
    at_written: Prediction
    information: Information
    written: Information
    drift: float
    profiles: tuple[Profile, ...]
    estimates: tuple[Estimate, ...]
    bootstrap: Bootstrap | None
    candidates: tuple[Candidate, ...]
    chosen: Candidate | None
    stand_in: BoxPolynomial
    comparison: tuple[Comparison, ...]
    seed: int

    @property
    def logarithms(self) -> tuple[str, ...]:
        """Symbols of all parameters but the bias: those whose relative changes the directions combine."""
        return tuple(item.symbol for item in self.parameters if item.name != BIAS)

    @property
    def count(self) -> str:
        """Number of units in words."""
        units = int(self.data.units.size)
        return "1 unit" if units == 1 else f"{units} units"

    @property
    def stiffness(self) -> IdentifiedStiffness | None:
        """The answer for a stiffness file; none if no stiffness was asked for."""
        notes = (
            f"identified by {self.found.method} from {self.count} of {self.reducer.name}; residuals "
            f"{np.sqrt(self.information.reduced_chi_square):.3g} times the noise",
        )
        return as_stiffness(self.estimates, self.written, self.measurements.source, notes)

    def rms(self, prediction: Prediction, kind: str) -> float:
        """Return the root-mean-square of predicted less measured for one kind of reading [arcsec]."""
        rows = np.concatenate([np.arange(self.data.measured.size)[block.rows] for block in self.blocks(kind)])
        left = prediction.values[rows] - self.data.measured[rows]
        return float(np.sqrt((left**2).mean()) / ARCSECOND)

    def blocks(self, kind: str) -> tuple[Block, ...]:
        """Return the blocks of one kind."""
        return tuple(block for block in self.data.blocks if block.kind == kind)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of readings that there are."""
        return tuple(dict.fromkeys(block.kind for block in self.data.blocks))

    def candidate(self, *names: str) -> Candidate | None:
        """Return the candidate with just these parameters, if it was judged."""
        for item in self.candidates:
            if {one.name for one in item.parameters} == set(names):
                return item
        return None

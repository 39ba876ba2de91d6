"""From measured units to stiffnesses: fit, what the data fix, and what simpler explanations would do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import InputError
from tolalloc.reading.units import ARCSECOND
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.reducer.stiffness import IdentifiedStiffness
from tolalloc.running.progress import Progress
from tolalloc.sensitivity.surrogate.regression import BoxPolynomial
from tolalloc.wings.bench.information import Information, information
from tolalloc.wings.bench.least_squares import IdentificationProblem, Identified, gauss_newton, require_enough, starts
from tolalloc.wings.bench.measurements import Measurements
from tolalloc.wings.bench.parameters import BIAS, TORQUE, Parameter, parameter
from tolalloc.wings.bench.prediction import (
    LARGE_DRIFT,
    LOOP,
    AllReadings,
    KernelPredictor,
    Prediction,
    Surrogate,
    data_of,
    fit_surrogate,
)
from tolalloc.wings.bench.profile import (
    FEWEST_UNITS,
    ParameterChoice,
    ParameterEstimate,
    ParameterProfile,
    as_stiffness,
    bootstrap,
    estimates,
    judged,
    profile,
    simplest,
)

_ANY_BIAS = (-3600.0, 3600.0)
STARTS = 8
"""Starts of Gauss–Newton: flat directions end in several corners of the box [-]."""


@dataclass(frozen=True, kw_only=True)
class IdentificationRequest:
    """What is to be identified."""

    parameters: tuple[Parameter, ...]  # The unknowns
    seed: int = 1  # Seed of every random number [-]
    data: str = "measurements"  # Where the data were read, for errors

    def __post_init__(self) -> None:
        place, names = "identification", [item.name for item in self.parameters]
        if not set(names) - {BIAS}:
            allowed = "one or more besides the bias, which is the baseline"
            raise InputError.of_argument(place, "parameters", names, allowed)
        for name in names:
            if names.count(name) > 1:
                raise InputError.of_argument(place, "parameters", name, "each parameter once")


@dataclass(frozen=True, kw_only=True)
class IdentificationResult:
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

    @property
    def stiffness(self) -> IdentifiedStiffness | None:
        """What a stiffness file states; none if no stiffness was asked for."""
        units = int(self.data.units.size)
        notes = (
            f"identified by {self.found.method} from {'1 unit' if units == 1 else f'{units} units'} of "
            f"{self.reducer.name}; residuals {np.sqrt(self.information.reduced_chi_square):.3g} times the noise",
        )
        return as_stiffness(self.estimates, self.written, self.measurements.source, notes)

    def rms(self, prediction: Prediction, kind: str) -> float:
        """Return the root-mean-square of predicted less measured for one kind of reading [rad]."""
        rows = self.data.rows(kind)
        left = prediction.values[rows] - self.data.measured[rows]
        return float(np.sqrt((left**2).mean()))

    def choice(self, *names: str) -> ParameterChoice | None:
        """Return the choice of just these parameters, if it was judged."""
        return next((item for item in self.choices if {one.name for one in item.parameters} == set(names)), None)


def identify(
    request: IdentificationRequest, measurements: Measurements, reducer: Reducer, progress: Progress
) -> IdentificationResult:
    """Return the stiffnesses, their uncertainty, and how simpler explanations compare.

    The stiffness of the reducer is where every search begins.
    """
    data, seeds = data_of(measurements, request.data), SeedTree(request.seed).child("identification")
    _require_visible(request, data)
    kernel = KernelPredictor(reducer, request.parameters, measurements, data, progress.advance)
    problem = IdentificationProblem(
        parameters=request.parameters,
        data=data,
        predictor=kernel,
        weight=np.ones(len(measurements.units)),
        place=request.data,
    )
    require_enough(problem)
    progress.begin("polynomials of the model")
    surrogate = fit_surrogate(kernel, seeds.child("stand-in"))
    _require_close(request, data, surrogate)
    quick = problem.of(request.parameters, surrogate)
    progress.begin("Gauss–Newton")
    found = _found(problem, quick, seeds)
    prediction = kernel(found.coordinates)
    own = information(problem, prediction, found.coordinates)
    widened = problem.widened(own.variance_factor)
    written = gauss_newton(replace(widened, evenly=True), found.coordinates[np.newaxis]).coordinates
    at_written = kernel(written)
    progress.begin("what the data fix")
    here = widened.of(request.parameters, surrogate.anchored(found.coordinates, prediction))
    near = gauss_newton(here, found.coordinates[np.newaxis]).coordinates
    profiles = tuple(profile(here, near, at, own) for at in range(len(request.parameters)))
    drift = float((np.abs(near - found.coordinates) / np.sqrt(np.diag(own.covariance))).max())
    if drift > LARGE_DRIFT:
        profiles = tuple(item.widened(own.interval[:, at]) for at, item in enumerate(profiles))
    several = data.units.size >= FEWEST_UNITS
    progress.begin("other choices")
    choices = judged_choices(quick, surrogate, reducer) if several else ()
    spread = information(widened, at_written, written)
    return IdentificationResult(
        measurements=measurements,
        reducer=reducer,
        data=data,
        parameters=request.parameters,
        found=found,
        at_start=kernel(problem.start),
        at_found=prediction,
        at_written=at_written,
        information=own,
        written=spread,
        profiles=profiles,
        drift=drift,
        estimates=estimates(request.parameters, own, spread, profiles),
        bootstrap=bootstrap(here, near, seeds.child("bootstrap")) if several else None,
        choices=choices,
        chosen=simplest(choices) if choices else None,
        polynomial=surrogate.polynomial,
    )


def _require_visible(request: IdentificationRequest, data: AllReadings) -> None:
    """Refuse a bias or a torque where no reading shows one, and a prior against readings without a stated noise."""
    names = [item.name for item in request.parameters]
    if BIAS in names and data.peak_to_peak is None:
        raise InputError(
            f"{request.data}: parameter 'bias' needs peak-to-peaks; the mean of curves and loops is removed."
        )
    if not data.noise_stated and any(isfinite(item.prior) for item in request.parameters):
        raise InputError(f"{request.data}: a prior can only be weighed against readings whose noise_arcsec is stated.")
    if TORQUE in names and all(block.kind == LOOP for block in data.blocks):
        raise InputError(
            f"{request.data}: parameter 'torque' needs peak-to-peaks or curves; loops measure their torque themselves."
        )


def _require_close(request: IdentificationRequest, data: AllReadings, surrogate: Surrogate) -> None:
    """Refuse bounds within which polynomials are no surrogate for the model."""
    off = surrogate.polynomial.rms_error
    if not off <= data.noise.min():
        bounds = ", ".join(f"{item.name}={item.low:g}:{item.high:g}" for item in request.parameters)
        error = (
            "in a part of them the model has no answer"
            if np.isnan(off)
            else f"polynomials of the model are off by {off / ARCSECOND:.2g}″ where the noise is "
            f"{data.noise.min() / ARCSECOND:.2g}″"
        )
        raise InputError(
            f"identification: bounds {bounds} are too wide, {error}; allowed are narrower ones, such as half to double."
        )


def _found(problem: IdentificationProblem, quick: IdentificationProblem, seeds: SeedTree) -> Identified:
    """Return the least objective on polynomials, finished on the model from there.

    The reducer as given is another start on the model, should polynomials lead astray.
    """
    near = gauss_newton(quick, starts(quick, STARTS, seeds.child("starts")))
    return gauss_newton(problem, np.stack([near.coordinates, problem.start])).after(near)


def judged_choices(quick: IdentificationProblem, surrogate: Surrogate, reducer: Reducer) -> tuple[ParameterChoice, ...]:
    """Return nothing, a bias, each parameter alone, all, and all with a bias, each judged by units not seen.

    The problem is that of the surrogate, which holds polynomials of all parameters.
    """
    asked = tuple(item for item in quick.parameters if item.name != BIAS)
    choices: list[tuple[Parameter, ...]] = [(), *((item,) for item in asked)]
    if len(asked) > 1:
        choices.append(asked)
    if quick.data.peak_to_peak is not None:
        bias = parameter(BIAS, reducer, _ANY_BIAS)
        choices[1:1] = [(bias,)]
        choices.append((*asked, bias))
    most = quick.data.units.size - 2 if quick.data.only_peak_to_peak else quick.readings
    return tuple(judged(quick, surrogate, choice) for choice in choices if len(choice) <= most)

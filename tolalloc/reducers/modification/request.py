"""Choosing the two modification amounts by a source's method."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import ARCMINUTE, MICROMETRE
from tolalloc.reducers.cycloid.clearance import LARGE
from tolalloc.reducers.equivalent.perfect import exact_loop
from tolalloc.reducers.modification.answer import ModificationAnswer
from tolalloc.reducers.modification.problem import ModificationProblem, reference
from tolalloc.reducers.modification.residual_gap import residual_gap
from tolalloc.reducers.modification.rotated_profile import METRICS, Metric, rotated_profile_fit
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.teeth.answer import contact_answer
from tolalloc.reports.header import Header

ASSUMPTIONS = {
    "song2019": (
        "song2019 prints no box: equidistant amount 0…1 mm, shift amount 0…±1 mm",
        "song2019's condition Δr_rp − |Δr_p| > 0 is none for a negative shift; Δr_rp − Δr_p keeps the radial clearance",
    ),
    "li2018": (
        "li2018's formulas are lost: least mean gap, radial clearance kept, no interference, is a well-posed reading",
        "work interval 25…100° in 100 steps, amounts 0…100 µm: li2018 prints none",
    ),
}
"""Method → what its source does not print."""


@dataclass(frozen=True, kw_only=True)
class ModificationRequest:
    """What is to be chosen.

    Raises
    ------
    InputError, UnknownNameError
        An unknown method or metric, or a radial clearance out of range.
    """

    method: str  # ``song2019``: closest to a rotated profile; ``li2018``: least gap on the working flank
    radial_clearance: float = 15 * MICROMETRE  # Smallest clearance at tip and root [m]
    rotation: float = 0.005  # δ of the profile to come close to, song2019 only [rad]
    metric: Metric = "same_angle"  # Distance of the profiles, song2019 only
    shift_sign: int = 1  # 1 for a positive and −1 for a negative shift, song2019 only [-]
    # Whether no pin may interfere after closing at φ0, song2019 only; li2018 always asks for it
    require_gap: bool = False

    def __post_init__(self) -> None:
        place = "modification"
        if self.method not in ASSUMPTIONS:
            raise UnknownNameError.among(place, "method", self.method, ASSUMPTIONS)
        if self.metric not in METRICS:
            raise UnknownNameError.among(place, "metric", self.metric, METRICS)
        if not 0 <= self.radial_clearance <= 1e-3:
            asked = f"{self.radial_clearance / MICROMETRE:g} µm"
            raise InputError.of_argument(place, "radial_clearance", asked, "0 to 1000 µm")

    def problem(self, reducer: Reducer) -> ModificationProblem:
        """Return what is minimised on a reducer's cycloid stage."""
        if self.method == "li2018":
            return residual_gap(reducer.cycloid_stage, self.radial_clearance)
        return rotated_profile_fit(
            reducer.cycloid_stage,
            shift_sign=self.shift_sign,
            metric=self.metric,
            rotation=self.rotation,
            radial_clearance=self.radial_clearance,
            require_gap=self.require_gap,
        )


def choose(request: ModificationRequest, reducer: Reducer, torque: float) -> ModificationAnswer:
    """Return the best amounts, and what they do on the reducer.

    The reducer's own modification is replaced; the torque on the carrier is that of the contact, negative resists
    [N·m].

    Raises
    ------
    InputError
        No amounts meet the constraints, or the best ones cannot be ground or mounted.
    """
    problem = request.problem(reducer)
    best = reference(problem)
    if best.violation > 0:
        equidistant, shift = (
            f"{low / MICROMETRE:g}…{high / MICROMETRE:g} µm"
            for low, high in zip(problem.lower, problem.upper, strict=True)
        )
        raise InputError(
            f"{reducer.name}: no equidistant amount of {equidistant} with a shift of {shift} will meet the "
            f"constraints; the nearest miss them by {best.violation / MICROMETRE:.3g} µm; "
            "allowed is less radial clearance."
        )
    modified = replace(reducer, modification=best.modification)
    contact = contact_answer(modified, torque)
    return ModificationAnswer(
        header=Header(
            name=request.method,
            model=reducer.name,
            conditions=contact.header.conditions,
            assumptions=ASSUMPTIONS[request.method],
        ),
        problem=problem,
        best=best,
        contact=contact,
        cautions=(
            *_cautions(request, reducer),
            *_beyond_catalogue(modified, contact.assessment.clearance.backlash),
        ),
    )


def _beyond_catalogue(modified: Reducer, backlash: float) -> tuple[str, ...]:
    """Return whether exact parts with the amounts have more play than the catalogue allows, backlash in [rad]."""
    if modified.catalogue is None:
        return ()
    lost, allowed = float(exact_loop(modified).lost_motion[-1]), modified.catalogue.lost_motion
    if max(lost, backlash) <= allowed:
        return ()
    return (
        f"Exact parts with these amounts have {backlash / ARCMINUTE:.2g}′ of backlash and {lost / ARCMINUTE:.2g}′ of "
        f"lost motion; the catalogue of {modified.name} allows {allowed / ARCMINUTE:.2g}′ of lost motion. Ask for less "
        "radial clearance or rotation before setting a drawing.",
    )


def _cautions(request: ModificationRequest, reducer: Reducer) -> tuple[str, ...]:
    """Return what the method itself must warn of."""
    if request.method != "song2019" or request.rotation * reducer.cycloid_stage.disc_pitch_radius <= LARGE:
        return ()
    return (
        f"A rotation of {request.rotation:g} rad is {request.rotation / ARCMINUTE:.0f} arcmin of play to each side; a "
        "precision reducer has one or two: ask for less before setting a drawing.",
    )

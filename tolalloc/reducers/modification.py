"""Equidistant and shift amount from wanted clearances or by a published method, and the optimum without chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, UnknownNameError
from tolalloc.reading.units import DEGREE, MICROMETRE, MILLIMETRE
from tolalloc.reducers.contact import ContactResult, contact_of
from tolalloc.reducers.cycloid.clearance import LARGE, formula_gap
from tolalloc.reducers.cycloid.tooth_profile import Amounts, ToothProfile, nearest_angles, path_of
from tolalloc.reducers.reducer.design import CycloidStage, Modification, Reducer

OnLines = Float[np.ndarray, " n"]
"""A number of every pair of amounts, or on every line."""
_ROUNDING = 1e-17  # violation that counts as none [m]
_MOST_OFF = 2 * MICROMETRE  # by which a wanted clearance may be missed by exact distances [m]
_UNMET = 1.0  # merit from which on a constraint is violated; no objective comes near it [m]
_FIRST, _POINTS, _LEVELS = 33, 9, 24  # the last points are 32·4²³ times closer than the bounds, which is rounding
Values = Callable[[Float[np.ndarray, "n p"]], Float[np.ndarray, "n p"]]
"""Values of points on n lines."""
Metric = Literal["same_angle", "normal", "nearest"]
METRICS: dict[Metric, str] = {
    "same_angle": "mean distance of the points with the same φ on the two profiles",
    "normal": "mean distance of the points with the same φ along the modified profile's normal",
    "nearest": "mean distance of the rotated profile's points from the modified profile",
}
METHODS = ("clearances", "song2019", "li2018")
"""Amounts that leave wanted clearances, and two published methods: closest to a rotated profile, and least gap."""
BUILDABLE_FLANK, BUILDABLE_RADIAL = 3.5 * MICROMETRE, 8 * MICROMETRE
"""Clearances that are wanted unless said otherwise, of a drawing of an RV-20E that can be built; assumed [m]."""
PUBLISHED_RADIAL = 15 * MICROMETRE
"""Radial clearance of the published methods unless said otherwise [m]."""


@dataclass(frozen=True, kw_only=True)
class EvaluatedAmounts:
    """Points of a problem, evaluated."""

    objective: OnLines  # What is to be minimised [m]
    constraints: Float[np.ndarray, "n c"]  # What must not be negative [m]

    @cached_property
    def violation(self) -> OnLines:
        """By how much all constraints together are missed, 0 where they are met [m]."""
        missed = np.maximum(-self.constraints, 0.0).sum(axis=-1)
        return np.where(missed > _ROUNDING, missed, 0.0)

    @cached_property
    def merit(self) -> OnLines:
        """One number to sort by: points that meet the constraints by objective, then the others by violation [m]."""
        return np.where(self.violation > 0, _UNMET + self.violation, self.objective)


@dataclass(frozen=True, kw_only=True)
class ModificationProblem:
    """Find the amounts (Δr_rp, Δr_p) with the smallest objective.

    Notes
    -----
    The gap after closing at φ0 is Δr_rp(1 − S) − Δr_p(C − qS) with C = √(1 − K1²S²), so it depends on φ by
    S ∈ [0, 1] alone (`tolalloc.reducers.cycloid.clearance.formula_gap`). It vanishes at S = 1, where its derivative
    by S is
    −Δr_rp + Δr_p/q, as K1² + q² = 1. C is concave in S: for Δr_p ≥ 0 the gap is convex and nowhere negative if and
    only if that derivative is not positive, q·Δr_rp ≥ Δr_p. For Δr_p < 0 it is concave and nowhere negative if and
    only if it is not negative at S = 0, Δr_rp ≥ Δr_p, from which q·Δr_rp ≥ Δr_p follows. So together with the radial
    clearance the one row q·Δr_rp − Δr_p ≥ 0 says gap ≥ 0 at every φ.
    """

    name: str  # What reports call it
    description: str  # What the objective measures, in a sentence for reports
    stage: CycloidStage  # Cycloid stage
    objective: Callable[[Amounts], OnLines]  # What is to be minimised [m]
    # Bounds of the two amounts [m]
    lower: Float[np.ndarray, " 2"]
    upper: Float[np.ndarray, " 2"]
    radial_clearance: float = 0.0  # Smallest clearance j at tip and root, Δr_rp − Δr_p ≥ j [m]
    require_gap: bool = False  # Whether no pin may interfere once the flank at φ0 is closed
    wanted: Modification | None = None  # The answer, where it follows from clearances that are wanted

    def constraints(self, amounts: Amounts) -> Float[np.ndarray, "n c"]:
        """Return what must not be negative: radial clearance beyond j and, if required, q·Δr_rp − Δr_p [m]."""
        equidistant, shift = amounts.T
        rows = [equidistant - shift - self.radial_clearance]
        if self.require_gap:
            rows.append(self.stage.flank_ratio * equidistant - shift)
        return np.stack(rows, axis=-1)

    def evaluate(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return objective and constraints."""
        return EvaluatedAmounts(objective=self.objective(amounts), constraints=self.constraints(amounts))


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The best of all points that were evaluated."""

    amounts: Float[np.ndarray, " 2"]  # Δr_rp and Δr_p [m]
    objective: float  # Objective there [m]
    violation: float  # By how much the constraints are missed there [m]
    evaluations: int  # Points that were evaluated [-]

    @property
    def modification(self) -> Modification:
        """The amounts as a tooth modification."""
        return Modification(equidistant=float(self.amounts[0]), shift=float(self.amounts[1]))

    @property
    def status(self) -> str:
        """One sentence: whether the answer can be used."""
        if self.violation == 0:
            return f"met every constraint; best of {self.evaluations} points"
        missed = f"{self.violation / MICROMETRE:.4g} µm"
        return f"no point of {self.evaluations} met the constraints; the one that misses them least, by {missed}"


class BestPoint:
    """Evaluates points of a problem, counts them and keeps the best."""

    def __init__(self, problem: ModificationProblem) -> None:
        self.problem = problem
        self.amounts, self.evaluations = np.full(2, np.nan), 0
        self._merit = self.objective = self.violation = np.inf

    def __call__(self, amounts: Amounts) -> EvaluatedAmounts:
        """Return points evaluated."""
        evaluated = self.problem.evaluate(amounts)
        at = int(evaluated.merit.argmin())
        if evaluated.merit[at] < self._merit:
            self.amounts, self._merit = amounts[at].copy(), float(evaluated.merit[at])
            self.objective, self.violation = float(evaluated.objective[at]), float(evaluated.violation[at])
        self.evaluations += len(amounts)
        return evaluated


def reference(problem: ModificationProblem) -> Optimum:
    """Return the optimum of a problem: for each equidistant amount the best shift, and of these the best.

    Both searches narrow a grid down around its best point, by comparison alone (own derivation). So kinks, bounds and
    corners of the constraints need no care, and an optimum is missed only if it hides between the points of the first
    grid, 33 × 33.
    """
    best = BestPoint(problem)

    def best_by_shift(equidistants: Float[np.ndarray, "1 p"]) -> Float[np.ndarray, "1 p"]:
        def merit(shifts: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "n p"]:
            amounts = np.stack(np.broadcast_arrays(equidistants.T, shifts), axis=-1)
            return best(amounts.reshape(-1, 2)).merit.reshape(shifts.shape)

        bounds = np.repeat([[problem.lower[1]], [problem.upper[1]]], equidistants.size, axis=1)
        return _smallest(merit, *bounds)[np.newaxis]

    _smallest(best_by_shift, problem.lower[:1], problem.upper[:1])
    return Optimum(
        amounts=best.amounts, objective=best.objective, violation=best.violation, evaluations=best.evaluations
    )


def _smallest(values: Values, lower: OnLines, upper: OnLines) -> OnLines:
    """Return the smallest value on each of n lines."""
    rows = np.arange(lower.size)
    for points in (_FIRST, *[_POINTS] * (_LEVELS - 1)):
        share = np.linspace(0, 1, points)
        places = np.outer(lower, 1 - share) + np.outer(upper, share)
        found = values(places)
        at = found.argmin(axis=1)
        lower, upper = places[rows, np.maximum(at - 1, 0)], places[rows, np.minimum(at + 1, points - 1)]
    return np.asarray(found[rows, at])


def residual_gap(
    stage: CycloidStage,
    radial_clearance: float,
    largest: float = 100 * MICROMETRE,
    interval: tuple[float, float] = (25 * DEGREE, 100 * DEGREE),
    intervals: int = 100,
) -> ModificationProblem:
    """Return the problem of the least mean gap that is left on the working flank once it is closed at φ0.

    Mean over φ of Δr_rp·(1 − S) − Δr_p·(C − q·S) ≥ 0, Δr_rp − Δr_p ≥ j, over n + 1 equally spaced φ of the work
    interval [rad]. Both amounts are between 0 and a largest one, which is assumed; the default of the work interval is
    that of song2019, as li2018 prints neither it nor n.

    Notes
    -----
    li2018's formulas are lost, and its "difference of two curves", taken literally, is least without any shift; this
    is a well-posed reading [A]: least mean gap (`tolalloc.reducers.cycloid.clearance.formula_gap`) with a radial
    clearance of j or more and a gap of 0 or more everywhere, a linear program, whose closed form stands in
    `studies/published/li2018_closed_form.py`. Gaps are the linear formula's, good for amounts up to 50 µm.
    """
    angle, (first, last) = np.linspace(*interval, intervals + 1), (end / DEGREE for end in interval)
    units = (Modification(equidistant=1.0, shift=0.0), Modification(equidistant=0.0, shift=1.0))
    per_amount = np.array([formula_gap(stage, unit, angle).mean() for unit in units])  # the gap is linear in both

    def mean_gap(amounts: Amounts) -> OnLines:
        return np.asarray(amounts @ per_amount)

    return ModificationProblem(
        name="residual gap",
        description=f"mean gap after closing at φ0, {intervals + 1} points from φ = {first:g}° to {last:g}°",
        stage=stage,
        objective=mean_gap,
        lower=np.zeros(2),
        upper=np.full(2, largest),
        radial_clearance=radial_clearance,
        require_gap=True,
    )


def rotated_profile_fit(
    stage: CycloidStage,
    shift_sign: int = 1,
    metric: Metric = "same_angle",
    rotation: float = 0.005,
    points: int = 180,
    radial_clearance: float = 0.0,
    require_gap: bool = False,
) -> ModificationProblem:
    """Return the problem of the modified profile that comes closest to the one that is rotated by δ and nothing else.

    Parameters
    ----------
    shift_sign
        1 for a positive and −1 for a negative shift [-].
    metric
        Distance of the two profiles, `METRICS`; song2019 takes ``same_angle``, which is mostly slip along the profile
        and no error of it. ``nearest`` carries the modified profile on beyond root and tip.
    rotation
        δ of the profile to come close to [rad].
    points
        m: the mean is over φ = iπ/m, i = 1…m as in the source's sum, so the tip counts and the root does not [-].

    Notes
    -----
    Δr_rp goes from 0 to 1 mm and Δr_p from 0 to 1 mm or, by its sign, to −1 mm, a box that is assumed. The source
    prints Δr_rp − |Δr_p| > 0 as its condition of a radial clearance (equation (11)), which for a negative shift is
    none; here it is Δr_rp − Δr_p ≥ j for both signs.

    References
    ----------
    song2019, equation (10).
    """
    name = f"rotated profile, {'positive' if shift_sign > 0 else 'negative'} shift, {metric}"
    largest, shift = np.pi / (8 * stage.disc_teeth), np.array([0.0, np.sign(shift_sign) * MILLIMETRE])
    if not 0 < rotation <= largest:
        raise InputError.at(
            name, "rotation", rotation, f"above 0 and up to a sixteenth of a tooth pitch, {largest:.4g} rad"
        )
    angles = np.arange(1, points + 1) * np.pi / points
    turned = Modification(equidistant=0.0, shift=0.0, rotation=rotation)
    place = ToothProfile(stage=stage, modification=turned).points(angles)
    rotated = place[:, 0] + 1j * place[:, 1]

    def mean_distance(amounts: Amounts) -> OnLines:
        angle = nearest_angles(stage, rotated, angles, amounts) if metric == "nearest" else angles
        path, slope, _ = path_of(stage, amounts, angle)
        normal = -1j * slope / np.abs(slope)
        difference = rotated - path - (stage.pin_radius + amounts[:, :1]) * normal
        if metric != "same_angle":
            # Where the nearest point is, all of the difference is along the normal.
            difference = (difference * normal.conj()).real
        return np.asarray(np.abs(difference).mean(axis=-1))

    return ModificationProblem(
        name=name,
        description=f"{METRICS[metric]}; δ = {rotation:g} rad, φ = iπ/{points}, i = 1…{points}",
        stage=stage,
        objective=mean_distance,
        lower=np.array([0.0, shift.min()]),
        upper=np.array([MILLIMETRE, shift.max()]),
        radial_clearance=radial_clearance,
        require_gap=require_gap,
    )


def wanted_clearances(stage: CycloidStage, flank: float, radial: float) -> ModificationProblem:
    """Return the problem of the amounts that leave a flank clearance F and a radial clearance J [m].

    Notes
    -----
    F = Δr_rp − q·Δr_p and J = Δr_rp − Δr_p are linear in both amounts, so Δr_p = (F − J)/(1 − q) and Δr_rp = J + Δr_p.
    The pin at φ0 touches first if the gap after closing is nowhere negative (`ModificationProblem`):
    q·Δr_rp ≥ Δr_p, which is F ≤ (1 + q)·J, for F ≥ J, and J ≥ 0 below.

    References
    ----------
    xi2015, equation (3), for F and J; the bound is an own derivation.
    """
    ratio = stage.flank_ratio
    most = (1 + ratio) * radial
    if not 0 <= flank <= most + _ROUNDING:
        raise InputError(
            f"modification: flank clearance is {flank / MICROMETRE:g} µm with a radial clearance of "
            f"{radial / MICROMETRE:g} µm; allowed is 0 to {most / MICROMETRE:.4g} µm, as another pin touches first "
            f"beyond, or a radial clearance of at least {flank / (1 + ratio) / MICROMETRE:.4g} µm."
        )
    wanted = np.array([flank, radial])

    def difference(amounts: Amounts) -> OnLines:
        equidistant, shift = amounts.T
        left = np.stack([equidistant - ratio * shift, equidistant - shift], axis=-1)
        return np.asarray(np.abs(left - wanted).max(axis=-1))

    return ModificationProblem(
        name="wanted clearances",
        description=f"flank clearance {flank / MICROMETRE:g} µm, radial clearance {radial / MICROMETRE:g} µm",
        stage=stage,
        objective=difference,
        lower=np.full(2, -MILLIMETRE),
        upper=np.full(2, MILLIMETRE),
        radial_clearance=radial,
        wanted=Modification.from_clearances(flank, radial, stage),
    )


def _solved(problem: ModificationProblem) -> Optimum:
    """Return the optimum of a problem, the amounts themselves where they follow from what is wanted."""
    if problem.wanted is None:
        return reference(problem)
    own = np.array([problem.wanted.equidistant, problem.wanted.shift])
    return Optimum(amounts=own, objective=float(problem.objective(own[np.newaxis])[0]), violation=0.0, evaluations=1)


@dataclass(frozen=True, kw_only=True)
class ModificationRequest:
    """What is to be chosen."""

    # ``clearances``: those that are wanted; ``song2019``: closest to a rotated profile; ``li2018``: least gap
    method: str = "clearances"
    flank_clearance: float = BUILDABLE_FLANK  # Wanted on the flank, clearances only [m]
    radial_clearance: float = PUBLISHED_RADIAL  # At tip and root: wanted by clearances, the smallest otherwise [m]
    rotation: float = 0.005  # δ of the profile to come close to, song2019 only [rad]
    metric: Metric = "same_angle"  # Distance of the profiles, song2019 only
    shift_sign: int = 1  # 1 for a positive and −1 for a negative shift, song2019 only [-]
    # Whether no pin may interfere after closing at φ0, song2019 only; li2018 always asks for it
    require_gap: bool = False

    def __post_init__(self) -> None:
        place = "modification"
        if self.method not in METHODS:
            raise UnknownNameError.among(place, "method", self.method, METHODS)
        if self.metric not in METRICS:
            raise UnknownNameError.among(place, "metric", self.metric, METRICS)
        for argument in ("radial_clearance", "flank_clearance"):
            if not 0 <= (value := getattr(self, argument)) <= 1e-3:
                raise InputError.of_argument(place, argument, f"{value / MICROMETRE:g} µm", "0 to 1000 µm")

    def problem(self, reducer: Reducer) -> ModificationProblem:
        """Return what is minimised on a reducer's cycloid stage."""
        if self.method == "clearances":
            return wanted_clearances(reducer.cycloid_stage, self.flank_clearance, self.radial_clearance)
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


@dataclass(frozen=True, kw_only=True)
class ModificationResult:
    """The two amounts that were chosen, and what they do on the reducer."""

    request: ModificationRequest  # What was asked
    reducer: Reducer  # The design with these amounts
    problem: ModificationProblem  # What was minimised, and what had to be kept
    best: Optimum  # The sure optimum
    contact: ContactResult  # What it does on the reducer

    @property
    def allowed_lost_motion(self) -> float:
        """Lost motion of the catalogue; not a number without one [rad]."""
        return self.reducer.catalogue.lost_motion if self.reducer.catalogue else np.nan

    @property
    def exceeds_catalogue(self) -> bool:
        """Whether exact parts with these amounts have more play than the catalogue allows."""
        return bool(self.contact.loop.lost_motion[0] > self.allowed_lost_motion)

    @property
    def delivered_flank(self) -> float:
        """Flank clearance by exact distances, from the free rotation until the first pin touches [m]."""
        return self.contact.assessment.exact_clearance.rotation * self.reducer.cycloid_stage.disc_pitch_radius

    @property
    def delivered_radial(self) -> float:
        """Smaller one of the exact distances at root and tip [m]."""
        before = self.contact.assessment.exact_clearance.before
        return float(min(before[0], before[-1]))

    @property
    def off(self) -> float:
        """By how much exact distances miss the clearances that were wanted, 0 where none were [m]."""
        if self.problem.wanted is None:
            return 0.0
        flank = abs(self.delivered_flank - self.request.flank_clearance)
        return max(flank, abs(self.delivered_radial - self.request.radial_clearance))

    @property
    def turns_far(self) -> bool:
        """Whether the rotated profile to come close to has more play than a precision reducer."""
        far = self.request.rotation * self.reducer.cycloid_stage.disc_pitch_radius > LARGE
        return self.request.method == "song2019" and far


def choose(request: ModificationRequest, reducer: Reducer, torque: float) -> ModificationResult:
    """Return the best amounts, and what they do on the reducer.

    The reducer's own modification is replaced; the torque on the carrier is that of the contact, negative resists
    [N·m].

    References
    ----------
    xi2015, equation (3), for wanted clearances; song2019, equation (10); li2018, whose formulas are lost, as
    `residual_gap` reads it, each with Δr_rp − Δr_p ≥ j.
    """
    if reducer.form is not None:
        raise InputError.at(
            reducer.name, "profile", "a free form", "none, as amounts are chosen for a profile that they alone make"
        )
    problem = request.problem(reducer)
    best = _solved(problem)
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
    found = ModificationResult(
        request=request,
        reducer=modified,
        problem=problem,
        best=best,
        contact=contact_of(modified, torque),
    )
    if found.off > _MOST_OFF:
        amounts = " and ".join(f"{amount / MICROMETRE:.4g}" for amount in best.amounts)
        raise InputError(
            f"{reducer.name}: {problem.description} would need amounts of {amounts} µm, which leave "
            f"{found.delivered_flank / MICROMETRE:.3g} and {found.delivered_radial / MICROMETRE:.3g} µm by exact "
            "distances; allowed is less radial clearance."
        )
    return found

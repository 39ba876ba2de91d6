"""Where a design is accepted: tests on units that no search has seen, with one stated error for the whole answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.joint_yield import tightened
from tolalloc.allocation.space.output_sample import LimitedSample
from tolalloc.allocation.space.problem import OneSidedConstraint
from tolalloc.allocation.space.requirement import AtYield, Check, QuantileBound, Requirement, Sampled
from tolalloc.allocation.verify.independent_sample import IndependentSample, Screen, SolvedPart, UnitSolver
from tolalloc.allocation.verify.verification import ALL_LIMITS, VerifiedDesign
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE
from tolalloc.capability.monte_carlo import ANY_LIMIT, AnsweredUnits, RedrawnUnits, require_few_failures
from tolalloc.capability.near_limit import Drawn
from tolalloc.drawings.seeds import SeedTree
from tolalloc.exceptions import FailedUnitsError
from tolalloc.models.model import Model, is_fast
from tolalloc.running.chunks import one_blas_thread

_SPENT = 0.75
"""Share of the error left that a design may spend [-]."""
ATTEMPTS = 4
"""Largest number of designs that one answer may test [-]."""
_NEAR = 1.25
"""Factor between the zones of two designs up to which the models of one are believed of the other [-]."""
AS_GOOD_AS = 4
"""Plain random units for each solved one that would place the limit as well, as measured on the RV-20E [-]."""
_LOOKS = (0.25, 0.5, 1.0)
"""Shares of the units after which a design may be given up; it is accepted after the last one alone [-]."""
_WHATEVER = 0.6
"""Share of the solved units that are solved whatever is predicted of them, to protect from a wrong prediction [-]."""
_MOST_DRAWN = 8
"""Drawn units for each solved one, at most; more would hardly place the limit better [-]."""
_TO_KEEP_TO_A_LAW = 2**18
"""Units at most of designs whose outputs are all linear: then 0.0013 % of all may leave the law at 3.75 % error [-]."""
_EVEN_ODDS = 0.5


Designs = tuple[VerifiedDesign, ...]
"""Tested designs of a kind, in order."""


@dataclass(frozen=True, kw_only=True)
class AlphaSpending:
    """The error that a design may spend, one of those that an answer tests one after another.

    Notes
    -----
    After m designs that were not accepted the next one may err with α·¾·¼ᵐ, whose sum over m is α. A design that is
    accepted gives its error back, one that is not has spent it (a sequentially rejective test). The designs that are
    wrongly accepted, if any, begin with one; all designs just at a limit before that one were not accepted, so what
    they and this one may spend adds up to no more than the error of the answer, and so does the probability that there
    is such a one, however the designs were found and whichever is taken in the end.

    References
    ----------
    Bretz, Maurer, Brannath & Posch 2009, Stat. Med. 28, 586–604; the fallback test is a special case.

    Examples
    --------
    Of 5 % the first design may spend 3.75 %, and the next one, where the first was not accepted, 0.9375 %:

    >>> round(FIRST.error(0.05), 6), round(FIRST.after(accepted=False).error(0.05), 6)
    (0.0375, 0.009375)
    """

    number: int = 1  # Counted from 1 [-]
    missed: int = 0  # Designs before it that were not accepted [-]

    def error(self, whole: float) -> float:
        """Return the error that the design may spend: three quarters of what the missed ones have left [-].

        Parameters
        ----------
        whole
            Probability with which the answer may be wrong [-].
        """
        return whole * _SPENT * (1 - _SPENT) ** self.missed

    def after(self, *, accepted: bool) -> AlphaSpending:
        """Return what the next design may spend, after this one was accepted or not."""
        return AlphaSpending(number=self.number + 1, missed=self.missed + (not accepted))


FIRST = AlphaSpending()
"""The first design of an answer."""


@dataclass(frozen=True, kw_only=True)
class Acceptance:
    """What became of the designs that an answer could draw."""

    drawn: tuple[str, VerifiedDesign] | None  # Kind and design that is drawn, none where nothing was accepted
    tested: tuple[tuple[str, VerifiedDesign], ...]  # All that were tested with their kinds, in order

    def last(self, kind: str) -> VerifiedDesign | None:
        """Return the design of a kind that stands: the drawn one, or the last that was tested."""
        if self.drawn and self.drawn[0] == kind:
            return self.drawn[1]
        return next((design for name, design in reversed(self.tested) if name == kind), None)


def accept_cheapest(
    test: AcceptanceTest,
    candidates: Mapping[str, VerifiedDesign],
    next_candidate: Callable[[str, Designs, AlphaSpending, float], tuple[str, VerifiedDesign] | None],
    gain: float,
    stated: Callable[[str, VerifiedDesign, AlphaSpending], VerifiedDesign] = lambda _, design, __: design,
) -> Acceptance:
    """Return the cheapest design that an acceptance test passes.

    Parameters
    ----------
    test
        Tests designs on units that no search has seen.
    candidates
        Kind → design that its search holds for good.
    next_candidate
        Makes of a kind and all tested designs of it what its search would try next, with what that may spend, below a
        cost; with its kind. A cheaper design after an accepted one, a safer one after any other, or none.
    gain
        Relative gain of cost that a design must promise to be made once another one is accepted [-].
    stated
        Makes of a kind, a design and what it may spend the one that the drawing states; that one is tested, unless what
        was spent has tested it.

    Notes
    -----
    The cheapest design that was not yet tested is tested next, those last that what was tested speaks against. After
    one that is accepted only cheaper ones are. One of which too many units have no answer is none.

    A design may err by α·¾·¼ᵐ, m of those before it not accepted; Σ ≤ α: Bretz et al. 2009, as `AlphaSpending`.
    """
    waiting, tested, doubtful = dict(candidates), list[tuple[str, VerifiedDesign]](), set[str]()
    drawn: tuple[str, VerifiedDesign] | None = None
    spending = FIRST
    while spending.number <= ATTEMPTS:
        kind = min(waiting, key=lambda own: (own in doubtful, waiting[own].cost), default=None)
        if kind is None or (drawn and waiting[kind].cost >= drawn[1].cost):
            break
        design = stated(kind, waiting.pop(kind), spending)
        if drawn and design.cost >= drawn[1].cost and not design.independent:
            continue
        try:
            found = design if design.independent else test.run(design, spending)
        except FailedUnitsError:
            if not waiting and not tested:
                raise
            continue
        tested.append((kind, found))
        if found.accepted:
            drawn = min((kind, found), drawn or (kind, found), key=lambda own: own[1].cost)
        else:
            doubtful |= {name for name, own in waiting.items() if _speaks_against(found, own)}
        worth = (1 - gain) * drawn[1].cost if drawn else np.inf
        spending = spending.after(accepted=found.accepted)
        alike = tuple(own for name, own in tested if name == kind)
        if spending.number <= ATTEMPTS and (after := next_candidate(kind, alike, spending, worth)):
            name, design = after
            waiting[name] = design
            doubtful.discard(name)
    return Acceptance(drawn=drawn, tested=tuple(tested))


def _speaks_against(tested: VerifiedDesign, other: VerifiedDesign) -> bool:
    """Return whether a tested design that was not accepted leads one to expect the same of another one near it."""
    apart = np.abs(np.log(other.scales / tested.scales)).max(initial=0.0)
    near = apart <= np.log(_NEAR) and np.allclose(other.settings, tested.settings)
    return bool(near and any(constraint.predicted(other.design) > 0 for constraint in tested.constraints))


def confidence_of_fewer(confidence: float, units: int, final: int) -> float:
    """Return the confidence with which fewer units find what the final ones are expected to find [-].

    Notes
    -----
    Φ(Φ⁻¹(confidence)·√(units/final)), with Φ the standard normal distribution: what a guarantee takes beyond the middle
    of the units falls with the root of their number. For confidences from 0.5 on (own
    derivation).

    Examples
    --------
    >>> round(confidence_of_fewer(0.95, 2_500, 10_000), 4)
    0.7946
    """
    from scipy.stats import norm

    return float(norm.cdf(norm.ppf(confidence) * np.sqrt(units / final))) if units != final else confidence


@dataclass(frozen=True, kw_only=True)
class AcceptanceTest:
    """Accepts designs on units that no search has seen.

    Notes
    -----
    Every design has units of its own, their number fixed beforehand, and an error of its own (`AlphaSpending`). All
    requirements must be shown, each with the whole error of the design: one that misses a requirement is wrongly
    accepted only if that one is wrongly shown.

    Where yields are asked for, many more units are drawn than solved: what lies near a limit is solved, of the others
    only some (`tolalloc.capability.near_limit`).
    """

    model: Model  # The real model
    seeds: SeedTree  # Node of the seed tree; every design takes its own child
    units: int  # Units that are solved to accept a design; fewer may give it up [-]
    error: float  # Probability with which the answer may be wrong [-]
    largest_failed_share: float = LARGEST_FAILED_SHARE  # Share of the units that may fail [-]

    def run(self, design: VerifiedDesign, spending: AlphaSpending) -> VerifiedDesign:
        """Return a design with what its independent sample says of it.

        Parameters
        ----------
        design
            A design with the local models of its search.
        spending
            Which of the answer's designs it is, and so what it may err.

        Notes
        -----
        Units that find the design beyond a limit by more than a standard error before all are solved end the test:
        giving up adds no error, and counts as not accepted.
        """
        screen, seeds, found = self._screen(design), self.seeds.child(f"attempt {spending.number}"), design
        final = self._planned(design, screen, spending)
        solver = UnitSolver(
            response=self.model.at(design.settings).reading(tuple(design.outputs)),
            space=design.space,
            design=design.design,
            laws=design.laws,
            nearest=design.nearest,
            screen=None if final.whatever == final.units else screen,
        )
        solved: list[SolvedPart] = []
        for look, share in enumerate(_LOOKS, start=1):
            wanted = Drawn(units=int(np.ceil(share * final.units)), whatever=int(np.ceil(share * final.whatever)))
            before = [own.units.drawn for own in solved]
            missing = Drawn(
                units=wanted.units - sum(own.units for own in before),
                whatever=wanted.whatever - sum(own.whatever for own in before),
            )
            solved.append(solver.solved(seeds.child(f"look {look}"), missing))
            together = SolvedPart.joined(solved)
            plain = AnsweredUnits(evaluation=together.plain)
            require_few_failures(plain, "of a drawing that was tried", self.largest_failed_share)
            confidence = confidence_of_fewer(1 - spending.error(self.error), wanted.whatever, final.whatever)
            looks = tuple(own.units.drawn.whatever for own in solved)
            redraw = partial(_plain_units, design.space, design.design, seeds, looks)
            found = _tested(design, together, confidence, redraw)
            if _is_hopeless(found):
                break
        return replace(found, accepted=found.met and wanted == final)

    def foreseen(self, tested: VerifiedDesign, spending: AlphaSpending) -> VerifiedDesign:
        """Return a tested design as its units stand against the limits at the error of another test."""
        if tested.independent is None:
            return tested
        return replace(tested, checks=_checks(tested, tested.independent, 1 - spending.error(self.error)))

    def margin(self, tested: VerifiedDesign, errors: float, known: Sequence[VerifiedDesign] = ()) -> float:
        """Return how far inside a limit the next design must be aimed [standard errors of the tested one].

        Parameters
        ----------
        errors
            The same in standard errors of what both say: the next one has all units, this one may have been given up.
        known
            Designs near by whose units say the same as those of the tested one, itself among them.

        Notes
        -----
        errors·√(n/M + n/N), with the n plain units of the tested design, the M of all near by and the N of the next
        one: variances go as 1/n.
        """
        solved = tested.independent.units.drawn if tested.independent else Drawn(units=self.units, whatever=self.units)
        final = self.units if solved.whatever == solved.units else np.ceil(_WHATEVER * self.units)
        share = tested.achieved.units / sum(own.achieved.units for own in known) if known else 1.0
        return float(errors * np.sqrt(share + solved.whatever / final))

    def _screen(self, design: VerifiedDesign) -> Screen | None:
        """Return what tells units near a limit from far ones; none where solving all of them costs little."""
        alone = design.checks_alone
        if is_fast(self.model) or len(design.laws) == len(alone):
            return None
        with one_blas_thread():  # the same units are near for any number of threads
            # A unit fails one limit at least if it fails all limits at once.
            return Screen.through(tuple(check.requirement for check in alone), design.outputs, design.sample.redraw)

    def _planned(self, design: VerifiedDesign, screen: Screen | None, spending: AlphaSpending) -> Drawn:
        """Return how many units are drawn for a design, and how many of them are solved whatever is predicted.

        All, where so many plain units show as much: few units leave little to protect from a wrong prediction.
        """
        units = self.units
        if len(design.laws) == len(design.checks):  # a law needs units only to show that none leaves it
            units = min(units, _TO_KEEP_TO_A_LAW)
        plain = Drawn(units=units, whatever=units)
        if screen is None:
            return plain
        whatever = int(np.ceil(_WHATEVER * self.units))
        near = int((self.units - whatever) / max(screen.share, 1 / self.units))
        many = Drawn(units=min(whatever + near, _MOST_DRAWN * self.units), whatever=whatever)
        confidence = 1 - spending.error(self.error)
        guarantees = (check.requirement.guarantee for check in design.checks)
        strictest = max(own.target for own in guarantees if isinstance(own, AtYield))
        shares = [own.allowed(strictest, confidence) / own.units for own in (many, plain)]
        return many if shares[0] > shares[1] else plain


def _plain_units(
    space: DesignSpace, design: Float[np.ndarray, " variable"], seeds: SeedTree, whatever: tuple[int, ...]
) -> Float[np.ndarray, "unit column"]:
    """Return the units of every look that were solved whatever was predicted, drawn again [m, angles rad]."""
    looks = ((seeds.child(f"look {look}"), units) for look, units in enumerate(whatever, start=1))
    return np.concatenate([space.units(design, *look) for look in looks])


def _tested(
    design: VerifiedDesign,
    solved: SolvedPart,
    confidence: float,
    redraw: Callable[[], Float[np.ndarray, "unit column"]],
) -> VerifiedDesign:
    """Return a design with what other units say of it; its derivatives stay those of its search."""
    units, values = solved.units, dict(zip(design.outputs, solved.known.T, strict=True))
    independent = IndependentSample(units=units, outputs=values, leaving=solved.leaving, planes=solved.planes)
    checks = _checks(design, independent, confidence)
    kept = np.array([own.requirement.limits.kept_by(own.requirement.read(values)) for own in checks])
    leading, uncertainties = checks[0].requirement, design.uncertainties
    achieved, joint = (units.yield_of(np.logical_not(own)) for own in (kept[0], kept.all(axis=0)))
    return replace(
        design,
        sample=RedrawnUnits(evaluation=solved.plain, redraw=redraw),
        achieved=achieved.widened_by(uncertainties.get(leading.output), leading.limits),
        checks=checks,
        joint=joint.widened_by(uncertainties.get(ALL_LIMITS), ANY_LIMIT),
        outputs={name: own[units.whatever] for name, own in values.items()},
        independent=independent,
        confidence=confidence,
    )


def _checks(design: VerifiedDesign, independent: IndependentSample, confidence: float) -> tuple[Check, ...]:
    """Return how a design stands against its requirements; what needs no units stands as it was."""
    found = []
    for check in design.checks:
        bounds = _bounds(design, check, independent, confidence)
        found.append(
            replace(check, constraints=_read(design, check.requirement, check.constraints, bounds, independent))
            if bounds
            else check
        )
    return tightened(
        tuple(found),
        lambda requirement: _limited(design, requirement, independent),
        confidence,
        lambda check, bounds, _: _read(design, check.requirement, check.steering[-len(bounds) :], bounds, independent),
    )


def _read(
    design: VerifiedDesign,
    requirement: Requirement,
    sides: tuple[OneSidedConstraint, ...],
    bounds: tuple[QuantileBound, ...],
    independent: IndependentSample,
) -> tuple[OneSidedConstraint, ...]:
    """Return the constraints of a requirement at other values of what is compared with the limits."""
    values = requirement.read(independent.outputs)
    good = values[np.isfinite(values)]
    return tuple(_with_bound(own, bound, design, bound.turned(good)) for own, bound in zip(sides, bounds, strict=True))


def _bounds(
    design: VerifiedDesign, check: Check, independent: IndependentSample, confidence: float
) -> tuple[QuantileBound, ...]:
    """Return what units say of a guarantee, nothing where units are not what shows it."""
    requirement = check.requirement
    if not isinstance(requirement.guarantee, Sampled):
        return ()
    return requirement.guarantee.bounds(_limited(design, requirement, independent), confidence)


def _limited(design: VerifiedDesign, requirement: Requirement, independent: IndependentSample) -> LimitedSample:
    """Return what units say of a requirement, with what measured parts leave open as the search found it."""
    law, uncertainty = design.laws.get(requirement.output), design.uncertainties.get(requirement.output)
    return independent.limited(requirement, law, design.nearest, uncertainty)


def _with_bound(
    constraint: OneSidedConstraint, bound: QuantileBound, design: VerifiedDesign, turned: float
) -> OneSidedConstraint:
    """Return a constraint at another value, its model with the same slopes through it."""
    load = float(constraint.stack.load(design.scales, design.settings))
    stack = replace(constraint.stack, budget=load - (turned - bound.sign * bound.limit))
    return replace(constraint, value=bound.value, standard_error=bound.standard_error, stack=stack)


def _is_hopeless(design: VerifiedDesign) -> bool:
    """Return whether even the middle of what the units say lies beyond a limit, by more than a standard error."""
    independent = design.independent
    if independent is None or design.met:  # what is shown at a confidence lies inside at even odds too
        return False
    bounds = [bound for check in design.checks for bound in _bounds(design, check, independent, _EVEN_ODDS)]
    return any(np.isfinite(bound.value) and bound.excess > bound.standard_error for bound in bounds)

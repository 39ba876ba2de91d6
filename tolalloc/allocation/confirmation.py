"""The last word on a design: fresh units that no search has seen, judged with one stated error for the whole answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from tolalloc.allocation.guarantee import Level, Sampled, reached
from tolalloc.allocation.local_model import Side
from tolalloc.allocation.requirement import Check
from tolalloc.allocation.verification import VerifiedDesign
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.capability.monte_carlo import MonteCarlo, monte_carlo, proportion, require_few_failures
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models import Evaluation, Model

ATTEMPTS = 4
"""Largest number of designs that one answer may try to confirm [-]."""
_SPENT = 0.75
"""Share of the error left that a design may spend [-]."""
_LOOKS = (0.25, 0.5, 1.0)
"""Shares of the units after which a design may be given up; it is confirmed after the last one alone [-]."""
_EVEN_ODDS = 0.5
_NEAR = 1.25
"""Factor between the zones of two designs up to which the models of one are believed of the other [-]."""


def error_of(error: float, attempt: int) -> float:
    """Return the error that one design may spend [-].

    Parameters
    ----------
    error
        Probability with which an answer may be wrong [-].
    attempt
        Number of the design, from 1; each may spend three quarters of what those before it left [-].
    """
    return error * _SPENT * (1 - _SPENT) ** (attempt - 1)


def confidence_of_fewer(confidence: float, units: int, final: int) -> float:
    """Return the confidence with which fewer units find what the final ones are expected to find [-].

    Notes
    -----
    What a guarantee takes beyond the middle of the units falls with the root of their number.
    """
    from scipy.stats import norm

    return float(norm.cdf(norm.ppf(confidence) * np.sqrt(units / final))) if units != final else confidence


@dataclass(frozen=True, kw_only=True)
class Judge:
    """Confirms designs on fresh units.

    Notes
    -----
    Every design has fresh units, their number fixed beforehand, and an error of its own; the errors add up to less than
    the one stated (Bonferroni), however the designs were found and whichever is taken in the end. All requirements must
    be shown, each with the whole error of the design: one that misses a requirement is wrongly confirmed only if that
    one is wrongly shown.
    """

    model: Model  # The real model
    seeds: SeedTree  # Node of the seed tree; every attempt takes its own child
    units: int  # Units that confirm a design; fewer may give it up [-]
    error: float  # Probability with which the answer may be wrong [-]
    largest_failed_share: float = LARGEST_FAILED_SHARE  # Share of the units that may fail [-]

    def judge(self, design: VerifiedDesign, attempt: int) -> VerifiedDesign:
        """Return a design with what its fresh units say of it.

        Parameters
        ----------
        design
            A design with the local models of its search.
        attempt
            Number of designs judged for this answer, with this one [-].

        Raises
        ------
        SolveError
            More units failed.

        Notes
        -----
        Units that find the design beyond a limit by more than a standard error before all are solved end the attempt:
        giving up spends no error.
        """
        seeds, found = self.seeds.child(f"attempt {attempt}"), design
        drawn: list[MonteCarlo] = []
        for look, share in enumerate(_LOOKS, start=1):
            units = int(np.ceil(share * self.units))
            drawn.append(self._drawn(design, seeds.child(f"look {look}"), units - sum(len(own.x) for own in drawn)))
            sample = _joined(drawn)
            require_few_failures(sample, f"{design.name}, confirmation", self.largest_failed_share)
            confidence = confidence_of_fewer(1 - error_of(self.error, attempt), units, self.units)
            found = _judged(design, sample, confidence)
            if _is_hopeless(found):
                break
        return replace(found, confirmed=found.met and found.achieved.units == self.units)

    def _drawn(self, design: VerifiedDesign, seeds: SeedTree, units: int) -> MonteCarlo:
        """Return fresh units with all outputs that are limited, the leading one first."""
        space, response = design.space, self.model.at(design.settings).reading(tuple(design.outputs))
        every = 1.0  # may fail here, as the failed ones of all looks are judged together
        return monte_carlo(Experiment(response, space.errors, space.zones(design.design), seeds, every), units)


def _joined(samples: list[MonteCarlo]) -> MonteCarlo:
    """Return all units of several samples."""
    return MonteCarlo(
        x=np.concatenate([own.x for own in samples]),
        evaluation=Evaluation(
            values=np.concatenate([own.evaluation.values for own in samples]),
            status=np.concatenate([own.evaluation.status for own in samples]),
        ),
    )


def _judged(design: VerifiedDesign, sample: MonteCarlo, confidence: float) -> VerifiedDesign:
    """Return a design with what other units say of it; its derivatives stay those of its search."""
    found = np.where(sample.evaluation.good[:, np.newaxis], sample.evaluation.values, np.nan)
    values = dict(zip(design.outputs, found.T, strict=True))
    checks = tuple(_checked(check, design, values, confidence) for check in design.checks)
    kept = np.array([own.requirement.limits.kept_by(own.requirement.read(values)) for own in checks])
    return replace(
        design,
        sample=sample,
        achieved=proportion(len(found), int(np.count_nonzero(~kept[0]))),
        checks=checks,
        joint=proportion(len(found), int(np.count_nonzero(~kept.all(axis=0)))),
        outputs=values,
        confidence=confidence,
    )


def _levels(
    check: Check, values: Mapping[str, Float[np.ndarray, " unit"]], confidence: float
) -> tuple[tuple[Level, ...], Float[np.ndarray, " good"]]:
    """Return what units say of a guarantee, nothing where units are not what shows it, and what they have of it."""
    requirement, read = check.requirement, check.requirement.read(values)
    good = np.asarray(read[np.isfinite(read)])
    if not isinstance(requirement.guarantee, Sampled):
        return (), good
    return requirement.guarantee.levels(good, read.size - good.size, requirement.limits, confidence), good


def _checked(
    check: Check, design: VerifiedDesign, values: Mapping[str, Float[np.ndarray, " unit"]], confidence: float
) -> Check:
    """Return how a design stands against a requirement; what needs no units stands as it was."""
    levels, good = _levels(check, values, confidence)
    if not levels:
        return check
    sides = zip(check.sides, levels, strict=True)
    return replace(check, sides=tuple(_moved(side, level, design, reached(level, good)) for side, level in sides))


def _moved(side: Side, level: Level, design: VerifiedDesign, value: float) -> Side:
    """Return a side at another value, its model with the same slopes through it."""
    load = float(side.stack.load(design.scales, design.settings))
    stack = replace(side.stack, budget=load - (value - level.sign * level.limit))
    return replace(side, value=level.value, standard_error=level.standard_error, stack=stack)


def _is_hopeless(design: VerifiedDesign) -> bool:
    """Return whether even the middle of what the units say lies beyond a limit, by more than a standard error."""
    levels = [level for check in design.checks for level in _levels(check, design.outputs, _EVEN_ODDS)[0]]
    return any(np.isfinite(level.value) and level.excess > level.standard_error for level in levels)


@dataclass(frozen=True, kw_only=True)
class Confirmed:
    """What became of the designs that an answer could draw."""

    drawn: tuple[str, VerifiedDesign] | None  # Kind and design that is drawn, none where nothing was confirmed
    judged: tuple[tuple[str, VerifiedDesign], ...]  # All that were judged with their kinds, in order

    def last(self, kind: str) -> VerifiedDesign | None:
        """Return the design of a kind that stands: the drawn one, or the last that was judged."""
        if self.drawn and self.drawn[0] == kind:
            return self.drawn[1]
        return next((design for name, design in reversed(self.judged) if name == kind), None)


Following = Callable[[str, VerifiedDesign, int], tuple[str, VerifiedDesign] | None]
"""Makes of a kind, a judged design of it and its attempt what its search would try next, with the kind of that."""


def confirm(judge: Judge, candidates: Mapping[str, VerifiedDesign], following: Following) -> Confirmed:
    """Return the cheapest design that fresh units confirm.

    Parameters
    ----------
    judge
        Judges designs on fresh units.
    candidates
        Kind → design that its search holds for good.
    following
        Gives a cheaper design after a confirmed one, a safer one after any other; none where there is no such design.

    Notes
    -----
    The cheapest design that was not yet judged is judged next, those last that what was judged speaks against. The
    first one confirmed is the answer, unless the one cheaper design that is tried after it is confirmed as well.
    """
    waiting, judged, doubtful = dict(candidates), list[tuple[str, VerifiedDesign]](), set[str]()
    drawn: tuple[str, VerifiedDesign] | None = None
    for attempt in range(1, ATTEMPTS + 1):
        doubted = doubtful if drawn is None else set[str]()
        kind = min(waiting, key=lambda own, late=doubted: (own in late, waiting[own].cost), default=None)  # type: ignore[misc]
        if kind is None or (drawn and waiting[kind].cost >= drawn[1].cost):
            break
        found = judge.judge(waiting.pop(kind), attempt)
        judged.append((kind, found))
        was_drawn = drawn is not None
        drawn = (kind, found) if found.confirmed else drawn
        if was_drawn:
            break
        if not found.confirmed:
            doubtful |= {name for name, own in waiting.items() if _speaks_against(found, own)}
        if attempt < ATTEMPTS and (after := following(kind, found, attempt)):
            name, design = after
            waiting[name] = design
            doubtful.discard(name)
    return Confirmed(drawn=drawn, judged=tuple(judged))


def _speaks_against(judged: VerifiedDesign, other: VerifiedDesign) -> bool:
    """Return whether a judged design that was not confirmed leads one to expect the same of another one near it."""
    apart = np.abs(np.log(other.scales / judged.scales)).max(initial=0.0)
    near = apart <= np.log(_NEAR) and np.allclose(other.settings, judged.settings)
    return bool(near and any(side.predicted(other.design) > 0 for side in judged.sides))

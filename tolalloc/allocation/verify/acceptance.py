"""Where a design is accepted: tests on units that no search has seen, with one stated error for the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from tolalloc.allocation.space.constraint import Level, Side, reached
from tolalloc.allocation.space.design_space import DesignSpace
from tolalloc.allocation.space.requirement import AtYield, Check, Sampled
from tolalloc.allocation.verify.screen import Screen
from tolalloc.allocation.verify.verification import Confirming, VerifiedDesign
from tolalloc.capability.experiment import LARGEST_FAILED_SHARE, Experiment
from tolalloc.capability.monte_carlo import AnsweredUnits, RedrawnUnits, require_few_failures
from tolalloc.capability.near_limit import Drawn, SolvedUnits
from tolalloc.drawings.seeds import SeedTree
from tolalloc.models.model import Evaluation, Model, Response
from tolalloc.running.blas import one_blas_thread

_SPENT = 0.75
"""Share of the error left that a design may spend [-]."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One of the designs that an answer judges, each on fresh units.

    Notes
    -----
    A design that is confirmed gives its error back, one that is not has spent it (a sequentially rejective test). The
    designs that are wrongly confirmed, if any, begin with one; all designs just at a limit before that one were not
    confirmed, so what they and this one may spend adds up to no more than the error of the answer, and so does the
    probability that there is such a one, however the designs were found and whichever is taken in the end.

    References
    ----------
    Bretz, Maurer, Brannath & Posch 2009, Stat. Med. 28, 586–604; the fallback test is a special case.
    """

    number: int = 1  # Counted from 1 [-]
    missed: int = 0  # Designs before it that were not confirmed [-]

    def error(self, whole: float) -> float:
        """Return the error that the design may spend: three quarters of what the missed ones have left [-].

        Parameters
        ----------
        whole
            Probability with which the answer may be wrong [-].
        """
        return whole * _SPENT * (1 - _SPENT) ** self.missed

    def after(self, *, confirmed: bool) -> Attempt:
        """Return the next one, after this one was confirmed or not."""
        return Attempt(number=self.number + 1, missed=self.missed + (not confirmed))


FIRST = Attempt()
"""The first design of an answer."""


AS_GOOD_AS = 4
"""Plain random units for each solved one that would place the limit as well, as measured on the RV-20E [-]."""
_LOOKS = (0.25, 0.5, 1.0)
"""Shares of the units after which a design may be given up; it is confirmed after the last one alone [-]."""
_WHATEVER = 0.6
"""Share of the solved units that are solved whatever is predicted of them, to protect from a wrong prediction [-]."""
_MOST_DRAWN = 8
"""Drawn units for each solved one, at most; more would hardly place the limit better [-]."""
_AT_ONCE = 2**17
"""Units that are solved at once, so that the deviations of millions are never all kept [-]."""
_EVEN_ODDS = 0.5


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
    Every design has fresh units, their number fixed beforehand, and an error of its own
    (`Attempt`). All requirements must be shown, each with the whole error of the design: one that
    misses a requirement is wrongly confirmed only if that one is wrongly shown.

    Where yields are asked for, many more units are drawn than solved: what lies near a limit is solved, of the others
    only some (`tolalloc.capability.near_limit`).
    """

    model: Model  # The real model
    seeds: SeedTree  # Node of the seed tree; every attempt takes its own child
    units: int  # Units that are solved to confirm a design; fewer may give it up [-]
    error: float  # Probability with which the answer may be wrong [-]
    largest_failed_share: float = LARGEST_FAILED_SHARE  # Share of the units that may fail [-]

    def judge(self, design: VerifiedDesign, attempt: Attempt) -> VerifiedDesign:
        """Return a design with what its fresh units say of it.

        Parameters
        ----------
        design
            A design with the local models of its search.
        attempt
            Which of the answer's designs it is.

        Raises
        ------
        SolveError
            More units failed.

        Notes
        -----
        Units that find the design beyond a limit by more than a standard error before all are solved end the attempt:
        giving up adds no error, and counts as not confirmed.
        """
        with one_blas_thread():  # the same units are near for any number of threads
            screen = None if self.model.is_fast or len(design.laws) == len(design.checks) else Screen.of(design)
        final, seeds, found = (
            self._drawn(design, screen, attempt),
            self.seeds.child(f"attempt {attempt.number}"),
            design,
        )
        if final.whatever == final.units:
            screen = None
        solved: list[_Solved] = []
        for look, share in enumerate(_LOOKS, start=1):
            wanted = Drawn(units=int(np.ceil(share * final.units)), whatever=int(np.ceil(share * final.whatever)))
            solved.append(self._solved(design, screen, seeds.child(f"look {look}"), _more(wanted, solved)))
            together = _joined(solved)
            plain = AnsweredUnits(evaluation=together.plain)
            require_few_failures(plain, f"{design.name}, confirmation", self.largest_failed_share)
            confidence = confidence_of_fewer(1 - attempt.error(self.error), wanted.whatever, final.whatever)
            redraw = partial(_plain_units, design.space, design.design, seeds, _whatever(solved))
            found = _judged(design, together, confidence, redraw)
            if _is_hopeless(found):
                break
        return replace(found, confirmed=found.met and wanted == final)

    def foreseen(self, judged: VerifiedDesign, attempt: Attempt) -> VerifiedDesign:
        """Return a judged design as its units stand against the limits at the error of another attempt."""
        if judged.confirming is None:
            return judged
        return replace(judged, checks=_checks(judged, judged.confirming, 1 - attempt.error(self.error)))

    def margin(self, judged: VerifiedDesign, errors: float) -> float:
        """Return how far inside a limit the next design must be aimed [standard errors of the judged one].

        Parameters
        ----------
        errors
            The same in standard errors of what both say: the next one has all units, this one may have been given up.
        """
        solved = judged.confirming.units.drawn if judged.confirming else Drawn(units=self.units, whatever=self.units)
        final = self.units if solved.whatever == solved.units else np.ceil(_WHATEVER * self.units)
        return float(errors * np.sqrt(1.0 + solved.whatever / final))

    def _drawn(self, design: VerifiedDesign, screen: Screen | None, attempt: Attempt) -> Drawn:
        """Return how many units are drawn for a design, and how many of them are solved whatever is predicted.

        All, where so many plain units show as much: few units leave little to protect from a wrong prediction.
        """
        plain = Drawn(units=self.units, whatever=self.units)
        if screen is None:
            return plain
        whatever = int(np.ceil(_WHATEVER * self.units))
        near = int((self.units - whatever) / max(screen.share, 1 / self.units))
        many = Drawn(units=min(whatever + near, _MOST_DRAWN * self.units), whatever=whatever)
        confidence = 1 - attempt.error(self.error)
        guarantees = (check.requirement.guarantee for check in design.checks)
        strictest = max(own.target for own in guarantees if isinstance(own, AtYield))
        shares = [own.allowed(strictest, confidence) / own.units for own in (many, plain)]
        return many if shares[0] > shares[1] else plain

    def _solved(self, design: VerifiedDesign, screen: Screen | None, seeds: SeedTree, drawn: Drawn) -> _Solved:
        """Return fresh units with all outputs that are limited, the leading one first."""
        space, response = design.space, self.model.at(design.settings).reading(tuple(design.outputs))
        experiment = Experiment(response, space.errors, space.zones(design.design), seeds)
        rows, near, found, first = list[Float[np.ndarray, "unit column"]](), list[Bool[np.ndarray, " unit"]](), [], 0
        for uniform in seeds.uniform_chunks(drawn.units, len(space.errors.columns)):
            x = experiment.deviations(space.errors.standard_values(uniform))
            is_near = screen(x) if screen else np.ones(len(x), bool)
            # Those solved whatever is predicted come first.
            kept = is_near | (first + np.arange(len(x)) < drawn.whatever)
            rows.append(x[kept])
            near.append(is_near[kept])
            first += len(x)
            if sum(map(len, rows)) >= _AT_ONCE:
                found.append(_answered(design, response, np.concatenate(rows)))
                rows.clear()
        found += [_answered(design, response, np.concatenate(rows))] if rows else []
        evaluation, off_the_law = _together(found)
        whatever = np.arange(evaluation.status.size) < drawn.whatever
        return _Solved(
            evaluation=evaluation,
            units=SolvedUnits(drawn=drawn, near=np.concatenate(near), whatever=whatever),
            leaving={name: int(np.count_nonzero(own[whatever])) for name, own in off_the_law.items()},
        )


_OffTheLaw = dict[str, Bool[np.ndarray, "..."]]
"""Output with a law → which units do not keep to it."""


def _answered(
    design: VerifiedDesign, response: Response, x: Float[np.ndarray, "unit column"]
) -> tuple[Evaluation, _OffTheLaw]:
    """Return what the model says of units, and which of them leave the laws of linear outputs."""
    evaluation, laws = response(x), design.laws
    values = dict(zip(design.outputs, _known(evaluation).T, strict=True))
    return evaluation, {output: law.function.leaves(x, values[output]) for output, law in laws.items()}


def _together(parts: list[tuple[Evaluation, _OffTheLaw]]) -> tuple[Evaluation, _OffTheLaw]:
    """Return several parts of the units as one."""
    evaluation = Evaluation(
        values=np.concatenate([own.values for own, _ in parts]),
        status=np.concatenate([own.status for own, _ in parts]),
    )
    return evaluation, {name: np.concatenate([own[name] for _, own in parts]) for name in parts[0][1]}


@dataclass(frozen=True, kw_only=True)
class _Solved:
    """Fresh units that were solved."""

    evaluation: Evaluation
    units: SolvedUnits
    leaving: dict[str, int]  # Output with a law → units solved whatever was predicted that do not keep to it [-]

    @property
    def plain(self) -> Evaluation:
        """Those that were solved whatever was predicted: a random sample like any other."""
        kept = self.units.whatever
        return Evaluation(values=self.evaluation.values[kept], status=self.evaluation.status[kept])


def _whatever(solved: list[_Solved]) -> tuple[int, ...]:
    """Return how many units of every look were solved whatever was predicted [-]."""
    return tuple(own.units.drawn.whatever for own in solved)


def _plain_units(
    space: DesignSpace, design: Float[np.ndarray, " variable"], seeds: SeedTree, whatever: tuple[int, ...]
) -> Float[np.ndarray, "unit column"]:
    """Return the units of every look that were solved whatever was predicted, drawn again [m, angles rad]."""
    looks = ((seeds.child(f"look {look}"), units) for look, units in enumerate(whatever, start=1))
    return np.concatenate([space.units(design, *look) for look in looks])


def _more(wanted: Drawn, before: list[_Solved]) -> Drawn:
    """Return how many units are missing."""
    drawn = [own.units.drawn for own in before]
    return Drawn(
        units=wanted.units - sum(own.units for own in drawn),
        whatever=wanted.whatever - sum(own.whatever for own in drawn),
    )


def _joined(solved: list[_Solved]) -> _Solved:
    """Return all units of several looks."""
    drawn = [own.units.drawn for own in solved]
    return _Solved(
        evaluation=Evaluation(
            values=np.concatenate([own.evaluation.values for own in solved]),
            status=np.concatenate([own.evaluation.status for own in solved]),
        ),
        units=SolvedUnits(
            drawn=Drawn(units=sum(own.units for own in drawn), whatever=sum(own.whatever for own in drawn)),
            near=np.concatenate([own.units.near for own in solved]),
            whatever=np.concatenate([own.units.whatever for own in solved]),
        ),
        leaving={output: sum(own.leaving[output] for own in solved) for output in solved[0].leaving},
    )


def _known(evaluation: Evaluation) -> Float[np.ndarray, "solved output"]:
    """Return the outputs, not a number where a unit has none."""
    return np.where(evaluation.good[:, np.newaxis], evaluation.values, np.nan)


def _judged(
    design: VerifiedDesign, solved: _Solved, confidence: float, redraw: Callable[[], Float[np.ndarray, "unit column"]]
) -> VerifiedDesign:
    """Return a design with what other units say of it; its derivatives stay those of its search."""
    units = solved.units
    values = dict(zip(design.outputs, _known(solved.evaluation).T, strict=True))
    confirming = Confirming(units=units, outputs=values, leaving=solved.leaving)
    checks = _checks(design, confirming, confidence)
    kept = np.array([own.requirement.limits.kept_by(own.requirement.read(values)) for own in checks])
    return replace(
        design,
        sample=RedrawnUnits(evaluation=solved.plain, redraw=redraw),
        achieved=units.yield_of(np.logical_not(kept[0])),
        checks=checks,
        joint=units.yield_of(np.logical_not(kept.all(axis=0))),
        outputs={name: own[units.whatever] for name, own in values.items()},
        confirming=confirming,
        confidence=confidence,
    )


def _checks(design: VerifiedDesign, confirming: Confirming, confidence: float) -> tuple[Check, ...]:
    """Return how a design stands against its requirements; what needs no units stands as it was."""
    found = []
    for check in design.checks:
        levels = _levels(design, check, confirming, confidence)
        values = check.requirement.read(confirming.outputs)
        good = values[np.isfinite(values)]
        sides = zip(check.sides, levels, strict=True) if levels else ()
        moved = tuple(_moved(side, level, design, reached(level, good)) for side, level in sides)
        found.append(replace(check, sides=moved) if levels else check)
    return tuple(found)


def _levels(design: VerifiedDesign, check: Check, confirming: Confirming, confidence: float) -> tuple[Level, ...]:
    """Return what units say of a guarantee, nothing where units are not what shows it."""
    guarantee = check.requirement.guarantee
    if not isinstance(guarantee, Sampled):
        return ()
    return guarantee.levels(confirming.sample(check, design.laws.get(check.requirement.output)), confidence)


def _moved(side: Side, level: Level, design: VerifiedDesign, value: float) -> Side:
    """Return a side at another value, its model with the same slopes through it."""
    load = float(side.stack.load(design.scales, design.settings))
    stack = replace(side.stack, budget=load - (value - level.sign * level.limit))
    return replace(side, value=level.value, standard_error=level.standard_error, stack=stack)


def _is_hopeless(design: VerifiedDesign) -> bool:
    """Return whether even the middle of what the units say lies beyond a limit, by more than a standard error."""
    confirming = design.confirming
    if confirming is None:
        return False
    levels = [level for check in design.checks for level in _levels(design, check, confirming, _EVEN_ODDS)]
    return any(np.isfinite(level.value) and level.excess > level.standard_error for level in levels)


ATTEMPTS = 4
"""Largest number of designs that one answer may try to confirm [-]."""
_NEAR = 1.25
"""Factor between the zones of two designs up to which the models of one are believed of the other [-]."""


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


Following = Callable[[str, VerifiedDesign, Attempt, float], tuple[str, VerifiedDesign] | None]
"""Makes of a kind and a judged design of it what its search would try next, as which attempt, below a cost; with its
kind."""


def confirm(judge: Judge, candidates: Mapping[str, VerifiedDesign], following: Following, gain: float) -> Confirmed:
    """Return the cheapest design that fresh units confirm.

    Parameters
    ----------
    judge
        Judges designs on fresh units.
    candidates
        Kind → design that its search holds for good.
    following
        Gives a cheaper design after a confirmed one, a safer one after any other; none where there is no such design.
    gain
        Relative gain of cost that a design must promise to be made once another one is confirmed [-].

    Notes
    -----
    The cheapest design that was not yet judged is judged next, those last that what was judged speaks against. After
    one that is confirmed only cheaper ones are.
    """
    waiting, judged, doubtful = dict(candidates), list[tuple[str, VerifiedDesign]](), set[str]()
    drawn: tuple[str, VerifiedDesign] | None = None
    attempt = FIRST
    while attempt.number <= ATTEMPTS:
        kind = min(waiting, key=lambda own: (own in doubtful, waiting[own].cost), default=None)
        if kind is None or (drawn and waiting[kind].cost >= drawn[1].cost):
            break
        found = judge.judge(waiting.pop(kind), attempt)
        judged.append((kind, found))
        if found.confirmed:
            drawn = (kind, found)
        else:
            doubtful |= {name for name, own in waiting.items() if _speaks_against(found, own)}
        worth = (1 - gain) * drawn[1].cost if drawn else np.inf
        attempt = attempt.after(confirmed=found.confirmed)
        if attempt.number <= ATTEMPTS and (after := following(kind, found, attempt, worth)):
            name, design = after
            waiting[name] = design
            doubtful.discard(name)
    return Confirmed(drawn=drawn, judged=tuple(judged))


def _speaks_against(judged: VerifiedDesign, other: VerifiedDesign) -> bool:
    """Return whether a judged design that was not confirmed leads one to expect the same of another one near it."""
    apart = np.abs(np.log(other.scales / judged.scales)).max(initial=0.0)
    near = apart <= np.log(_NEAR) and np.allclose(other.settings, judged.settings)
    return bool(near and any(side.predicted(other.design) > 0 for side in judged.sides))

"""The last word on a drawing: designs judged one after another with one stated error for the whole answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tolalloc.allocation.attempts import FIRST, Attempt
from tolalloc.allocation.judging import Judge
from tolalloc.allocation.verification import VerifiedDesign

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

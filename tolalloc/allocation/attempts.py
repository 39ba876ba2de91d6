"""Which error each of the designs may spend that one answer judges."""

from __future__ import annotations

from dataclasses import dataclass

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

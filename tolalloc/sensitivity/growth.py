"""Growing a design until the first places of its ranking are stable."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError
from tolalloc.sensitivity.ranking import require_confidence, require_places

Resampled = tuple[Float[np.ndarray, " source"], Float[np.ndarray, "resample source"]]
"""Indices of the sources, and the same from resamples [-]."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """One number of blocks on the way to a stable order.

    Parameters
    ----------
    blocks
        Number of blocks [-].
    first
        Positions of the first sources, largest index first [-].
    probability
        Share of resamples whose first sources are these in this order [-].
    """

    blocks: int
    first: tuple[int, ...]
    probability: float


@dataclass(frozen=True, kw_only=True)
class Growth:
    """How the order settled as the blocks grew.

    Parameters
    ----------
    history
        One step per number of blocks.
    probability
        Share of resamples that was asked for [-].
    """

    history: tuple[Step, ...]
    probability: float

    @property
    def stable(self) -> bool:
        """Whether the last step reached the probability asked for."""
        return self.history[-1].probability >= self.probability

    @property
    def status(self) -> str:
        """One sentence for a person."""
        last = self.history[-1]
        verdict = "is stable" if self.stable else "is not stable at the largest number of blocks allowed"
        return (
            f"The order of the first {len(last.first)} over the outputs with a limit, sources of one group taken "
            f"alike, {verdict}: {last.probability:.0%} of the resamples of {last.blocks} blocks have it, asked for are "
            f"{self.probability:.0%}."
        )


def grow_until_stable(
    resampled: Callable[[int], Resampled],
    groups: Sequence[str],
    count: int,
    *,
    start: int,
    limit: int,
    probability: float = 0.9,
) -> Growth:
    """Double the blocks until the order of the first sources is stable.

    Parameters
    ----------
    resampled
        Gives the indices for a number of blocks; it may keep the answers of the blocks that it has had.
    groups
        Group of each source; sources of one group may change places.
    count
        How many of the first sources must keep their order [-].
    start, limit
        First and largest number of blocks [-].
    probability
        Share of resamples that must have the order of the estimate [-].

    Notes
    -----
    Sources of one group share a tolerance, such as the pitch of both discs: their indices are often equal, so that
    no number of blocks would settle an order between them, and no drawing needs one. Looking several times makes a stop
    by chance likelier than one look does; the history shows whether the order was the same before.
    """
    require_confidence(probability)
    if not 2 <= start <= limit:
        raise InputError.at("ranking", "first number of blocks", start, f"2 to the limit {limit}")
    history, names = list[Step](), np.array(list(groups))
    blocks = start
    while blocks <= limit:
        indices, resamples = resampled(blocks)
        require_places(count, indices.size)
        first = np.argsort(-indices, kind="stable")[:count]
        same = (names[np.argsort(-resamples, axis=1, kind="stable")[:, :count]] == names[first]).all(axis=1)
        history.append(Step(blocks=blocks, first=tuple(first.tolist()), probability=float(same.mean())))
        if history[-1].probability >= probability:
            break
        blocks *= 2
    return Growth(history=tuple(history), probability=probability)

"""Saltelli's design in chunks of whole blocks: bit for bit the samples of SALib, without holding them all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import qmc

from tolalloc.exceptions import InputError

SAMPLES_AT_ONCE = 8192
"""Samples of a chunk at most, unless one block has more [-]."""


@dataclass(frozen=True, kw_only=True)
class SaltelliDesign:
    """Scrambled Sobol' points A and B, and the samples between them: A, AB₁ … AB_D, if asked for BA₁ … BA_D, and B.

    Parameters
    ----------
    factor_groups
        Name of the factor group of each column; the columns of a factor group are exchanged together.
    seed
        Seed of the scrambling, positive: 0 would be no seed at all for other libraries [-].
    second_order
        Whether the design has the BA samples.

    Notes
    -----
    The sequence is one and the same for any number of blocks: a larger design begins with the smaller one.

    References
    ----------
    Saltelli 2002 and Saltelli et al. 2010; Sobol' points scrambled by a random matrix and a digital shift (Matoušek
    1998), as `scipy.stats.qmc.Sobol` draws them for `SALib.sample.sobol`.
    """

    factor_groups: tuple[str, ...]
    seed: int
    second_order: bool = False

    def __post_init__(self) -> None:
        if self.seed < 1:
            raise InputError.at("Saltelli design", "seed", self.seed, "1 or more")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Players in the order of their first columns."""
        return tuple(dict.fromkeys(self.factor_groups))

    @property
    def samples_per_block(self) -> int:
        """Samples of a block [-]."""
        return (1 + self.second_order) * len(self.names) + 2

    def chunks(self, start: int, stop: int) -> Iterator[Float[np.ndarray, "sample column"]]:
        """Yield the samples of the blocks from ``start`` up to but not ``stop``, uniform numbers in [0, 1)."""
        sequence = qmc.Sobol(d=2 * len(self.factor_groups), scramble=True, seed=self.seed)
        if start:
            sequence.fast_forward(start)
        # A power of two, as the first draw from the sequence ought to be.
        at_once = 1 << max(0, (SAMPLES_AT_ONCE // self.samples_per_block).bit_length() - 1)
        for first in range(start, stop, at_once):
            yield self._samples(sequence.random(min(at_once, stop - first)))

    @cached_property
    def _own(self) -> Bool[np.ndarray, "group column"]:
        """Which columns belong to each factor group."""
        return np.asarray(np.array(self.factor_groups) == np.array(self.names)[:, np.newaxis])

    def _samples(self, base: Float[np.ndarray, "block base_column"]) -> Float[np.ndarray, "sample column"]:
        """Return the samples of the blocks whose A and B stand side by side."""
        a, b = np.split(base[:, np.newaxis], 2, axis=2)
        exchanged = [(a, b), (b, a)][: 1 + self.second_order]
        between = [np.where(self._own, inner, outer) for outer, inner in exchanged]
        return np.concatenate([a, *between, b], axis=1).reshape(-1, len(self.factor_groups))

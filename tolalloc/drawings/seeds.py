"""One seed tree: every random number hangs on the study's seed, a path of names and the index of its chunk alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from zlib import crc32

import numpy as np
from jaxtyping import Float

CHUNK = 1024
"""Samples per chunk; a chunk's numbers depend on its index alone, so executors and chunk order do not matter."""

_SOBOL_BITS = 32
"""Bits of a Sobol' number, as many as scipy can skip chunks with [-]."""


class SamplingDesign(StrEnum):
    """How the samples of a study are spread.

    Notes
    -----
    Monte Carlo: independent samples, the only ones for which an exact interval of a share (Clopper–Pearson) or of a
    quantile (order statistics) holds. Latin hypercube: each chunk is a Latin hypercube of its own, independent of the
    others (replicated Latin hypercubes). No permutation runs over all samples, and the spread of the chunks' means
    gives an honest standard error of the mean of the whole chunks; a last chunk that is cut is a random part of one.
    Sobol': consecutive points of one scrambled sequence, so that chunks depend on each other; an honest standard error
    comes from several nodes of the seed tree, each with a scrambling of its own. A power of two of samples is balanced.

    References
    ----------
    McKay, Beckman & Conover 1979, Technometrics 21 (Latin hypercubes); Iman & Conover 1980, Commun. Stat. A9
    (replications); Owen 1998, J. Complexity 14 (scrambled sequences), as scipy implements them.
    """

    MONTE_CARLO = "monte carlo"
    LATIN_HYPERCUBE = "latin hypercube"
    SOBOL = "sobol"


@dataclass(frozen=True)
class SeedTree:
    """A place in the tree of random numbers: who draws there draws the same, whoever draws elsewhere, and when.

    Parameters
    ----------
    seed
        Seed of the study, where 0 is a seed like every other [-].
    path
        Names from the root to this place.
    """

    seed: int
    path: tuple[str, ...] = ()

    def child(self, *names: str) -> SeedTree:
        """Return the node below this one."""
        return SeedTree(self.seed, self.path + names)

    def generator(self, index: int = 0) -> np.random.Generator:
        """Return the generator of one chunk at this node."""
        key = [crc32(name.encode()) for name in self.path]
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(*key, index)))

    def integer(self) -> int:
        """Return a positive integer for libraries that take 0 as no seed at all."""
        return int(self.generator().integers(1, 2**31 - 1))

    def uniform_chunk(
        self, index: int, columns: int, design: SamplingDesign = SamplingDesign.MONTE_CARLO
    ) -> Float[np.ndarray, "sample column"]:
        """Return one whole chunk of uniform numbers in (0, 1), the first one at index 0 [-]."""
        if design is SamplingDesign.SOBOL:
            from scipy.stats import qmc

            sequence = qmc.Sobol(columns, bits=_SOBOL_BITS, rng=self.generator())
            if index:
                sequence.fast_forward(index * CHUNK)
            # The middle of the smallest cell: 0 would be an infinite normal deviate.
            return np.asarray(sequence.random(CHUNK) + 0.5**_SOBOL_BITS / 2)
        generator = self.generator(index)
        if design is SamplingDesign.LATIN_HYPERCUBE:
            stratum = generator.permuted(np.tile(np.arange(CHUNK)[:, np.newaxis], columns), axis=0)
            uniform = (stratum + generator.random(stratum.shape)) / CHUNK
        else:
            uniform = generator.random((CHUNK, columns))
        # Zero would be an infinite normal deviate; the next float above it is not.
        return np.asarray(np.maximum(uniform, np.finfo(float).tiny))

    def uniform_chunks(
        self, samples: int, columns: int, design: SamplingDesign = SamplingDesign.MONTE_CARLO
    ) -> Iterator[Float[np.ndarray, "sample column"]]:
        """Yield uniform numbers in (0, 1) chunk by chunk; the last chunk is cut to the number of samples [-]."""
        for index, start in enumerate(range(0, samples, CHUNK)):
            yield self.uniform_chunk(index, columns, design)[: samples - start]

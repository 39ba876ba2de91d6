"""One seed tree: every random number of a study hangs on the study's seed and a path of names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from zlib import crc32

import numpy as np
from jaxtyping import Float

CHUNK = 1024
"""Samples per chunk; a chunk's numbers depend on its index alone, so executors and chunk order do not matter."""


@dataclass(frozen=True)
class SeedTree:
    """A node of the tree.

    Parameters
    ----------
    seed
        Seed of the study; 0 is a seed like every other [-].
    path
        Names from the root to this node.
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

    def uniform_chunk(self, index: int, columns: int) -> Float[np.ndarray, "sample column"]:
        """Return one whole chunk of uniform numbers in (0, 1) [-]."""
        # Zero would be an infinite normal deviate; the next float above it is not.
        return np.maximum(self.generator(index).random((CHUNK, columns)), np.finfo(float).tiny)

    def uniform_chunks(self, samples: int, columns: int) -> Iterator[Float[np.ndarray, "sample column"]]:
        """Yield uniform numbers in (0, 1) chunk by chunk."""
        for index, start in enumerate(range(0, samples, CHUNK)):
            yield self.uniform_chunk(index, columns)[: samples - start]

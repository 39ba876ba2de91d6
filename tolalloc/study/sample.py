"""Files that ``tolalloc new --with`` makes for a new reducer, simulated or invented, and said to be so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from tolalloc.drawings.error_model import ErrorModel
from tolalloc.drawings.seeds import SeedTree
from tolalloc.drawings.sources import Source
from tolalloc.reducers.choice import bind
from tolalloc.reducers.reducer.design import Reducer
from tolalloc.reducers.response.kernel import KernelResponse

SIMULATED = "Simulated by tolalloc new, not measured."


@dataclass(frozen=True, kw_only=True)
class NewReducer:
    """A new reducer with its tolerance table, of which units are simulated."""

    reducer: Reducer
    sources: tuple[Source, ...]

    @cached_property
    def errors(self) -> ErrorModel:
        """The sources as random ones."""
        return ErrorModel(self.sources)

    @cached_property
    def kernel(self) -> KernelResponse:
        """What the reducer answers to their deviations."""
        return bind(self.reducer, self.errors, None, "new folder")[0]

    def units(self, count: int) -> Float[np.ndarray, "unit column"]:
        """Return the deviations of random units [m, angles rad]."""
        return self.errors.random_units(count, SeedTree(1).child("samples"))


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One kind of files, and the command that reads them."""

    files: Mapping[str, str]  # File → what it is
    make: Callable[[NewReducer], dict[str, str]]  # Returns the text of every file, by name
    command: str = ""  # As typed in the folder; none unless given
    needs_cranks: bool = False  # Whether a reducer without crankshafts has no such files

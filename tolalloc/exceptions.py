"""Every exception that this package raises on purpose.

TolallocError                 one sentence for a person; the command line prints it and exits with code 2
├── InputError                a file, a field or an argument holds a value that is not allowed
├── UnknownNameError          a name that nothing here carries; the nearest known names are offered
├── RunFolderError            the run folder cannot be used without losing what is in it
└── SolveError                too many samples of a batch failed to be trusted
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path


class TolallocError(Exception):
    """Base of all errors that a user can mend; its text is one sentence."""


class InputError(TolallocError):
    """A value at the border of the program is not allowed."""

    @classmethod
    def at(cls, place: Path | str, field: str, value: object, allowed: str) -> InputError:
        """Say in one sentence where the value stands, what it is and what is allowed."""
        return cls(f"{place}: {field} is {value!r}; allowed is {allowed}.")


class UnknownNameError(TolallocError):
    """A name that nothing here carries."""

    @classmethod
    def among(cls, place: Path | str, what: str, name: str, known: Iterable[str]) -> UnknownNameError:
        """Name the unknown, the kind of thing it should be, and the nearest known names."""
        names = sorted(known)
        near: Sequence[str] = difflib.get_close_matches(name, names, n=3, cutoff=0.5) or names[:6]
        nearest = f"the nearest known {'is' if len(near) == 1 else 'are'} {', '.join(near)}" if near else "it has none"
        return cls(f"{place}: {what} {name!r} is not known; {nearest}.")


class RunFolderError(TolallocError):
    """The run folder cannot be used without losing what is in it."""


class SolveError(TolallocError):
    """Too many samples of a batch failed for its numbers to be trusted."""

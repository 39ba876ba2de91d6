"""Every exception that this package raises on purpose.

TolallocError                 one sentence for a person; the command line prints it and exits with code 2
├── InputError                a file, a field or an argument holds a value that is not allowed
├── UnknownNameError          a name that nothing here carries; the nearest known names are offered
├── RunFolderError            the run folder cannot be used without losing what is in it
├── SolveError                too many samples of a batch failed to be trusted
│   ├── FailedUnitsError      the same of the random units of one drawing, beside which a search may try others
│   └── ConstantOutputError   nothing varies, so nothing can be ranked
└── StoppedError              a person stopped the work; exit code 130
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

_LONGEST_VALUE = 200
"""Most characters of a value that a sentence quotes [-]."""
_LONGEST_SENTENCE = 2000
"""Most characters of a sentence [-]."""
_MOST_NAMES = 30
"""Most names that a sentence lists where none is spelled nearly as the unknown one [-]."""
_UNBROKEN = re.compile(rf"\S{{{_LONGEST_VALUE + 1},}}")
"""What is written without a blank and is longer than any word or path that a sentence needs."""
_MOST_FAULTS = 20
"""Most faults of one file that are said; the others are counted [-]."""


def in_short(text: str, longest: int = _LONGEST_VALUE) -> str:
    """Return a text, with its middle left out if it has more characters than that."""
    head = longest // 2
    return text if len(text) <= longest else f"{text[:head]}…{text[head + 1 - longest :]}"


def quoted(value: object) -> str:
    """Return a value as a sentence shows it, 200 characters at most."""
    try:
        return in_short(repr(value))
    except (ValueError, RecursionError):  # Python writes no whole number of more than 4300 digits
        return f"a {type(value).__name__} too long to be shown"


class TolallocError(Exception):
    """Base of all errors that a user can mend; its text is one sentence, or one to each line."""

    def __init__(self, sentences: str = "") -> None:
        short = (
            in_short(_UNBROKEN.sub(lambda found: in_short(found[0]), line), _LONGEST_SENTENCE)
            for line in sentences.split("\n")
        )
        super().__init__("\n".join(short))


class InputError(TolallocError):
    """A value at the border of the program is not allowed."""

    argument: str = ""
    """Name of the argument that holds the value, where one does; a command says its option instead."""

    @classmethod
    def at(cls, place: Path | str, field: str, value: object, allowed: str) -> InputError:
        """Say in one sentence where the value stands, what it is and what is allowed."""
        return cls(f"{place}: {field} is {quoted(value)}; allowed is {allowed}.")

    @classmethod
    def of_argument(cls, work: str, argument: str, value: object, allowed: str) -> InputError:
        """Say the same of an argument of a piece of work, such as a diagnosis."""
        error = cls.at(work, argument, value, allowed)
        error.argument = argument
        return error

    def named_among(self, names: Iterable[str]) -> str:
        """Return the name from which the argument comes, which may carry its unit besides; empty if there is none."""
        return next((name for name in names if self.argument == name or self.argument.startswith(f"{name}_")), "")

    def as_option(self, command: str, option: str) -> InputError:
        """Return the error as somebody needs it who gave an option of a command."""
        _, _, said = str(self).partition(f": {self.argument} is ")
        return InputError(f"{command}: {option} is {said}")


class UnknownNameError(TolallocError):
    """A name that nothing here carries."""

    @classmethod
    def among(cls, place: Path | str, what: str, name: str, known: Iterable[str]) -> UnknownNameError:
        """Name the unknown, the kind of thing it should be, and the nearest known names."""
        names, name = sorted(known), in_short(name)
        return cls(f"{place}: unknown {what} {name!r}; {_what_is_known(name, names)}.")

    @classmethod
    def require(cls, place: Path | str, what: str, name: str, known: Collection[str]) -> None:
        """Raise unless a name is known."""
        if name not in known:
            raise cls.among(place, what, name, known)


def _what_is_known(name: str, names: Sequence[str]) -> str:
    """Return the names that are spelled nearly so; where none is, all of them, or the first of many."""
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if near:
        return f"the nearest known {'is' if len(near) == 1 else 'are'} {', '.join(near)}"
    more = len(names) - _MOST_NAMES
    shown = f"{', '.join(names[:_MOST_NAMES])}{f' and {more} more' if more > 0 else ''}"
    return f"known {'is' if len(names) == 1 else 'are'} {shown}" if names else "it has none"


class RunFolderError(TolallocError):
    """The run folder cannot be used without losing what is in it."""


class StoppedError(TolallocError):
    """A person stopped the work."""


class SolveError(TolallocError):
    """Too many samples of a batch failed for its numbers to be trusted."""


class FailedUnitsError(SolveError):
    """Too many random units of one drawing have no answer."""


class ConstantOutputError(SolveError):
    """No output varies."""


class Faults:
    """What is wrong with one file, found row by row and said together."""

    def __init__(self) -> None:
        self._found: list[TolallocError] = []

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Keep what is wrong in one row, so that the next can be looked at."""
        try:
            yield
        except (InputError, UnknownNameError) as error:
            self._found.append(error)

    def require_none(self) -> None:
        """Raise everything that was found as one exception, one sentence to a line, if there is anything.

        Raises
        ------
        InputError, UnknownNameError
            The faults; of the second kind only if all of them are names.
        """
        if not self._found:
            return
        kinds = {type(error) for error in self._found}
        sentences = list(dict.fromkeys(line for error in self._found for line in str(error).split("\n")))
        more = len(sentences) - _MOST_FAULTS
        if more > 0:
            sentences[_MOST_FAULTS:] = [f"And {more} more {'fault' if more == 1 else 'faults'}."]
        raise (kinds.pop() if len(kinds) == 1 else InputError)("\n".join(sentences)) from None

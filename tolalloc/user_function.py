"""A function that a user gives: called for many samples at once where it can be, and told from other functions."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import CodeType, ModuleType
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError

FAILURES = (ArithmeticError, ValueError)
"""What a function may raise for a sample that has no answer."""
_SAME = 1e-9
"""By how much a function of arrays may differ from itself called with numbers, over the largest value [-]."""


_FEWEST = 30
"""Samples from which on a function that raises for all of them has a fault rather than bad samples [-]."""


@dataclass(frozen=True, kw_only=True)
class UserFunction:
    """A function with the number of values that it returns for one sample, and whom messages name."""

    function: Callable[..., Any]
    values: int  # Numbers that it returns for one sample [-]
    place: str  # Who is meant, for messages

    def __call__(self, arguments: Float[np.ndarray, "sample argument"]) -> Float[np.ndarray, "sample value"]:
        """Return the values of every sample, NaN where there are none.

        The function is first given whole columns. What it returns counts only if every value comes by itself, as a
        number or one number per sample, and if the first and last sample called alone say the same; it is called
        sample by sample otherwise.

        Raises
        ------
        InputError
            The function takes another number of arguments, returns another number of values, or has a fault.
        SolveError
            It raises for every one of many samples; a few without an answer are statuses.
        """
        self._require_arguments(arguments.shape[1])
        with np.errstate(all="ignore"):
            whole = self._of_columns(arguments)
            if whole is not None:
                return whole
            rows, reasons = [], []
            for sample in arguments:
                row, reason = self._of_sample(sample)
                rows.append(row)
                reasons += [reason] * bool(reason)
        if len(reasons) == len(rows) >= _FEWEST:
            raise SolveError(f"{self.place}: the function raises for each of {len(rows)} samples, first {reasons[0]}.")
        return np.array(rows).reshape(-1, self.values)

    def takes_columns(self, arguments: Float[np.ndarray, "sample argument"]) -> bool:
        """Return whether one call with whole columns gives the values of all samples."""
        with np.errstate(all="ignore"):
            return self._of_columns(arguments) is not None

    def _of_columns(self, arguments: Float[np.ndarray, "sample argument"]) -> Float[np.ndarray, "sample value"] | None:
        """Return the values by one call with whole columns; None unless they can be trusted."""
        samples = arguments.shape[0]
        if samples < 2:
            return None
        try:
            found = self.function(*arguments.T)
            single = self.values == 1 and np.shape(found) in ((), (samples,))
            columns = [np.broadcast_to(np.asarray(one, float), samples) for one in _flat([found] if single else found)]
        except (TypeError, *FAILURES):
            return None
        if len(columns) != self.values:
            return None
        whole = np.stack(columns, axis=1)
        ends = np.array([self._of_sample(arguments[at])[0] for at in (0, -1)])
        size = float(np.abs(ends[np.isfinite(ends)]).max(initial=0.0))
        return whole if np.allclose(whole[[0, -1]], ends, rtol=0.0, atol=_SAME * size, equal_nan=True) else None

    def _of_sample(self, sample: Float[np.ndarray, " argument"]) -> tuple[Float[np.ndarray, " value"], str]:
        """Return the values of one sample, and what the function raised if it did."""
        nothing = np.full(self.values, np.nan)
        try:
            found = np.asarray(self.function(*sample.tolist()), float).ravel()
        except FAILURES as reason:
            given = ", ".join(f"{value:.6g}" for value in sample)
            return nothing, f"{type(reason).__name__} ({reason}) for ({given})"
        except TypeError as error:
            raise InputError(f"{self.place}: the function has a fault: {error}.") from error
        if found.size != self.values:
            raise InputError(f"{self.place}: the function returned {found.size} values; asked for are {self.values}.")
        return found, ""

    def _require_arguments(self, count: int) -> None:
        """Raise if the function cannot be called with so many arguments; what hides its signature is tried."""
        try:
            signature = inspect.signature(self.function)
        except (TypeError, ValueError):
            return
        try:
            signature.bind(*range(count))
        except TypeError as error:
            raise InputError(
                f"{self.place}: the function cannot be called with {count} values, inputs and settings ({error})."
            ) from None


def _flat(found: Any) -> list[Any]:
    """Return the items of nested tuples and lists, and the first axis of an array, in their order."""
    if isinstance(found, np.ndarray) and found.ndim > 2:
        return [row for part in found for row in part]
    return [item for part in found for item in (_flat(part) if isinstance(part, list | tuple) else [part])]


def identity(thing: Any, deep: int = 12) -> Any:
    """Return what tells a function from another one in any process: its code, and the values that it was made with.

    What other modules do is not seen, and of values within values only so many levels.
    """
    if deep == 0:
        return type(thing).__qualname__
    inside = _inside(thing)
    if inside is not None:
        return [identity(item, deep - 1) for item in inside]
    if isinstance(thing, set | frozenset):
        return sorted(repr(identity(item, deep - 1)) for item in thing)
    if isinstance(thing, ModuleType):
        return thing.__name__
    if callable(thing) or hasattr(thing, "__dict__"):
        own = vars(thing) if hasattr(thing, "__dict__") and not isinstance(thing, type) else {}
        return (getattr(thing, "__qualname__", type(thing).__qualname__), identity(own, deep - 1))
    return repr(thing)


def _inside(thing: Any) -> Sequence[Any] | None:
    """Return what a thing is made of in its order; None for what is one thing, or has no order."""
    if isinstance(thing, partial):
        return (thing.func, thing.args, thing.keywords)
    if isinstance(thing, CodeType):
        return (thing.co_code.hex(), thing.co_names, thing.co_consts)
    if isinstance(thing, np.ndarray):
        return (thing.shape, thing.tolist())
    if isinstance(thing, Mapping):
        return tuple(thing.items())
    if isinstance(thing, list | tuple):
        return thing
    return _made_of(thing) if hasattr(thing, "__code__") else None


def _made_of(function: Any) -> tuple[Any, ...]:
    """Return the code of a function, what it finds by name, what it encloses and what it was given."""
    code, known = function.__code__, function.__globals__
    named = {name: known[name] for name in code.co_names if _tells(known.get(name), function.__module__)}
    enclosed = [cell.cell_contents for cell in function.__closure__ or ()]
    given = (function.__defaults__, function.__kwdefaults__, getattr(function, "__self__", None))
    return (code, named, enclosed, given)


_VALUES = (int, float, str, tuple, list, dict, set, frozenset, np.ndarray)


def _tells(value: Any, module: str) -> bool:
    """Return whether what a function finds by name tells it from others: a value, or a function of its own module."""
    return isinstance(value, _VALUES) or (hasattr(value, "__code__") and value.__module__ == module)

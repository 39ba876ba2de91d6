"""A function that a user gives, called for many samples at once where it can be."""

from __future__ import annotations

import inspect
import re
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from tolalloc.exceptions import InputError, SolveError
from tolalloc.reading.files import is_users_file

FAILURES = (ArithmeticError, ValueError, RuntimeError)
"""What a function may raise for a sample that has no answer, such as a root finder that does not converge."""
_FAULTS = (RecursionError, NotImplementedError)
"""What of these is the function's fault all the same; so is everything else that it raises."""
_LARGEST = 1e100
"""Size beyond which a value is no answer, as its square is none [unit of the output]."""
_SAME = 1e-9
"""By how much a function of arrays may differ from itself called with numbers, over the largest value [-]."""
_FEWEST = 30
"""Samples from which on a function that raises for all of them has a fault rather than bad samples [-]."""

Arguments = Float[np.ndarray, "sample argument"]
Values = Float[np.ndarray, "sample value"]


@dataclass(frozen=True, kw_only=True)
class UserFunction:
    """A function with the number of values that it returns for one sample, and whom messages name."""

    function: Callable[..., Any]
    values: int  # Numbers that it returns for one sample [-]
    place: str  # Who is meant, for messages
    names: tuple[str, ...] = ()  # What these numbers are called, with their units, where it may return them by name

    def __call__(self, arguments: Arguments) -> Values:
        """Return the values of every sample, NaN where there are none.

        The function is first given whole columns, copies that it may change. What it returns counts only if every
        value comes by itself, as a number or one number per sample, and if a few samples called alone say the same; it
        is called sample by sample otherwise. A masked value and one with an imaginary part are no answer.

        Raises
        ------
        InputError
            The function takes another number of arguments, returns another number of values or what is no number, has
            a fault, or answers differently when it is asked the same again.
        SolveError
            It has an answer for none of many samples; a few without one are statuses.
        """
        self._require_arguments(arguments.shape[1])
        with np.errstate(all="ignore"):
            found = self._of_columns(arguments)
            if found is None:
                answers, few = [self._of_sample(sample) for sample in arguments], _few(len(arguments))
                found = np.array([row for row, _ in answers]).reshape(-1, self.values)
                self._require_same(arguments[few], found[few])
                if len(answers) >= _FEWEST and all(reason for _, reason in answers):
                    said = f"the function raises for each of {len(answers)} samples, first {answers[0][1]}"
                    raise SolveError(f"{self.place}: {said}.")
        self._require_a_number(found, arguments)
        return found

    def takes_columns(self, arguments: Arguments) -> bool:
        """Return whether one call with whole columns gives the values of all samples."""
        with np.errstate(all="ignore"):
            return self._of_columns(arguments) is not None

    def _of_columns(self, arguments: Arguments) -> Values | None:
        """Return the values by one call with whole columns; None unless they can be trusted."""
        samples = arguments.shape[0]
        if samples < 2:
            return None
        try:
            found = self._in_order(self.function(*(column.copy() for column in arguments.T)))
            single = self.values == 1 and np.shape(found) in ((), (samples,))
            columns = [np.broadcast_to(self._numbers(one), samples) for one in _flat([found] if single else found)]
        except KeyboardInterrupt:
            raise
        except BaseException:  # whatever it is, it is met again sample by sample, and said there
            return None
        if len(columns) != self.values:
            return None
        whole, few = np.stack(columns, axis=1), _few(samples)
        alone = self._alone(arguments[few])
        if _agree(whole[few], alone):
            return whole
        self._require_same(arguments[few], alone)
        return None

    def _alone(self, arguments: Arguments) -> Values:
        """Return the values of samples that are called one by one."""
        return np.array([self._of_sample(sample)[0] for sample in arguments]).reshape(-1, self.values)

    def _require_a_number(self, found: Values, arguments: Arguments) -> None:
        """Raise if none of many samples has an answer: what is wrong then is the function."""
        if len(found) >= _FEWEST and not np.isfinite(found).any():
            raise SolveError(
                f"{self.place}: the function returns no number for any of {len(found)} samples, as for "
                f"({_listed(arguments[0])}); allowed are numbers that are real and within ±{_LARGEST:g}."
            )

    def _require_same(self, arguments: Arguments, before: Values) -> None:
        """Raise if the function says something else of the same samples in another order."""
        again = self._alone(arguments[::-1])[::-1]
        for sample, first, second in zip(arguments, before, again, strict=True):
            if not _agree(first, second):
                said = " and then ".join(", ".join(f"{value:.9g}" for value in own) for own in (first, second))
                raise InputError(
                    f"{self.place}: the function gives different results for the same arguments: {said} for "
                    f"({_listed(sample)}); allowed is a function of its arguments alone, without random numbers and "
                    "without memory of earlier calls."
                )

    def _of_sample(self, sample: Float[np.ndarray, " argument"]) -> tuple[Float[np.ndarray, " value"], str]:
        """Return the values of one sample, and what the function raised if it did."""
        nothing = np.full(self.values, np.nan)
        try:
            said = self._said(sample)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            if isinstance(error, FAILURES) and not isinstance(error, _FAULTS):
                return nothing, f"{_named(error)} for ({_listed(sample)})"
            raise InputError(f"{self.place}: the function has a fault: {_named(error)}{_line_of(error)}.") from error
        try:
            found = self._numbers(self._in_order(said)).ravel()
        except FAILURES as reason:
            return nothing, f"{_named(reason)} for ({_listed(sample)})"
        except TypeError as error:
            raise InputError(f"{self.place}: the function has a fault: {error}.") from error
        if found.size != self.values:
            raise InputError(f"{self.place}: the function returned {found.size} values; asked for are {self.values}.")
        return found, ""

    def _said(self, sample: Float[np.ndarray, " argument"]) -> Any:
        """Return what the function returns for numbers; for arrays of one, where only these have what it asks for."""
        try:
            return self.function(*sample.tolist())
        except (AttributeError, TypeError, IndexError, ValueError):
            with suppress(Exception, SystemExit):
                return self.function(*sample[:, np.newaxis].copy())
            raise

    def _in_order(self, found: Any) -> Any:
        """Return what the function returned in the order of its outputs, where it says them by name."""
        said = _named_values(found)
        if not said or not self.names:
            return found
        bare = [name.rpartition(" [")[0] for name in self.names]
        keys = [name if name in said else own for name, own in zip(self.names, bare, strict=True)]
        if {*keys} != said.keys():
            raise InputError(
                f"{self.place}: the function returned {', '.join(map(repr, said))}; allowed are its outputs by "
                f"name, {', '.join(map(repr, bare))}, or without names in this order."
            )
        return [said[key] for key in keys]

    def _numbers(self, found: Any) -> Float[np.ndarray, "..."]:
        """Return what the function returned as numbers of its own, NaN where that is no answer.

        Refused are text, times, and numbers of 32 bits and less, whose rounding differences would take for a slope.
        """
        if isinstance(found, list | tuple):
            return np.array([self._numbers(one) for one in found])
        masked = np.ma.getmaskarray(found) if isinstance(found, np.ma.MaskedArray) else False
        values = np.asarray(np.ma.getdata(found) if np.any(masked) else found)
        if values.dtype.kind in "USmM":
            kind = "text" if values.dtype.kind in "US" else values.dtype.name
            raise InputError(f"{self.place}: the function returned {kind}; allowed are numbers.")
        if values.dtype in (np.float16, np.float32, np.complex64):
            raise InputError(
                f"{self.place}: the function returned {values.dtype.name}; allowed are numbers of 64 bits, as those of "
                "less are too coarse to tell how an output changes with a deviation."
            )
        if values.dtype.kind == "c" or (values.dtype.kind == "O" and any(isinstance(v, complex) for v in values.flat)):
            turned = values.astype(complex)
            values = np.where(np.abs(turned.imag) <= _SAME * np.abs(turned), turned.real, np.nan)
        values = values.astype(float)
        return np.where(masked | ~(np.abs(values) <= _LARGEST), np.nan, values)

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


def _named_values(found: Any) -> dict[str, Any]:
    """Return the values that a function returned by name: of keys, columns or fields; nothing without names."""
    if isinstance(found, Mapping):
        own = dict(found)
    elif hasattr(found, "iloc"):  # a table or a series of pandas
        own = dict(zip(getattr(found, "columns", found.index), found.to_numpy().T, strict=True))
    else:
        own = {name: found[name] for name in getattr(getattr(found, "dtype", None), "names", None) or ()}
    return own if all(isinstance(name, str) for name in own) else {}


def _of_names(function: Callable[..., Any], names: tuple[str, ...], first: tuple[str, ...], *values: Any) -> Any:
    """Return what a function says of values by name: in its own order where its first parameters are these names."""
    given = dict(zip(names, values, strict=True))
    return function(*map(given.__getitem__, first)) if {*first} == {*names} else function(**given)


def by_name(function: Callable[..., Any], names: Sequence[str], place: str) -> Callable[..., Any]:
    """Return a function that takes values in the order of some names, and gives each to its parameter of that name.

    A name is compared as Python would spell it: ``crank1.play`` is ``crank1_play``. Where no parameter has a name of
    these the values are given in their order.

    Raises
    ------
    InputError
        Some of the names are parameters and others are not, and one of them stands at another place.
    """
    try:
        known = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return function
    parameters = [own.name for own in known if own.kind in (own.POSITIONAL_ONLY, own.POSITIONAL_OR_KEYWORD)]
    spelled = [re.sub(r"\W", "_", name) for name in names]
    if spelled == parameters[: len(spelled)] or not {*spelled} & {*parameters}:
        return function
    needed = {own.name for own in known if own.default is own.empty and own.name in parameters}
    if {*spelled} <= {*parameters} and needed <= {*spelled} and len({*spelled}) == len(spelled):
        return partial(_of_names, function, tuple(spelled), tuple(parameters[: len(spelled)]))
    for at, (name, own) in enumerate(zip(names, spelled, strict=True)):
        if own in parameters and parameters.index(own) != at:
            raise InputError(
                f"{place}: the function takes {own!r} as number {parameters.index(own) + 1} of its arguments, and "
                f"{name!r} is number {at + 1} of the inputs and settings; allowed are parameters that are all called "
                f"as these are, or in their order: {', '.join(names)}."
            )
    return function


def _named(error: BaseException) -> str:
    """Return what was raised, and what it says if it says anything."""
    try:
        words = " ".join(str(error).split())
    except Exception:  # what a user's exception says may raise too
        words = ""
    return f"{type(error).__name__} ({words})" if words else type(error).__name__


def _line_of(error: BaseException) -> str:
    """Return where in the user's own files something was raised; nothing where that was in none."""
    frames = [own for own in traceback.extract_tb(error.__traceback__)[1:] if is_users_file(own.filename)]
    return f" in {Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else ""


def _few(samples: int) -> list[int]:
    """Return the first, the middle and the last of some samples."""
    return sorted({0, samples // 2, samples - 1} & {*range(samples)})


def _agree(one: Float[np.ndarray, "..."], other: Float[np.ndarray, "..."]) -> bool:
    """Return whether two answers to the same samples are the same, up to rounding."""
    size = float(np.abs(other[np.isfinite(other)]).max(initial=0.0))
    return bool(np.allclose(one, other, rtol=0.0, atol=_SAME * size, equal_nan=True))


def _listed(sample: Float[np.ndarray, " argument"]) -> str:
    return ", ".join(f"{value:.6g}" for value in sample)


def _flat(found: Any) -> list[Any]:
    """Return the items of nested tuples and lists, and the first axis of an array, in their order."""
    if isinstance(found, np.ndarray) and found.ndim > 2:
        return [row for part in found for row in part]
    return [item for part in found for item in (_flat(part) if isinstance(part, list | tuple) else [part])]
